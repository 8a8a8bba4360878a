"""The commands of `robosc-bridge` that end by themselves: what they refuse, and what they print."""

import logging
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from robosc.cli.main import main as robosc
from robosc_bridge.main import main
from support.models import EXAMPLES
from support.service import served

MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"


class Done(NamedTuple):
    """Result of a command that has ended."""

    returncode: int
    stdout: str
    stderr: str


class Bridge:
    """The program, called in this process.

    Args:
        capsys: Capture of its printed output.
        caplog: Capture of its log messages while it runs.
    """

    def __init__(self, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> None:
        self._capsys = capsys
        self._caplog = caplog

    def __call__(self, *arguments: str) -> Done:
        self._capsys.readouterr()
        self._caplog.clear()
        status = main(list(arguments))
        printed = self._capsys.readouterr()
        return Done(status, printed.out, self._caplog.text + printed.err)


@pytest.fixture
def bridge(capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> Iterator[Bridge]:
    caplog.set_level(logging.INFO, "robosc_bridge")
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    handlers = {number: signal.getsignal(number) for number in numbers}
    try:
        yield Bridge(capsys, caplog)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def configured(bridge: Bridge, folder: Path) -> Path:
    """A configuration as `init` writes it, with options of the drive."""
    made = bridge("init", "--model", str(MODEL), "--drive", "opencr", "--scanner", "lds01")
    assert made.returncode == 0, made.stderr
    text = re.sub(r"^  port: .*$", "  port: /dev/none", made.stdout, flags=re.MULTILINE)
    file = folder / "bridge.yaml"
    file.write_text(text.replace("\nscanner:\n", "  options: {answer_limit_s: 0.3}\n\nscanner:\n", 1))
    return file


def test_ports_are_those_of_the_machine_or_those_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("robosc_bridge.main.UDEV_FOLDERS", (tmp_path / "none", tmp_path))

    def ports(*more: str) -> list[str]:
        assert main(["init", "--model", str(MODEL), *more]) == 0
        return re.findall(r"^  port: (.*)$", capsys.readouterr().out, re.MULTILINE)

    assert ports() == ["/dev/ttyACM0", "/dev/ttyUSB0"]
    (tmp_path / "60-robosc.rules").touch()
    assert ports() == ["/dev/robosc-opencr", "/dev/robosc-lds"]
    assert ports("--drive-port", "/tmp/base") == ["/tmp/base", "/dev/robosc-lds"]


def test_what_is_not_tied_is_listed(bridge: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "bridge.yaml"
    file.write_text(
        "robot: burger\ndrive: {driver: opencr, port: /dev/ttyACM0}\nchannels: {/cmd_vel: {channel: drive}}\n"
    )
    for command in ("check", "run"):
        done = bridge(command, "--model", str(MODEL), "--config", str(file))
        assert done.returncode == 2
        for name in ("scan_front", "rotate_left", "rotate_right", "rotate_done"):
            assert f"'{name}'" in done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("driver: opencr", "driver: opncr"), "unknown drive base 'opncr'"),
        (("answer_limit_s", "answer_limt_s"), "answer_limt_s"),
        (("token_file: null", "token_file: /nowhere/token"), "/nowhere/token: No such file"),
        (("mavlink_key: null", "mavlink_key: key"), "has no effect without 'mavlink_url'"),
    ],
)
def test_check_refuses_what_run_refuses(change: tuple[str, str], why: str, bridge: Bridge, tmp_path: Path) -> None:
    file = configured(bridge, tmp_path)
    text = file.read_text()
    assert change[0] in text
    file.write_text(text.replace(*change, 1))
    results = [bridge(command, "--model", str(MODEL), "--config", str(file)) for command in ("check", "run")]
    assert [done.returncode for done in results] == [2, 2]
    lines = [[line for line in done.stderr.splitlines() if line.startswith("robosc-bridge: ")] for done in results]
    assert lines[0] == lines[1]
    assert why in lines[0][0]


