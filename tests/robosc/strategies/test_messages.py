"""Messages that several components read: what they carry together, a strategy counts on."""

import pytest

from robosc.certification import make_supervisor, strategies
from robosc.certification.strategies import verify_strategy
from robosc.strategies import arena
from robosc.verification import CheckOutcome, Limits
from support.battery_readers import BATTERY_READERS
from support.models import bundle_of

PATROL = (
    """robot Patrol {
    interface battery use BatteryState from sensor_msgs
    datatype object Charge { percentage: double }
    datatype enum Level from Charge to { value.percentage < 0.2 -> low default -> good }
    datatype enum Reserve from Charge to { value.percentage < 0.3 -> small default -> large }
"""
    + BATTERY_READERS
    + """\
    component Base {
        incoming message dock with identifier: "/dock", type: none
        incoming message leave with identifier: "/leave", type: none
        behaviour {
            initial marked state away { on request to dock goto docked }
            marked state docked { on request to leave goto away }
        }
    }
    // No dock is taken from others without need.
    requirement dock needs Planner.reserve = small
    goal Battery.level = low leads to Base.docked or Battery.level = good
    goal always eventually Base.away or Battery.level = low
}"""
)


def codes() -> list[str]:
    made = make_supervisor(bundle_of(PATROL))
    return [item.code for item in made.diagnostics if item.code == "unreachable-goal"]


def test_a_low_battery_is_one_with_a_small_reserve() -> None:
    assert codes() == []


def test_too_many_cases_count_as_independent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arena, "MAXIMUM_CASES", 1)
    assert codes() == ["unreachable-goal"]


def test_a_fault_that_only_too_many_cases_show_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = make_supervisor(bundle_of(PATROL)).supervisor
    assert supervisor is not None and supervisor.strategy is not None
    limits = Limits(0, 0, 10**6)
    given = (supervisor.executable, supervisor.added, supervisor.strategy, limits)
    assert verify_strategy(*given).outcome is CheckOutcome.PASSED
    monkeypatch.setattr(strategies, "MAXIMUM_CASES", 1)
    found = verify_strategy(*given)
    assert (found.outcome, found.missed) == (CheckOutcome.NOT_CHECKED, None)
    assert found.method == ("goals not checked: more than 0 positions, and the data of a message has more than 1 cases")
