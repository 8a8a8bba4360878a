"""Troubles told: cancels that must be possible and are forbidden, requests that never come because of what follows."""

import re

import pytest

from robosc.certification import OutcomeStatus, SynthesisOutcome, make_supervisor
from robosc.errors import Diagnostic, Severity
from robosc.model.structure import Deployment
from robosc.source import Location
from support.models import STOPPING, bundle_of


def found(outcome: SynthesisOutcome, code: str) -> Diagnostic:
    (item,) = (item for item in outcome.diagnostics if item.code == code)
    assert item.location is not None
    return item


def line_of(location: Location | None) -> str:
    """Return the line of the model that a place is in."""
    assert location is not None
    return STOPPING.splitlines()[location.line - 1].strip()


def obeyed(text: str, item: Diagnostic) -> str:
    """Return the text of a model after a fix is obeyed to the letter."""
    instead = re.match(r"Write '(goto \w+)' instead of '(goto \w+)' at '([^']+)' in state '(\w+)' of (\w+)", item.fix)
    if instead:
        new, old, event, state, component = instead.groups()
    else:
        added = re.match(r"Write '(on \w+ \w+ \w+) (goto \w+)' in state '(\w+)' of (\w+)", item.fix)
        assert added, item.fix
        event, new, state, component = added.groups()
        old = ""
    place = re.search(rf"state {state} {{", text[text.index(f"component {component} ") :])
    assert place
    begin = text.index(f"component {component} ") + place.end()
    end = text.index("}", begin)
    inside = text[begin:end]
    assert (f"{event} {old}" in inside) == bool(old)
    inside = inside.replace(f"{event} {old}", f"{event} {new}") if old else f" {event} {new}{inside}"
    return text[:begin] + inside + text[end:]


def test_a_cancel_that_must_be_possible_is_an_error_with_its_run_and_a_fix_that_works() -> None:
    outcome = make_supervisor(bundle_of(STOPPING))
    assert (outcome.status, outcome.supervisor) == (OutcomeStatus.MODEL_ERRORS, None)
    assert "forbid a cancel that must be possible" in outcome.reason
    item = found(outcome, "forbidden-cancel")
    assert item.severity is Severity.ERROR
    assert item.message == (
        "'travel' cannot be cancelled after travel.request, stop.response, though a requirement on it does not hold "
        "any more: after travel.cancel, Drive stays in braking: nothing leaves it"
    )
    assert line_of(item.location) == "on cancel to travel goto braking"
    assert [line_of(place.location) for place in item.related] == ["requirement travel needs !Stop.pressed"]
    assert {item.code for item in outcome.diagnostics} == {"forbidden-cancel", "unprompted-request"}
    mended = make_supervisor(bundle_of(obeyed(STOPPING, item)))
    assert mended.supervisor is not None
    assert mended.supervisor.certificate.controller is not None
    assert mended.supervisor.certificate.controller.cancels == "passed"
    assert not [item for item in mended.diagnostics if item.code in ("never-enabled", "forbidden-cancel")]


def test_no_option_overrides_it_but_it_may_be_looked_at() -> None:
    assert make_supervisor(bundle_of(STOPPING), allow_livelock=True).supervisor is None
    shown = make_supervisor(bundle_of(STOPPING), only_shown=True)
    assert shown.supervisor is not None
    assert found(shown, "forbidden-cancel").severity is Severity.WARNING
    # In a layer callers cancel, and no request is let through that they could cancel.
    layer = make_supervisor(bundle_of(STOPPING), deployment=Deployment.LAYER)
    assert "travel.cancel can follow, and Drive stays in braking" in found(layer, "never-enabled").message


def test_of_a_large_model_no_mend_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc.certification.troubles.MAXIMUM_NODES", 0)
    item = found(make_supervisor(bundle_of(STOPPING)), "forbidden-cancel")
    assert item.severity is Severity.ERROR
    assert item.message.endswith("though a requirement on it does not hold any more: synthesis forbids it")
    assert "run 'robosc explain-synthesis --event travel.cancel'" in item.fix


