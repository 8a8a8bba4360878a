"""The simulator as a program of its own, and its commands."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import Faults, SimulatedTurtleBot3, scene_names
from robosc_simulated.__main__ import main
from robosc_simulated.commands import UnknownCommandError, execute


def test_scenes_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list-scenes"]) == 0
    assert capsys.readouterr().out.split() == list(scene_names())


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--speed", "0"], "speed factor"),
        (["--speed", "1000"], "the speed factor must be a positive number up to 100, and is 1000"),
        (["--walls", "/nowhere"], "No such file"),
        (["--line", "/nowhere"], "No such file"),
        (["--line", "/dev/zero"], "/dev/zero: is not a regular file"),
        (["--walls", "/proc/self/fd"], "is not a regular file"),
        (["--scene", "nowhere"], "there is no scene and no file 'nowhere'"),
        (["--scene", "/dev/null"], "is not a regular file"),
        (["--scene", "room", "--line", "oval"], "--line does not go with --scene"),
        (["--motion", "/nowhere/motion"], "No such file"),
        (["--line", __file__], "line 1 of the track is not `x y`"),
        (["--camera-link", "/dev/null"], "something at /dev/null already"),
    ],
)
def test_what_cannot_be_simulated_is_reported(
    arguments: list[str], text: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    assert main(arguments) == 1
    found = capsys.readouterr()
    assert found.out == ""
    assert text in found.err
    assert found.err.count("\n") == 1


def test_a_line_needs_two_points_and_files_are_bounded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    file = tmp_path / "file"
    for data, text in ((b"", "at least two points"), (b"#" * 300_000, "larger than"), (b"\xff", "not text in UTF-8")):
        file.write_bytes(data)
        assert main(["--line", str(file)]) == 1
        assert text in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value", "text"),
    [
        ("--room", "3", "2 numbers with `x` between them"),
        ("--room", "nanx3", "a number from 0.1 to 1000"),
        ("--maze", "0x2", "a whole number from 1 to 30"),
        ("--maze", "100000x1", "a whole number from 1 to 30"),
        ("--maze", "2.5x3", "a whole number from 1 to 30"),
        ("--pose", "nan,0,0", "a number from -1000 to 1000"),
        ("--pose", "0,0,1e300", "a number from -1000 to 1000"),
        ("--noise", "nan", "a number from 0 to 1"),
        ("--noise", "-1", "a number from 0 to 1"),
        ("--seed", "-1", "a whole number from 0 to 2147483647"),
        ("--seed", "1000000000000000", "a whole number from 0 to 2147483647"),
    ],
)
def test_wrong_arguments_are_reported(option: str, value: str, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([option, value])
    assert caught.value.code == 2
    assert f"argument {option}: {text}" in capsys.readouterr().err


def test_a_wall_map_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "walls"
    place.write_text("1 0 0\n")
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    assert main(["--walls", str(place)]) == 1
    assert "line 1 of the wall map" in capsys.readouterr().err


@pytest.fixture
def robot() -> Iterator[SimulatedTurtleBot3]:
    with SimulatedTurtleBot3(clock=ManualClock()) as found:
        yield found


def test_every_fault_of_a_wire_can_be_reported(robot: SimulatedTurtleBot3) -> None:
    values = {
        "delay_s": ("0.1", 0.1),
        "drop_next": ("3", 3),
        "drop_share": ("0.5", 0.5),
        "corrupt_next": ("2", 2),
        "corrupt_share": ("0.25", 0.25),
        "lose_bytes_share": ("0.01", 0.01),
        "cut_next": ("1", 1),
        "garbage": ("ff 00", b"\xff\0"),
        "split_s": ("0.001", 0.001),
        "echo": ("true", True),
        "is_deaf": ("true", True),
        "duplicate_share": ("0.1", 0.1),
        "cut_share": ("0.2", 0.2),
        "flip_share": ("0.3", 0.3),
        "device_drop_share": ("0.4", 0.4),
        "device_duplicate_share": ("0.5", 0.5),
        "device_cut_share": ("0.6", 0.6),
        "device_flip_share": ("0.7", 0.7),
        "batch_s": ("0.016", 0.016),
        "has_wire_time": ("true", True),
    }
    assert set(values) == set(vars(Faults()))
    for name, (text, _) in values.items():
        assert execute(robot, f"scanner {name} {text}") == ""
    assert vars(robot.scanner_faults) == {name: value for name, (_, value) in values.items()}
    execute(robot, "scanner split_s none")
    assert robot.scanner_faults.split_s is None
    execute(robot, "scanner sound")
    assert robot.scanner_faults == Faults()
    assert robot.base_faults == Faults()


def test_devices_are_reported(robot: SimulatedTurtleBot3) -> None:
    assert robot.opencr is not None
    execute(robot, "left overheat")
    assert robot.left.table["hardware error status"] == 0x04
    execute(robot, "left cool_down")
    assert robot.left.temperature_c == 33.0
    execute(robot, "right trip overload")
    assert robot.right.table["hardware error status"] == 0x20
    execute(robot, "right block")
    assert robot.world.right.is_blocked
    execute(robot, "right release")
    assert not robot.world.right.is_blocked
    execute(robot, "left voltage 7.5")
    assert robot.left.voltage_v == 7.5
    execute(robot, "battery 11.2")
    assert robot.opencr.panel.battery_v == 11.2
    execute(robot, "press bumper_1")
    assert robot.opencr.panel.bumper_1
    execute(robot, "let bumper_1")
    assert not robot.opencr.panel.bumper_1
    execute(robot, "scanner cover")
    execute(robot, "scanner stall")
    execute(robot, "scanner turn 0.5")
    assert (robot.scanner.is_covered, robot.scanner.is_stalled, robot.scanner.revolutions_per_s) == (True, True, 2.5)
    execute(robot, "scanner uncover")
    execute(robot, "scanner go")
    assert (robot.scanner.is_covered, robot.scanner.is_stalled) == (False, False)
    execute(robot, "base answers_as 7")
    assert robot.opencr.answers_as == 7
    execute(robot, "base answers_as own")
    assert robot.opencr.answers_as is None
    execute(robot, "scanner disconnect")
    assert not robot.scanner_line.is_connected
    execute(robot, "scanner reconnect")
    assert robot.scanner_line.is_connected
    execute(robot, "pose 1 0.5 3")
    assert execute(robot, "pose") == "pose 1.0000 0.5000 3.0000"
    assert execute(robot, "collisions") == "collisions 0"
    assert execute(robot, "") == ""
    assert "delay_s" in execute(robot, "help")
    assert "shock" in execute(robot, "help")


@pytest.mark.parametrize(
    "line",
    ["jump", "left", "left jump", "left trip it", "base jump 1", "base delay_s", "base delay_s x", "base echo 1",
     "press battery_v", "scanner turn 0", "pose 1", "base garbage xx", "base answers_as x", "battery"],
)  # fmt: skip
def test_what_is_not_known_is_reported(robot: SimulatedTurtleBot3, line: str) -> None:
    with pytest.raises(UnknownCommandError):
        execute(robot, line)


@pytest.mark.parametrize(
    "line",
    ["steer nan 0", "steer 0 1e9",
     "pose nan 0 0", "pose 1e308 0 0", "pose 0 0 1e308", "battery nan", "battery 1e300", "battery -1",
     "left voltage nan", "right voltage inf", "base delay_s nan", "scanner delay_s 1e30", "scanner split_s 1e30",
     "scanner split_s -1", "base drop_share nan", "base drop_share 1.1", "base corrupt_next -1",
     "base cut_next 1000000000000", "base answers_as 99999", "scanner turn 1e-9", "scanner turn nan",
     f"base garbage {'00' * 5000}"],
)  # fmt: skip
def test_numbers_that_no_device_can_bear_are_refused(robot: SimulatedTurtleBot3, line: str) -> None:
    with pytest.raises(UnknownCommandError, match=r"is needed, not|at most"):
        execute(robot, line)
    # And nothing has changed.
    robot.advance(0.2)
    assert robot.base_faults == robot.scanner_faults == Faults()
    assert robot.world.pose == (0.0, 0.0, 0.0)


def test_a_remote_control_steers(robot: SimulatedTurtleBot3) -> None:
    execute(robot, "steer 0.05 0")
    robot.advance(0.2)
    execute(robot, "steer 0 0")
    robot.advance(0.1)
    way_m = robot.world.pose[0]
    assert 0.0 < way_m < 0.02
    robot.advance(0.2)
    assert robot.world.pose[0] == way_m


def test_a_port_whose_place_was_taken_is_reported(tmp_path: Path) -> None:
    link = tmp_path / "base"
    with SimulatedTurtleBot3(clock=ManualClock(), base_link=link) as robot:
        execute(robot, "base disconnect")
        link.touch()
        with pytest.raises(UnknownCommandError, match="exists"):
            execute(robot, "base reconnect")
        link.unlink()
        execute(robot, "base reconnect")
        assert robot.base_line.is_connected


def test_servos_have_no_buttons() -> None:
    with SimulatedTurtleBot3(base="dynamixel", clock=ManualClock()) as robot:
        for line in ("battery 11.0", "press button_1"):
            with pytest.raises(UnknownCommandError):
                execute(robot, line)


def test_a_rover_is_reported() -> None:
    with SimulatedTurtleBot3(base="mavlink-rover", clock=ManualClock()) as robot:
        rover = robot.rover
        assert rover is not None
        execute(robot, "rover refuse no GPS")
        assert rover.refusal == "no GPS"
        execute(robot, "rover accept")
        assert rover.refusal == ""
        execute(robot, "rover take_over 4")
        assert rover.mode == 4
        rover.is_armed = True
        execute(robot, "rover disarm")
        assert not rover.is_armed
        rover.is_armed = True
        execute(robot, "rover restart")
        assert not rover.is_armed
        execute(robot, "rover silent")
        assert rover.is_silent
        execute(robot, "rover heard")
        assert not rover.is_silent
        execute(robot, "battery 10.5")
        assert rover.battery_v == 10.5
        for line in (
            "left overheat",
            "rover jump",
            "rover refuse",
            "rover take_over x",
            "rover take_over 1000",
            "battery 70",
            "base answers_as 7",
            "rover",
        ):
            with pytest.raises(UnknownCommandError):
                execute(robot, line)
