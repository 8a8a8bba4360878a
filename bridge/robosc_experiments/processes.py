"""Programs of a scenario as processes: each in a session of its own, stopped in order, none left behind.

A terminal sends Ctrl-C to every process of its session. The programs have other sessions, so that the process which
runs the scenario can stop them one after the other. If that process is killed, the kernel ends each program by a
signal.
"""

import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType, TracebackType
from typing import Self

from robosc_experiments.scenario import ScenarioError

START_LIMIT_S = 60.0
STOP_LIMIT_S = 15.0
"""Longer than the bridge needs to bring a robot to rest."""

ANSWER_LIMIT_S = 10.0
_POLL_S = 0.02
_END_WITH_PARENT = str(Path(__file__).with_name("end_with_parent.py"))
_PREFERRED = -15
_SHOWN_BYTES = 4096
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class _Interrupts:
    """Hold on signals: none may interrupt between the start of a process and the note that it is there."""

    def __init__(self) -> None:
        self._is_held = False
        self._is_due = False

    @contextmanager
    def held(self) -> Iterator[None]:
        """Hold back signals in the block: those that come meanwhile interrupt at its end."""
        self._is_held = True
        try:
            yield
        finally:
            self._is_held = False
            if self._is_due:
                self._is_due = False
                raise KeyboardInterrupt

    def take(self, number: int, frame: FrameType | None) -> None:
        """A signal has come; those after it change nothing."""
        for each in _SIGNALS:
            signal.signal(each, signal.SIG_IGN)
        if self._is_held:
            self._is_due = True
        else:
            raise KeyboardInterrupt


_interrupts = _Interrupts()


