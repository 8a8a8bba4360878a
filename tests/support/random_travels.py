"""Random robots whose goals are often to be cancelled: they travel while sensors and an arm allow it.

What a goal's end does to the robot differs from robot to robot, and so does what keeps it from starting again.
"""

from random import Random

from robosc.automata import to_automata
from robosc.model.structure import Deployment
from robosc.supervisor import AddedCondition, DecisionDiagram, DecisionNode, Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of
from support.failing import made, model_files
from support.models import model_of


def random_travels(seed: int, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    """The supervisor of a random robot, the same for the same seed; sometimes it forbids the events of cancels."""
    dice = Random(seed)
    text = _text(dice)
    model = model_of(text)
    made("random_travels", seed, lambda: model_files(model))
    result = synthesize(to_automata(model, deployment))
    added = () if result.status is SynthesisStatus.EMPTY else result.added
    is_free = "Sensors.b1" in text and "t0.cancel" not in {item.event for item in added}
    if is_free and deployment is Deployment.CONTROLLER and dice.random() < 0.4:
        diagram = DecisionDiagram((DecisionNode("Sensors", "b1", (0, 1), (0, 1)),), 2)
        added = (*added, AddedCondition("t0.cancel", diagram))
    return supervisor_of(model, deployment, added)


def _text(dice: Random) -> str:
    count = dice.randint(1, 2)
    travels = "\n".join(_travel(dice, number) for number in range(count))
    needs = "\n".join(
        f"requirement t{number} needs {_condition(dice, number, count)}"
        for number in range(count)
        for _ in range(dice.randint(1, 2))
    )
    return f"""robot Travels {{
    interface fibonacci use Fibonacci from test_msgs
    interface switch use SetBool from std_srvs
    datatype object Order {{ order: integer }}
    datatype object Sequence {{ sequence: array(integer) }}
    datatype object Position {{ data: boolean }}
    component Sensors {{
        outgoing message m0 with identifier: "/m0", type: boolean
        outgoing message m1 with identifier: "/m1", type: boolean
        behaviour {{
            variable b0: boolean = true
            variable b1: boolean
            on response from m0 do b0 := value
            on response from m1 do b1 := value
            initial marked state watching {{ }}
        }}
    }}
    {travels}
    component Arm {{
        service reach with identifier: "/reach", request: Position, response: none links switch
        behaviour {{
            initial marked state folded {{ on request to reach goto moving }}
            state moving {{ on response from reach goto folded on error from reach goto folded }}
        }}
    }}
    {needs}
    requirement reach needs T0.idle
}}"""


def _travel(dice: Random, number: int) -> str:
    name = f"t{number}"
    ends = {kind: dice.choice(("idle", "idle", "resting")) for kind in ("response", "error", "cancel")}
    slow = _sensor(dice)
    slows = f"transition if {slow} goto slow" if dice.random() < 0.4 else ""
    reacts = "\n".join(
        f"on {kind} {'to' if kind == 'cancel' else 'from'} {name} goto {state}" for kind, state in ends.items()
    )
    feedback = f"on feedback from {name} do steps := if steps < 2 then steps + 1 else 0"
    return f"""component T{number} {{
        action {name} with identifier: "/{name}", request: Order, response: none, feedback: Sequence links fibonacci
        behaviour {{
            variable steps: integer(0..2)
            {feedback}
            initial marked state idle {{ on request to {name} goto driving }}
            state driving {{ {reacts} {slows} }}
            state slow {{ {reacts} transition if !{slow} goto driving }}
            marked state resting {{ transition if {_sensor(dice)} goto idle }}
        }}
    }}"""


def _sensor(dice: Random) -> str:
    return dice.choice(("Sensors.b0", "(!Sensors.b0)", "Sensors.b1", "(!Sensors.b1)"))


def _condition(dice: Random, number: int, count: int) -> str:
    parts = [_sensor(dice)]
    if dice.random() < 0.5:
        parts.append("Arm.folded")
    if count > 1 and dice.random() < 0.4:
        parts.append(f"T{1 - number}.{dice.choice(('idle', 'resting'))}")
    if dice.random() < 0.3:
        parts.append(f"(T{number}.steps < 2 or T{number}.idle)")
    return f" {dice.choice(('and', 'or'))} ".join(parts)
