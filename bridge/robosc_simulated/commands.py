"""Commands to a simulated robot as lines of text, for a simulator in a process of its own."""

import contextlib
import sys
from collections.abc import Callable
from dataclasses import fields

from robosc_simulated.camera import SimulatedCamera
from robosc_simulated.line import Faults, SimulatedLine
from robosc_simulated.rover import Rover
from robosc_simulated.servo import HardwareError, Servo
from robosc_simulated.turtlebot3 import SimulatedTurtleBot3
from robosc_simulated.values import angle, coordinate, number, voltage, whole_number
from robosc_simulated.world import World

WORLD_HELP = """\
pose [X Y HEADING]                          print where the robot is, or put it there (m, rad)
collisions                                  print how often it came to a wall or an obstacle
goal                                        print `reached S`, in seconds of the world, or `not yet`
obstacle NAME X Y                           put a round thing somewhere (m)
obstacle NAME away|back                     take it away, or put it back to where it was"""

HELP = """\
base|scanner disconnect|reconnect|sound     the plug of a line; `sound` removes its faults
base|scanner FAULT VALUE                    a fault of a line: {faults}
base answers_as ID|own                      the ID that its answers carry
left|right overheat|cool_down               a wheel's servo; a rover has none
left|right trip ERROR                       an error of its hardware: {errors}
left|right block|release                    a wheel
left|right voltage V                        a servo's supply
battery V                                   OpenCR's or the rover's battery
rover refuse REASON|accept                  whether it arms
rover take_over MODE                        its mode's number, by its remote control
rover disarm|restart|silent|heard           the rover's autopilot
press|let NAME                              button_1, button_2, bumper_1, bumper_2 of OpenCR
steer LINEAR ANGULAR                        OpenCR's remote control (m/s, rad/s)
scanner cover|uncover|stall|go              the LiDAR
scanner turn SHARE                          its speed, as a share of the nominal one
camera disconnect|reconnect                 the plug of the camera
camera cover|uncover|freeze|go              the camera
{world}"""


# A port takes at most so much at once.
_MOST_GARBAGE = 4096
# The fastest velocity of a remote control, in m/s or rad/s.
_FASTEST = 100.0


class UnknownCommandError(ValueError):
    """The command does not exist, or not with such values."""


def obey_input(obey: Callable[[str], str]) -> None:
    """Obey the lines of standard input to its end, or until it cannot be read; answers are printed.

    Args:
        obey: Function that carries out a line and returns the answer, as `execute` does.
    """
    with contextlib.suppress(ValueError, OSError):
        for line in sys.stdin:
            try:
                answer = obey(line)
            except UnknownCommandError as error:
                answer = f"error: {error}"
            if answer:
                print(answer, flush=True)


def execute(robot: SimulatedTurtleBot3, line: str) -> str:
    """Do what a line says.

    Args:
        robot: To which it is done.
        line: A command; an empty one does nothing.

    Returns:
        The answer to print; empty if there is none.

    Raises:
        UnknownCommandError: It is not known, or cannot be done.
    """
    words = line.split()
    if not words:
        return ""
    try:
        return _obey(robot, words)
    except UnknownCommandError:
        raise
    # A port whose name another one has taken meanwhile cannot be plugged in again.
    except (ValueError, OSError) as error:
        raise UnknownCommandError(str(error)) from error


def execute_in_world(world: World, words: list[str]) -> str:
    """Do to the world what words say.

    Args:
        world: To which it is done.
        words: A command of `WORLD_HELP`.

    Returns:
        The answer to print; empty if there is none.

    Raises:
        UnknownCommandError: It is not known, or not with such values.
    """
    try:
        match words:
            case ["pose"]:
                return "pose " + " ".join(f"{value:.4f}" for value in world.pose)
            case ["pose", x, y, heading]:
                world.place(coordinate(x), coordinate(y), angle(heading))
            case ["collisions"]:
                return f"collisions {world.collisions}"
            case ["goal"]:
                return _goal(world)
            case ["obstacle", name, "away" | "back" as what]:
                world.put_obstacle(name, what == "back")
            case ["obstacle", name, x, y]:
                world.move_obstacle(name, coordinate(x), coordinate(y))
            case _:
                raise UnknownCommandError(f"unknown command {' '.join(words)!r}; `help` lists them")
    except UnknownCommandError:
        raise
    except ValueError as error:
        raise UnknownCommandError(str(error)) from error
    return ""


