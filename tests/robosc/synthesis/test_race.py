"""Races: fair turns, the caller's business on the caller's stack, and no stack that is left."""

import gc
import signal
import threading
from collections.abc import Callable, Iterator, Sequence

import pytest
from greenlet import getcurrent, greenlet
from hypothesis import given
from hypothesis import strategies as st

from robosc.errors import NodeLimitError, SynthesisCancelled
from robosc.synthesis import SynthesisProgress, race
from robosc.synthesis.monitor import BoundedMonitor, EffortSpentError, ProgressMonitor
from robosc.synthesis.race import Race, Runner


@pytest.fixture(autouse=True)
def short_turns(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Turns of ten nodes, and no way that is left in the midst of its work after a test."""
    monkeypatch.setattr(race, "HEAD_START", 30)
    monkeypatch.setattr(race, "SHARE", 10)
    yield
    left = [item for item in gc.get_objects() if isinstance(item, greenlet) and not item.dead]
    assert left in ([], [getcurrent()])


def silent() -> ProgressMonitor:
    return ProgressMonitor(lambda: False, lambda progress: None)


def runners_of(monitor: Race, costs: Sequence[Sequence[int]], met: list[int] | None = None) -> list[Runner[int]]:
    """Ways that spend some nodes each time, and are called by their number."""

    def work(number: int) -> int:
        for cost in costs[number]:
            monitor.check_stop()
            if met is not None:
                met.append(number)
            monitor.spend(cost)
        return number

    return [Runner(lambda number=number: work(number)) for number in range(len(costs))]  # type: ignore[misc]


def simulated(costs: Sequence[Sequence[int]], head_start: int, share: int) -> tuple[int, list[int]]:
    """The winner, and the nodes of each way, without a thread."""
    waiting = [iter(chunks) for chunks in costs]
    nodes, targets = [0] * len(costs), [head_start] + [0] * (len(costs) - 1)

    def ends(number: int) -> bool:
        for cost in waiting[number]:
            nodes[number] += cost
            if nodes[number] >= targets[number]:
                return False
        return True

    while not ends(0):
        while nodes[0] >= targets[0] and len(costs) > 1:
            targets[0] += share
            for number in range(1, len(costs)):
                targets[number] += share
                if nodes[number] < targets[number] and ends(number):
                    return number, nodes
    return 0, nodes


@given(
    st.lists(st.lists(st.integers(0, 25), max_size=30), min_size=1, max_size=4),
    st.integers(1, 60),
    st.integers(1, 30),
)
def test_turns_are_those_of_the_twin(costs: list[list[int]], head_start: int, share: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(race, "HEAD_START", head_start)
        patch.setattr(race, "SHARE", share)
        monitor = Race(silent())
        runners = runners_of(monitor, costs)
        winner = monitor.first_of(runners)
    nodes = [runner.nodes for runner in runners]
    assert (winner, nodes) == simulated(costs, head_start, share)
    assert [runner.has_won for runner in runners] == [number == winner for number in range(len(costs))]
    # No way is worked on for longer than the best one, but for its head start and what it does at once.
    at_once = share + 25
    assert sum(nodes) <= len(costs) * (min(map(sum, costs)) + at_once) + head_start


def test_a_race_that_ends_within_the_head_start_has_no_other_way() -> None:
    monitor, met = Race(silent()), list[int]()
    runners = runners_of(monitor, [[10, 10], [1]], met)
    assert monitor.first_of(runners) == 0
    assert set(met) == {0}
    assert not runners[1].has_begun


def test_all_that_is_the_callers_happens_on_its_stack() -> None:
    here = getcurrent()
    told: list[SynthesisProgress] = []
    stacks = set[greenlet]()

    def tell(progress: SynthesisProgress) -> None:
        assert getcurrent() is here
        told.append(progress)

    def should_stop() -> bool:
        assert getcurrent() is here
        return False

    monitor = Race(ProgressMonitor(should_stop, tell))
    running = [0]

    def work(steps: int) -> int:
        for step in range(steps):
            running[0] += 1
            assert running[0] == 1
            stacks.add(getcurrent())
            monitor.check_stop()
            monitor.tell(SynthesisProgress("test", step, steps))
            running[0] -= 1
            monitor.spend(4)
        return steps

    assert monitor.first_of([Runner(lambda: work(100)), Runner(lambda: work(20)), Runner(lambda: work(200))]) == 20
    assert len(stacks) == 3
    stacks.clear()
    assert [item.iteration for item in told if item.nodes == 20] == list(range(20))
    assert monitor.peak_nodes == 20


def endless(monitor: Race) -> Runner[int]:
    def work() -> int:
        while True:
            monitor.check_stop()
            monitor.spend(1)

    return Runner(work)


def failing(monitor: Race, error: BaseException) -> Runner[int]:
    def work() -> int:
        monitor.spend(25)
        raise error

    return Runner(work)


@pytest.mark.parametrize("error", [ZeroDivisionError("test"), KeyboardInterrupt(), MemoryError()])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_an_error_of_one_way_is_the_callers(error: BaseException, place: int) -> None:
    monitor = Race(silent())
    runners = [endless(monitor) for _ in range(3)]
    runners[place] = failing(monitor, error)
    with pytest.raises(type(error)) as caught:
        monitor.first_of(runners)
    assert caught.value is error


@pytest.mark.parametrize("error", [None, KeyboardInterrupt()])
@pytest.mark.parametrize("asked", [1, 20, 45, 100])
def test_the_caller_ends_a_race(error: BaseException | None, asked: int) -> None:
    times: list[None] = []

    def should_stop() -> bool:
        times.append(None)
        if len(times) >= asked and error is not None:
            raise error
        return len(times) >= asked

    monitor = Race(ProgressMonitor(should_stop, lambda progress: None))
    with pytest.raises(SynthesisCancelled if error is None else KeyboardInterrupt):
        monitor.first_of([endless(monitor) for _ in range(3)])
    assert len(times) == asked


def test_an_interrupt_while_another_way_runs() -> None:
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("interrupts reach the main thread alone")
    monitor = Race(silent())

    def work() -> int:
        monitor.spend(25)
        signal.raise_signal(signal.SIGINT)
        while True:
            monitor.check_stop()

    with pytest.raises(KeyboardInterrupt):
        monitor.first_of([endless(monitor), endless(monitor), Runner(work), endless(monitor)])


def test_a_limit_of_steps_around_a_race_ends_it() -> None:
    bounded = BoundedMonitor(silent(), 100)
    monitor = Race(bounded)
    with pytest.raises(EffortSpentError):
        monitor.first_of([endless(monitor) for _ in range(3)])
    assert bounded.result_of(lambda: Race(bounded).first_of([endless(monitor)])) is None


class Nodes:
    """Nodes that ways take, and may take together."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.taken: dict[str, int] = {}
        self.begun: list[str] = []
        self.monitor = Race(ProgressMonitor(lambda: False, lambda progress: None, self.check))

    def check(self) -> None:
        if sum(self.taken.values()) > self.limit:
            raise NodeLimitError("too many")

    def runner(self, name: str, count: int) -> Runner[str]:
        def work() -> str:
            self.begun.append(name)
            try:
                for _ in range(count):
                    self.taken[name] = self.taken.get(name, 0) + 1
                    self.monitor.check_stop()
                    self.monitor.spend(1)
            finally:
                self.taken[name] = 0
            return name

        return Runner(work)


def test_others_are_given_up_where_there_are_too_many_nodes() -> None:
    nodes = Nodes(95)
    runners = [nodes.runner("a", 90), nodes.runner("b", 60), nodes.runner("c", 200)]
    assert nodes.monitor.first_of(runners) == "a"
    assert nodes.begun == ["a", "b", "c"]
    assert [runner.is_given_up for runner in runners] == [False, True, True]
    # The work that is left counts as that of the first one.
    assert runners[0].nodes == 90


def test_others_begin_anew_where_the_first_takes_too_many_nodes_alone() -> None:
    nodes = Nodes(95)
    runners = [nodes.runner("a", 100), nodes.runner("b", 110), nodes.runner("c", 80)]
    assert nodes.monitor.first_of(runners) == "c"
    assert nodes.begun == ["a", "b", "c", "b", "c", "c"]
    assert [runner.is_given_up for runner in runners] == [True, True, False]


def test_where_all_take_too_many_nodes_there_is_no_result() -> None:
    nodes = Nodes(50)
    with pytest.raises(NodeLimitError, match="too many"):
        nodes.monitor.first_of([nodes.runner(name, 100) for name in "abc"])


def test_a_way_that_takes_too_many_nodes_by_itself_is_given_up_alone() -> None:
    monitor = Race(silent())
    runners = [*runners_of(monitor, [[10] * 20]), failing(monitor, NodeLimitError("one")), endless(monitor)]
    assert monitor.first_of(runners) == 0
    assert [runner.is_given_up for runner in runners] == [False, True, False]


def test_a_race_within_a_race() -> None:
    outer = Race(silent())

    def inner(costs: list[list[int]]) -> Callable[[], int]:
        def work() -> int:
            monitor = Race(outer)
            return 100 * len(costs) + monitor.first_of(runners_of(monitor, costs))

        return work

    runners = [Runner(inner([[5] * 100])), Runner(inner([[5] * 20, [5] * 9, [5] * 50]))]
    assert outer.first_of(runners) == 301
    # The work of the inner race's ways counts as that of the outer one's way.
    assert runners[1].nodes == 30 + 3 * 45 - 5 - 10


def test_a_race_that_is_over_passes_on() -> None:
    told: list[SynthesisProgress] = []
    asked: list[None] = []

    def should_stop() -> bool:
        asked.append(None)
        return len(asked) > 3

    monitor = Race(ProgressMonitor(should_stop, told.append))
    assert monitor.first_of([Runner(lambda: 7)]) == 7
    monitor.tell(SynthesisProgress("test", 1, 5))
    assert told == [SynthesisProgress("test", 1, 5)]
    with pytest.raises(SynthesisCancelled):
        for _ in range(4):
            monitor.check_stop()
