"""An endpoint that serves from an event loop in a thread of its own, so that it cannot hold up the control loop."""

import asyncio
import logging
import threading
from abc import ABC, abstractmethod

from robosc_bridge.errors import BridgeError

_log = logging.getLogger(__name__)

_START_LIMIT_S, _STOP_LIMIT_S = 20.0, 5.0


class ServedEndpoint(ABC):
    """`Endpoint` of the daemon; its subclass defines how it serves.

    Args:
        name: Name of the thread, and for the log.
        label: Text before the reason why it cannot serve.
        error: Exception type that is raised with that text.
        expected: Exceptions that a wrong configuration may cause: reported in a sentence, without a traceback.

    Attributes:
        address: `HOST:PORT` that it listens on; empty: it does not listen yet.
    """

    def __init__(
        self, name: str, label: str, error: type[BridgeError], expected: tuple[type[Exception], ...] = ()
    ) -> None:
        self.address = ""
        self._label = label
        self._error = error
        self._expected = (error, *expected)
        self._failure: Exception | None = None
        self._is_ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    @property
    def name(self) -> str:
        """Name of the endpoint, for the log."""
        return self._thread.name

    @property
    def is_alive(self) -> bool:
        """True if the endpoint serves."""
        return self._thread.is_alive() and self._failure is None

    def start(self) -> None:
        """Listen.

        Raises:
            BridgeError: The endpoint cannot listen; an instance of `error`.
        """
        self._thread.start()
        if not self._is_ready.wait(_START_LIMIT_S):
            raise self._error(f"{self._label}: it has not started within {_START_LIMIT_S:g} seconds")
        if self._failure is not None:
            self._thread.join(_STOP_LIMIT_S)
            if isinstance(self._failure, self._error):
                raise self._failure
            raise self._error(f"{self._label}: {self._failure}") from self._failure

    def stop(self) -> None:
        """End all calls and close the port; may be called again."""
        if self._loop is not None and self._thread.is_alive():
            try:
                self._loop.call_soon_threadsafe(self._end.set)
            except RuntimeError:
                return  # It has just ended by itself.
            self._thread.join(_STOP_LIMIT_S)
            if self._thread.is_alive():
                _log.error("the %s has not ended within %g seconds", self.name, _STOP_LIMIT_S)

    @abstractmethod
    async def _serve(self) -> None:
        """Listen, set `address`, call `_is_listening`, and serve until `_end` is set."""

    def _is_listening(self) -> None:
        """Let the thread that waits in `start` go on."""
        self._is_ready.set()

    def _run(self) -> None:
        try:
            asyncio.run(self._loop_serves())
        except self._expected as error:
            self._failure = error
        except Exception as error:
            self._failure = error
            _log.exception("the %s has failed", self.name)
        finally:
            self._is_ready.set()

    async def _loop_serves(self) -> None:
        self._loop = asyncio.get_running_loop()
        await self._serve()
