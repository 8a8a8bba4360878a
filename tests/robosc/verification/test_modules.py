"""Tests of the check module by module, against the check of the whole."""

from collections import Counter
from random import Random

import pytest

from robosc.automata import Semantics, System
from robosc.automata.decision import Decision
from robosc.certification import SynthesisOutcome, prepare
from robosc.model.structure import Deployment
from robosc.modular.robots import synthesize_robot
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import CheckOutcome, verify_explicitly
from robosc.verification.modules import verify_modules
from support.effort import seeds
from support.models import bundle_of
from support.random_crews import random_crew

EXAMPLES = 60
PASSED = CheckOutcome.PASSED


def changed(added: dict[str, Decision], system: System, dice: Random) -> dict[str, Decision]:
    """The conditions, with one that is left out, or an event that never happens."""
    event = dice.choice([item.name for item in system.events if item.is_controllable])
    if event in added and dice.random() < 0.6:
        return {name: item for name, item in added.items() if name != event}
    never = state_predicates(system, [AddedCondition(event, DecisionDiagram((), 0))])
    return {**added, **never}


@pytest.mark.random
def test_what_is_shown_of_modules_holds_of_the_whole() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        dice = Random(seed)
        problem = prepare(random_crew(seed), Deployment.CONTROLLER)
        assert not isinstance(problem, SynthesisOutcome)
        system = problem.system.automata
        found = synthesize_robot(problem.model, problem.places, system, Deployment.CONTROLLER, module_bits=0.0)
        if found.result.status is SynthesisStatus.EMPTY:
            continue
        added = state_predicates(system, found.result.added)
        modules = [[item.name for item in part.system.automata] for part in found.parts]
        if seed % 3 == 0:
            # All that is shown of any modules must be true.
            names = [item.name for item in system.automata]
            modules = [dice.sample(names, dice.randint(1, len(names))) for _ in range(3)]
        is_changed = seed % 2 == 0
        if is_changed:
            added = changed(added, system, dice)
        shown = verify_modules(system, added, modules, limit=20_000)
        twin = verify_explicitly(system, added, limit=20_000, permissive_limit=20_000, semantics=Semantics(system))
        if twin.states is None:
            continue
        assert shown.safe is not PASSED or twin.safe is PASSED
        # It forbids no more than it must, if it allows only what a supervisor may at all.
        if twin.safe is PASSED and twin.nonblocking is PASSED:
            assert shown.maximally_permissive is not PASSED or twin.maximally_permissive is PASSED
        kind = "changed" if is_changed else "as made"
        met[f"{kind}, safe {shown.safe}"] += 1
        met[f"{kind}, permissive {shown.maximally_permissive}"] += 1
        met["chosen at random, passed"] += seed % 3 == 0 and shown.maximally_permissive is PASSED
    assert met["as made, safe passed"] > met["as made, safe not checked"], met
    assert met["as made, permissive passed"] > met["as made, permissive not checked"], met
    assert met["changed, permissive not checked"], met
    assert met["changed, safe not checked"], met


def ring(size: int) -> System:
    """Each goes while the next one is idle, and no two neighbours are ever out."""
    component = """
    component C{0} {{
      incoming message go{0} with identifier: "/go{0}", type: none
      incoming message back{0} with identifier: "/back{0}", type: none
      outgoing message done{0} with identifier: "/done{0}", type: none
      behaviour {{
        initial marked state idle {{ on request to go{0} goto busy }}
        state busy {{ on response from done{0} goto out }}
        state out {{ on request to back{0} goto idle }}
      }}
    }}
    """
    rules = "".join(f"requirement never C{n}.out and C{(n + 1) % size}.out\n" for n in range(size))
    text = f"robot Ring {{ {''.join(map(component.format, range(size)))} {rules} }}"
    problem = prepare(bundle_of(text), Deployment.CONTROLLER)
    assert not isinstance(problem, SynthesisOutcome)
    return problem.system.automata


def modules_of(size: int) -> list[set[str]]:
    one = [{f"C{n}", f"message go{n}", f"message back{n}", f"message done{n}"} for n in range(size)]
    return [one[n] | one[(n + 1) % size] for n in range(size)]


def made(system: System) -> dict[str, Decision]:
    return state_predicates(system, synthesize(system).added)


def test_a_ring_is_checked_in_modules() -> None:
    system = ring(4)
    added = made(system)
    shown = verify_modules(system, added, modules_of(4), limit=1_000)
    assert (shown.safe, shown.maximally_permissive) == (PASSED, PASSED)
    assert shown.method == "safe and maximally permissive by explicit search of 4 modules"


def test_too_much_is_not_checked() -> None:
    system = ring(4)
    shown = verify_modules(system, made(system), modules_of(4), limit=10)
    assert shown.method == "nothing by explicit search of 4 modules (more than 10 states, or very many steps)"
    assert shown.maximally_permissive is CheckOutcome.NOT_CHECKED


def test_an_invariant_of_no_module_is_not_checked() -> None:
    system = ring(4)
    shown = verify_modules(system, made(system), modules_of(4)[:3], limit=1_000)
    assert (shown.safe, shown.maximally_permissive) == (CheckOutcome.NOT_CHECKED,) * 2


def test_a_module_that_another_one_could_hold_up_shows_nothing() -> None:
    """The answer to a service comes only while it is waited for, which the component alone does not know."""
    text = """robot One {
      interface i use Thing from own_msgs
      component C {
        service ask with identifier: "/ask", request: none, response: none links i
        behaviour {
          initial marked state idle { on request to ask goto busy }
          state busy { on response from ask goto idle on error from ask goto idle }
        }
      }
    }"""
    problem = prepare(bundle_of(text), Deployment.CONTROLLER)
    assert not isinstance(problem, SynthesisOutcome)
    shown = verify_modules(problem.system.automata, {}, [["C"]], limit=1_000)
    assert shown.method == "nothing by explicit search of 1 module (some depend on automata that are not in them)"
    shown = verify_modules(problem.system.automata, {}, [["C", "service ask"]], limit=1_000)
    assert shown.method == "safe and maximally permissive by explicit search of 1 module"
