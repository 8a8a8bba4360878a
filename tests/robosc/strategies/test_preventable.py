"""Assumptions that the robot can keep from coming true, and those that only the surroundings can."""

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
