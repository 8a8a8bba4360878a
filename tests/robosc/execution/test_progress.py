"""Progress of a strategy, against a plain account of what happened, and on a robot whose door does not open."""

import math
from itertools import pairwise, product
from pathlib import Path
from typing import Any
from unittest.mock import Mock, patch

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robosc.event_logs import check_log, read_log
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import EventLog, MemoryLog, NullLog, json_line
from robosc.execution.runtime.progress import Progress, ProgressAccount
from robosc.execution.runtime.protocol import Aim, Description
from robosc.execution.runtime.recorder import Recorder
from robosc.execution.runtime.settings import Settings, SettingsError
from support.effort import examples
from support.execution import Bench, bench
from support.goal_porter import porter_supervisor

KINDS = ("reached", "approach", "owed", "met")
TIMEOUT_S = 3.0


class Scripted:
    """A system whose aims and assumptions are met as the test says."""

    description = Description(
        *("Scripted", "controller", "", (), (), (), 0, True),
        (Aim("a", "A"), Aim("b", "B")),
        (Aim("c", "C"), Aim("d", "D")),
    )
    mode = 0

    def __init__(self) -> None:
        self.met = (False, False, False, False)

    def situation(self) -> tuple[bool, ...]:
        return self.met

    def remembered(self) -> None:
        pass

    def recall(self, remembered: None) -> None:
        pass

    def observe(self) -> tuple[bool, ...]:
        return self.met

    def choose(self) -> int | None:
        return None


Moment = tuple[int, tuple[bool, bool, bool, bool]]


def told(history: list[Moment], now_s: int) -> tuple[list[tuple[bool, int, float | None]], tuple[str, ...]]:
    """Return each item's standing, and the assumptions that are not met for too long, from all that was seen."""
    standings: list[tuple[bool, int, float | None]] = []
    late = []
    for number, name in enumerate("abcd"):
        seen = [(time_s, met[number]) for time_s, met in history]
        count = sum(not before and after for (_, before), (_, after) in pairwise(seen))
        unmet_s = None
        if not seen[-1][1]:
            since = len(seen) - 1
            while since > 0 and not seen[since - 1][1]:
                since -= 1
            unmet_s = float(now_s - seen[since][0])
        standings.append((seen[-1][1], count, unmet_s))
        if number > 1 and unmet_s is not None and unmet_s >= TIMEOUT_S:
            late.append(name)
    return standings, tuple(late)


class Expected:
    """Reports of assumptions that are to be made, worked out of all that was seen.

    Attributes:
        history: All that was seen.
        due_s: Time of the next look.
        lines: Reports: what, of which assumption, and for how long it was owed.
    """

    def __init__(self) -> None:
        self.history: list[Moment] = []
        self.due_s = math.inf
        self.lines: list[tuple[str, str, float]] = []
        self._reported: set[str] = set()

    def _unmet_s(self, now_s: int) -> dict[str, float]:
        standings = told(self.history, now_s)[0] if self.history else []
        return {
            name: unmet_s for name, (_, _, unmet_s) in zip("cd", standings[2:], strict=False) if unmet_s is not None
        }

    def expire(self, now_s: int) -> None:
        unmet_s = self._unmet_s(now_s)
        for name in told(self.history, now_s)[1]:
            if name not in self._reported:
                self._reported.add(name)
                self.lines.append(("owed", name, unmet_s[name]))
        left = [TIMEOUT_S - owed_s for name, owed_s in unmet_s.items() if name not in self._reported]
        self.due_s = now_s + min(left, default=math.inf)

    def observe(self, now_s: int, met: tuple[bool, bool, bool, bool]) -> None:
        before = self._unmet_s(now_s)
        self.history.append((now_s, met))
        after = self._unmet_s(now_s)
        for name in sorted(self._reported - after.keys()):
            self._reported.remove(name)
            self.lines.append(("met", name, before[name]))
        if after.keys() - before.keys():
            self.due_s = min(self.due_s, now_s + TIMEOUT_S)


