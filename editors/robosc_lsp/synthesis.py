"""Synthesis beside the editor: in a process of its own, which is killed when its answer is not wanted any more.

As a program (`python -m robosc_lsp.synthesis`) it reads a bundle as a line of JSON and writes as JSON what synthesis
tells of it. It ends when its input does: nothing goes on when the language server is gone.
"""

import asyncio
import contextlib
import os
import sys
import threading
from collections.abc import AsyncIterator
from typing import IO, NoReturn

import msgspec

from robosc.automata import to_automata
from robosc.errors import NodeLimitError, RoboscError
from robosc.model.structure import Deployment
from robosc.source import Bundle, Location, SourceFile
from robosc.supervisor import make_supervisor
from robosc.supervisor.summary import added_texts
from robosc.synthesis.engines import EngineOptions

_MOST_NODES = 4_000_000
"""Of decision diagrams, for which CUDD takes a gigabyte at most: who types wants to go on with other work."""


class Finding(msgspec.Struct, frozen=True):
    """A finding of synthesis, as `robosc.errors.Diagnostic`."""

    severity: str
    code: str
    message: str
    mend: str
    location: Location | None
    related: tuple[tuple[str, Location], ...] = ()


class Outcome(msgspec.Struct, frozen=True):
    """What synthesis tells of a robot.

    Attributes:
        unknown: Why nothing is known; empty where something is.
        states: States of the controlled robot; None where there is no supervisor.
        reason: Why there is none; empty where there is one.
        added: For each controllable event what the supervisor adds, in words.
        findings: What only synthesis can find.
    """

    unknown: str = ""
    states: int | None = None
    reason: str = ""
    added: dict[str, str] = {}
    findings: tuple[Finding, ...] = ()


class _Asked(msgspec.Struct, frozen=True):
    """A bundle on its way to the process."""

    main: tuple[str, str]
    libraries: tuple[tuple[str, str], ...]
    known: tuple[str, ...]


class Turns:
    """One synthesis at a time, that of the text edited last first."""

    def __init__(self) -> None:
        self._edited: list[str] = []
        self._waiting: list[tuple[str, asyncio.Future[None]]] = []
        self._is_taken = False

    def prefer(self, uri: str) -> None:
        """A text has been edited."""
        self._edited = [uri, *(other for other in self._edited if other != uri)]

    def forget(self, uri: str) -> None:
        """A text is edited no more."""
        self._edited = [other for other in self._edited if other != uri]

    @contextlib.asynccontextmanager
    async def turn(self, uri: str) -> AsyncIterator[None]:
        """Wait for the turn of a text, and have it."""
        mine = uri, asyncio.get_running_loop().create_future()
        self._waiting.append(mine)
        self._give()
        try:
            await mine[1]
            yield
        finally:
            if mine in self._waiting:
                self._waiting.remove(mine)
            else:
                self._is_taken = False
            self._give()

    def _give(self) -> None:
        # One that was cancelled has not left yet.
        waiting = [each for each in self._waiting if not each[1].done()]
        if waiting and not self._is_taken:
            chosen = min(waiting, key=lambda each: self._place_of(each[0]))
            self._waiting.remove(chosen)
            self._is_taken = True
            chosen[1].set_result(None)

    def _place_of(self, uri: str) -> int:
        return self._edited.index(uri) if uri in self._edited else len(self._edited)


async def synthesized(bundle: Bundle, known: frozenset[str], limit_s: float) -> Outcome:
    """What synthesis tells of a robot without errors; cancelling this ends its process.

    Args:
        bundle: The robot.
        known: Codes of findings that the checks have told already.
        limit_s: Longest time; after it, nothing is known.
    """
    asked = _Asked(
        (bundle.main.name, bundle.main.text),
        tuple((file.name, file.text) for file in bundle.libraries),
        tuple(sorted(known)),
    )
    try:
        process = await asyncio.create_subprocess_exec(
            # -P: the editor's folder may be a stranger's, and nothing in it is to be run.
            *(sys.executable, "-P", "-m", __name__),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL,
        )
    except OSError as error:
        return Outcome(f"synthesis cannot be started: {error.strerror}")
    try:
        async with asyncio.timeout(limit_s):
            answer = await _answer(process, msgspec.json.encode(asked) + b"\n")
        return msgspec.json.decode(answer, type=Outcome)
    except TimeoutError:
        return Outcome(f"synthesis takes longer than {limit_s:g} s")
    except (OSError, msgspec.DecodeError):
        return Outcome("synthesis failed")
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await asyncio.shield(process.wait())


async def _answer(process: asyncio.subprocess.Process, request: bytes) -> bytes:
    """What a process answers, whose input stays open until it has."""
    if process.stdin is None or process.stdout is None:
        raise OSError("no pipes to the process of a synthesis")
    process.stdin.write(request)
    await process.stdin.drain()
    return await process.stdout.read()


def _outcome(asked: _Asked) -> Outcome:
    bundle = Bundle(SourceFile(*asked.main), tuple(SourceFile(*file) for file in asked.libraries))
    try:
        made = make_supervisor(
            bundle, deployment=Deployment.CONTROLLER, engine=EngineOptions(maximum_nodes=_MOST_NODES)
        )
    except NodeLimitError:
        return Outcome("synthesis needs more memory than it may have beside an editor")
    except RoboscError as error:
        return Outcome(reason=str(error))
    findings = tuple(
        Finding(
            str(item.severity),
            item.code,
            item.message,
            item.mend,
            item.location,
            tuple((place.message, place.location) for place in item.related),
        )
        for item in made.diagnostics
        if item.code not in asked.known
    )
    if made.supervisor is None:
        return Outcome(reason=made.reason, findings=findings)
    system = to_automata(made.supervisor.model, made.supervisor.deployment)
    states = made.supervisor.certificate.states
    return Outcome(states=int(states), added=added_texts(made.supervisor, system), findings=findings)


def _end_with(server: IO[bytes]) -> None:
    """End this process when what it is asked from is gone."""
    server.read()
    os._exit(1)


def main() -> NoReturn:
    """Answer one request."""
    # Who types goes before.
    os.nice(10)
    asked = msgspec.json.decode(sys.stdin.buffer.readline(), type=_Asked)
    threading.Thread(target=_end_with, args=(sys.stdin.buffer,), daemon=True).start()
    sys.stdout.buffer.write(msgspec.json.encode(_outcome(asked)))
    sys.stdout.buffer.flush()
    # Not by the interpreter's end: the thread holds a lock of the input.
    os._exit(0)


if __name__ == "__main__":
    main()
