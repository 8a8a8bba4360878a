"""Tests of modular synthesis for robots: against the supervisor of the whole, and the answers about it."""

from collections import Counter

import pytest
from hypothesis import given

from robosc.automata import Semantics
from robosc.automata.controlled import ControlledGraph, controlled_graph
from robosc.certification import SynthesisOutcome, SynthesisProblem, prepare
from robosc.errors import UnsupportedModelError
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.modular.clusters import MAXIMUM_BITS
from robosc.modular.robots import RobotSynthesis, synthesize_robot
from robosc.source import Bundle
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisResult, SynthesisStatus, questions_about, synthesize
from support.effort import seeds
from support.models import EXAMPLES as EXAMPLE_ROBOTS
from support.models import bundle_of
from support.random_crews import random_crew
from support.random_models import models

EXAMPLES = 100
STATES = 20_000


def problem_of(bundle: Bundle, deployment: Deployment = Deployment.CONTROLLER) -> SynthesisProblem:
    found = prepare(bundle, deployment)
    assert not isinstance(found, SynthesisOutcome), found.diagnostics
    return found


def in_modules(
    problem: SynthesisProblem, deployment: Deployment = Deployment.CONTROLLER, *, bits: float = MAXIMUM_BITS
) -> tuple[RobotSynthesis, list[str]]:
    said: list[str] = []
    system = problem.system.automata
    made = synthesize_robot(
        problem.model, problem.places, system, deployment, module_bits=bits, on_progress=said.append
    )
    return made, said


def whole(problem: SynthesisProblem, deployment: Deployment = Deployment.CONTROLLER) -> SynthesisResult:
    system = problem.system.automata
    return synthesize(system, questions=questions_about(problem.model, system, deployment))


def graph_of(problem: SynthesisProblem, result: SynthesisResult) -> ControlledGraph | None:
    system = problem.system.automata
    return controlled_graph(Semantics(system), state_predicates(system, result.added), limit=STATES)


def check(problem: SynthesisProblem, made: RobotSynthesis, expected: SynthesisResult) -> bool:
    """Compare with the supervisor of the whole, state by state; returns True if there is one."""
    assert made.result.status is expected.status
    if expected.status is SynthesisStatus.EMPTY:
        assert len(made.parts) == 1
        return False
    graph, twin = graph_of(problem, made.result), graph_of(problem, expected)
    # One that is too large is too large for both.
    assert (graph is None) == (twin is None)
    if graph is not None and twin is not None:
        assert (graph.states, graph.steps) == (twin.states, twin.steps)
        assert made.modular.states in (None, len(graph.states))
    return True


def check_answers(problem: SynthesisProblem, made: RobotSynthesis, expected: SynthesisResult) -> bool:
    """Compare the answers: each is true of the robot; returns True if none is missing."""
    found, all_of = made.result.answers, expected.answers
    assert {item.event for item in found.never} <= {item.event for item in all_of.never}
    assert set(found.unreached) <= set(all_of.unreached)
    assert {item.event for item in found.unprompted} <= {item.event for item in all_of.unprompted}
    rivals = {(item.first, item.second) for item in found.together}
    assert rivals <= {(item.first, item.second) for item in all_of.together}
    # Either of two requirements may be named of which one could stand in for the other.
    assert len(found.unused) <= len(all_of.unused)
    if len(made.parts) == 1 and len(made.parts[0].system.events) == len(problem.system.automata.events):
        assert found == all_of
    return len(found.never) == len(all_of.never)


@pytest.mark.random
def test_modules_of_a_robot_allow_what_the_whole_does() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        problem = problem_of(random_crew(seed))
        made, said = in_modules(problem, bits=MAXIMUM_BITS if seed % 2 else 0.0)
        expected = whole(problem)
        if not check(problem, made, expected):
            met["empty"] += 1
            continue
        met["complete"] += check_answers(problem, made, expected)
        met["modules"] += len(made.parts) > 1
        met["shared"] += any(len(group) > 1 for group in made.modular.groups)
        met["merged"] += any("become one" in text for text in said)
    assert all(met[name] for name in ("empty", "complete", "modules", "shared", "merged")), met


@given(models())
def test_any_robot_can_be_taken_apart(bundle: Bundle) -> None:
    for deployment in Deployment:
        found = prepare(bundle, deployment) if _is_supported(bundle, deployment) else None
        if isinstance(found, SynthesisProblem):
            made, _ = in_modules(found, deployment, bits=0.0)
            check(found, made, whole(found, deployment))


def _is_supported(bundle: Bundle, deployment: Deployment) -> bool:
    try:
        prepare(bundle, deployment)
    except UnsupportedModelError:
        return False
    return True


@pytest.mark.parametrize(
    "name", sorted(str(path.relative_to(EXAMPLE_ROBOTS)) for path in EXAMPLE_ROBOTS.rglob("*.rscd"))
)
@pytest.mark.parametrize("deployment", Deployment)
def test_the_examples_can_be_taken_apart(name: str, deployment: Deployment) -> None:
    found = prepare(load_bundle(EXAMPLE_ROBOTS / name), deployment)
    # A library is no robot, and some are for one deployment alone.
    if isinstance(found, SynthesisProblem):
        made, _ = in_modules(found, deployment, bits=0.0)
        expected = whole(found, deployment)
        assert check(found, made, expected)
        check_answers(found, made, expected)


COMPONENT = """
component C{0} {{
  incoming message go{0} with identifier: "{1}", type: none
  incoming message back{0} with identifier: "/back{0}", type: none
  outgoing message done{0} with identifier: "/done{0}", type: none
  behaviour {{
    initial marked state idle {{ on request to go{0} goto busy }}
    state busy {{ on response from done{0} goto out }}
    state out {{ on request to back{0} goto idle }}
  }}
}}
"""


