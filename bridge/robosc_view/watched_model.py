"""A model that is stepped by hand: its supervisor is made anew whenever its files change.

A model that was changed is synthesized in a process of its own, which the next change ends. Until there is another
supervisor the one before stays, with why it is not the file's.
"""

import argparse
import asyncio
import contextlib
import hashlib
import pickle
import sys
import tempfile
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from robosc.certification import SynthesisOutcome
from robosc.certification.goals import GoalExplanation
from robosc.certification.supervisor_file import StateInWords
from robosc.errors import RoboscError, Severity
from robosc.pipeline.systems import SystemSupervisor
from robosc.supervisor import Supervisor, decode
from robosc_view.requests import ROBOSC

LOOK_S = 0.3
"""Between two looks at the files."""


class NoSupervisorError(Exception):
    """The present model has no supervisor; the message is one sentence."""


@dataclass(frozen=True)
class SynthesizedModel:
    """A model with its supervisor.

    Attributes:
        supervisor: The supervisor.
        findings: Findings about the model, a line each; none for a supervisor's file.
        text: Text of the model, if it is complete without libraries.
        language: Language of the text: `rscd`, or for automata the ending of their files.
        beginnings: Initial states of automata.
        denied: Explanation why the goals cannot be reached, where the surroundings play against a person.
    """

    supervisor: Supervisor | SystemSupervisor
    findings: tuple[str, ...] = ()
    text: str | None = None
    language: str = ROBOSC
    beginnings: tuple[StateInWords, ...] = ()
    denied: GoalExplanation | None = None


class WatchedModel:
    """A model for all pages; its files are watched while a page uses it.

    Args:
        made: The present model.
        seen: Digest of its files when it was made.
        digest: Function that returns the digest of the files; called in a thread.
        make: Function that makes the model from the present files.
        pause: Function that waits until the files are to be checked again.

    `digest` and `make` raise `NoSupervisorError`.

    Attributes:
        made: The model that was made last.
        warning: Reason why the model is older than its files; empty: it is not.
    """

    def __init__(
        self,
        made: SynthesizedModel,
        seen: str,
        digest: Callable[[], str],
        make: Callable[[], Awaitable[SynthesizedModel]],
        pause: Callable[[], Awaitable[None]] = lambda: asyncio.sleep(LOOK_S),
    ) -> None:
        self.made = made
        self.warning = ""
        self._seen = seen
        self._digest = digest
        self._make = make
        self._pause = pause
        self._listeners: set[Callable[[], None]] = set()
        self._watching: asyncio.Task[None] | None = None

    @contextlib.asynccontextmanager
    async def listened(self, listener: Callable[[], None]) -> AsyncIterator[None]:
        """Call a function whenever `made` or `warning` has changed."""
        self._listeners.add(listener)
        if self._watching is None:
            self._watching = asyncio.create_task(self._watch())
        try:
            yield
        finally:
            self._listeners.discard(listener)
            if not self._listeners:
                watching, self._watching = self._watching, None
                await _ended(watching)

    async def _watch(self) -> None:
        making: asyncio.Task[SynthesizedModel] | None = None
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
                    self._take(making)
                    making = None
        finally:
            if making is not None:
                # The next watcher has to make it again.
                self._seen = ""
            await _ended(making)

    async def _made(self) -> SynthesizedModel:
        return await self._make()

    def _take(self, making: asyncio.Task[SynthesizedModel]) -> None:
        try:
            self.made, self.warning = making.result(), ""
        except NoSupervisorError as error:
            self.warning = f"the file has changed since, and this is not what it says: {error}"
        for listener in tuple(self._listeners):
            listener()


async def _ended(making: "asyncio.Task[SynthesizedModel] | asyncio.Task[None] | None") -> None:
    """End a synthesis, or a watch, that has become useless."""
    if making is not None:
        making.cancel()
        await asyncio.gather(making, return_exceptions=True)


