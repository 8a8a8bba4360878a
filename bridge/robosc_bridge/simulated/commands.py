"""What can be done to a simulated robot by a line of text, for a simulator in a process of its own."""

from collections.abc import Callable
from dataclasses import fields

from robosc_bridge.simulated.camera import SimulatedCamera
from robosc_bridge.simulated.line import Faults, SimulatedLine
from robosc_bridge.simulated.rover import Rover
from robosc_bridge.simulated.servo import HardwareError, Servo
from robosc_bridge.simulated.turtlebot3 import SimulatedTurtleBot3
from robosc_bridge.simulated.world import World

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
scanner cover|uncover|stall|go              the LiDAR
scanner turn SHARE                          its speed, as a share of the nominal one
camera disconnect|reconnect                 the plug of the camera
camera cover|uncover|freeze|go              the camera
pose [X Y HEADING]                          tell where the robot is, or put it there (m, rad)
collisions                                  tell how often it came to a wall or an obstacle
goal                                        tell `reached S`, in seconds of the world, or `not yet`
obstacle NAME X Y                           put a round thing somewhere (m)
obstacle NAME away|back                     take it away, or put it back to where it was"""


class UnknownCommandError(ValueError):
    """There is no such command, or not with such values."""


def obey(robot: SimulatedTurtleBot3, line: str) -> str:
    """Do what a line says.

    Args:
        robot: To which it is done.
        line: A command; an empty one does nothing.

    Returns:
        What there is to tell; else nothing.

    Raises:
        UnknownCommandError: It is not known.
    """
    words = line.split()
    if not words:
        return ""
    try:
        return _obey(robot, words)
    except UnknownCommandError:
        raise
    except ValueError as error:
        raise UnknownCommandError(str(error)) from error


def _obey(robot: SimulatedTurtleBot3, words: list[str]) -> str:
    match words:
        case ["help"]:
            return HELP.format(
                faults=", ".join(field.name for field in fields(Faults)),
                errors=", ".join(name.lower() for name in HardwareError.__members__),
            )
        case ["pose"]:
            return "pose " + " ".join(f"{value:.4f}" for value in robot.world.pose)
        case ["pose", x, y, heading]:
            robot.world.place(float(x), float(y), float(heading))
        case ["collisions"]:
            return f"collisions {robot.world.collisions}"
        case ["goal"]:
            return _goal(robot.world)
        case ["obstacle", name, "away" | "back" as what]:
            robot.world.put_obstacle(name, what == "back")
        case ["obstacle", name, x, y]:
            robot.world.move_obstacle(name, float(x), float(y))
        case ["left" | "right" as side, *what] if robot.rover is None:
            _to_servo(robot.left if side == "left" else robot.right, what)
        case ["battery", voltage] if robot.opencr is not None:
            robot.opencr.set_battery(float(voltage))
        case ["battery", voltage] if robot.rover is not None:
            robot.rover.battery_v = float(voltage)
        case ["rover", *what] if robot.rover is not None:
            _to_rover(robot.rover, what)
        case ["press" | "let" as what, name] if robot.opencr is not None:
            robot.opencr.press(**{name: what == "press"})
        case ["scanner", "cover" | "uncover" as what]:
            robot.scanner.is_covered = what == "cover"
        case ["scanner", "stall" | "go" as what]:
            robot.scanner.is_stalled = what == "stall"
        case ["scanner", "turn", share]:
            robot.scanner.turn_at(float(share))
        case ["camera", what] if robot.camera is not None:
            _to_camera(robot.camera, what)
        case ["base", "answers_as", device_id] if robot.rover is None:
            answers_as = None if device_id == "own" else int(device_id)
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
        case ["voltage", voltage]:
            servo.brown_out(float(voltage))
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
            rover.take_over(int(mode))
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


def _seconds_or_none(text: str) -> float | None:
    return None if text == "none" else float(text)


_READERS: dict[str, Callable[[str], object]] = {
    "delay_s": float,
    "drop_next": int,
    "drop_share": float,
    "corrupt_next": int,
    "corrupt_share": float,
    "lose_bytes_share": float,
    "cut_next": int,
    "split_s": _seconds_or_none,
    "echo": _boolean,
    "is_deaf": _boolean,
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
            line.faults.garbage = bytes.fromhex("".join(hexes))
        case [name, value] if name in _READERS:
            setattr(line.faults, name, _READERS[name](value))
        case _:
            raise UnknownCommandError(f"a line does not know {' '.join(words)!r}; `help` lists what it knows")
