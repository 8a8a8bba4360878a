"""The source for a model that nothing executes: its initial state, of the model as its files are this moment.

A model that was changed is synthesized in a process of its own, which the next change ends. Until there is another
supervisor the one before is shown, with why it is not the file's.
"""

import asyncio
import contextlib
import hashlib
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from robosc.errors import RoboscError
from robosc.supervisor import Supervisor, decode
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.definition import Robot, robot_of
from robosc_view.replay import first_frame
from robosc_view.reports import Notice, SourceKind, Status
from robosc_view.sources import RefusedError, ReplayCommand, Sink, not_replayed

LOOK_S = 0.3
"""Between two looks at the files."""

_CODE = "model"


class NoSupervisorError(Exception):
    """There is none of the model as it is; one sentence."""


class StaticModel:
    """A model in its initial state, for all pages.

    Args:
        supervisor: Supervisor of the model.
        seen: Digest that its files had.
        digest: Function that returns the digest of the files; called in a thread.
        make: Function that makes the supervisor of the files as they are.
        scene: Scene for the map.
        pause: Function that waits for the next look at the files.

    `digest` and `make` raise `NoSupervisorError`.
    """

    def __init__(
        self,
        supervisor: Supervisor,
        seen: str,
        digest: Callable[[], str],
        make: Callable[[], Awaitable[Supervisor]],
        scene: Any = None,
        pause: Callable[[], Awaitable[None]] = lambda: asyncio.sleep(LOOK_S),
    ) -> None:
        self._supervisor = supervisor
        self._digest = digest
        self._make = make
        self._scene = scene
        self._pause = pause
        self._seen = seen
        self._warning = ""

    @property
    def robot(self) -> Robot:
        """Robot that is shown."""
        return robot_of(self._supervisor, SourceKind.MODEL, version="", can_command=False, scene=self._scene)

    async def run(self, sink: Sink) -> None:
        """Tell the initial state, and again when the files change, until cancelled."""
        making: asyncio.Task[Supervisor] | None = None
        await self._show(sink)
        try:
            while True:
                await self._pause()
                try:
                    digest = await asyncio.to_thread(self._digest)
                except NoSupervisorError as error:
                    digest = f"none: {error}"
                if digest != self._seen:
                    self._seen = digest
                    await _ended(making)
                    making = asyncio.create_task(self._made())
                if making is not None and making.done():
                    await self._take(making, sink)
                    making = None
        finally:
            await _ended(making)

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Not here: nothing is executed.

        Raises:
            RefusedError: Always.
        """
        raise RefusedError("nothing is executed here")

    def control_replay(self, command: ReplayCommand) -> None:
        """Not here.

        Raises:
            RefusedError: Always.
        """
        raise not_replayed()

    async def _made(self) -> Supervisor:
        return await self._make()

    async def _take(self, making: asyncio.Task[Supervisor], sink: Sink) -> None:
        try:
            self._supervisor, self._warning = making.result(), ""
        except NoSupervisorError as error:
            self._warning = f"the file has changed since, and this is not what it says: {error}"
        await self._show(sink)

    async def _show(self, sink: Sink) -> None:
        frame = first_frame(self._supervisor.model)
        await sink.define(self.robot)
        sink.begin({})
        warnings = (Notice(_CODE, self._warning),) if self._warning else ()
        sink.show(
            Status(
                time_s=time.time(),
                warnings=warnings,
                components=frame.components,
                communications=frame.communications,
                last={},
            )
        )


async def _ended(making: asyncio.Task[Supervisor] | None) -> None:
    """End a synthesis that nobody wants any more."""
    if making is not None:
        making.cancel()
        await asyncio.gather(making, return_exceptions=True)


def file_digest(path: Path) -> str:
    """Return the digest of a supervisor's file at this moment.

    Raises:
        NoSupervisorError: It cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise NoSupervisorError(f"{path}: {error.strerror or error}") from error


async def synthesized(words: Sequence[str]) -> Supervisor:
    """The supervisor that `robosc synth` makes; cancelling this ends it.

    Args:
        words: Its arguments.

    Raises:
        NoSupervisorError: It makes none.
    """
    with tempfile.TemporaryDirectory(prefix="robosc-") as folder:
        made = Path(folder) / "model.rsup"
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "robosc.cli.main", "synth", "--json", "--output", str(made), *words),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        try:
            output, errors = await process.communicate()
        finally:
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await asyncio.shield(process.wait())
        if process.returncode != 0:
            raise NoSupervisorError(_reason(output, errors))
        return read(made)


def read(path: Path) -> Supervisor:
    """The supervisor of a file.

    Raises:
        NoSupervisorError: There is none.
    """
    try:
        return decode(path.read_bytes())
    except (OSError, RoboscError) as error:
        raise NoSupervisorError(f"{path.name}: {error}") from error


class _Place(msgspec.Struct):
    severity: str
    message: str
    file: str | None = None
    line: int | None = None


class _Error(msgspec.Struct):
    message: str


class _Told(msgspec.Struct):
    """Output of `robosc synth --json` where there is no supervisor."""

    reason: str = ""
    diagnostics: tuple[_Place, ...] = ()
    error: _Error | None = None


def _reason(output: bytes, errors: bytes) -> str:
    try:
        told = msgspec.json.decode(output, type=_Told)
    except msgspec.DecodeError:
        lines = errors.decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else "synthesis failed"
    wrong = [item for item in told.diagnostics if item.severity == "error"]
    if told.error is not None or not wrong:
        return told.error.message if told.error is not None else told.reason or "synthesis failed"
    first = wrong[0]
    place = f"{first.file}, line {first.line}: " if first.file is not None else ""
    more = f" ({len(wrong)} errors)" if len(wrong) > 1 else ""
    return f"{place}{first.message}{more}"
