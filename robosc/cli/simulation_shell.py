"""The commands of `robosc simulate`: read from a terminal with a prompt and completion, or from a file."""

import contextlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from robosc.cli.output import ExitCode
from robosc.cli.simulation_steps import state_lines, step_lines, take_event, write_lines
from robosc.errors import RoboscError
from robosc.pipeline.counter_run import CounterRun
from robosc.pipeline.event_scripts import parse_event, target_split
from robosc.pipeline.received_data import NO_DATA, DataField
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.pipeline.saved_runs import ModelOfTest
    from robosc.pipeline.simulation import Run
    from robosc.pipeline.steps import Step
    from robosc.pipeline.system_runs import SystemRun

PROMPT = "> "

HELP = """\
EVENT [DATA]               an event: move.request, scan.response front=0.7, level.response 3; move for move.request
enabled                    what can happen now, with the data that it carries
why EVENT                  why an event cannot happen now
state                      where everything is
undo [N], redo [N]         take back the last events; take them again
history                    the events so far
restart                    begin again in the initial state
random N [SEED]            N events by chance
strategy N [SEED]          N events: the world's by chance, the controller's by the strategy that reaches its goals
until-finding [N] [SEED]   events by chance until there is a finding: a deadlock, a blocked request, something unknown
save FILE                  the events so far, as an event log (.jsonl) or a test for pytest (.py)
help, quit
"""

AUTOMATA_HELP = """\
EVENT [DATA] [-> STATE]    an event: press, sensor true, take -> Buffer = full where it can lead to several states
""" + "".join(line for line in HELP.splitlines(keepends=True)[1:] if line.split()[0] not in ("save", "strategy"))

COUNTER_HELP = """\
REQUEST                    a request that is allowed: move.request, or move; the surroundings answer
wait [N]                   request nothing, N times
enabled                    what you may request now
why EVENT                  why you cannot request something now
state                      where everything is
undo [N], redo [N]         take back the last requests, with what followed; take them again
history                    the events so far
restart                    begin again; the surroundings may begin
random N [SEED]            N events, where you request by chance or wait
save FILE                  the events so far, as an event log (.jsonl)
help, quit
"""

_DEFAULT_STEPS = 1000
_MOST = 1_000_000
_MOST_PRINTED = 20
"""Steps of a walk that are printed at once."""


class _CommandFault(Exception):
    """A command that cannot be done; one sentence."""


