"""Tests of the command: what it refuses, without ROS 2 and with a node that is none."""

import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from robosc_api.security import Scope, ServerSecurity, make_token
from robosc_bridge.host import monotonic
from robosc_bridge.main import make_parser
from robosc_bridge.remote import RemoteSettings, convert
from robosc_bridge.ros2 import command, node
from robosc_bridge.ros2.command import main
from support.remote import READING, FakeDaemon, served
from support.waiting import PATIENCE_S

NOWHERE = "127.0.0.1:1"


class Outlet:
    """A node without ROS.

    Attributes:
        made: Arguments of the last that was made.
    """

    made: tuple[Any, ...] = ()

    def __init__(self, *arguments: Any, **options: Any) -> None:
        Outlet.made = (*arguments, options)

    def __enter__(self) -> "Outlet":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def know(self, turtlebot: str, scanner: tuple[float, float] | None) -> None:
        if not turtlebot:
            raise node.NodeError("where is the LiDAR?")

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None


@pytest.fixture
def outlet(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Outlet]]:
    monkeypatch.setattr(node, "BridgeNode", Outlet)
    yield Outlet
    Outlet.made = ()


def status(*arguments: str) -> int:
    """Run the command in a thread, whose signals are its own."""
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(main(["ros2", *arguments])), daemon=True)
    thread.start()
    thread.join(PATIENCE_S)
    return found[0]


@pytest.mark.parametrize("package", ["rclpy", "sensor_msgs.msg"])
def test_without_ros_2_it_is_one_clear_line(
    package: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    assert status("--address", NOWHERE) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert errors.startswith("robosc-bridge: ROS 2 is not there (")
    assert "source its setup file, or install RoboSC with its extra `ros2`" in errors


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rate", "0"], "a number from 1 to 100 is needed"),
        (["--rate", "nan"], "a number from 1 to 100 is needed"),
        (["--rate", "fast"], "invalid number value: 'fast'"),
        (["--scan-at", "0", "0"], "expected 3 arguments"),
        (["--scan-at", "0", "0", "inf"], "a number of metres from -10 to 10 is needed"),
        (["--address", "robot:0"], "neither HOST nor HOST:PORT"),
    ],
)
def test_wrong_use(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["ros2", *arguments])
    assert caught.value.code == 2
    assert words in capsys.readouterr().err


def test_the_whole_program_knows_it(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        make_parser().parse_args(["ros2", "--help"])
    assert "takes no velocities: the supervisor keeps command of the wheels" in " ".join(
        capsys.readouterr().out.split()
    )


def test_files_that_cannot_be_used_are_reported_at_once(
    outlet: type[Outlet], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = tmp_path / "empty"
    empty.touch()
    assert status("--address", NOWHERE, "--token-file", str(empty)) == 2
    assert "exactly one token" in capsys.readouterr().err
    assert outlet.made == ()


def test_a_bridge_that_refuses_ends_it(
    outlet: type[Outlet], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tokens = tmp_path / "tokens"
    tokens.write_text(make_token("screen", (Scope.WATCH,))[1])
    tokens.chmod(0o600)
    with FakeDaemon() as daemon, served(daemon, RemoteSettings("127.0.0.1:0", ServerSecurity(tokens=tokens))) as bridge:
        assert status("--address", bridge.address) == 1
    assert "a valid token is needed" in capsys.readouterr().err


def test_another_robot_whose_parts_nobody_knows_ends_it(
    outlet: type[Outlet], capsys: pytest.CaptureFixture[str]
) -> None:
    with FakeDaemon() as daemon, served(daemon) as bridge:
        assert status("--address", bridge.address, "--scan-at", "0.1", "0", "0.2", "--ros-args", "-r", "a:=b") == 2
    assert capsys.readouterr().err == "robosc-bridge: where is the LiDAR?\n"
    frames, scan, namespace, options = outlet.made
    assert (frames.base, scan.z_m, namespace) == ("base_footprint", 0.2, "")
    assert options == {"sends_odom_tf": True, "sends_static_tf": True, "arguments": ["-r", "a:=b"]}


@pytest.mark.parametrize(
    ("arguments", "sends"), [([], (True, True)), (["--no-tf"], (False, False)), (["--no-static-tf"], (True, False))]
)
def test_an_earlier_bridge_ends_it(
    arguments: list[str],
    sends: tuple[bool, bool],
    outlet: type[Outlet],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(convert, "put_sent", lambda response: None)
    with FakeDaemon() as daemon:
        daemon.operations.turtlebot = "burger"
        with served(daemon) as bridge:
            assert status("--address", bridge.address, *arguments) == 2
    opening, error = capsys.readouterr().err.splitlines()
    assert opening.startswith("robosc-bridge: publishes what the bridge of Porter at 127.0.0.1:")
    assert "is of an earlier version" in error
    assert (outlet.made[-1]["sends_odom_tf"], outlet.made[-1]["sends_static_tf"]) == sends


def test_a_failure_of_ros_ends_it(
    outlet: type[Outlet], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def put_drive(*_: object) -> None:
        raise RuntimeError("the publisher is gone")

    monkeypatch.setattr(outlet, "put_drive", put_drive, raising=False)
    with FakeDaemon() as daemon:
        daemon.operations.turtlebot = "burger"
        daemon.show(reading=replace(READING, time_s=monotonic()))
        with served(daemon) as bridge:
            assert status("--address", bridge.address) == 1
    assert capsys.readouterr().err.splitlines()[-1] == (
        "robosc-bridge: publishing failed: RuntimeError: the publisher is gone"
    )


def test_a_bridge_that_goes_is_reported_once_and_found_again(
    outlet: type[Outlet], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "RETRY_S", 0.01)
    errors: list[str] = []
    comes, goes = threading.Event(), threading.Event()

    def say(text: str) -> None:
        errors.append(text)
        (comes if text.startswith("publishes") else goes).set()

    monkeypatch.setattr(command, "_say", say)
    with FakeDaemon() as daemon:
        daemon.operations.turtlebot = "burger"
        with served(daemon) as bridge:
            address = bridge.address
            found: list[int] = []
            thread = threading.Thread(target=lambda: found.append(main(["ros2", "--address", address])), daemon=True)
            thread.start()
            assert comes.wait(PATIENCE_S)
            comes.clear()
        assert goes.wait(PATIENCE_S)
        # The second one ends it, so that nothing is left behind.
        monkeypatch.setattr(convert, "put_sent", lambda response: None)
        with served(daemon, RemoteSettings(address)):
            assert comes.wait(PATIENCE_S)
            thread.join(PATIENCE_S)
    assert found == [2]
    away = [text for text in errors if not text.startswith("publishes")]
    assert len(away) == len(set(away))