def file_digest(path: Path) -> str:
    """Return the present digest of a supervisor's file.

    Raises:
        NoSupervisorError: The file cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise NoSupervisorError(f"{path}: {error.strerror or error}") from error


async def synthesized(words: Sequence[str], text: str | None = None) -> SynthesizedModel:
    """Return the model with the supervisor that `robosc synth` makes; cancelling this ends the synthesis.

    Args:
        words: Arguments of `robosc synth`.
        text: Text of the model, which is put into a file of its own; None: the arguments name it.

    Raises:
        NoSupervisorError: The command makes none.
    """
    with tempfile.TemporaryDirectory(prefix="robosc-") as folder:
        made = Path(folder) / "model.rsup"
        if text is not None:
            given = Path(folder) / "model.rscd"
            given.write_bytes(text.encode("utf-8", "surrogatepass"))
            words = (*words, "--", str(given))
        status, output, errors = await _output("robosc.cli.main", "synth", "--json", "--output", str(made), *words)
        if status != 0:
            raise NoSupervisorError(_reason(output, errors))
        failure = msgspec.json.decode(output, type=_FailureOutput)
        return SynthesizedModel(read(made), tuple(map(str, failure.diagnostics)), text)


def denied_model(outcome: SynthesisOutcome, text: str | None) -> SynthesizedModel:
    """Return the model of a synthesis whose goals cannot be reached, to be played against the surroundings.

    Args:
        outcome: Outcome of the synthesis.
        text: Text of the model, if it is complete without libraries.

    Raises:
        NoSupervisorError: There is no counter-strategy.
    """
    goals = outcome.explanation
    findings = tuple(finding_text(item.severity, item.message, item.code) for item in outcome.diagnostics)
    if not isinstance(goals, GoalExplanation):
        errors = [item.message for item in outcome.diagnostics if item.severity is Severity.ERROR]
        raise NoSupervisorError(outcome.reason or (errors or ["the surroundings have no counter-strategy"])[0])
    if goals.supervisor is None or goals.counter is None:
        raise NoSupervisorError("the surroundings have no counter-strategy, or one that is too large to be played")
    return SynthesizedModel(goals.supervisor, findings, text, denied=goals)


async def synthesized_denied(make: Callable[[Callable[[], bool]], SynthesizedModel]) -> SynthesizedModel:
    """Return the model that a function makes in a thread; cancelling this ends its work.

    Args:
        make: Function that makes the model; it asks the function that it is given whether to stop.

    Raises:
        NoSupervisorError: There is no counter-strategy.
    """
    stop = threading.Event()
    try:
        return await asyncio.to_thread(make, stop.is_set)
    except RoboscError as error:
        raise NoSupervisorError(str(error)) from error
    finally:
        stop.set()


async def synthesized_automata(arguments: argparse.Namespace, text: str | None = None) -> SynthesizedModel:
    """Return the automata with the supervisor that a separate process makes; cancelling this ends the process.

    Args:
        arguments: Arguments of the command.
        text: Text of the model, of which the arguments only give the name then; None: their file's.

    Raises:
        NoSupervisorError: There is none.
    """
    wanted = {name: getattr(arguments, name) for name in ("engine", "reorder", "max_nodes")}
    given = msgspec.json.encode({"model": str(arguments.model), "text": text, **wanted})
    status, output, errors = await _output("robosc_view.automata_synthesis", given=given)
    if status != 0:
        raise NoSupervisorError(_reason(b"", errors))
    # From a process of our own. No supervisor's file could hold all of it: names of plain automata may be anything.
    found = pickle.loads(output)  # noqa: S301
    if isinstance(found, SynthesizedModel):
        return found
    raise NoSupervisorError(found)


async def _output(module: str, *words: str, given: bytes = b"") -> tuple[int | None, bytes, bytes]:
    """Status, output and errors of a module that runs as a process; cancelling this ends it."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-P", "-m", module, *words),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        output, errors = await process.communicate(given)
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await asyncio.shield(process.wait())
    return process.returncode, output, errors


def read(path: Path) -> Supervisor:
    """Return the supervisor of a file.

    Raises:
        NoSupervisorError: There is none.
    """
    try:
        return decode(path.read_bytes())
    except (OSError, RoboscError) as error:
        raise NoSupervisorError(f"{path.name}: {error}") from error


def finding_text(severity: str, message: str, code: str) -> str:
    """Return a finding without its place, since a line number that has only moved is no change."""
    return f"{severity}: {message} [{code}]"


class _Place(msgspec.Struct):
    severity: str
    message: str
    code: str = ""
    file: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        return finding_text(self.severity, self.message, self.code)


class _Error(msgspec.Struct):
    message: str


class _FailureOutput(msgspec.Struct):
    """Output of `robosc synth --json` where there is no supervisor."""

    reason: str = ""
    diagnostics: tuple[_Place, ...] = ()
    error: _Error | None = None


def _reason(output: bytes, errors: bytes) -> str:
    try:
        failure = msgspec.json.decode(output, type=_FailureOutput)
    except msgspec.DecodeError:
        lines = errors.decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else "synthesis failed"
    wrong = [item for item in failure.diagnostics if item.severity == "error"]
    if failure.error is not None or not wrong:
        return failure.error.message if failure.error is not None else failure.reason or "synthesis failed"
    first = wrong[0]
    place = f"{first.file}, line {first.line}: " if first.file is not None else ""
    more = f" ({len(wrong)} errors)" if len(wrong) > 1 else ""
    return f"{place}{first.message}{more}"