@contextmanager
def interruptible() -> Iterator[None]:
    """Within the block the first SIGINT, SIGTERM or SIGHUP raises `KeyboardInterrupt`; what follows is ignored.

    Whoever is impatient and interrupts twice must not keep processes from being stopped. For the main thread.
    """
    before = {number: signal.signal(number, _interrupts.take) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def environment() -> dict[str, str]:
    """Return the environment of this process; modules are found where this process finds them."""
    paths = os.pathsep.join(path for path in sys.path if path)
    return {**os.environ, "PYTHONPATH": paths, "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1"}


def _prefer(number: int) -> None:
    """Let a process that has just begun a session go before others, where that is permitted."""
    # Now it has one thread, whose priority the others will inherit.
    with suppress(PermissionError, ProcessLookupError):
        os.setpriority(os.PRIO_PROCESS, number, _PREFERRED)
    # That counts within its session; where Linux shares processors out among sessions first, so does this, sched(7).
    with suppress(OSError):
        Path(f"/proc/{number}/autogroup").write_text(str(_PREFERRED), encoding="ascii")


class Program:
    """A Python program that runs as long as the `with` block, and no longer than the thread that has entered it.

    Args:
        name: Name in messages, and of its log file.
        arguments: `-m`, the module, and its arguments.
        folder: Folder of its log, and its working folder.
        is_preferred: True if it goes before other programs, where that is permitted: it lives by the computer's
            clock.
        is_asked: True if it takes commands; its output is answers then, and no part of its log.
        interpreter: Interpreter of the program; None: that of this process.
        variables: Its environment; None: that of this process, as `environment` has it.

    Raises:
        ScenarioError: It cannot be started.

    Attributes:
        name: Name in messages.
        log: Log of its output; of one that is asked, its errors alone.
    """

    def __init__(
        self,
        name: str,
        arguments: Sequence[str],
        folder: Path,
        *,
        is_preferred: bool = False,
        is_asked: bool = False,
        interpreter: str | None = None,
        variables: Mapping[str, str] | None = None,
    ) -> None:
        self.name = name
        self.log = folder / f"{name}.log"
        self._arguments = arguments
        self._folder = folder
        self._is_preferred = is_preferred
        self._is_asked = is_asked
        self._interpreter = interpreter or sys.executable
        self._variables = variables
        self._answers: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        pipe = subprocess.PIPE if self._is_asked else None
        try:
            process = self._started(pipe)
            if self._is_preferred:
                _prefer(process.pid)
            if self._is_asked:
                threading.Thread(target=self._listen, args=(process,), name=self.name, daemon=True).start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _started(self, pipe: int | None) -> "subprocess.Popen[str]":
        # Interrupts wait until the process is noted.
        with self.log.open("w", encoding="utf-8") as log, _interrupts.held():
            try:
                self._process = subprocess.Popen(  # noqa: S603 (our own programs)
                    [
                        sys.executable,
                        "-I",
                        "-S",
                        _END_WITH_PARENT,
                        str(os.getpid()),
                        self._interpreter,
                        *self._arguments,
                    ],
                    env=environment() if self._variables is None else dict(self._variables),
                    cwd=self._folder,
                    stdin=pipe or subprocess.DEVNULL,
                    stdout=pipe or log,
                    stderr=log,
                    start_new_session=True,
                    text=True,
                )
            except OSError as error:
                raise ScenarioError(f"{self.name} cannot be started: {error.strerror or error}") from error
            return self._process

    @property
    def _used(self) -> "subprocess.Popen[str]":
        if self._process is None:
            raise ScenarioError(f"{self.name} has not been started")
        return self._process

    @property
    def status(self) -> int | None:
        """Its exit status; None: it runs."""
        return self._used.poll()

    @property
    def cpu_s(self) -> float:
        """Seconds that processors have worked for it so far; 0 when it has ended."""
        try:
            fields = Path(f"/proc/{self._used.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        except (OSError, IndexError):
            return 0.0
        # utime and stime, proc(5).
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def output(self) -> str:
        """The end of its log."""
        try:
            data = self.log.read_bytes()
        except OSError:
            return ""
        return data[-_SHOWN_BYTES:].decode("utf-8", "replace").strip()

    def require(self) -> None:
        """Raise ScenarioError if it has ended by itself."""
        if self.status is not None:
            raise ScenarioError(f"{self.name} ended by itself with status {self.status}:\n{self.output()}")

    def wait_for(self, pattern: str, limit_s: float = START_LIMIT_S) -> re.Match[str]:
        """Wait until its log has a line.

        Raises:
            ScenarioError: It ended before, or the limit has passed.
        """
        end_s = time.monotonic() + limit_s
        while True:
            # The status is read before the output, so that lines written just before the end of the program count.
            has_ended = self.status is not None
            output = self.log.read_text(encoding="utf-8", errors="replace")
            # The last line may be half of one as long as the program lives.
            whole = output if has_ended else output[: output.rfind("\n") + 1]
            found = re.search(pattern, whole, re.MULTILINE)
            if found:
                return found
            if has_ended:
                self.require()
            if time.monotonic() > end_s:
                raise ScenarioError(f"{self.name} did not print {pattern!r} in {limit_s:g} s:\n{self.output()}")
            time.sleep(_POLL_S)

    def send(self, command: str) -> None:
        """Have it do something that it does not answer."""
        stdin = self._used.stdin
        if stdin is None:
            raise ScenarioError(f"{self.name} takes no commands")
        try:
            stdin.write(command + "\n")
            stdin.flush()
        except OSError as error:
            raise ScenarioError(f"{self.name} takes no commands any more:\n{self.output()}") from error

    def answer(self, limit_s: float = ANSWER_LIMIT_S) -> str:
        """The next line of its output.

        Raises:
            ScenarioError: None comes in time.
        """
        try:
            found = self._answers.get(timeout=limit_s)
        except queue.Empty:
            raise ScenarioError(f"{self.name} did not answer in {limit_s:g} s:\n{self.output()}") from None
        if found is None:
            self._answers.put(None)
            raise ScenarioError(f"{self.name} has ended:\n{self.output()}")
        return found

    def ask(self, command: str) -> str:
        """Have it answer with a line."""
        self.send(command)
        return self.answer()

    def stop(self) -> None:
        """End it and whatever it has started: first politely, so that a robot comes to rest. May be called again."""
        process = self._process
        if process is None:
            return
        try:
            if process.poll() is None:
                process.terminate()
                with suppress(subprocess.TimeoutExpired):
                    process.wait(STOP_LIMIT_S)
        finally:
            # The same holds where its end is not awaited any longer.
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if process.stdin is not None:
            # Input that it has not read is lost.
            with suppress(OSError):
                process.stdin.close()

    def _listen(self, process: "subprocess.Popen[str]") -> None:
        if process.stdout is not None:
            with suppress(ValueError), process.stdout:
                for line in process.stdout:
                    self._answers.put(line.rstrip("\n"))
        self._answers.put(None)


def finish(program: Program) -> None:
    """Stop a program that has not ended by itself, and whose exit status counts.

    Raises:
        ScenarioError: It did not end in order.
    """
    program.require()
    program.stop()
    if program.status != 0:
        raise ScenarioError(f"{program.name} ended with status {program.status}:\n{program.output()}")
