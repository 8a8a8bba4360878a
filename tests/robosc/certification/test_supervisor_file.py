"""Mutants of supervisors: whatever is not right is caught, whatever changes nothing passes."""

from functools import cache
from random import Random

import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robosc.automata import System, to_automata
from robosc.certification import make_supervisor
from robosc.certification.differences import MAXIMUM_DIFFERENCES, model_differences
from robosc.certification.supervisor_file import PROPERTIES, FileVerification, verify_supervisor_file
from robosc.errors import InvalidSupervisorError
from robosc.expressions import Binary, Constant
from robosc.model.check import check
from robosc.model.structure import Assumption, Deployment, Goal, GoalForm
from robosc.source import Bundle
from robosc.supervisor import Supervisor, decode, encode
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import CheckOutcome, Limits, synthesize_explicit, verify
from support.effort import examples
from support.models import EXAMPLE_DEPLOYMENTS, bundle_of, example_bundle
from support.mutants import (
    Mutant,
    added_mutants,
    change,
    false_certificates,
    is_right,
    model_mutants,
    with_added,
)
from support.random_models import random_bundle
from support.random_systems import disables_something, explicit_supervisor, systems

LIMITS = Limits.of(40_000)
SYMBOLIC = Limits(0, 0, 10**7)

# A count beyond 3 must be kept from happening, and so must an undoing from which there is no way back.
COUNTER = """robot Counter {
    component C {
        service count with request: none, response: none links i
        incoming message undo with type: none
        behaviour {
            variable n: integer(0..3)
            variable busy: boolean
            initial marked state s {
                on response from count do n := n + 1, busy := true
                on request to undo goto u
            }
            state u { transition if n > 1 goto s }
        }
    }
    interface i use S from p
    requirement count needs C.s and (C.busy or C.n < 9)
}"""

ACTION = """robot R {
    interface a use Move from p
    component C {
        action move with request: none, response: none, feedback: none links a
        behaviour {
            initial marked state s { on request to move goto t }
            state t {
                on response from move goto s
                on error from move goto s
                on cancel to move goto s
            }
        }
    }
    requirement move needs C.s
}"""


