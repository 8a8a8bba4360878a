"""Control nodes of behaviour trees become states and requirements that do the same."""

import re
from collections.abc import Callable
from random import Random

import pytest

from robosc.language import parse, syntax
from robosc.language.control_node_advice import why
from robosc.language.control_nodes import _NAMES, Declared, Family, Leaf, Node, NodeReader, family_of
from robosc.language.tokens import tokenize
from robosc.source import SourceFile
from support.mistakes import first_error, obeyed

FRAME = """robot R {
    interface trigger use Trigger from std_srvs
    datatype object Answer { success: boolean }
    datatype enum Light from boolean to { value -> green default -> red }
    component Sensor {
        outgoing message light with type: Light
        outgoing message button with type: none
        behaviour {
            variable a: boolean
            variable b: boolean
            variable shows: Light
            on response from light do shows := value
            initial marked state on_ { // in the state
            }
        }
    }
    component Base {
        incoming message go with type: none
        incoming message halt with type: none
        service dock with request: none, response: Answer links trigger
        service find with request: none, response: Answer links trigger
        // in the component
    }
    component Empty { behaviour { // in the behaviour
    } }
    // in the robot
}
"""


def written(line: str, place: str = "robot") -> str:
    """The frame with a line in it; of the empty behaviour only where the line stands there."""
    frame = FRAME if place == "behaviour" else FRAME.replace("behaviour { // in the behaviour\n    }", "")
    assert f"// in the {place}\n" in frame
    return frame.replace(f"// in the {place}\n", f"\n{line}\n")


def mended(text: str) -> str:
    """The text after obeying its first fix, which has to leave no error."""
    found = first_error(text)
    assert found is not None
    assert found.message.startswith("there is no '"), found
    after = obeyed(text, found)
    assert after is not None, found
    assert first_error(after) is None, (found.fix, first_error(after))
    return after


EVERY_NAME = [name for names in _NAMES.values() for name in names.split()]


BODIES = ("{ }", "{ go halt }", "Main {\n dock;\n find }", "(3) { Sensor.a dock }", "{ button undock }")


@pytest.mark.parametrize("name", EVERY_NAME)
def test_every_control_node_has_a_fix(name: str) -> None:
    for body in BODIES:
        mended(written(f"{name} {body}"))


@pytest.mark.parametrize("family", Family)
@pytest.mark.parametrize("place", ["component", "behaviour", "state"])
def test_every_family_has_its_fix_wherever_it_stands(family: Family, place: str) -> None:
    for body in BODIES:
        if (family, place, body) != (Family.STATE_MACHINE, "component", "{ }"):  # Another word for 'behaviour'.
            mended(written(f"{_NAMES[family].split()[0]} {body}", place))


def test_every_family_has_names_and_a_reason() -> None:
    assert {*_NAMES} == {*Family}
    assert len(EVERY_NAME) == len({*EVERY_NAME})
    assert all(why(family) for family in Family)


@pytest.mark.parametrize(
    ("word", "family"),
    [
        ("Sequence", Family.SEQUENCE),
        ("SEQUENCE_STAR", Family.SEQUENCE),
        ("ParallelNode", Family.PARALLEL),
        ("Switch4", Family.SWITCH),
        ("retry_until_successful", Family.RETRY),
        ("InverterDecorator", Family.INVERTER),
        ("sequel", None),
        ("component", None),
    ],
)
def test_names_in_any_spelling(word: str, family: Family | None) -> None:
    assert family_of(word) is family


def read(line: str) -> Node | None:
    text = written(line)
    tokens = tokenize(text)
    found = NodeReader(text, tokens, Declared(tokens)).read(tokens.texts.index(line.split()[0].split("(")[0]))
    return None if found is None else found[0]


GO, HALT = Leaf("go", is_requested=True), Leaf("halt", is_requested=True)
DOCK = Leaf("dock", is_requested=True, is_answered=True, can_fail=True)


@pytest.mark.parametrize(
    ("line", "node"),
    [
        ("Sequence { go halt }", Node(Family.SEQUENCE, (GO, HALT))),
        ("Sequence { go, halt; }", Node(Family.SEQUENCE, (GO, HALT))),
        ("Sequence go -> halt", Node(Family.SEQUENCE, (GO, HALT))),
        ("Sequence([go, Halt()])", Node(Family.SEQUENCE, (GO, HALT))),
        ('Sequence("patrol", go)', Node(Family.SEQUENCE, (GO,))),
        ("Sequence { request to go then action halt }", Node(Family.SEQUENCE, (GO, HALT))),
        ("Sequence { Base }", Node(Family.SEQUENCE, (GO,))),
        ("Retry num_attempts=3 { dock }", Node(Family.RETRY, (DOCK,), count=3)),
        ("Retry(3) { dock }", Node(Family.RETRY, (DOCK,), count=3)),
        ("Retry(dock, num=3)", Node(Family.RETRY, (DOCK,), count=3)),
        ("Timeout msec: 500 { Retry 2 { dock } }", Node(Family.TIMEOUT, (Node(Family.RETRY, (DOCK,), count=2),), 500)),
        ("Sequence Main { Inverter go }", Node(Family.SEQUENCE, (Node(Family.INVERTER, (GO,)),), name="Main")),
        ("Sequence { !Sensor.a }", Node(Family.SEQUENCE, (Leaf("!Sensor.a", is_condition=True),))),
        (
            "Sequence { Sensor.shows = green and (Sensor.a or Sensor.b) go }",
            Node(Family.SEQUENCE, (Leaf("Sensor.shows = green and (Sensor.a or Sensor.b)", is_condition=True), GO)),
        ),
        ("Sequence { component C { } }", None),
        ("Sequence { state s { } }", None),
        ("Sequence { go ( }", None),
        ("Sequence { " * 50, None),
        ("Sequence { " + "go " * 500 + "}", None),
        ("Sequence { Sensor.", None),
    ],
)
def test_what_is_read(line: str, node: Node | None) -> None:
    assert read(line) == node