class Shell:
    """The commands on one run.

    Args:
        run: The run.
        model: Model that a saved test loads; None for automata.
    """

    def __init__(self, run: "Run | SystemRun", model: "ModelOfTest | None") -> None:
        self._run = run
        self._model = model
        self._walks = 0
        self._commands: dict[str, Callable[[Sequence[str]], None]] = {
            "enabled": self._enabled,
            "why": self._why,
            "state": self._state,
            "undo": self._undo,
            "redo": self._redo,
            "history": self._history,
            "restart": self._restart,
            "random": self._random,
            "strategy": self._strategy,
            "until-finding": self._until_finding,
            "save": self._save,
            "help": self._help,
        }
        if isinstance(run, CounterRun):
            self._commands["wait"] = self._wait

    def loop(self, stream: TextIO) -> int:
        """Do the commands of a stream until it ends; returns the exit status.

        On a terminal what cannot be done is reported, and the next command read; elsewhere it ends everything.
        """
        is_terminal = stream.isatty()
        if is_terminal:
            return self._converse()
        if len(self._run):
            # The surroundings have begun.
            self._print_steps(0)
        for number, line in enumerate(stream, start=1):
            try:
                if not self.do(line):
                    break
            except (_CommandFault, RoboscError) as error:
                sys.stdout.flush()
                sys.stderr.write(f"robosc: standard input:{number}: {visible(str(error))}\n")
                return ExitCode.FAILED
        return ExitCode.OK

    def _converse(self) -> int:
        with contextlib.suppress(ImportError):  # Some Pythons are built without it: then lines are typed plainly.
            import readline

            readline.set_completer_delims(" =")
            readline.set_completer(lambda text, state: self._completion(readline.get_line_buffer(), text, state))
            is_libedit = getattr(readline, "backend", "readline") == "editline"
            readline.parse_and_bind("bind ^I rl_complete" if is_libedit else "tab: complete")
        write_lines([f"{self._run.name}: 'help' lists the commands, Tab completes"])
        self._print_steps(0)
        write_lines(state_lines(self._run))
        while True:
            try:
                line = input(PROMPT)
            except EOFError:
                sys.stdout.write("\n")
                return ExitCode.OK
            try:
                if not self.do(line):
                    return ExitCode.OK
            except (_CommandFault, RoboscError) as error:
                write_lines([str(error)])

    def do(self, line: str) -> bool:
        """Do a command; False: it was the last one.

        Raises:
            RoboscError: It cannot be done.
        """
        words = line.split()
        if not words or words[0].startswith("#"):
            return True
        if words[0] in ("quit", "exit"):
            return False
        if words[0] in self._commands:
            self._commands[words[0]](words[1:])
            return True
        text, target = target_split(line) if self._model is None else (line, "")
        event, data = parse_event(text)
        before = len(self._run)
        take_event(self._run, event, data, target)
        self._print_steps(before)
        write_lines(state_lines(self._run))
        return True

    # The commands

    def _enabled(self, words: Sequence[str]) -> None:
        _no_words("enabled", words)
        for event in self._run.possible:
            sign = "allowed " if self._run.is_controllable(event) else "can come"
            write_lines([f"{sign}  {event}{_carried(self._run.data_fields(event))}"])

    def _why(self, words: Sequence[str]) -> None:
        if len(words) != 1:
            raise _CommandFault("why which event? why EVENT")
        event = self._run.event_called(words[0])
        write_lines(self._run.reasons(event) or [f"{event} can happen"])

    def _wait(self, words: Sequence[str]) -> None:
        (count,) = _numbers("wait", words, (1,))
        before = len(self._run)
        for _ in range(count):
            take_event(self._run, "wait", NO_DATA, "")
        self._print_walk(before)
        nothing = ["the surroundings wait, too"] if len(self._run) == before else []
        write_lines([*nothing, *state_lines(self._run)])

    def _state(self, words: Sequence[str]) -> None:
        _no_words("state", words)
        write_lines(state_lines(self._run))

    def _undo(self, words: Sequence[str]) -> None:
        self._repeat("undo", words, self._run.undo, "taken back")

    def _redo(self, words: Sequence[str]) -> None:
        self._repeat("redo", words, self._run.redo, "taken again")

    def _repeat(self, name: str, words: Sequence[str], action: "Callable[[], Step | None]", what: str) -> None:
        (count,) = _numbers(name, words, (1,))
        for _ in range(count):
            step = action()
            if step is None:
                write_lines([f"nothing is left to be {what}"])
                break
            write_lines([f"{what}: {step.event}"])
        write_lines(state_lines(self._run))

    def _history(self, words: Sequence[str]) -> None:
        _no_words("history", words)
        self._print_steps(0)

    def _restart(self, words: Sequence[str]) -> None:
        _no_words("restart", words)
        self._run.restart()
        self._print_steps(0)
        write_lines(state_lines(self._run))

    def _random(self, words: Sequence[str]) -> None:
        self._walk("random", words, strategy=False)

    def _strategy(self, words: Sequence[str]) -> None:
        self._walk("strategy", words, strategy=True)

    def _walk(self, name: str, words: Sequence[str], *, strategy: bool) -> None:
        count, seed = _numbers(name, words, (None, self._walks))
        before = len(self._run)
        taken = self._run.walk(count, seed, strategy=strategy)
        self._walks += 1
        self._print_walk(before)
        ended = ["nothing more can happen"] if len(taken) < count else []
        write_lines([*ended, f"seed {seed}", *state_lines(self._run)])

    def _until_finding(self, words: Sequence[str]) -> None:
        count, seed = _numbers("until-finding", words, (_DEFAULT_STEPS, self._walks))
        self._walks += 1
        before = len(self._run)
        finding = self._run.walk_until_finding(count, seed)
        self._print_walk(before)
        write_lines([str(finding) if finding is not None else f"no finding in {len(self._run) - before} steps"])
        write_lines([f"seed {seed}", *state_lines(self._run)])

    def _save(self, words: Sequence[str]) -> None:
        from robosc.pipeline.simulation import Run

        if len(words) != 1:
            raise _CommandFault("save to which file? save FILE, with a name that ends in .jsonl or .py")
        if not isinstance(self._run, Run):
            raise _CommandFault("a run of automata is not saved: event logs and tests are of robots")
        write_lines([f"written to {self._run.save(Path(words[0]), self._model)}"])

    def _help(self, words: Sequence[str]) -> None:
        of_robots = COUNTER_HELP if isinstance(self._run, CounterRun) else HELP
        sys.stdout.write(of_robots if self._model is not None else AUTOMATA_HELP)

    # Output and completion

    def _print_walk(self, number: int) -> None:
        """Print the steps after a number of steps; of a long walk only the last ones."""
        left_out = len(self._run) - number - _MOST_PRINTED
        if left_out > 0:
            write_lines([f"      {left_out} events, which 'history' lists"])
            number += left_out
        self._print_steps(number)

    def _print_steps(self, number: int) -> None:
        """Print the steps after a number of steps."""
        before = self._run.history[number - 1].state if number else self._run.initial
        for count, step in enumerate(self._run.history[number:], start=number + 1):
            write_lines(step_lines(count, step, before, self._run.actor(step.event)))
            before = step.state

    def _completion(self, line: str, text: str, state: int) -> str | None:
        """Return one of the words that may stand where `text` is begun: what `readline` asks for, one by one."""
        found = [word for word in self.words_after(line[: len(line) - len(text)]) if word.startswith(text)]
        return found[state] if state < len(found) else None

    def words_after(self, line: str) -> list[str]:
        """The words that may stand after the beginning of a line."""
        words = line.split()
        if not words:
            return [f"{word} " for word in (*self._run.possible, *self._commands, "quit")]
        if words == ["why"]:
            return [event for event in self._run.events if event not in self._run.possible]
        if words[0] in self._commands or words[0] not in self._run.events:
            return []
        fields = self._run.data_fields(words[0])
        if line.endswith("="):
            name = words[-1].rstrip("=").rpartition(" ")[2]
            return [f"{choice} " for item in fields if item.path == (name,) for choice in item.choices]
        given = {word.partition("=")[0] for word in words[1:]}
        return [
            choice
            for item in fields
            for choice in ([f"{item.path[0]}="] if len(item.path) == 1 else item.choices if not item.path else ())
            if not item.path or item.path[0] not in given
        ]


def _carried(fields: Sequence[DataField]) -> str:
    texts = [f"{item.name}: {' | '.join(item.choices) or item.type}" for item in fields if item.is_read]
    return f"  ({', '.join(texts)})" if texts else ""


def _no_words(name: str, words: Sequence[str]) -> None:
    if words:
        raise _CommandFault(f"{name} takes nothing more")


def _numbers(name: str, words: Sequence[str], defaults: Sequence[int | None]) -> tuple[int, ...]:
    """Return the numbers of a command: the first at least 1, the second any; a default stands for one left out.

    Raises:
        _CommandFault: They are none, or too many.
    """
    shown = f"{name} {'N' if defaults[0] is None else '[N]'}{' [SEED]' if len(defaults) > 1 else ''}"
    if len(words) > len(defaults):
        raise _CommandFault(f"too many words: {shown}")
    found = []
    for place, default in enumerate(defaults):
        try:
            number = int(words[place]) if place < len(words) else default
        except ValueError:
            raise _CommandFault(f"'{words[place]}' is not a whole number: {shown}") from None
        if number is None or (place == 0 and not 1 <= number <= _MOST):
            raise _CommandFault(f"N is a number from 1 to {_MOST}: {shown}")
        found.append(number)
    return tuple(found)