@cache
def made(bundle: Bundle, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor | None:
    return make_supervisor(bundle, deployment=deployment).supervisor


def _supervisor(bundle: Bundle, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    found = made(bundle, deployment)
    assert found is not None
    return found


def _passed(found: FileVerification) -> bool:
    return found.report is not None and not found.faults


def _failed_checks(found: FileVerification) -> set[str]:
    return {name for name, outcome in found.outcomes().items() if outcome is CheckOutcome.FAILED}


def _read_back(mutant: Mutant[Supervisor]) -> Supervisor | None:
    """Return the supervisor that comes out of a file; None if the file is refused at once."""
    try:
        return decode(encode(mutant.value))
    except InvalidSupervisorError:
        return None


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_the_examples_pass(name: str, deployment: Deployment) -> None:
    bundle = example_bundle(name)
    for limits in (LIMITS, SYMBOLIC):
        found = verify_supervisor_file(_supervisor(bundle, deployment), bundle, limits)
        assert _passed(found)
        assert found.notes == () if limits is LIMITS else "was not checked here" in found.notes[0]
        assert found.unchecked() == (() if limits is LIMITS else ("maximally_permissive",))


def _right_or_caught(bundle: Bundle, supervisor: Supervisor, most: int, seed: int) -> tuple[int, int]:
    """Check mutants of what is added against the slow verifier; returns how many are right and how many are not."""
    system = to_automata(supervisor.model, supervisor.deployment)
    right = explicit_supervisor(system)
    assert right is not None
    counts = [0, 0]
    mutants = list(added_mutants(supervisor.added, system, Random(seed)))
    if len(mutants) > most:
        mutants = Random(seed).sample(mutants, most)
    for mutant in mutants:
        handed = _read_back(Mutant(mutant.name, with_added(supervisor, mutant.value)))
        assert handed is not None, mutant.name
        expected = is_right(system, state_predicates(system, mutant.value), right)
        found = verify_supervisor_file(handed, bundle, LIMITS)
        assert _passed(found) == expected, (mutant.name, found.faults)
        assert expected or _failed_checks(found) & {*PROPERTIES}, mutant.name
        for fault in found.faults:
            assert fault.check == "certificate" or (fault.trace is not None and fault.state is not None)
        counts[expected] += 1
    return counts[1], counts[0]


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_every_mutant_of_what_the_examples_add_is_verified_rightly(name: str, deployment: Deployment) -> None:
    bundle = example_bundle(name)
    _, wrong = _right_or_caught(bundle, _supervisor(bundle, deployment), 15, 1)
    assert wrong >= 2


def test_every_mutant_of_a_counter_is_verified_rightly() -> None:
    bundle = bundle_of(COUNTER)
    right, wrong = _right_or_caught(bundle, _supervisor(bundle), 1000, 1)
    assert right >= 2
    assert wrong >= 20


@settings(max_examples=examples(10))
@given(st.integers(0, 10**6))
def test_mutants_of_random_models_are_verified_rightly(seed: int) -> None:
    bundle = random_bundle(seed)
    checked = check(bundle)
    assume(checked.model is not None)
    assert checked.model is not None
    system = to_automata(checked.model, Deployment.CONTROLLER)
    assume(synthesize_explicit(system, limit=2000) is not None)
    supervisor = made(bundle)
    assume(supervisor is not None)
    assert supervisor is not None
    _right_or_caught(bundle, supervisor, 6, seed)


def _verified_rightly(system: System, seed: int, most: int) -> None:
    result, right = synthesize(system), explicit_supervisor(system)
    assert right is not None
    assume(result.status is SynthesisStatus.SUPERVISOR and disables_something(system, right))
    mutants = list(added_mutants(result.added, system, Random(seed)))
    for mutant in Random(seed).sample(mutants, min(most, len(mutants))):
        added = state_predicates(system, mutant.value)
        expected = is_right(system, added, right)
        found = verify(system, added, LIMITS)
        assert (not found.verification.failures) == expected, mutant.name
        symbolic = verify(system, added, SYMBOLIC).verification
        serious = [item.property for item in found.verification.failures if item.property != "maximally permissive"]
        assert [item.property for item in symbolic.failures] == serious
        assert symbolic.states == found.verification.states


@settings(max_examples=examples(10))
@given(systems(), st.integers(0, 10**6))
def test_mutants_of_random_supervisors_are_verified_rightly(system: System, seed: int) -> None:
    _verified_rightly(system, seed, 4)


@pytest.mark.parametrize("name", ["navigation/navigation", "maze_solver/maze_solver"])
def test_every_mutant_of_the_model_inside_is_caught(name: str) -> None:
    bundle = example_bundle(name)
    supervisor = _supervisor(bundle)
    count = refused = 0
    for mutant in model_mutants(supervisor.model):
        handed = _read_back(Mutant(mutant.name, change(supervisor, model=mutant.value)))
        count += 1
        if handed is None:
            refused += 1
            continue
        found = verify_supervisor_file(handed, bundle, Limits.of(0))
        assert _failed_checks(found) == {"model"}, mutant.name
        assert found.report is None
        assert all(outcome is CheckOutcome.NOT_CHECKED for outcome in list(found.outcomes().values())[2:])
    assert count - refused >= 20


def test_a_number_of_another_kind_is_another_model() -> None:
    """Python holds 1, 1.0 and True for equal; a file does not."""
    model = _supervisor(bundle_of(COUNTER)).model
    as_double = change(
        model, requirements=(change(model.requirements[0], expression=Binary("<", Constant(1), Constant(2))),)
    )
    as_integer = change(
        model, requirements=(change(model.requirements[0], expression=Binary("<", Constant(1.0), Constant(2))),)
    )
    assert as_double == as_integer
    assert model_differences(as_double, as_integer) == (
        "requirement 1: expression: 1 < 2 in the supervisor, 1.0 < 2 in the model",
    )


def test_goals_and_assumptions_are_a_part_of_the_model() -> None:
    model = _supervisor(bundle_of(COUNTER)).model
    goal, other = Goal(GoalForm.ONCE, Constant(True)), Goal(GoalForm.LEADS_TO, Constant(True), Constant(False))
    assumed = Assumption(GoalForm.ALWAYS_EVENTUALLY, Constant(True))
    assert model_differences(change(model, goals=(goal,)), model) == ("goal 1: in the supervisor only",)
    assert model_differences(change(model, goals=(goal,)), change(model, goals=(other,))) == (
        "goal 1: form: 'once' in the supervisor, 'leads to' in the model",
        "goal 1: trigger: nothing in the supervisor, false in the model",
    )
    allowed = change(assumed, is_allowed=True)
    assert model_differences(change(model, assumptions=(assumed,)), change(model, assumptions=(allowed,))) == (
        "assumption 1: 'allow': no in the supervisor, yes in the model",
    )


def test_false_certificates_are_caught() -> None:
    bundle = bundle_of(COUNTER)
    supervisor = _supervisor(bundle)
    for mutant in false_certificates(supervisor.certificate):
        found = verify_supervisor_file(change(supervisor, certificate=mutant.value), bundle, LIMITS)
        if int(mutant.value.states) > LIMITS.states:
            assert found.report is not None
            assert found.report.method.startswith("symbolic search")
        assert _failed_checks(found) == {"certificate"}, mutant.name
    modest = change(supervisor.certificate, safe="not checked", transitions=None)
    assert _passed(verify_supervisor_file(change(supervisor, certificate=modest), bundle, LIMITS))


def test_a_false_claim_is_reported_as_false() -> None:
    bundle = bundle_of(COUNTER)
    found = verify_supervisor_file(change(_supervisor(bundle), added=()), bundle, LIMITS)
    assert _failed_checks(found) >= {"certificate", "safe"}
    texts = [fault.message for fault in found.faults if fault.check == "certificate"]
    assert "it says 'safe: passed', which is false" in texts
    fault = next(fault for fault in found.faults if fault.check == "safe")
    assert fault.trace is not None
    assert fault.trace[0] == "count.request"
    assert fault.state is not None
    assert fault.state.variables["C.n"] == 3
    assert fault.state.communications == {"count": "waiting"}
    assert fault.state.text().startswith("C = s, C.n = 3, C.busy = true")


def test_another_digest_is_reported_and_decides_nothing() -> None:
    bundle = bundle_of(COUNTER)
    supervisor = _supervisor(bundle)
    other = bundle_of(COUNTER + "// the same")
    found = verify_supervisor_file(supervisor, other, LIMITS)
    assert _passed(found)
    assert "digest is of other texts" in found.notes[0]
    forged = change(supervisor, certificate=change(supervisor.certificate, bundle_sha256="0" * 64, engine_version="9"))
    notes = verify_supervisor_file(forged, bundle, LIMITS).notes
    assert len(notes) == 2
    assert "made by RoboSC 9" in notes[1]


def test_a_supervisor_of_another_deployment_is_verified_as_what_it_says() -> None:
    bundle = bundle_of(ACTION)
    supervisor = _supervisor(bundle)
    assert _passed(verify_supervisor_file(supervisor, bundle, LIMITS, deployment=Deployment.CONTROLLER))
    wanted = verify_supervisor_file(supervisor, bundle, LIMITS, deployment=Deployment.LAYER)
    assert _failed_checks(wanted) == {"deployment"}
    certificate = change(supervisor.certificate, deployment=Deployment.LAYER)
    forged = change(supervisor, deployment=Deployment.LAYER, certificate=certificate)
    with pytest.raises(InvalidSupervisorError):
        decode(encode(change(supervisor, deployment=Deployment.LAYER)))
    expected = _supervisor(bundle, Deployment.LAYER)
    found = verify_supervisor_file(forged, bundle, LIMITS)
    assert found.report is not None
    assert _passed(found) == (found.report.verification.states == int(expected.certificate.states))
    without_actions = bundle_of(COUNTER)
    assert _passed(
        verify_supervisor_file(_supervisor(without_actions), without_actions, LIMITS, deployment=Deployment.LAYER)
    )


def test_texts_without_a_model_and_without_a_robot() -> None:
    supervisor = _supervisor(bundle_of(COUNTER))
    broken = verify_supervisor_file(supervisor, bundle_of("robot R { requirement x needs true }"), LIMITS)
    assert [item.code for item in broken.diagnostics] == ["unknown-name"]
    assert broken.report is None
    library = verify_supervisor_file(
        supervisor, bundle_of("library L { component C { incoming message m with type: none } }"), LIMITS
    )
    assert (library.report, library.faults) == (None, ())


def test_differences_end() -> None:
    model = _supervisor(bundle_of(COUNTER)).model
    rows = tuple(msgspec.structs.replace(model.requirements[0]) for _ in range(50))
    found = model_differences(change(model, requirements=rows), model)
    assert len(found) == MAXIMUM_DIFFERENCES + 1
    assert found[:1] == ("requirement 2: in the supervisor only",)
    assert found[-1] == "and more"
    assert model_differences(model, model) == ()


def test_one_that_is_to_be_a_layer_must_tell_messages_apart() -> None:
    """Without actions it may be made for either; as a controller it need not."""
    text = """robot R { component C {
        incoming message slow with identifier: "/go", type: integer
        incoming message fast with identifier: "/go", type: integer
    } provide slow with 1 provide fast with 2 }"""
    bundle = bundle_of(text)
    supervisor = _supervisor(bundle)
    assert _passed(verify_supervisor_file(supervisor, bundle, LIMITS, deployment=Deployment.CONTROLLER))
    refused = verify_supervisor_file(supervisor, bundle, LIMITS, deployment=Deployment.LAYER)
    assert [item.code for item in refused.diagnostics] == ["ambiguous-layer-topic"]
    assert not refused.has_passed
