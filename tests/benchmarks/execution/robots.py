"""The robots that are measured, what comes to them, and a large one."""

from typing import Any

from robosc.supervisor import Supervisor
from robosc_experiments.cycles.times import PAPER
from robosc_experiments.cycles.times import feed as comes
from support.execution import supervisor_of
from support.generated import example_supervisor
from support.models import model_of

SMALL = ("line_follower", "maze_solver")
EXPERIMENTS = {"line_follower": "line", "maze_solver": "maze"}


def _paper(*, has_middleware: bool) -> dict[str, str]:
    """The paper's Table I: mean, minimum, maximum, standard deviation."""
    return {
        name: " / ".join(f"{us:g}" for us in PAPER[experiment, has_middleware])
        for name, experiment in EXPERIMENTS.items()
    }


WITHOUT, WITH = _paper(has_middleware=False), _paper(has_middleware=True)

LARGE = "60 components"
_SEEN = ("/seen7", True)

_LARGE_SENSORS = 28


def supervisor(name: str) -> Supervisor:
    """The supervisor of a robot."""
    return supervisor_of(model_of(_large_text())) if name == LARGE else example_supervisor(f"{name}/{name}")


def feed(name: str, number: int) -> tuple[str, Any]:
    """Return the input that comes: every other time a scan, whose obstacle comes and goes."""
    if name == LARGE and number % 2 == 0:
        return _SEEN
    return comes(EXPERIMENTS.get(name, "line"), number)


def _large_text() -> str:
    """A line follower with more around it: sensors that are fine or not, and a lamp for each that may then shine."""
    begin = """
        interface twist use Twist from geometry_msgs
        interface laser_scan use LaserScan from sensor_msgs
        datatype object Vector { x: double }
        datatype object Twist { linear: Vector }
        datatype object Scan { ranges: array(double) }
        datatype enum Way from Scan to {
            value.ranges[0] > 0.4 and value.ranges[20] > 0.4 and value.ranges[340] > 0.4 -> clear  default -> obstructed
        }
        component Lidar {
            outgoing message scan with identifier: "/scan", type: Way links laser_scan
            behaviour {
                variable way: Way = obstructed
                on response from scan do way := value
                initial marked state unsafe { transition if way = clear goto safe }
                marked state safe { transition if way = obstructed goto unsafe }
            }
        }
        component Stop {
            outgoing message stop with type: none
            outgoing message resume with type: none
            behaviour {
                initial marked state running { on response from stop goto stopped }
                marked state stopped { on response from resume goto running }
            }
        }
        component Line {
            outgoing message line with type: none
            behaviour { initial marked state lost { on response from line goto found } marked state found { } }
        }
        component Platform {
            incoming message move with identifier: "/cmd_vel", type: Twist links twist
            incoming message halt with identifier: "/cmd_vel", type: Twist links twist
            behaviour { initial marked state operational { on request to move  on request to halt } }
        }
        requirement move needs Lidar.safe and Stop.running
        requirement halt needs Lidar.unsafe or Stop.stopped
        provide move with { linear: { x: 0.15 } }
    """
    pairs = "".join(
        f"""
        component Sensor{number} {{
            outgoing message seen{number} with identifier: "/seen{number}", type: boolean
            behaviour {{
                variable seen: boolean
                on response from seen{number} do seen := value
                initial marked state watching {{ }}
            }}
        }}
        component Lamp{number} {{
            incoming message shine{number} with identifier: "/shine{number}", type: none
            behaviour {{
                initial marked state dark {{ on request to shine{number} goto lit }}
                marked state lit {{ on response from seen{number} goto dark }}
            }}
        }}
        requirement shine{number} needs Sensor{number}.seen and Stop.running and Lidar.safe
        """
        for number in range(_LARGE_SENSORS)
    )
    return f"robot Large {{ {begin} {pairs} }}"
