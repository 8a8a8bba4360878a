"""Commands, as lines of text, to the twin behind ROS."""

from robosc_simulated.commands import WORLD_HELP, UnknownCommandError, execute_in_world
from robosc_simulated.ros.robot import RosRobot
from robosc_simulated.values import voltage

HELP = f"""\
scanner cover|uncover                       the LiDAR
camera cover|uncover                        the camera
battery V                                   its supply
{WORLD_HELP}"""


def execute(robot: RosRobot, line: str) -> str:
    """Do what a line says.

    Args:
        robot: To which it is done.
        line: A command; an empty one does nothing.

    Returns:
        The answer to print; empty if there is none.

    Raises:
        UnknownCommandError: It is not known, or not with such values.
    """
    words = line.split()
    match words:
        case []:
            return ""
        case ["help"]:
            return HELP
        case ["scanner", "cover" | "uncover" as what]:
            robot.is_scanner_covered = what == "cover"
        case ["camera", "cover" | "uncover" as what]:
            robot.is_camera_covered = what == "cover"
        case ["battery", text]:
            try:
                robot.battery_v = voltage(text)
            except ValueError as error:
                raise UnknownCommandError(str(error)) from error
        case _:
            return execute_in_world(robot.world, words)
    return ""
