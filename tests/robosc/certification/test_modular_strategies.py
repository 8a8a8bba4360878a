"""Strategies of robots in modules: made for the modules that the goals are about, and right in the whole robot."""

import pytest

from robosc.certification import OutcomeStatus, SynthesisOutcome, make_supervisor
from robosc.certification.supervisor_file import verify_supervisor_file
from robosc.supervisor import decode, encode
from robosc.verification import CheckOutcome, Limits
from support.models import bundle_of

COMPONENT = """
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
assume C{0}.busy leads to C{0}.out
"""


def robot(count: int, *more: str, assumed: range | None = None) -> str:
    """Components that go out and come back; what is assumed of some of them is a part of the goals."""
    texts = []
    for number in range(count):
        declared, _, assumption = COMPONENT.format(number).rpartition("assume ")
        texts.append(declared if assumed is not None and number not in assumed else f"{declared}assume {assumption}")
    return f"robot Crew {{ {''.join(texts)} {' '.join(more)} }}"


def made(text: str, *, is_modular: bool = True) -> SynthesisOutcome:
    return make_supervisor(bundle_of(text), is_modular=is_modular)


NEVER = [f"requirement never C{number}.out and C{number + 1}.out" for number in range(9)]


@pytest.mark.parametrize("goal", ["goal always eventually C0.out", "mission tour { visit C0.out then C0.idle }"])
def test_a_goal_of_one_module_is_reached_by_it(goal: str) -> None:
    text = robot(10, *NEVER, goal, assumed=range(1))
    found = made(text)
    assert found.supervisor is not None
    certificate = found.supervisor.certificate
    assert certificate.goals == "passed"
    assert certificate.method.endswith("goals position by position, with a strategy of module 1")
    whole = made(text, is_modular=False)
    assert whole.supervisor is not None
    assert {item.code for item in found.diagnostics} == {item.code for item in whole.diagnostics}
    again = decode(encode(found.supervisor))
    report = verify_supervisor_file(again, bundle_of(text), Limits.of(1_000_000))
    assert (report.faults, report.goals) == ((), CheckOutcome.PASSED)


DIRECT = """
component C{0} {{
  incoming message go{0} with identifier: "/go{0}", type: none
  incoming message back{0} with identifier: "/back{0}", type: none
  behaviour {{
    initial marked state idle {{ on request to go{0} goto out }}
    state out {{ on request to back{0} goto idle }}
  }}
}}
"""


def test_a_strategy_that_others_would_stop_is_made_for_the_whole() -> None:
    """Each needs the next one, of which the modules of the goal know only the first ones."""
    rules = " ".join(f"requirement go{number} needs C{number + 1}.out" for number in range(11))
    text = f"robot Chain {{ {''.join(map(DIRECT.format, range(12)))} {rules} goal always eventually C0.out }}"
    found = made(text)
    assert found.supervisor is not None
    assert len(found.supervisor.modules) > 1
    certificate = found.supervisor.certificate
    assert certificate.goals == "passed"
    assert certificate.method.endswith("goals position by position")


def test_goals_that_cannot_be_reached_are_explained_of_the_whole() -> None:
    text = robot(10, *NEVER, "goal always eventually C0.out", "requirement go0 needs C1.out and C1.idle")
    found, whole = made(text), made(text, is_modular=False)
    assert found.status is OutcomeStatus.MODEL_ERRORS
    assert (found.reason, found.diagnostics) == (whole.reason, whole.diagnostics)
    assert found.explanation == whole.explanation
