"""The demonstration's judge must itself be able to find fault."""

import pytest

from judge import judge_log, judge_motion, table
from scenario import REACTION_LIMIT_S, Happening

ALLOWED = {
    "LineDetector": "line_found",
    "LidarSensor": "safe",
    "EmergencyStop": "in_service",
    "Platform": "operational",
}
HAPPENINGS = (Happening(1.0, "obstacle", forbids_moving=True, ended_by="gone"), Happening(2.0, "gone"))


def entry(event: str, state: dict[str, str], *, controllable: bool = False, kind: str = "event") -> dict[str, object]:
    return {
        "time": 10.0,
        "kind": kind,
        "event": event,
        "controllable": controllable,
        "state": {name: {"state": value, "variables": {}} for name, value in state.items()},
    }


def record(rest_after_s: float, *, moves_before: bool = True, moves_after: bool = True) -> list[dict[str, object]]:
    samples = [(step / 100, 0.15 if moves_before else 0.0) for step in range(100)]
    samples += [(1.0 + step / 100, 0.1 if step / 100 <= rest_after_s else 0.0) for step in range(1, 100)]
    samples += [(2.0 + step / 100, 0.15 if moves_after else 0.0) for step in range(1, 100)]
    entries: list[dict[str, object]] = [
        {"time_s": 1.0, "happening": "obstacle"},
        {"time_s": 2.0, "happening": "gone"},
    ]
    return entries + [{"time_s": time_s, "speed_m_s": speed} for time_s, speed in samples]


def test_an_allowed_move_passes() -> None:
    log = [entry("scan.response", ALLOWED), entry("move.request", ALLOWED, controllable=True)]
    assert judge_log(log) == []


@pytest.mark.parametrize(
    ("component", "state"), [("LineDetector", "no_line"), ("LidarSensor", "unsafe"), ("EmergencyStop", "stopped")]
)
def test_a_forbidden_move_is_found_even_if_the_state_is_fine_afterwards(component: str, state: str) -> None:
    log = [
        entry("scan.response", {**ALLOWED, component: state}),
        entry("move.request", ALLOWED, controllable=True),
    ]
    assert judge_log(log) == [f"log line 2: move although {component} is {state}"]


def test_a_log_without_a_move_or_with_a_fault_is_refused() -> None:
    assert judge_log([entry("scan.response", ALLOWED)]) == ["the log has no move at all"]
    log = [entry("scan.response", ALLOWED), entry("move.request", ALLOWED, controllable=True)]
    assert len(judge_log([*log, entry("", ALLOWED, kind="fault")])) == 1


def test_a_robot_that_rests_in_time_passes_with_its_figure() -> None:
    faults, remarks = judge_motion(record(0.2), HAPPENINGS)
    assert faults == []
    assert remarks == ["obstacle: at rest after 200 ms"]


def test_a_robot_that_rests_late_is_found() -> None:
    faults, _ = judge_motion(record(REACTION_LIMIT_S + 0.02), HAPPENINGS)
    assert faults == ["obstacle: the robot still moved after 320 ms"]


def test_a_late_command_is_found_even_if_the_robot_rests() -> None:
    commands = [{"time_s": 0.9, "command_m_s": 0.15}, {"time_s": 1.1, "command_m_s": 0.15}]
    assert judge_motion([*record(0.1), *commands], HAPPENINGS)[0] == []
    late: dict[str, object] = {"time_s": 1.5, "command_m_s": 0.15}
    faults, _ = judge_motion([*record(0.1), late], HAPPENINGS)
    assert faults == ["obstacle: a command to drive came more than 0.3 s later"]


def test_a_robot_that_never_moved_proves_nothing() -> None:
    assert judge_motion(record(0.1, moves_before=False), HAPPENINGS)[0]
    assert judge_motion(record(0.1, moves_after=False), HAPPENINGS)[0] == ["gone: the robot did not move again"]
    assert judge_motion([], HAPPENINGS)[0] == ["obstacle: did not take place"]


def test_the_table_counts_equal_steps() -> None:
    move = entry("move.request", ALLOWED, controllable=True)
    unsafe = {**ALLOWED, "LidarSensor": "unsafe"}
    log = [entry("scan.response", ALLOWED), move, entry("scan.response", ALLOWED), move, entry("scan.response", unsafe)]
    lines = [line.split() for line in table(log).splitlines()[1:]]
    assert [line[1:4] for line in lines] == [
        ["scan.response", "uncontrollable", "2"],
        ["move.request", "controllable", "2"],
        ["scan.response", "uncontrollable", "1"],
    ]
    assert [line[4:] for line in lines] == [
        ["LineDetector.line_found,", "LidarSensor.safe,", "EmergencyStop.in_service"],
        [],
        ["LineDetector.line_found,", "LidarSensor.unsafe,", "EmergencyStop.in_service"],
    ]