def test_silent_steps_that_never_end_are_refused_unless_they_are_allowed(bridge: Bridge, tmp_path: Path) -> None:
    model, supervisor, file = (tmp_path / name for name in ("live.rscd", "live.rsup", "bridge.yaml"))
    model.write_text(
        """robot Live {
    component C {
        incoming message go with identifier: "/go", type: none
        behaviour { initial marked state s { transition goto t } marked state t { transition goto s } }
    }
}"""
    )
    file.write_text("robot: burger\ndrive: {driver: opencr, port: /dev/none}\nchannels: {/go: {channel: log}}\n")
    assert robosc(["synth", str(model), "--allow-livelock", "-o", str(supervisor)]) == 0
    for path in (model, supervisor):
        # The next fault is reported once they are allowed.
        command_line = ("run", "--standby", "--model", str(path), "--config", str(file))
        refused, allowed = bridge(*command_line), bridge(*command_line, "--allow-livelock")
        assert (refused.returncode, allowed.returncode) == (2, 2)
        assert "silent steps never end (--allow-livelock overrides this)" in refused.stderr
        assert "to wait in standby" not in refused.stderr
        assert "its silent steps may go on for ever" in allowed.stderr
        assert "to wait in standby" in allowed.stderr


def test_what_a_server_made_is_kept_unasked(bridge: Bridge, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    model, file = tmp_path / "r.rscd", tmp_path / "bridge.yaml"
    model.write_text('robot R { component C { incoming message go with identifier: "/go", type: none } }')
    file.write_text("robot: burger\ndrive: {driver: opencr, port: /dev/none}\nchannels: {/go: {channel: log}}\n")
    # The next fault is reported once there is a supervisor.
    command_line = ["run", "--standby", "--model", str(model), "--config", str(file), "--server"]
    with served() as address:
        first = bridge(*command_line, address)
    (kept,) = (tmp_path / "state" / "robosc-bridge").iterdir()
    assert kept.suffix == ".rsup"
    second = bridge(*command_line, address)
    assert "what it made last is taken" in second.stderr
    for done in (first, second):
        assert "to wait in standby" in done.stderr
    kept.unlink()
    assert "none is kept of an earlier start" in bridge(*command_line, address).stderr


def test_standby_without_a_remote_face_is_refused(bridge: Bridge, tmp_path: Path) -> None:
    file = configured(bridge, tmp_path)
    done = bridge("run", "--standby", "--model", str(MODEL), "--config", str(file))
    assert done.returncode == 2
    assert (
        "to wait in standby, the bridge needs 'remote.grpc_address', 'remote.mavlink_url' or 'view.address'"
        in done.stderr
    )


def test_drivers_are_listed_for_people_and_programs(bridge: Bridge) -> None:
    assert "opencr" in bridge("drivers").stdout
    assert '"name": "lds03"' in bridge("drivers", "--json").stdout


def test_the_schema_is_printed(bridge: Bridge) -> None:
    assert bridge("schema").stdout.startswith("{")


def test_a_file_is_not_overwritten(bridge: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "bridge.yaml"
    assert bridge("init", "--model", str(MODEL), "-o", str(file)).returncode == 0
    again = bridge("init", "--model", str(MODEL), "-o", str(file))
    assert again.returncode == 2
    assert "File exists" in again.stderr


@pytest.mark.parametrize(
    ("key", "address", "commands", "why"),
    [
        (
            "mavlink_url",
            "udpbcast:10.0.0.255:14550",
            ("check", "run"),
            "remote.mavlink_url: 'udpbcast:10.0.0.255:14550' cannot be used; it is udpin:HOST:PORT",
        ),
        ("grpc_address", "0.0.0.0:0", ("run",), "is reachable from other machines"),
    ],
)
def test_an_address_that_cannot_be_used_is_one_line(
    key: str, address: str, commands: tuple[str, ...], why: str, bridge: Bridge, tmp_path: Path
) -> None:
    file = configured(bridge, tmp_path)
    text, count = re.subn(rf"^  {key}: .*$", f"  {key}: '{address}'", file.read_text(), flags=re.MULTILINE)
    assert count == 1
    file.write_text(text)
    for command in commands:
        done = bridge(command, "--model", str(MODEL), "--config", str(file))
        assert done.returncode == 2
        assert why in done.stderr
        assert "Traceback" not in done.stderr


def test_a_start_loads_no_library_that_few_robots_need() -> None:
    code = (
        "import sys, robosc_bridge.main; "
        "print(*sys.modules.keys() & {'numpy', 'cv2', 'pymavlink', 'prometheus_client', 'rclpy'})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "\n"