def _obey(robot: SimulatedTurtleBot3, words: list[str]) -> str:
    match words:
        case ["help"]:
            return HELP.format(
                faults=", ".join(field.name for field in fields(Faults)),
                errors=", ".join(name.lower() for name in HardwareError.__members__),
                world=WORLD_HELP,
            )
        case ["pose" | "collisions" | "goal" | "obstacle", *_]:
            return execute_in_world(robot.world, words)
        case ["left" | "right" as side, *what] if robot.rover is None:
            _to_servo(robot.left if side == "left" else robot.right, what)
        case ["battery", text] if robot.opencr is not None:
            robot.opencr.set_battery(voltage(text))
        case ["battery", text] if robot.rover is not None:
            robot.rover.battery_v = voltage(text)
        case ["rover", *what] if robot.rover is not None:
            _to_rover(robot.rover, what)
        case ["press" | "let" as what, name] if robot.opencr is not None:
            robot.opencr.press(**{name: what == "press"})
        case ["steer", linear, angular] if robot.opencr is not None:
            robot.opencr.steer(_speed(linear), _speed(angular))
        case ["scanner", "cover" | "uncover" as what]:
            robot.scanner.is_covered = what == "cover"
        case ["scanner", "stall" | "go" as what]:
            robot.scanner.is_stalled = what == "stall"
        case ["scanner", "turn", share]:
            robot.scanner.set_speed(number(share, 0.01, 2.0))
        case ["camera", what] if robot.camera is not None:
            _to_camera(robot.camera, what)
        case ["base", "answers_as", device_id] if robot.rover is None:
            answers_as = None if device_id == "own" else whole_number(device_id, 0, 255)
            # It has one of the two.
            if robot.opencr is not None:
                robot.opencr.answers_as = answers_as
            if robot.bus is not None:
                robot.bus.answers_as = answers_as
        case ["base" | "scanner" as which, *what]:
            _to_line(robot.base_line if which == "base" else robot.scanner_line, what)
        case _:
            raise UnknownCommandError(f"unknown command {' '.join(words)!r}; `help` lists them")
    return ""


def _goal(world: World) -> str:
    with world.time.lock:
        world.catch_up()
        if world.scene.goal is None:
            raise UnknownCommandError("there is no goal in this scene")
        return "not yet" if world.reached_s is None else f"reached {world.reached_s:.3f}"


def _to_servo(servo: Servo, words: list[str]) -> None:
    match words:
        case ["overheat"]:
            servo.overheat()
        case ["cool_down"]:
            servo.cool_down()
        case ["trip", name] if name.upper() in HardwareError.__members__:
            servo.trip(HardwareError[name.upper()])
        case ["block"]:
            servo.block_wheel()
        case ["release"]:
            servo.block_wheel(False)
        case ["voltage", text]:
            servo.brown_out(voltage(text))
        case _:
            raise UnknownCommandError(f"a servo does not know {' '.join(words)!r}; `help` lists what it knows")


def _to_camera(camera: SimulatedCamera, what: str) -> None:
    match what:
        case "disconnect":
            camera.disconnect()
        case "reconnect":
            camera.reconnect()
        case "cover" | "uncover":
            camera.is_covered = what == "cover"
        case "freeze" | "go":
            camera.is_frozen = what == "freeze"
        case _:
            raise UnknownCommandError(f"a camera does not know {what!r}; `help` lists what it knows")


def _to_rover(rover: Rover, words: list[str]) -> None:
    match words:
        case ["refuse", *reason] if reason:
            rover.refusal = " ".join(reason)
        case ["accept"]:
            rover.refusal = ""
        case ["take_over", mode]:
            rover.take_over(whole_number(mode, 0, 255))
        case ["disarm"]:
            rover.disarm()
        case ["restart"]:
            rover.restart()
        case ["silent" | "heard" as what]:
            rover.is_silent = what == "silent"
        case _:
            raise UnknownCommandError(f"a rover does not know {' '.join(words)!r}; `help` lists what it knows")


def _boolean(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueError(f"true or false is needed, not {text!r}")
    return text == "true"


def _seconds(text: str) -> float:
    return number(text, 0.0, 3600.0)


def _seconds_or_none(text: str) -> float | None:
    return None if text == "none" else _seconds(text)


def _share(text: str) -> float:
    return number(text, 0.0, 1.0)


def _count(text: str) -> int:
    return whole_number(text, 0, 1_000_000)


_READERS: dict[str, Callable[[str], object]] = {
    "delay_s": _seconds,
    "drop_next": _count,
    "drop_share": _share,
    "corrupt_next": _count,
    "corrupt_share": _share,
    "lose_bytes_share": _share,
    "cut_next": _count,
    "split_s": _seconds_or_none,
    "echo": _boolean,
    "is_deaf": _boolean,
    "duplicate_share": _share,
    "cut_share": _share,
    "flip_share": _share,
    "device_drop_share": _share,
    "device_duplicate_share": _share,
    "device_cut_share": _share,
    "device_flip_share": _share,
    "batch_s": _seconds,
    "has_wire_time": _boolean,
}


def _to_line(line: SimulatedLine, words: list[str]) -> None:
    match words:
        case ["disconnect"]:
            line.disconnect()
        case ["reconnect"]:
            line.reconnect()
        case ["sound"]:
            line.faults.clear()
        case ["garbage", *hexes] if hexes:
            found = "".join(hexes)
            if len(found) > 2 * _MOST_GARBAGE:
                raise UnknownCommandError(f"garbage has {_MOST_GARBAGE} bytes at most")
            line.faults.garbage = bytes.fromhex(found)
        case [name, value] if name in _READERS:
            setattr(line.faults, name, _READERS[name](value))
        case _:
            raise UnknownCommandError(f"a line does not know {' '.join(words)!r}; `help` lists what it knows")


def _speed(text: str) -> float:
    return number(text, -_FASTEST, _FASTEST)