def fix_of(line: str, place: str = "robot") -> str:
    found = first_error(written(line, place))
    assert found is not None
    return found.fix


@pytest.mark.parametrize(
    ("line", "fix"),
    [
        ("Parallel { go halt }", "Remove 'Parallel { go halt }'."),
        ("Fallback { go halt }", "Remove 'Fallback { go halt }'."),
        ("Retry(5) { dock }", "Remove 'Retry(5) { dock }'."),
        ("Sequence { Sensor.a go }", "Write 'requirement go needs Sensor.a' instead of 'Sequence { Sensor.a go }'."),
        ("Fallback { Sensor.a dock }", "Write 'requirement dock needs !Sensor.a' instead of"),
        ("Sequence { Inverter { Sensor.a } go }", "Write 'requirement go needs !Sensor.a' instead of"),
        ("Switch2 { go halt }", "Write 'requirement go needs Sensor.shows = green requirement halt needs !("),
        ("Sequence Patrol { go halt }", "Write 'component Patrol { behaviour {"),
        ("Sequence Base { go halt }", "Write 'component Order { behaviour {"),
        ("Sequence { go halt }", "Write 'component Order { behaviour { initial marked state step_1 { on request to go"),
        ("Sequence { undock go }", "Write 'component Order { incoming message undock with type: none behaviour {"),
        ("Parallel { Sequence { go halt } Sequence { find dock } }", "Write 'component Order { behaviour { initial"),
        ("Sequence { Parallel { go halt find dock } go }", "Remove it, and write a component in the robot"),
        (f"Sequence {{ {'go halt ' * 20} }}", "Remove it, and write a component in the robot"),
        (f"Sequence {{ {'x' * 250} {'y' * 250} {'z' * 250} {'w' * 250} }}", "Remove it, and write a component"),
    ],
)
def test_the_fix_of_a_control_node(line: str, fix: str) -> None:
    assert fix_of(line).startswith(fix)


def test_a_node_of_a_component_stays_in_it_as_its_behaviour() -> None:
    assert fix_of("Sequence { go halt }", "component").startswith("Write 'behaviour { initial marked state step_1 {")
    assert fix_of("Sequence { go halt }", "behaviour").startswith("Write 'initial marked state step_1 {")
    assert " in the robot instead of 'Sequence { go halt }'." in fix_of("Sequence { go halt }", "state")


def test_two_nodes_are_reported_at_once() -> None:
    text = written("Sequence { go halt }\nFallback { dock find }")
    codes = [item.message.split("'")[1] for item in parse(SourceFile("r.rscd", text)).diagnostics]
    assert codes == ["Sequence", "Fallback"]


def test_what_is_written_is_laid_out() -> None:
    after = mended(written("    Sequence {\n        go\n        halt // }\n    }"))
    assert "    component Order {\n        behaviour {\n            initial marked state step_1 {" in after
    assert "halt // }" not in after
    assert mended(written("Sequence(\n go,\n halt)")) == mended(written("Sequence { go halt }"))


@pytest.mark.parametrize(
    "use",
    [
        "requirement walk needs B.x",
        "requirement { stop, walk } needs B.x",
        "B.x disables { walk }",
        "provide walk with 1",
    ],
)
def test_names_of_imported_components_are_known_by_their_uses(use: str) -> None:
    diagnostics = parse(SourceFile("r.rscd", f"robot R {{ Sequence {{ walk halt }} {use} }}")).diagnostics
    assert "incoming message halt with type: none behaviour" in diagnostics[0].fix
    assert "message walk" not in diagnostics[0].fix


def test_without_any_names_there_is_nothing_to_write() -> None:
    found = first_error("robot R { Sequence { } component C { } }")
    assert found is not None
    assert found.fix == "Remove 'Sequence { }'."


# The slow twin: a tree that is ticked

REQUESTS = ("go", "halt", "dock", "find")
CONDITIONS = ("Sensor.a", "Sensor.b")
type Tree = tuple[str, tuple["Tree", ...]] | str
type _Run = Callable[[str], bool]

ONE = ("Inverter", "ForceSuccess", "ForceFailure", "Retry(2)", "Retry", "Repeat(2)", "Timeout", "SubTree")
MANY = ("Sequence", "Fallback", "RoundRobin")