@settings(max_examples=examples(200))
@given(st.lists(st.tuples(st.integers(0, 4), st.tuples(*[st.booleans()] * 4)), min_size=1, max_size=12))
@example([(1, (number % 2 > 0, True, True, True)) for number in range(6)])
@example([(0, (True, True, False, True)), (1, (True, True, False, False)), (4, (True, True, True, True))])
def test_the_account_tells_what_happened(steps: list[Any]) -> None:
    """Two write a log and one does not; one alone is asked all the time."""
    system, clock, logs = Scripted(), ManualClock(), (MemoryLog(), MemoryLog(), NullLog())
    accounts = [_account(system, clock, log) for log in logs]
    asked = accounts[0][0]
    expected = Expected()
    now_s = 0
    for pause_s, met in steps:
        for _ in range(pause_s):
            now_s += 1
            clock.advance(1.0)
            if now_s >= expected.due_s:
                for account, _ in accounts:
                    account.expire(now_s)
                expected.expire(now_s)
            if expected.history:
                assert asked.at(now_s).overdue == told(expected.history, now_s)[1]
        system.met = met
        for account, recorder in accounts:
            recorder.began_s = float(now_s)
            account.observe()
        expected.observe(now_s, met)
        found = asked.at(now_s)
        assert [item[2:5] for item in (*found.aims, *found.assumptions)] == told(expected.history, now_s)[0]
        assert [account.due_s for account, _ in accounts] == [expected.due_s] * 3
    for log in logs[:2]:
        counts = [count for _, count, _ in told(expected.history, now_s)[0]]
        assert [sum(line.get("aim") == name for line in log.entries) for name in "ab"] == counts[:2]
        lines = [line for line in log.entries if "assumption" in line]
        assert [(line["kind"], line["assumption"], line["owed_s"]) for line in lines] == expected.lines
    assert [account.at(now_s) for account, _ in accounts] == [asked.at(now_s)] * 3


def test_a_look_from_before_the_last_stable_state_finds_nothing_unmet_yet() -> None:
    account, recorder = _account(Scripted(), ManualClock(), NullLog())
    recorder.began_s = 5.0
    account.observe()
    assert [item.unmet_s for item in account.at(4.0).aims] == [0.0, 0.0]


def _account(system: Scripted, clock: ManualClock, log: EventLog) -> tuple[ProgressAccount, Recorder]:
    recorder = Recorder(system, clock, log)  # type: ignore[arg-type]  # its state is not needed
    return ProgressAccount(system, recorder, (), TIMEOUT_S), recorder  # type: ignore[arg-type]


@settings(max_examples=examples(200))
@given(
    st.lists(
        st.tuples(st.sampled_from((False, False, False, True)), st.tuples(*[st.booleans()] * 4)),
        min_size=1,
        max_size=24,
    ),
    st.sampled_from((2, 4096)),
    st.sampled_from((2, 256)),
)
@example(
    # The same change, another one by which the same aim is not met any more, and the first one again.
    [
        (False, (aim, other, True, True))
        for aim, other in ((True, True), (False, True), (True, False), (False, False), (True, True), (False, True))
    ],
    4096,
    256,
)
def test_the_account_is_the_same_whoever_looked_at_it_before(steps: list[Any], changes: int, kept: int) -> None:
    """One is read and logged in each state, the other at the end alone, however many changes are remembered."""
    system, clock = Scripted(), ManualClock()
    runtime = "robosc.execution.runtime.progress"
    with patch(f"{runtime}.MAXIMUM_CHANGES", changes), patch(f"{runtime}._MAXIMUM_OPEN", kept):
        accounts = [_account(system, clock, log) for log in (MemoryLog(), NullLog())]
        for number, (is_restarted, met) in enumerate(steps):
            system.met = met
            for account, recorder in accounts:
                if is_restarted:
                    account.restart()
                recorder.began_s = float(number)
                account.observe()
            accounts[0][0].at(float(number))
        left, right = (account.at(100.0) for account, _ in accounts)
    assert left == right


def changes_kept(account: ProgressAccount) -> int:
    """Return the number of changes that an account keeps, of which others may lead to further ones."""
    queue = [account._memory, *account._memories.values()]
    found = set[int]()
    for memory in queue:
        for change in memory.known.values():
            if id(change) not in found:
                found.add(id(change))
                queue.append(change.after)
    return len(found)


def test_the_table_of_changes_grows_up_to_its_limit_and_no_further() -> None:
    system = Scripted()
    with patch("robosc.execution.runtime.progress.MAXIMUM_CHANGES", 8):
        account, _ = _account(system, ManualClock(), NullLog())
        seen = [(*item, True) for item in product((False, True), repeat=3)]
        for before, after in 2 * list(product(seen, repeat=2)):
            for system.met in (before, after):  # type: ignore[assignment]  # three of them
                account.observe()
        assert changes_kept(account) == 8


def porter(**settings: Any) -> Bench:
    return Bench(InterpretedSystem(porter_supervisor()), **settings)