def test_a_driver_that_overlooks_the_end_is_told_what_to_write() -> None:
    text = STOPPING.replace("on cancel to travel goto braking", "")
    item = found(make_supervisor(bundle_of(text)), "forbidden-cancel")
    assert "after travel.cancel, Drive stays in driving: nothing leaves it" in item.message
    assert item.fix.startswith("Write 'on cancel to travel goto idle' in state 'driving' of Drive: ")
    assert make_supervisor(bundle_of(obeyed(text, item))).supervisor is not None


def test_what_must_always_hold_forbids_a_cancel() -> None:
    text = STOPPING.replace("goto braking\n", "goto idle\n").replace(
        "requirement travel", "requirement never Stop.pressed and Drive.idle requirement travel"
    )
    outcome = make_supervisor(bundle_of(text))
    # The stop may be pressed at any time.
    assert outcome.status is OutcomeStatus.EMPTY
    text = text.replace("Stop.pressed and Drive.idle", "Drive.braking").replace("cancel to travel goto idle", "%s")
    item = found(make_supervisor(bundle_of(text % "cancel to travel goto braking")), "forbidden-cancel")
    assert "after travel.cancel, 'requirement never Drive.braking' is broken" in item.message
    assert make_supervisor(bundle_of(obeyed(text % "cancel to travel goto braking", item))).supervisor is not None


def test_a_range_forbids_a_cancel() -> None:
    counting = STOPPING.replace("behaviour {\n", "behaviour {\n variable n: integer(0..1)\n").replace(
        "on cancel to travel goto braking", "on cancel to travel do n := n + 1 goto idle"
    )
    counting = counting.replace("requirement", "requirement travel needs Drive.n < 2 requirement")
    item = found(make_supervisor(bundle_of(counting)), "forbidden-cancel")
    assert "it would take Drive.n, which is 1, out of its range" in item.message
    assert "have a way back" in item.fix or "range" in item.fix


NAVIGATING = """robot Navigating {
    interface i use Fibonacci from p
    component Nav {
        action navigate with request: none, response: none, feedback: none links i
        behaviour {
            initial marked state idle { on request to navigate goto driving }
            state driving { on response from navigate goto idle }
        }
    }
}
"""


def test_a_request_that_can_never_come_is_told_what_must_be_added() -> None:
    outcome = make_supervisor(bundle_of(NAVIGATING))
    item = found(outcome, "never-enabled")
    assert item.message == (
        "'navigate' can never be requested: navigate.error can follow, and Nav stays in driving: nothing leaves it"
    )
    assert item.fix == "Write 'on error from navigate goto idle' in state 'driving' of Nav."
    mended = make_supervisor(bundle_of(obeyed(NAVIGATING, item)))
    assert not [item for item in mended.diagnostics if item.code == "never-enabled"]
    assert mended.supervisor is not None


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (
            "interface i use S from p component A { incoming message go with type: none"
            " service ask with request: none, response: none links i outgoing message tick with type: none behaviour {"
            " initial marked state a { on request to go goto b on request to ask }"
            " state b { on response from tick goto c on response from ask goto a }"
            " state c { on response from tick goto b } } }",
            "'go' can never be requested: A, then in b, never gets to a marked state again",
        ),
        (
            "component A { incoming message go with type: none incoming message back with type: none behaviour {"
            " initial marked state a { on request to go goto b } state b { on request to back goto a } } }"
            " requirement back needs A.a",
            "'go' can never be requested: back.request, on the only way back to a marked state, must not happen then: "
            "'requirement back needs A.a' forbids it: A is b",
        ),
        (
            "component A { incoming message go with type: none outgoing message tick with type: none behaviour {"
            " variable n: integer(0..1) initial marked state a { on request to go goto b }"
            " marked state b { on response from tick do n := n + 1 } } } requirement go needs A.n = 0",
            "'go' can never be requested: tick.response can follow, and tick.response can take A.n, which is 1, out of "
            "its range",
        ),
    ],
)
def test_the_first_line_says_what_would_follow(text: str, why: str) -> None:
    outcome = make_supervisor(bundle_of(f"robot R {{ {text} }}"))
    assert next(item.message for item in outcome.diagnostics if item.code == "never-enabled") == why
