"""Who is next: fair, bounded, and the same as an obvious twin."""

import asyncio
from collections.abc import Awaitable, Callable

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from robosc_server.failures import RefusedError
from robosc_server.jobs.scheduler import Place, QueueLimits, Scheduler
from robosc_server.tasks.task import Reason, Report, Result, TaskLimits
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


def test_a_task_is_done_and_its_place_is_free_again() -> None:
    async def test() -> None:
        scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
        begun: list[int] = []

        async def on_begin() -> None:
            begun.append(scheduler.running)

        for _ in range(3):
            outcome = await scheduler.run(task_of("a"), "me", TaskLimits(), drop, on_begin)
            assert isinstance(outcome, Result)
        assert begun == [1, 1, 1]
        assert (scheduler.waiting, scheduler.running) == (0, 0)

    run(test)


def test_cancelling_frees_the_place_waiting_or_running(tmp_path: object) -> None:
    async def test() -> None:
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

    run(test)


def test_bounds_hold_and_tell_when_to_come_back() -> None:
    async def test() -> None:
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
        # What was accepted before is not bounded.
        adopted = scheduler.enter_anyway("greedy")
        clock.now_s = 4.0
        scheduler.leave(first)
        # Tasks take four seconds, then: five wait, one is done at a time.
        with pytest.raises(RefusedError) as refused:
            scheduler.enter("late")
        assert refused.value.retry_after_s == pytest.approx(20.0)
        for place in (*places, *others, adopted):
            scheduler.leave(place)
        assert (scheduler.waiting, scheduler.running) == (0, 0)

    run(test)


def test_more_workers_are_noticed_while_tasks_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc_server.jobs.scheduler._LOOK_S", 0.01)

    async def test() -> None:
        workers = ScriptedWorkers(0)
        scheduler = Scheduler(workers, QueueLimits())
        with pytest.raises(RefusedError) as refused:
            await scheduler.run(task_of("a"), "me", TaskLimits(), drop)
        assert refused.value.reason is Reason.WORKERS_UNAVAILABLE
        place = scheduler.enter("me")
        assert not place.has_turn
        workers.capacity = 1
        async with asyncio.timeout(30):
            await place.turn()
        assert place.has_turn

    run(test)


def test_workers_that_are_away_are_told_as_such() -> None:
    async def test() -> None:
        workers = ScriptedWorkers(1)
        workers.is_away = True
        scheduler = Scheduler(workers, QueueLimits())
        with pytest.raises(RefusedError) as refused:
            await scheduler.run(task_of("a"), "me", TaskLimits(), drop)
        assert refused.value.reason is Reason.WORKERS_UNAVAILABLE
        assert scheduler.running == 0

    run(test)


def test_a_closed_line_takes_nothing_more() -> None:
    async def test() -> None:
        scheduler = Scheduler(ScriptedWorkers(1), QueueLimits())
        scheduler.enter("me")
        waiting = scheduler.enter("me")
        scheduler.close()
        with pytest.raises(RefusedError) as refused:
            scheduler.enter("me")
        assert refused.value.reason is Reason.SHUTTING_DOWN
        assert scheduler.before(waiting) == 0

    run(test)


class Twin:
    """The line as a list: who is next is found by looking through it."""

    def __init__(self, capacity: int, limits: QueueLimits) -> None:
        self.capacity, self.limits = capacity, limits
        self.waiting: list[tuple[int, str]] = []
        self.running: set[int] = set()
        self.turns: list[str] = []

    def enter(self, number: int, caller: str) -> bool:
        own = sum(1 for _, name in self.waiting if name == caller)
        is_full = own >= self.limits.waiting_per_caller or len(self.waiting) >= self.limits.waiting
        if (self.waiting or len(self.running) >= self.capacity) and is_full:
            return False
        if own == 0:
            self.turns.append(caller)
        self.waiting.append((number, caller))
        self.serve()
        return True

    def leave(self, number: int) -> None:
        if number in self.running:
            self.running.discard(number)
        for place, (waiting, caller) in enumerate(self.waiting):
            if waiting == number:
                del self.waiting[place]
                if all(name != caller for _, name in self.waiting):
                    self.turns.remove(caller)
                break
        self.serve()

    def serve(self) -> None:
        while self.waiting and len(self.running) < self.capacity:
            caller = self.turns.pop(0)
            place = next(place for place, (_, name) in enumerate(self.waiting) if name == caller)
            number, _ = self.waiting.pop(place)
            self.running.add(number)
            if any(name == caller for _, name in self.waiting):
                self.turns.append(caller)

    def before(self) -> dict[int, int]:
        """Served one after the other, as if each left at once."""
        copy = Twin(1, self.limits)
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


@settings(max_examples=100)
@given(st.lists(_STEP, max_size=60), st.integers(1, 3), st.integers(1, 8), st.integers(1, 4))
def test_whatever_happens_it_does_as_the_twin(
    steps: list[tuple[str, str | int]], capacity: int, waiting: int, per_caller: int
) -> None:
    async def test() -> None:
        limits = QueueLimits(waiting, per_caller)
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
                scheduler._look_again()
                twin.serve()
            assert scheduler.waiting == len(twin.waiting)
            assert scheduler.running == len(twin.running)
            assert {number for number, place in enumerate(places) if place and place.has_turn} == twin.running
            order = twin.before()
            for number, place in enumerate(places):
                if place is not None:
                    assert scheduler.before(place) == order.get(number, 0)

    run(test)