def lines(bench: Bench) -> list[dict[str, Any]]:
    """Entries about the strategy, without their times."""
    return [
        {key: value for key, value in line.items() if key not in ("time", "what")}
        for line in bench.log.entries
        if line["kind"] in KINDS
    ]


def progress(bench: Bench) -> Progress:
    found = bench.executor.progress
    assert found is not None
    return found


def test_a_door_that_does_not_open_is_reported_once_and_again_when_it_opens() -> None:
    robot = porter(assumption_timeout_s=2.0)
    robot.tick()
    robot.receive("/call")
    robot.tick()
    found = progress(robot)
    assert (found.approached, found.chosen, found.is_followed) == ("goal 1", "open", True)
    assert found.assumptions[0][:4] == ("assumption 1", "Door.opening leads to Door.ajar", False, 0)
    robot.tick()
    assert progress(robot).chosen is None
    robot.tick(60)
    found = progress(robot)
    assert found.overdue == ("assumption 1",)
    assert found.assumptions[0].unmet_s == pytest.approx(6.1)
    assert found.aims[0].unmet_s == pytest.approx(6.2)
    robot.receive("/door/opened")
    robot.tick()
    assert progress(robot).overdue == ()
    assert progress(robot).aims[0][2:5] == (True, 1, None)
    assert lines(robot) == [
        {"kind": "approach", "aim": None},
        {"kind": "approach", "aim": "goal 1"},
        {"kind": "owed", "assumption": "assumption 1", "owed_s": pytest.approx(2.0, abs=0.11)},
        {"kind": "met", "assumption": "assumption 1", "owed_s": pytest.approx(6.1)},
        {"kind": "reached", "aim": "goal 1", "count": 1},
    ]


def test_an_assumption_is_reported_between_decisions_and_never_where_the_setting_is_0() -> None:
    for timeout_s, expected in ((2.0, ["owed"]), (0.0, [])):
        robot = porter(assumption_timeout_s=timeout_s)
        robot.receive("/call")
        robot.tick()
        robot.clock.advance(2.0)
        robot.executor.watch()
        robot.clock.advance(600.0)
        robot.executor.watch()
        assert [line["kind"] for line in lines(robot)][1:] == expected


def test_its_log_is_read_and_agrees_with_the_supervisor(tmp_path: Path) -> None:
    robot = porter(assumption_timeout_s=2.0)
    robot.receive("/call")
    robot.tick(40)
    robot.receive("/door/opened")
    robot.tick(2)
    log = tmp_path / "log.jsonl"
    log.write_text("".join(map(json_line, robot.log.entries)), encoding="utf-8")
    assert {line["kind"] for line in robot.log.entries} >= set(KINDS)
    found = check_log(read_log(log), porter_supervisor())
    assert (found.violations, found.notes) == ((), ())


def test_a_restart_begins_the_account_again() -> None:
    robot = porter(assumption_timeout_s=2.0)
    robot.receive("/call")
    robot.tick(40)
    robot.executor.stop("test")
    robot.executor.restart()
    found = progress(robot)
    assert (found.approached, found.chosen, found.overdue) == (None, None, ())
    assert [item.is_met for item in (*found.aims, *found.assumptions)] == [True] * 4
    assert [item.times for item in (*found.aims, *found.assumptions)] == [0] * 4


def test_under_another_policy_the_goals_are_told_and_nothing_is_approached() -> None:
    robot = porter(policy="fair")
    robot.receive("/call")
    robot.tick()
    found = progress(robot)
    assert (found.is_followed, found.approached, found.chosen) == (False, None, None)
    assert not found.aims[0].is_met


def test_a_strategy_is_asked_once_in_each_stable_state(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = porter()
    choose = Mock(side_effect=robot.system.choose)  # type: ignore[attr-defined]
    monkeypatch.setattr(robot.system, "choose", choose)
    robot.tick(3)
    assert choose.call_count == 1
    robot.receive("/call")
    assert robot.tick(3) == [("publish", "open", None)]
    assert choose.call_count == 3


def test_a_robot_without_goals_has_no_progress_and_no_timeout() -> None:
    text = """robot Plain {
        component Base { incoming message go with type: none behaviour { initial marked state here { } } }
    }"""
    assert bench(text).executor.progress is None
    with pytest.raises(SettingsError, match="setting 'assumption_timeout_s' means nothing here"):
        bench(text, assumption_timeout_s=5.0)
    assert bench(text, assumption_timeout_s=30.0).executor.settings == Settings(policy="fair", release_identifiers=())
