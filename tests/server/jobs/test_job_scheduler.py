"""Tests of the choice of the next task: fair, bounded, and the same as an obvious twin."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from robosc_server.jobs.scheduler import Place, QueueLimits, Scheduler
from robosc_server.tasks.task import Failure, Reason, RefusedError, Report, Result, TaskLimits
from support.effort import examples
from support.job_workers import ScriptedWorkers, task_of


def run[T](test: Callable[[], Awaitable[T]]) -> T:
    async def whole() -> T:
        return await test()

    return asyncio.run(whole())


async def drop(report: Report) -> None:
    pass


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


async def test_a_task_is_done_and_its_place_is_free_again() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
    for _ in range(3):
        outcome = await scheduler.run(task_of("a"), "me", TaskLimits(), drop)
        assert isinstance(outcome, Result)
    assert (scheduler.waiting, scheduler.running) == (0, 0)


async def test_what_is_known_when_the_turn_comes_is_not_done() -> None:
    workers = ScriptedWorkers(1)
    scheduler = Scheduler(workers, QueueLimits())
    known = Result((b"known",))
    assert await scheduler.run(task_of("a"), "me", TaskLimits(), drop, lambda: known) is known
    assert workers.begun == []
    assert (scheduler.waiting, scheduler.running) == (0, 0)


async def test_who_has_no_task_running_need_not_wait_for_who_has_all_workers() -> None:
    scheduler = Scheduler(ScriptedWorkers(2), QueueLimits(waiting=3, reserved=1))
    greedy = [scheduler.enter("greedy") for _ in range(5)]
    assert [place.has_worker for place in greedy] == [True, True, False, False, False]
    # The line is full, too.
    first, second = scheduler.enter("modest"), None
    assert first.has_worker
    with pytest.raises(RefusedError):
        second = scheduler.enter("modest")
    assert (scheduler.running, second) == (3, None)
    # One of three has ended: as many go on as there are workers.
    scheduler.leave(greedy[0])
    assert not greedy[2].has_worker
    scheduler.leave(greedy[1])
    assert greedy[2].has_worker
    scheduler.leave(first)
    assert (greedy[3].has_worker, greedy[4].has_worker) == (True, False)


async def test_cancelling_frees_the_place_waiting_or_running(tmp_path: object) -> None:
    workers = ScriptedWorkers(1)
    scheduler = Scheduler(workers, QueueLimits())
    calls = [
        asyncio.create_task(scheduler.run(task_of(f"until {tmp_path}/never\n{number}"), "me", TaskLimits(), drop))
        for number in range(3)
    ]
    await asyncio.sleep(0)
    assert (scheduler.waiting, scheduler.running) == (2, 1)
    calls[1].cancel()
    await asyncio.gather(calls[1], return_exceptions=True)
    assert (scheduler.waiting, scheduler.running) == (1, 1)
    calls[0].cancel()
    await asyncio.gather(calls[0], return_exceptions=True)
    await asyncio.sleep(0)
    assert (scheduler.waiting, scheduler.running) == (0, 1)
    assert workers.begun[-1].endswith("2")
    calls[2].cancel()
    await asyncio.gather(calls[2], return_exceptions=True)
    assert (scheduler.waiting, scheduler.running) == (0, 0)


async def test_bounds_hold_and_say_when_to_come_back() -> None:
    clock = Clock()
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits(waiting=5, waiting_per_caller=3), clock)
    first = scheduler.enter("greedy")
    places = [scheduler.enter("greedy") for _ in range(3)]
    with pytest.raises(RefusedError) as refused:
        scheduler.enter("greedy")
    assert refused.value.reason is Reason.SERVER_BUSY
    assert refused.value.retry_after_s == pytest.approx(3.0)
    others = [scheduler.enter(f"other {number}") for number in range(2)]
    with pytest.raises(RefusedError) as refused:
        scheduler.enter("late")
    assert refused.value.reason is Reason.SERVER_BUSY
    # Jobs that were accepted before are not bounded.
    adopted = scheduler.enter_unbounded("greedy")
    clock.now_s = 4.0
    scheduler.leave(first)
    # Tasks take four seconds, then: five wait, one is done at a time.
    with pytest.raises(RefusedError) as refused:
        scheduler.enter("late")
    assert refused.value.retry_after_s == pytest.approx(20.0)
    for place in (*places, *others, adopted):
        scheduler.leave(place)
    assert (scheduler.waiting, scheduler.running) == (0, 0)


class Spent:
    """Accounts of callers who have used up their quotas."""

    def waiting(self, caller: str) -> int | None:
        return None

    def check(self, caller: str) -> None:
        raise RefusedError(Reason.QUOTA_EXCEEDED, "the quota is used up")

    def charge(self, caller: str, cpu_s: float) -> None:
        raise AssertionError("nothing was done")


async def test_a_quota_that_was_used_up_meanwhile_counts_when_the_turn_comes() -> None:
    workers = ScriptedWorkers(1)
    scheduler = Scheduler(workers, QueueLimits(), accounts=Spent())
    with pytest.raises(RefusedError, match="the quota is used up"):
        await scheduler.run(task_of("a"), "me", TaskLimits(), drop)
    assert (workers.begun, scheduler.waiting, scheduler.running) == ([], 0, 0)


async def test_callers_take_turns_however_many_tasks_they_have() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
    running = scheduler.enter("c")
    waiting = [scheduler.enter(name) for name in "aaaabb"]
    order = ""
    for _ in waiting:
        scheduler.leave(running)
        (running,) = (place for place in waiting if place.has_worker)
        order += running.caller
    assert order == "ababaa"


async def test_who_leaves_the_line_leaves_no_gap_in_it() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
    running, gone, last = (scheduler.enter(name) for name in "abc")
    scheduler.leave(gone)
    scheduler.leave(running)
    assert (last.has_worker, scheduler.waiting) == (True, 0)


async def test_all_addresses_of_one_network_stand_in_one_line() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits(100, 2))
    taken = scheduler.enter("2001:db8::1")
    waiting = [scheduler.enter(f"2001:db8::{number}") for number in (2, 3)]
    with pytest.raises(RefusedError, match="of this caller"):
        scheduler.enter("2001:db8::4")
    others = [scheduler.enter(name) for name in ("2001:db8:0:1::1", "192.0.2.1", "192.0.2.2", "robot")]
    # One after the other: a caller who has had a turn goes to the end.
    assert [scheduler.tasks_ahead(place) for place in (waiting[0], *others, waiting[1])] == list(range(6))
    for place in (taken, *waiting, *others):
        scheduler.leave(place)
    assert (scheduler.running, scheduler.waiting) == (0, 0)


async def test_more_workers_are_noticed_while_tasks_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc_server.jobs.scheduler._POLL_S", 0.01)
    workers = ScriptedWorkers(0)
    scheduler = Scheduler(workers, QueueLimits())
    with pytest.raises(RefusedError) as refused:
        await scheduler.run(task_of("a"), "me", TaskLimits(), drop)
    assert refused.value.reason is Reason.WORKERS_UNAVAILABLE
    place = scheduler.enter("me")
    assert not place.has_worker
    workers.capacity = 1
    async with asyncio.timeout(30):
        await place.wait_for_worker()
    assert place.has_worker


async def test_workers_that_are_away_are_reported_as_such() -> None:
    workers = ScriptedWorkers(1)
    workers.is_away = True
    scheduler = Scheduler(workers, QueueLimits())
    with pytest.raises(RefusedError) as refused:
        await scheduler.run(task_of("a"), "me", TaskLimits(), drop)
    assert refused.value.reason is Reason.WORKERS_UNAVAILABLE
    assert scheduler.running == 0


async def test_a_call_that_loses_its_worker_is_not_asked_to_come_again() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
    outcome = await scheduler.run(task_of("lose"), "me", TaskLimits(), drop)
    assert isinstance(outcome, Failure)
    assert outcome.reason is Reason.WORKER_DIED
    assert scheduler.running == 0


async def test_a_closed_line_takes_nothing_more() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
    scheduler.enter("me")
    waiting = scheduler.enter("me")
    scheduler.close()
    with pytest.raises(RefusedError) as refused:
        scheduler.enter("me")
    assert refused.value.reason is Reason.SHUTTING_DOWN
    assert scheduler.tasks_ahead(waiting) == 0


async def test_calls_that_the_end_of_the_server_cuts_off_learn_why_and_jobs_stay() -> None:
    scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
    job = scheduler.enter("me")
    calls = [asyncio.create_task(scheduler.run(task_of("a"), "me", TaskLimits(), drop)) for _ in range(3)]
    await asyncio.sleep(0)
    # A caller who goes away at that time is no concern of the end.
    calls[2].cancel()
    await asyncio.wait(calls[2:])
    assert calls[2].cancelled()
    scheduler.end_calls()
    for call in calls[:2]:
        with pytest.raises(RefusedError) as refused:
            await call
        assert refused.value.reason is Reason.SHUTTING_DOWN
        assert not call.cancelling()
    assert (scheduler.waiting, scheduler.running, job.has_worker) == (0, 1, True)


class Twin:
    """The line as a list: who is next is found by looking through it."""

    def __init__(self, capacity: int, limits: QueueLimits) -> None:
        self.capacity, self.limits = capacity, limits
        self.waiting: list[tuple[int, str]] = []
        self.running: dict[int, str] = {}
        self.turns: list[str] = []

    def enter(self, number: int, caller: str) -> bool:
        own = sum(1 for _, name in self.waiting if name == caller)
        is_full = own >= self.limits.waiting_per_caller or len(self.waiting) >= self.limits.waiting
        is_free = not self.waiting and len(self.running) < self.capacity
        if is_full and not is_free and not self.is_reserved(caller):
            return False
        if own == 0:
            self.turns.append(caller)
        self.waiting.append((number, caller))
        self.serve()
        return True

    def leave(self, number: int) -> None:
        if number in self.running:
            del self.running[number]
        for place, (waiting, caller) in enumerate(self.waiting):
            if waiting == number:
                del self.waiting[place]
                if all(name != caller for _, name in self.waiting):
                    self.turns.remove(caller)
                break
        self.serve()

    def serve(self) -> None:
        while self.waiting and len(self.running) < self.capacity:
            self.begin(self.turns[0])
        for caller in list(self.turns):
            if self.is_reserved(caller):
                self.begin(caller)

    def begin(self, caller: str) -> None:
        self.turns.remove(caller)
        place = next(place for place, (_, name) in enumerate(self.waiting) if name == caller)
        number, _ = self.waiting.pop(place)
        self.running[number] = caller
        if any(name == caller for _, name in self.waiting):
            self.turns.append(caller)

    def is_reserved(self, caller: str) -> bool:
        """Return True if a task may begin though no worker is free."""
        count, most = len(self.running), self.capacity + self.limits.reserved
        return self.capacity > 0 and self.capacity <= count < most and caller not in self.running.values()

    def before(self) -> dict[int, int]:
        """Served one after the other, as if each left at once."""
        copy = Twin(1, replace(self.limits, reserved=0))
        copy.waiting, copy.turns = list(self.waiting), list(self.turns)
        order: dict[int, int] = {}
        while copy.waiting:
            copy.serve()
            (number,) = copy.running
            order[number] = len(order)
            copy.running.clear()
        return order


_STEP = st.one_of(
    st.tuples(st.just("enter"), st.sampled_from("abcd")),
    st.tuples(st.just("leave"), st.integers(0, 60)),
    st.tuples(st.just("capacity"), st.integers(0, 4)),
)


@settings(max_examples=examples(200))
@given(
    st.lists(_STEP, min_size=20, max_size=60),
    st.integers(1, 3),
    st.integers(1, 8),
    st.integers(1, 4),
    st.integers(0, 2),
)
def test_whatever_happens_it_does_as_the_twin(
    steps: list[tuple[str, str | int]], capacity: int, waiting: int, per_caller: int, reserved: int
) -> None:
    async def test() -> None:
        limits = QueueLimits(waiting, per_caller, reserved)
        workers, twin = ScriptedWorkers(capacity), Twin(capacity, limits)
        scheduler = Scheduler(workers, limits)
        places: list[Place | None] = []
        for what, value in steps:
            if what == "enter":
                try:
                    places.append(scheduler.enter(str(value)))
                except RefusedError:
                    places.append(None)
                assert twin.enter(len(places) - 1, str(value)) == (places[-1] is not None)
            elif what == "leave" and places:
                number = int(value) % len(places)
                left = places[number]
                if left is not None:
                    scheduler.leave(left)
                    twin.leave(number)
            elif what == "capacity":
                workers.capacity = twin.capacity = int(value)
                scheduler._poll_capacity()
                twin.serve()
            assert scheduler.waiting == len(twin.waiting)
            assert scheduler.running == len(twin.running)
            assert {number for number, place in enumerate(places) if place and place.has_worker} == twin.running.keys()
            order = twin.before()
            for number, place in enumerate(places):
                if place is not None:
                    assert scheduler.tasks_ahead(place) == order.get(number, 0)

    run(test)