def crew(count: int, *requirements: str, identifier: str = "/go{0}") -> SynthesisProblem:
    components = "".join(COMPONENT.format(number, identifier.format(number)) for number in range(count))
    return problem_of(bundle_of(f"robot Crew {{ {components} {' '.join(requirements)} }}"))


def test_modules_have_the_words_of_the_robot() -> None:
    problem = crew(4, "requirement never C0.out and C1.out", "requirement {go1, go3} needs C2.idle")
    made, _ = in_modules(problem, bits=0.0)
    assert check(problem, made, whole(problem))
    assert [(part.components, part.requirements, part.invariants) for part in made.parts] == [
        (("C0", "C1"), (), (0,)),
        (("C1", "C2"), (0,), ()),
        (("C2", "C3"), (0,), ()),
    ]
    assert [item.communications for part in made.parts for item in part.model.requirements] == [("go1",), ("go3",)]
    assert made.parts[2].places.requirements == problem.places.requirements
    assert made.modular.groups == ((0, 1, 2),)


def test_modules_that_would_block_each_other_become_one() -> None:
    """Each waits for the next one with its way back: where two neighbours are out, nothing moves."""
    rules = [f"requirement back{number} needs C{(number + 1) % 3}.idle" for number in range(3)]
    problem = crew(3, *rules)
    made, said = in_modules(problem, bits=0.0)
    assert any("become one" in text for text in said)
    assert check(problem, made, whole(problem))
    assert made.result.added


def test_a_requirement_in_two_modules_is_unused_if_both_say_so() -> None:
    """One module alone knows what C2 never does: in the other one the same requirement restricts."""
    for restricted, expected in (("go1", (0,)), ("{go1, go3}", ())):
        problem = crew(4, f"requirement {restricted} needs !C2.out", "requirement never C2.out")
        made, _ = in_modules(problem, bits=0.0)
        assert whole(problem).answers.unused == (0,)
        assert made.result.answers.unused == expected
        check_answers(problem, made, whole(problem))


def test_rivals_are_told_of_if_the_robot_can_get_there() -> None:
    """Both can go in the module of the first two; the third one never lets the second one."""
    both = "requirement go1 needs C0.idle or C0.busy or C0.out"
    problem = crew(3, both, identifier="/go")
    made, _ = in_modules(problem, bits=0.0)
    pairs = {(item.first, item.second) for item in made.result.answers.together}
    assert ("go0.request", "go1.request") in pairs
    problem = crew(3, both, "requirement go1 needs C2.out", "requirement go2 needs C1.out", identifier="/go")
    made, _ = in_modules(problem, bits=0.0)
    assert check(problem, made, whole(problem))
    assert len(made.parts) > 1
    assert made.result.answers.together == ()


def test_rivals_of_different_modules_are_told_of() -> None:
    problem = crew(4, "requirement go0 needs C1.out", "requirement go2 needs C3.out", identifier="/go")
    made, _ = in_modules(problem, bits=0.0)
    assert len(made.parts) == 2
    expected = whole(problem).answers.together
    assert {(item.first, item.second) for item in made.result.answers.together} == {
        (item.first, item.second) for item in expected
    }
    runs = {(item.first, item.second): item.trace for item in made.result.answers.together}
    assert runs["go0.request", "go2.request"] == ("go1.request", "done1.response", "go3.request", "done3.response")


HEARING = """
component C{0} {{
  incoming message go{0} with identifier: "/go{0}", type: none
  incoming message back{0} with identifier: "/back{0}", type: none
  behaviour {{
    initial marked state idle {{ on request to go{0} goto out }}
    state out {{ on request to back{0} goto idle on response from {1} goto idle }}
  }}
}}
"""
STOP = 'component Stop { outgoing message stop with identifier: "/stop", type: none }'
ASKING = """
interface i use Thing from own_msgs
component Ask {
  service ask with identifier: "/ask", request: none, response: none links i
  behaviour {
    initial marked state quiet { on request to ask goto asking }
    state asking { on response from ask goto quiet on error from ask goto quiet }
  }
}
"""


@pytest.mark.parametrize(("heard", "speaker"), [("stop", STOP), ("ask", ASKING)])
def test_those_that_hear_the_same_are_parts_of_their_own(heard: str, speaker: str) -> None:
    """A message binds nobody together; of a service each module has its plant, which says when it answers."""
    count = 6
    components = "".join(HEARING.format(number, heard) for number in range(count))
    rules = "".join(f"requirement go{number} needs C{(number + 1) % count}.idle\n" for number in range(count))
    problem = problem_of(bundle_of(f"robot Crew {{ {speaker} {components} {rules} }}"))
    made, _ = in_modules(problem, bits=0.0)
    assert len(made.parts) >= count
    plant = "message stop" if heard == "stop" else "service ask"
    assert all(plant in {item.name for item in part.system.automata} for part in made.parts)
    assert check(problem, made, whole(problem))


def test_those_that_read_the_same_data_are_one_part() -> None:
    reading = HEARING.replace("initial marked", "variable n: integer(0..1) = 0 initial marked")
    reading = reading.replace("response from {1} goto", "response from {1} do n := if value then 1 else 0 goto")
    speaker = STOP.replace("none", "boolean")
    rules = "requirement never C0.out and C1.out requirement never C0.n = 1 and C1.n = 0 and C0.out"
    components = "".join(reading.format(number, "stop") for number in range(3))
    problem = problem_of(bundle_of(f"robot Crew {{ {speaker} {components} {rules} }}"))
    made, _ = in_modules(problem, bits=0.0)
    assert [part.components for part in made.parts] == [("Stop", "C0", "C1", "C2")]
    assert check(problem, made, whole(problem))