def drawn(dice: Random, depth: int) -> Tree:
    """A tree by chance."""
    if depth == 0 or dice.random() < 0.25:
        return dice.choice((*REQUESTS, *CONDITIONS))
    kind = dice.random()
    if kind < 0.3:
        return dice.choice(ONE), (drawn(dice, depth - 1),)
    if kind < 0.4:
        return "IfThenElse", (dice.choice(CONDITIONS), drawn(dice, depth - 1), drawn(dice, depth - 1))
    if kind < 0.5:
        return "Recovery", (drawn(dice, depth - 1), drawn(dice, depth - 1))
    return dice.choice(MANY), tuple(drawn(dice, depth - 1) for _ in range(dice.randint(1, 3)))


def text_of(tree: Tree) -> str:
    return tree if isinstance(tree, str) else f"{tree[0]} {{ {' '.join(map(text_of, tree[1]))} }}"


def ticked(tree: Tree, run: _Run) -> bool:
    """Run a tree to its end as the books define it; `run` runs a leaf and returns if it succeeded."""
    if isinstance(tree, str):
        return run(tree)
    name, children = tree
    if name in ("Sequence", "Timeout", "SubTree"):
        return all(ticked(child, run) for child in children)
    if name == "Fallback":
        return any(ticked(child, run) for child in children)
    if name == "RoundRobin":
        for child in children:
            ticked(child, run)
        return True
    if name == "IfThenElse":
        return ticked(children[1 if ticked(children[0], run) else 2], run)
    if name == "Recovery":
        while not ticked(children[0], run):
            if not ticked(children[1], run):
                return False
        return True
    result = ticked(children[0], run)
    match name:
        case "Inverter":
            return not result
        case "ForceSuccess" | "ForceFailure":
            return name == "ForceSuccess"
        case "Retry(2)":
            return result or ticked(children[0], run)
        case "Repeat(2)":
            return result and ticked(children[0], run)
        case _:
            assert name == "Retry"
            while not result:
                result = ticked(children[0], run)
            return result


class Enough(Exception):
    """Enough leaves were run."""


def expected(tree: Tree, outcomes: Callable[[str], bool], count: int) -> list[tuple[str, bool]]:
    """The leaves that a tree runs, ticked again and again."""
    found: list[tuple[str, bool]] = []

    def run(leaf: str) -> bool:
        if len(found) == count:
            raise Enough
        found.append((leaf, outcomes(leaf)))
        return found[-1][1]

    try:
        while True:
            ticked(tree, run)
    except Enough:
        return found


def followed(text: str, outcomes: Callable[[str], bool], count: int) -> list[tuple[str, bool]]:
    """The leaves that the states of the component 'Order' run."""
    tree = parse(SourceFile("r.rscd", text)).tree
    assert tree is not None
    component = next(item for item in tree.items if isinstance(item, syntax.Component) and item.name.text == "Order")
    behaviour = next(item for item in component.items if isinstance(item, syntax.Behaviour))
    states = [item for item in behaviour.items if isinstance(item, syntax.State)]
    by_name = {state.name.text: state for state in states}
    state = next(each for each in states if each.is_initial)
    found: list[tuple[str, bool]] = []
    while len(found) < count:
        leaf, targets = leaf_of(text, state)
        if not leaf:
            break
        succeeded = outcomes(leaf)
        found.append((leaf, succeeded))
        target = targets.get(succeeded)
        state = state if target is None else by_name[target]
    return found


def leaf_of(text: str, state: syntax.State) -> tuple[str, dict[bool, str | None]]:
    """The one leaf of a state, and where it leads by its outcome."""
    targets: dict[bool, str | None] = {}
    names = set()
    for item in state.transitions:
        target = None if item.target is None else item.target.text
        if isinstance(item, syntax.TauTransition):
            line = text.split("\n")[item.location.line - 1]
            condition = re.search(r"transition if (!?)(Sensor\.\w)", line[item.location.column - 1 :])
            assert condition
            names.add(condition[2])
            targets[not condition[1]] = target
        else:
            names.add(item.communication.text)
            is_request = item.kind == "request"
            if not is_request or item.communication.text in ("go", "halt"):
                targets[item.kind != "error"] = target
    assert len(names) <= 1, state
    # A condition that leads nowhere else is not written.
    return next(iter(names), ""), targets


def outcomes_of(seed: int) -> Callable[[str], bool]:
    """Outcomes by chance, the same for a seed; a message never fails."""
    dice = Random(seed)
    return lambda leaf: dice.random() < 0.5 or leaf in ("go", "halt")


def test_random_trees_do_the_same_as_states() -> None:
    dice = Random(3)
    compared = 0
    for number in range(400):
        tree = drawn(dice, 4)
        line = text_of(tree)
        if isinstance(tree, str) or not fix_of(line).startswith("Write 'component Order"):
            continue
        after = mended(written(line))
        wanted = expected(tree, outcomes_of(number), 60)
        found = followed(after, outcomes_of(number), 60)
        assert found == wanted[: len(found)], line
        compared += 1
    assert compared > 100
