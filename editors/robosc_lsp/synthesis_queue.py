"""Background synthesis for the editor: in a separate process, which is killed when its answer is no longer needed.

That process runs `robosc_lsp.synthesizer`, which nothing here imports, so that neither process loads what only the
other needs.
"""

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator

import msgspec

from robosc.source import Bundle
from robosc_lsp.messages import SynthesisRequest, SynthesisResponse

_PROGRAM = "robosc_lsp.synthesizer"


class SynthesisQueue:
    """Queue that runs one synthesis at a time; the text that was edited last goes first."""

    def __init__(self) -> None:
        self._edited: list[str] = []
        self._waiting: list[tuple[str, asyncio.Future[None]]] = []
        self._is_busy = False

    def prefer(self, uri: str) -> None:
        """Give priority to an edited text."""
        self._edited = [uri, *(other for other in self._edited if other != uri)]

    def forget(self, uri: str) -> None:
        """Remove the priority of a closed text."""
        self._edited = [other for other in self._edited if other != uri]

    @contextlib.asynccontextmanager
    async def slot(self, uri: str) -> AsyncIterator[None]:
        """Wait until the synthesis of a text may run; the slot is released at the end of the context."""
        mine = uri, asyncio.get_running_loop().create_future()
        self._waiting.append(mine)
        self._start_next()
        try:
            await mine[1]
            yield
        finally:
            if mine in self._waiting:
                self._waiting.remove(mine)
            else:
                self._is_busy = False
            self._start_next()

    def _start_next(self) -> None:
        # A cancelled waiter may still be in the list.
        waiting = [each for each in self._waiting if not each[1].done()]
        if waiting and not self._is_busy:
            chosen = min(waiting, key=lambda each: self._priority_of(each[0]))
            self._waiting.remove(chosen)
            self._is_busy = True
            chosen[1].set_result(None)

    def _priority_of(self, uri: str) -> int:
        return self._edited.index(uri) if uri in self._edited else len(self._edited)


async def run_synthesis(bundle: Bundle, limit_s: float) -> SynthesisResponse:
    """Return the result of synthesis for a robot without errors; cancelling this ends its process.

    Args:
        bundle: The robot.
        limit_s: Time limit, in seconds.
    """
    request = SynthesisRequest(
        (bundle.main.name, bundle.main.text),
        tuple((file.name, file.text) for file in bundle.libraries),
    )
    try:
        process = await asyncio.create_subprocess_exec(
            # -P: never run code of the working directory, which may be untrusted.
            *(sys.executable, "-P", "-m", _PROGRAM),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL,
        )
    except OSError as error:
        return SynthesisResponse(f"synthesis cannot be started: {error.strerror}")
    try:
        async with asyncio.timeout(limit_s):
            answer = await _answer(process, msgspec.json.encode(request) + b"\n")
        return msgspec.json.decode(answer, type=SynthesisResponse)
    except TimeoutError:
        return SynthesisResponse(f"synthesis exceeds the time limit of {limit_s:g} s")
    except (OSError, msgspec.DecodeError):
        return SynthesisResponse("synthesis failed")
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await asyncio.shield(process.wait())


async def _answer(process: asyncio.subprocess.Process, request: bytes) -> bytes:
    """Send a request and return the answer; the input of the process stays open until then."""
    if process.stdin is None or process.stdout is None:
        raise OSError("no pipes to the process of a synthesis")
    process.stdin.write(request)
    await process.stdin.drain()
    return await process.stdout.read()
