"""The whole pipeline in one call: outcomes, certificate, cancellation."""

from typing import Any

import pytest

from robosc.automata import System, to_automata
from robosc.certification import OutcomeStatus, Progress, make_supervisor
from robosc.conditions.summary import summary_json, summary_text
from robosc.errors import InternalError, SynthesisCancelled
from robosc.model.structure import Deployment
from robosc.supervisor import AddedCondition, Certificate, DecisionDiagram, encode
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisResult, synthesize
from robosc.verification import Limits, verify_explicitly
from support.models import EXAMPLE_DEPLOYMENTS, bundle_of, example_bundle

COUNTER = """robot Counter {
    component C {
        service count with request: none, response: none links i
        behaviour {
            variable n: integer(0..99)
            on response from count do n := n + 1
            initial marked state s { }
        }
    }
    interface i use S from p
    requirement count needs C.n >= 0
}"""


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_the_examples_get_a_certified_supervisor(name: str, deployment: Deployment) -> None:
    bundle = example_bundle(name)
    outcome = make_supervisor(bundle, deployment=deployment)
    assert outcome.status is OutcomeStatus.SUPERVISOR
    assert outcome.supervisor is not None
    certificate = outcome.supervisor.certificate
    assert (certificate.deployment, certificate.bundle_sha256) == (deployment, bundle.digest)
    checks = (certificate.safe, certificate.controllable, certificate.nonblocking, certificate.maximally_permissive)
    assert set(checks) == {"passed"}
    system = to_automata(outcome.supervisor.model, deployment)
    found = verify_explicitly(system, state_predicates(system, outcome.supervisor.added))
    assert (str(found.states), str(found.transitions)) == (certificate.states, certificate.transitions)
    assert summary_json(outcome.supervisor)["states"] == found.states
    assert f"{found.states} states, {found.transitions} transitions" in summary_text(outcome.supervisor)


def test_what_always_holds_counts_as_a_requirement() -> None:
    open_ended = COUNTER.rstrip().removesuffix("}")
    counts = []
    for more in ("", "requirement always C.n <= 90 }", "requirement count needs C.n < 9 requirement never C.n = 8 }"):
        outcome = make_supervisor(bundle_of(f"{open_ended} {more}" if more else COUNTER))
        assert outcome.supervisor is not None
        shown = summary_json(outcome.supervisor)
        (line,) = (line for line in summary_text(outcome.supervisor).splitlines() if "  requirements " in line)
        counts.append((shown["requirements"], shown["state_invariants"], line.split(maxsplit=1)[1]))
    assert counts == [(1, 0, "1"), (2, 1, "2, 1 of them state invariant"), (3, 1, "3, 1 of them state invariant")]


def test_the_same_bundle_gives_the_same_bytes() -> None:
    outcome = [
        make_supervisor(example_bundle("navigation/navigation"), engine=engine)
        for engine in ("cudd", "oxidd", "autoref")
    ]
    contents = {encode(item.supervisor) for item in outcome if item.supervisor}
    assert len(contents) == 1


def test_a_count_that_nobody_could_stop_is_stopped_in_time() -> None:
    """A response cannot be forbidden, so the request before it must be, at the last value."""
    outcome = make_supervisor(bundle_of(COUNTER))
    assert outcome.supervisor is not None
    assert summary_json(outcome.supervisor)["added"] == {
        "count.request": "C.n <= 98",
        "count.reset": "true",
    }


def test_what_is_too_large_to_search_is_not_called_checked() -> None:
    def certificate(limit: int) -> Certificate:
        outcome = make_supervisor(bundle_of(COUNTER), verify_limit=limit)
        assert outcome.supervisor is not None
        return outcome.supervisor.certificate

    whole, fewer, symbolic, none = certificate(2000), certificate(400), certificate(50), certificate(1)
    assert (whole.safe, whole.maximally_permissive) == ("passed", "passed")
    assert (fewer.safe, fewer.maximally_permissive) == ("passed", "not checked")
    assert "not recomputed: more than 100 states" in fewer.method
    assert fewer.transitions == whole.transitions
    assert (symbolic.safe, symbolic.maximally_permissive) == ("not checked", "not checked")
    assert (none.safe, none.maximally_permissive, none.transitions) == ("not checked", "not checked", None)
    assert none.method == "not checked: more than 1 states, and the symbolic search takes more than 25 nodes"
    assert {item.states for item in (fewer, symbolic, none)} == {whole.states}


