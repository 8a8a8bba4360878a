"""Programs of a scenario: what they tell, how they are stopped, and that nothing of them is left."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

import pytest

from robosc_experiments import processes
from robosc_experiments.processes import Program, finish, interruptible
from robosc_experiments.scenario import ScenarioError
from support.background import has_ended
from support.waiting import wait_until

LIMIT_S = 30.0


def script(folder: Path, text: str, name: str = "program.py") -> tuple[str, ...]:
    """Words that run a program with this text."""
    file = folder / name
    file.write_text(textwrap.dedent(text), encoding="utf-8")
    return (str(file),)


def test_a_program_answers_and_ends_politely(tmp_path: Path) -> None:
    text = """
        import sys
        for line in sys.stdin:
            print("heard", line.strip(), flush=True)
    """
    with Program("echo", script(tmp_path, text), tmp_path, is_asked=True) as program:
        assert program.ask("one") == "heard one"
        assert program.ask("two") == "heard two"
        assert program.status is None
        assert program.cpu_s >= 0.0
    assert program.status == -signal.SIGTERM


def test_what_a_program_tells_is_waited_for(tmp_path: Path) -> None:
    with Program("teller", script(tmp_path, "print('port', 17)"), tmp_path) as program:
        assert program.wait_for(r"^port (\d+)$")[1] == "17"
        wait_until(lambda: program.status == 0)
        with pytest.raises(ScenarioError) as raised:
            finish(program)
    assert str(raised.value) == "teller ended by itself with status 0:\nport 17"


def test_half_a_line_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = """
        import signal, sys
        sys.stdout.write("port 1")
        open("seen").read()
        sys.stdout.write("7\\n")
        signal.pause()
    """
    os.mkfifo(tmp_path / "seen")
    sleep = time.sleep

    def look(duration_s: float) -> None:
        if (tmp_path / "teller.log").read_text() == "port 1":
            # For writing and reading, so that it does not wait for a reader.
            os.close(os.open(tmp_path / "seen", os.O_RDWR))
        sleep(duration_s)

    with Program("teller", script(tmp_path, text), tmp_path) as program:
        # The first look is at half a line.
        wait_until(lambda: (tmp_path / "teller.log").read_text() == "port 1")
        monkeypatch.setattr(time, "sleep", look)
        assert program.wait_for(r"^port (\d+)$")[1] == "17"


def test_a_program_that_dies_is_told_with_its_last_words(tmp_path: Path) -> None:
    text = "raise SystemExit('no such device')"
    with Program("dying", script(tmp_path, text), tmp_path) as program, pytest.raises(ScenarioError) as raised:
        program.wait_for("never told")
    assert str(raised.value) == "dying ended by itself with status 1:\nno such device"


def test_a_program_that_says_nothing_is_given_up(tmp_path: Path) -> None:
    text = "import signal; signal.pause()"
    with Program("silent", script(tmp_path, text), tmp_path, is_asked=True) as program:
        with pytest.raises(ScenarioError, match=r"silent did not print 'x' in 0\.2 s"):
            program.wait_for("x", 0.2)
        with pytest.raises(ScenarioError, match=r"silent did not answer in 0\.1 s"):
            program.answer(0.1)


def test_what_a_program_has_started_ends_with_it(tmp_path: Path) -> None:
    text = """
        import signal, subprocess, sys
        child = subprocess.Popen([sys.executable, "-c", "import signal; signal.pause()"])
        print("child", child.pid, flush=True)
        signal.pause()
    """
    with Program("parent", script(tmp_path, text), tmp_path) as program:
        child = int(program.wait_for(r"^child (\d+)$")[1])
        assert not has_ended(child)
    wait_until(lambda: has_ended(child))


def test_a_program_that_is_not_there_is_told(tmp_path: Path) -> None:
    with Program("none", (), tmp_path, interpreter="/no/python") as program, pytest.raises(ScenarioError) as raised:
        program.wait_for("never told")
    assert str(raised.value) == (
        "none ended by itself with status 127:\n/no/python cannot be run: No such file or directory"
    )


@pytest.mark.skipif(sys.platform != "linux", reason="no other kernel tells a program that its parent has died")
def test_a_program_ends_politely_when_who_runs_it_is_killed(tmp_path: Path) -> None:
    ending = """
        import signal, sys, time
        def end(*_):
            print("at rest", flush=True)
            sys.exit(0)
        signal.signal(signal.SIGTERM, end)
        print("ready", flush=True)
        while True:
            time.sleep(60.0)
    """
    text = f"""
        import time
        from pathlib import Path
        from robosc_experiments.processes import Program
        with Program("robot", {script(tmp_path, ending, "robot.py")!r}, Path({str(tmp_path)!r})) as program:
            program.wait_for("^ready$")
            print(program._used.pid, flush=True)
            time.sleep(60.0)
    """
    outer = subprocess.Popen([sys.executable, *script(tmp_path, text)], stdout=subprocess.PIPE, text=True)
    try:
        assert outer.stdout is not None
        robot = int(outer.stdout.readline())
        assert not has_ended(robot)
        outer.kill()
        outer.wait()
        wait_until(lambda: has_ended(robot))
        assert (tmp_path / "robot.log").read_text() == "ready\nat rest\n"
    finally:
        outer.kill()
        outer.communicate()


def test_a_program_whose_parent_died_before_it_began_does_not_run(tmp_path: Path) -> None:
    begin = Path(processes.__file__).with_name("end_with_parent.py")
    nobody = str(os.getppid())
    command = [sys.executable, "-I", "-S", str(begin), nobody, sys.executable, *script(tmp_path, "print('runs')")]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr == f"who started {sys.executable} has ended\n"


SLOW = """
import pathlib, signal, sys, time

