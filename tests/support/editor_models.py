"""Robots in files, for tests of editors: a name in one is used in another, and comments count more than they show."""

from pathlib import Path

LIBRARY = """// 🤖🤖 parts of robots
library parts {
    interface twist use Twist from geometry_msgs
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    datatype enum Level from double to { value > 0.5 -> high  default -> low }
    component Base {
        incoming message walk with identifier: "/cmd_vel", type: Twist links twist
        outgoing message level with identifier: "/level", type: Level
        behaviour {
            variable count: integer(0..3)
            initial marked state calm { transition if count > 1 goto hurried }
            marked state hurried { }
        }
    }
}
"""

ROBOT = """robot Walker {
    /* 🦿 it 🏃 walks */ component Base from parts import Base
    interface power_ use Power from robot_interfaces
    component Button {
        outgoing message pressed with identifier: "/button", type: Level
        service power with request: Asked, response: none links power_
        behaviour {
            variable last: Level = low
            on response from pressed do last := value
            initial marked state off { /* 😀 */ on response from power goto on_ }
            marked state on_ { on response from power goto off }
        }
    }
    datatype enum Level from double to { value > 0.5 -> high  default -> low }
    datatype object Asked { data: boolean level: Level times: integer(0..3) }
    constant most: integer = 2
    requirement walk needs Base.calm and Button.on_
    requirement { power } needs Button.last = high or Base.count < most
    provide walk with { linear: { x: 0.5 } }
    provide power with { data: true, level: 0.7, times: most } if Button.off
}
"""


def write_definitions(folder: Path) -> None:
    """Write the definition of the service that the robot has, where it is found beside the robot."""
    package = folder / "robot_interfaces" / "srv"
    package.mkdir(parents=True)
    (package / "Power.srv").write_text("bool data\nfloat64 level\nint32 times\n---\n", "utf-8")