def test_what_is_too_large_to_search_one_by_one_is_searched_symbolically(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Limits, "of", lambda states: Limits(10, 10, 10**6))
    contents = set()
    for engine in ("cudd", "oxidd", "autoref"):
        outcome = make_supervisor(bundle_of(COUNTER), engine=engine)
        assert outcome.supervisor is not None
        certificate = outcome.supervisor.certificate
        assert certificate.method == "symbolic search (more than 10 states); permissiveness not recomputed"
        assert certificate.safe == certificate.controllable == certificate.nonblocking == "passed"
        assert (certificate.maximally_permissive, certificate.transitions) == ("not checked", None)
        contents.add(encode(outcome.supervisor))
    assert len(contents) == 1


def test_a_model_with_errors_and_a_library_have_none() -> None:
    broken = make_supervisor(bundle_of("robot R { requirement x needs true }"))
    assert (broken.status, broken.supervisor) == (OutcomeStatus.MODEL_ERRORS, None)
    assert [item.code for item in broken.diagnostics] == ["unknown-name"]
    library = make_supervisor(bundle_of("library L { component C { incoming message m with type: none } }"))
    assert library.status is OutcomeStatus.MODEL_ERRORS
    assert "no robot" in library.reason


def test_a_wrong_synthesis_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The verifier stands between a fault of the synthesizer and a robot."""

    def wrong(system: System, **options: Any) -> SynthesisResult:
        result = synthesize(system, **options)
        spoilt = tuple(AddedCondition(item.event, DecisionDiagram((), 1)) for item in result.added)
        return SynthesisResult(result.status, spoilt, result.statistics)

    monkeypatch.setattr("robosc.certification.pipeline.synthesize_in_parts", wrong)
    with pytest.raises(InternalError, match="the verifier refuses the supervisor: not safe"):
        make_supervisor(bundle_of(COUNTER))


def test_progress_and_cancellation() -> None:
    reported: list[Progress] = []
    make_supervisor(bundle_of(COUNTER), on_progress=reported.append)
    assert list(dict.fromkeys(item.stage for item in reported)) == [
        "check",
        "synthesis",
        "verification",
        "controller",
    ]
    with pytest.raises(SynthesisCancelled):
        make_supervisor(bundle_of(COUNTER), should_stop=lambda: True)


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    ("inputs", "outcome"),
    [
        ("x := value.a, b := x > 7", "passed"),
        ("x := value.a, y := value.b", "passed"),
        ("b := value.a < value.b", "passed"),
        ("b := value.a * value.c < 7", "not checked"),
    ],
)
def test_wide_integers_are_synthesized_and_searched_honestly(inputs: str, outcome: str) -> None:
    text = (
        "robot R { interface i use T from p datatype object P { a: integer(0..10000) b: integer(0..10000)"
        " c: integer(0..500) } component S { outgoing message m with type: P links i behaviour {"
        " variable x: integer(0..10000)"
        " variable y: integer(0..10000) variable b: boolean"
        f" initial marked state s {{ on response from m do {inputs} }} }} }}"
        " component G { incoming message go with type: none }"
        " requirement go needs S.x < 5000 and S.y < 5 or S.b }"
    )
    found = make_supervisor(bundle_of(text))
    assert found.supervisor is not None
    certificate = found.supervisor.certificate
    assert (certificate.safe, certificate.maximally_permissive) == (outcome, "not checked")
    assert certificate.method.startswith("symbolic search" if outcome == "passed" else "not checked: more than ")