def end(*_):
    print("ending", flush=True)
    while not pathlib.Path("end").exists():
        time.sleep(0.01)
    sys.exit(0)

signal.signal(signal.SIGTERM, end)
print("ready", flush=True)
signal.pause()
"""
"""A program that ends in order, but only when there is a file `end`."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_programs_and_a_second_one_changes_nothing(number: signal.Signals, tmp_path: Path) -> None:
    text = f"""
        import time
        from pathlib import Path
        from robosc_experiments.processes import Program, interruptible
        code = {SLOW!r}
        try:
            with interruptible(), Program("slow", ("-c", code), Path({str(tmp_path)!r})) as program:
                program.wait_for("^ready$")
                print(program._used.pid, flush=True)
                time.sleep(60)
        except KeyboardInterrupt:
            print("interrupted", program.status, flush=True)
    """
    outer = subprocess.Popen([sys.executable, *script(tmp_path, text)], stdout=subprocess.PIPE, text=True)
    try:
        assert outer.stdout is not None
        child = int(outer.stdout.readline())
        outer.send_signal(number)
        # The child is in the middle of ending.
        wait_until(lambda: "ending" in (tmp_path / "slow.log").read_text())
        outer.send_signal(number)
        (tmp_path / "end").touch()
        assert outer.communicate(timeout=LIMIT_S)[0] == "interrupted 0\n"
        assert has_ended(child)
    finally:
        outer.kill()
        outer.wait()


def test_a_signal_while_a_program_is_started_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[int] = []

    class Interrupted(subprocess.Popen[str]):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            started.append(self.pid)
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    program = Program("waiting", script(tmp_path, "import signal; signal.pause()"), tmp_path)
    with pytest.raises(KeyboardInterrupt), interruptible(), program:
        pytest.fail("it goes on")
    assert len(started) == 1
    assert has_ended(started[0])


def test_a_first_signal_while_a_deaf_program_is_stopped_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deaf = "import signal; signal.signal(15, signal.SIG_IGN); print('ready', flush=True); signal.pause()"
    wait = subprocess.Popen.wait

    def interrupted(process: "subprocess.Popen[str]", timeout: float | None = None) -> int:
        if timeout is not None:
            os.kill(os.getpid(), signal.SIGINT)
        return wait(process, timeout)

    with (
        pytest.raises(KeyboardInterrupt),
        interruptible(),
        Program("deaf", script(tmp_path, deaf), tmp_path) as program,
    ):
        program.wait_for("^ready$")
        monkeypatch.setattr(subprocess.Popen, "wait", interrupted)
    assert program.status == -signal.SIGKILL


def test_the_handlers_of_signals_are_as_before_afterwards() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), interruptible():
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(LIMIT_S)
    assert signal.getsignal(signal.SIGTERM) is before
