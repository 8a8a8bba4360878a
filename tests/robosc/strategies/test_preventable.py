"""Assumptions that the robot can keep from coming true, those that only the surroundings can, and those that cannot."""

import pytest

from robosc.certification import make_supervisor
from robosc.errors import Severity
from support.models import bundle_of

BATTERY = """robot Worker {
    component Battery {
        outgoing message low with identifier: "/low", type: none
        outgoing message full with identifier: "/full", type: none
        outgoing message broken with identifier: "/broken", type: none
        behaviour {
            initial marked state good { on response from low goto empty }
            state empty { on response from full goto good on response from broken goto dead }
            marked state dead { }
        }
    }
    component Dock {
        incoming message dock with identifier: "/dock", type: none
        incoming message undock with identifier: "/undock", type: none
        incoming message lock with identifier: "/lock", type: none
        behaviour {
            initial marked state away { on request to dock goto docked }
            marked state docked { on request to undock goto away on request to lock goto locked }
            marked state locked { }
        }
    }
    requirement dock needs Battery.empty
    requirement { undock, lock } needs false
    goal Battery.empty leads to Battery.good or Battery.dead
    assume Dock.docked and Battery.empty leads to Battery.good
}
"""


def errors(text: str) -> list[str]:
    found = make_supervisor(bundle_of(text)).diagnostics
    return [item.code for item in found if item.severity is Severity.ERROR]


def test_what_the_surroundings_alone_can_spoil_is_not_the_robot_s_doing() -> None:
    assert errors(BATTERY) == []


@pytest.mark.parametrize("request_", ["dock", "undock"])
def test_what_the_robot_can_take_back_is_prevented(request_: str) -> None:
    """The battery is charged only while the robot is docked, which the robot decides."""
    text = BATTERY.replace("on response from full goto good on", "transition if Dock.docked goto charging on")
    text = text.replace("marked state dead", "state charging { on response from full goto good }\n marked state dead")
    assert errors(text.replace("Dock.docked and Battery.empty leads", "Battery.charging leads")) == []
    free = text.replace("{ undock, lock }", "lock") if request_ == "undock" else text
    assert errors(free.replace("Dock.docked and Battery.empty leads", "Battery.empty leads")) == [
        "preventable-assumption"
    ]


def test_a_step_of_the_robot_after_which_nobody_can_help_is_prevented() -> None:
    # Locked in, it has no charger.
    text = BATTERY.replace("on response from full goto good on", "transition if Dock.docked goto charging on")
    text = text.replace(
        "marked state dead",
        "state charging { on response from full goto good transition if Dock.locked goto empty }\n marked state dead",
    )
    text = text.replace("Dock.docked and Battery.empty leads", "Battery.charging leads")
    assert errors(text) == []
    assert errors(text.replace("{ undock, lock }", "undock")) == ["preventable-assumption"]


def test_findings_say_if_the_goals_keep_assumptions_from_coming_true() -> None:
    free = BATTERY.replace("{ undock, lock } needs false", "undock needs true").rstrip().removesuffix("}")
    away, assume = "goal always eventually Dock.away", "assume allow always eventually"
    for condition, when in (("Dock.locked", "while the goals do"), ("Dock.locked and Dock.away", "whatever happens")):
        found = make_supervisor(bundle_of(f"{free}{away}\n{assume} {condition}\n}}")).diagnostics
        messages = [item.message for item in found if item.code == "impossible-assumption"]
        assert messages == [
            f"this assumption cannot come true again and again, {when}: every goal would be reached in name alone"
        ]


def found_with(*statements: str, text: str = BATTERY) -> list[tuple[str, int]]:
    """Return the codes of what is found about more statements, each with how many other places belong to it."""
    found = make_supervisor(bundle_of(text.rstrip().removesuffix("}") + "\n".join((*statements, "}")))).diagnostics
    return [
        (item.code, len(item.related))
        for item in found
        if item.location is not None and item.location.line >= text.count("\n")
    ]


@pytest.mark.parametrize("allow", ["", "allow "])
def test_what_cannot_come_true_excuses_no_goal(allow: str) -> None:
    """Without the finding, a robot that does nothing would have a strategy for each of these."""
    assume = f"assume {allow}always eventually"
    lost = "goal always eventually Dock.away and Dock.docked"
    assert found_with(lost, f"{assume} Battery.good and Battery.empty") == [("impossible-assumption", 0)]
    # Each can come true for ever, and not with the other.
    together = [("impossible-assumption", 1)]
    assert found_with(lost, f"{assume} Battery.dead", f"{assume} Battery.good") == together


def test_what_comes_true_without_the_goals_excuses_them_no_more() -> None:
    free = BATTERY.replace("{ undock, lock } needs false", "undock needs true")
    away, locked = "goal always eventually Dock.away", "assume allow always eventually Dock.locked"
    assert found_with(away, locked, text=free) == [("impossible-assumption", 0)]
    assert found_with(away, "assume allow Dock.locked leads to Dock.away", text=free) == [("unneeded-assumption", 0)]
    # A goal that cannot be reached at all is the one to blame.
    lost = "goal always eventually Dock.away and Dock.docked"
    assert found_with(lost, "assume allow always eventually Dock.docked") == [("unreachable-goal", 0)]


def test_a_goal_for_which_nothing_is_done_is_found() -> None:
    goals = ("goal Battery.good and Battery.empty leads to Dock.docked", "goal once Dock.away")
    assert found_with(*goals) == [("idle-goal", 0), ("idle-goal", 0)]
    assert found_with("goal always eventually Dock.away") == []
