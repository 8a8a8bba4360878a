"""The page of a bridge, served in a thread of its own: nothing in it can hold up the control loop."""

import asyncio
import logging
import threading

from robosc_bridge.daemon.operations import Operations
from robosc_bridge.view.settings import ViewSettings
from robosc_bridge.view.sources import ViewError

_log = logging.getLogger(__name__)

_START_LIMIT_S, _STOP_LIMIT_S = 20.0, 5.0


class ViewFace:
    """The live view of a bridge; a `Face` of the daemon.

    Args:
        operations: The daemon.
        settings: Where and how.

    Raises:
        ViewError: The extra `view` is not installed, or there is no such scene.

    Attributes:
        address: `HOST:PORT` that it listens on; empty: it does not yet.
        url: What to open in a browser, with the token.
    """

    def __init__(self, operations: Operations, settings: ViewSettings) -> None:
        from robosc_bridge.view.extra import require_view

        require_view()
        from robosc_bridge.view.running import RunningBridge
        from robosc_bridge.view.scenery import scenery
        from robosc_bridge.view.server import ViewServer

        self.address = self.url = ""
        source = RunningBridge(operations, scenery(settings.scene, settings.scene_seed))
        # Laid out before the robot moves: a large automaton would hold up everything for a while.
        self._server = ViewServer(settings, lambda: source, is_shared=True, robot=source.robot)
        self._failure: BaseException | None = None
        self._is_ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="live view", daemon=True)

    @property
    def name(self) -> str:
        """For the log."""
        return self._thread.name

    @property
    def is_alive(self) -> bool:
        """Whether it serves."""
        return self._thread.is_alive() and self._failure is None

    def start(self) -> None:
        """Listen.

        Raises:
            ViewError: It cannot.
        """
        self._thread.start()
        if not self._is_ready.wait(_START_LIMIT_S):
            raise ViewError(f"the live view has not begun within {_START_LIMIT_S:g} seconds")
        if self._failure is not None:
            self._thread.join(_STOP_LIMIT_S)
            if isinstance(self._failure, ViewError):
                raise self._failure
            raise ViewError(f"the live view: {self._failure}") from self._failure
        _log.info("the live view: %s", self.url)

    def stop(self) -> None:
        """End every connection and give the port back; may be called again."""
        if self._loop is not None and self._thread.is_alive():
            try:
                self._loop.call_soon_threadsafe(self._end.set)
            except RuntimeError:
                return  # It has just ended by itself.
            self._thread.join(_STOP_LIMIT_S)
            if self._thread.is_alive():
                _log.error("the live view has not ended within %g seconds", _STOP_LIMIT_S)

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except ViewError as error:
            self._failure = error
        except Exception as error:
            self._failure = error
            _log.exception("the live view has failed")
        finally:
            self._is_ready.set()

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        await self._server.start()
        self.address, self.url = self._server.address, self._server.url
        self._is_ready.set()
        try:
            await self._end.wait()
        finally:
            await self._server.stop()
