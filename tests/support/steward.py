"""The robot Steward: requests that share names and are told apart by their data, and limits on every kind of number."""

from collections.abc import Sequence
from functools import cache

from robosc.certification import make_supervisor
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.equivalence.observation import Observation
from support.models import bundle_of
from support.porter_ros1 import of_ros1

_MODEL = """
robot Steward {
    interface twist use Twist from geometry_msgs
    interface set_bool use SetBool from std_srvs
    interface search use BasicTypes from test_msgs
    interface fibonacci use Fibonacci from test_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    datatype object Order { order: integer }
    datatype object Sequence { sequence: array(integer) }
    datatype object Switch { data: boolean }
    datatype object Done { success: boolean }
    datatype object Search { float64_value: double }

    component Permission {
        outgoing message allowed with identifier: "/allowed", type: boolean
        outgoing message speed with identifier: "/speed", type: double
        behaviour {
            variable yes: boolean
            variable wanted: double
            on response from allowed do yes := value
            on response from speed do wanted := value
            initial marked state denied { transition if yes goto granted }
            marked state granted { transition if !yes goto denied }
        }
    }
    component Base {
        incoming message halt with identifier: "/cmd_vel", type: Twist, when: default links twist
        incoming message walk with identifier: "/cmd_vel", type: Twist, when: value.linear.x != 0.0 links twist
        incoming message turn with identifier: "/cmd_vel", type: Twist, when: value.angular.z > 0.0 links twist
        incoming message loud with identifier: "volume", type: double
        incoming message gear with identifier: "/gear", type: integer
        behaviour {
            initial marked state ready {
                on request to halt
                on request to walk
                on request to turn
                on request to loud
                on request to gear
            }
        }
    }
    component Power {
        service up with identifier: "/power", request: Switch, response: Done, when: value.data links set_bool
        service down with identifier: "/power", request: Switch, response: Done, when: default links set_bool
        behaviour {
            variable is_on: boolean = false
            initial marked state idle { on request to up goto asked on request to down goto asked }
            state asked {
                on response from up do is_on := value.success goto idle
                on response from down do is_on := false goto idle
                on error from up goto idle
                on error from down goto idle
            }
        }
    }
    component Planner {
        service near with identifier: "/plan", request: Search, response: none,
            when: value.float64_value < 1.0 links search
        service far with identifier: "/plan", request: Search, response: none links search
        behaviour {
            initial marked state idle { on request to near goto asked on request to far goto asked }
            state asked {
                on response from near goto idle
                on response from far goto idle
                on error from near goto idle
                on error from far goto idle
            }
        }
    }
    component Counter {
        action zero with identifier: "/count", request: Order, response: Sequence, feedback: Sequence,
            when: default links fibonacci
        action brief with identifier: "/count", request: Order, response: Sequence, feedback: Sequence,
            when: value.order < 3 links fibonacci
        action long with identifier: "/count", request: Order, response: Sequence, feedback: Sequence links fibonacci
        behaviour {
            variable steps: integer = 0
            initial marked state idle {
                on request to zero goto busy
                on request to brief goto busy
                on request to long goto busy
            }
            state busy {
                on feedback from long do steps := value.sequence[0]
                on response from zero goto idle
                on error from zero goto idle
                on cancel from zero goto idle
                on response from brief goto idle
                on error from brief goto idle
                on cancel from brief goto idle
                on response from long goto idle
                on error from long goto idle
                on cancel from long goto idle
            }
        }
    }
    limit walk to { linear: { x: -0.5..1.0 }, angular: { z: 0.0..0.25 } }
    limit walk to { linear: { x: 0.0..0.25 } } if Permission.denied
    limit turn to { angular: { z: 0.25..0.75 } }
    limit loud to 0.0..1.5
    limit loud to 2.0..3.0 if Counter.busy
    limit gear to -1..3
    limit near to { float64_value: 0.25..0.75 }
    limit far to { float64_value: 1.0..2.5 } if Power.idle
    limit brief to { order: 2..2 }
    limit long to { order: 4..6 } if Permission.granted
    requirement turn needs Permission.granted
    requirement up needs Permission.granted
    requirement far needs !Power.is_on
    requirement long needs Permission.granted
PROVIDES}
"""

_PROVIDES = """
    provide walk with { linear: { x: Permission.wanted } }
    provide turn with { angular: { z: Permission.wanted } }
    provide loud with Permission.wanted
    provide gear with Counter.steps
    provide up with { data: true }
    provide near with { float64_value: Permission.wanted }
    provide far with { float64_value: Permission.wanted }
    provide brief with { order: 1 }
    provide long with { order: Counter.steps }
"""

_ON_ROS1 = {
    "use BasicTypes from test_msgs": "use GetPlan from nav_msgs",
    "float64_value": "tolerance",
    "value.order": "value.goal",
    "{ order: ": "{ goal: ",
}

LIMITED = frozenset({"walk", "turn", "loud", "gear", "near", "far", "brief", "long"})
"""Requests that have a limit."""

REQUESTS = LIMITED | {"halt", "up", "down", "zero"}


def let_through(seen: Sequence[Observation]) -> set[str]:
    """The requests that a run has."""
    return {name for item in seen for kind, name, _ in item.issued if kind in ("publish", "call", "goal")}


def limited(seen: Sequence[Observation]) -> set[str]:
    """The requests with numbers that were moved in a run."""
    return {item["event"].removesuffix(".request") for step in seen for item in step.log if item["kind"] == "limited"}


@cache
def steward(deployment: Deployment, *, on_ros1: bool = False) -> Supervisor:
    """Synthesized and verified.

    Args:
        deployment: A layer has the requests' data from an existing controller, a controller is given it by the model.
        on_ros1: True if its service and its action are of types that ROS 1 has.
    """
    is_layer = deployment is Deployment.LAYER
    text = _MODEL.replace("PROVIDES", "" if is_layer else _PROVIDES)
    if on_ros1:
        text = of_ros1(text)
        for old, new in _ON_ROS1.items():
            assert old in text
            text = text.replace(old, new)
    made = make_supervisor(bundle_of(text), deployment=deployment)
    assert made.supervisor is not None, made.reason
    return made.supervisor
