"""Random controllers against the reference executor, which is led through everything that its world can do."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest

from robosc.automata import ExecutableSystem, Semantics
from robosc.controller_properties import Properties, check_controller
from robosc.controller_properties.confluence import ConfluenceSearch
from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.search import search
from robosc.controller_properties.silent_steps import always_end, never_conflict, never_forbids, stays_nonblocking
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import MissingData
from robosc.model.structure import CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc.verification import verify_explicitly
from support.controller_twin import ASKED, twin_of
from support.random_controllers import ONE_FIELD, random_controller, random_robot
from support.random_supervisors import random_supervisor
from support.random_travels import random_travels

LIMIT = 2_000
TWIN_LIMIT = 16
TRAVEL_LIMIT = 60
DATA = (None, False, True, {"n": 1, "m": 1}, {"n": 1, "m": 6}, {"n": 6, "m": 1}, {"n": 6, "m": 6})


def checked(supervisor: Supervisor) -> Properties:
    return check_controller(
        ExecutableSystem(supervisor.model, supervisor.deployment), supervisor.added, is_nonblocking=True
    )


def actions_of(supervisor: Supervisor) -> list[str]:
    return [item.name for item in supervisor.model.communications if item.kind is CommunicationKind.ACTION]


def failures(found: Properties) -> tuple[bool, bool, bool]:
    outcomes = (found.finite_response, found.confluence, found.nonblocking)
    assert "not checked" not in outcomes
    assert [item is not None for item in (found.livelock, found.conflict, found.blocking)] == [
        item == "failed" for item in outcomes
    ]
    return outcomes[0] == "failed", outcomes[1] == "failed", outcomes[2] == "failed"


def test_the_executor_shows_what_the_automaton_has(record_property: Callable[[str, object], None]) -> None:
    shares: Counter[str] = Counter()
    for seed in range(70):
        supervisor = random_controller(seed)
        twin = None if supervisor is None else twin_of(supervisor, TWIN_LIMIT)
        if supervisor is None or twin is None:
            shares["no supervisor" if supervisor is None else "too large"] += 1
            continue
        controller = Controller(ExecutableSystem(supervisor.model, Deployment.CONTROLLER), supervisor.added)
        found = search(controller, limit=LIMIT, confluence=ConfluenceSearch(controller, LIMIT))
        assert found.is_complete
        assert found.states == len(twin.states), seed
        shown = (twin.has_livelock, twin.has_conflict, twin.is_blocking)
        assert (found.livelock is not None, found.conflict is not None, found.blocking is not None) == shown, seed
        properties = checked(supervisor)
        assert failures(properties) == shown, seed
        for name, has_failed in zip(("livelock", "conflict", "blocking"), shown, strict=True):
            shares[name] += has_failed
        assert {item.action for item in found.forbidden.values()} == twin.forbidden, seed
        shares["forbidden cancels"] += bool(twin.forbidden)
        shares["cancels"] += any(supervisor.model.requirements_on(name) for name in actions_of(supervisor))
        shares["compared"] += 1
        shares["without a search"] += "structure" in properties.method
    for name, count in sorted(shares.items()):
        record_property(name, count)
    assert shares["compared"] > 20
    assert min(shares["livelock"], shares["conflict"], shares["blocking"]) >= 2


def test_goals_are_cancelled_as_the_executor_does(record_property: Callable[[str, object], None]) -> None:
    """Check robots whose requirements often turn, and supervisors that forbid cancels, some of them for no reason."""
    met: Counter[str] = Counter()
    for seed in range(30):
        supervisor = random_travels(seed)
        controller = Controller(supervisor.executable, supervisor.added)
        found = search(controller, limit=LIMIT, confluence=ConfluenceSearch(controller, LIMIT))
        if not found.is_complete or found.states > TRAVEL_LIMIT:
            met["too large"] += 1
            continue
        twin = twin_of(supervisor, TRAVEL_LIMIT)
        assert twin is not None and found.states == len(twin.states), seed
        shown = (twin.has_livelock, twin.has_conflict, twin.is_blocking)
        assert (found.livelock is not None, found.conflict is not None, found.blocking is not None) == shown, seed
        assert {item.action for item in found.forbidden.values()} == twin.forbidden, seed
        properties = checked(supervisor)
        assert properties.cancels == ("failed" if twin.forbidden else "passed"), seed
        met["compared"] += 1
        met["asked for"] += any(kept is ASKED for _, held in twin.states for _, kept in held)
        met["forbidden"] += bool(twin.forbidden)
        met["conflict"] += twin.has_conflict
        met["possible by structure"] += never_forbids(controller, supervisor.added)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert min(met["compared"], met["asked for"]) > 10, met
    assert met["forbidden"] >= 3, met


def test_enums_of_one_field_agree(record_property: Callable[[str, object], None]) -> None:
    """Check that whatever one message cannot bring is neither visited nor reported; all that it can bring is."""
    met: Counter[str] = Counter()
    for seed in range(180):
        supervisor = random_controller(seed, enums=ONE_FIELD[seed % 2])
        topics = Counter(item.identifier for item in supervisor.model.communications) if supervisor else Counter()
        if supervisor is None or 2 not in topics.values():
            continue
        twin = twin_of(supervisor, TWIN_LIMIT)
        if twin is None:
            continue
        executable = ExecutableSystem(supervisor.model, Deployment.CONTROLLER)
        controller, unaware = (Controller(executable, supervisor.added) for _ in range(2))
        found = search(controller, limit=LIMIT, confluence=ConfluenceSearch(controller, LIMIT))
        assert found.states == len(twin.states), seed
        shown = (twin.has_livelock, twin.has_conflict, twin.is_blocking)
        assert (found.livelock is not None, found.conflict is not None, found.blocking is not None) == shown, seed
        unaware._choices.clear()
        apart = search(unaware, limit=LIMIT, confluence=ConfluenceSearch(unaware, LIMIT))
        met["compared"] += 1
        met["fewer states"] += found.states < apart.states
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert met["compared"] > 10 and met["fewer states"] >= 3, met


def _after(system: InterpretedSystem, states: list[dict[Any, Any]], event: str) -> list[dict[Any, Any]]:
    """Every state that an event leads to from some states, whatever its data."""
    found: list[dict[Any, Any]] = []
    is_ours = system._events[event].is_controllable
    for state in states:
        for data in (None,) if is_ours else DATA:
            system._state = state
            if is_ours and not system.enabled(event):
                continue
            try:
                reading = None if is_ours else system.read(event, data)
            except MissingData:
                continue
            if system.step(event, reading) is not None and system._state not in found:
                found.append(system._state)
    return found


def _replayed(supervisor: Supervisor, events: tuple[str, ...]) -> tuple[InterpretedSystem, list[dict[Any, Any]]]:
    system = InterpretedSystem(supervisor)
    states = [system._initial]
    for event in events:
        states = _after(system, states, event)
    return system, states


def _is_stable(system: InterpretedSystem, state: dict[Any, Any]) -> bool:
    system._state = state
    return not any(system.enabled(event) for event in system.description.resets + system.description.taus)


def test_traces_lead_to_the_failures_they_report() -> None:
    """Each can be replayed, a cycle leads back to where it began, and two orders end where they say they do."""
    kinds: Counter[str] = Counter()
    for seed in range(150):
        supervisor = random_robot(seed)
        found = check_controller(
            ExecutableSystem(supervisor.model, Deployment.CONTROLLER), (), is_nonblocking=False, limit=LIMIT
        )
        if found.livelock is not None:
            system, states = _replayed(supervisor, found.livelock.trace)
            kinds["livelock"] += 1
            again: list[list[dict[Any, Any]]] = [[state] for state in states]
            for event in found.livelock.cycle:
                again = [_after(system, item, event) for item in again]
            assert any(item == [state] for state, item in zip(states, again, strict=True)), seed
        if found.conflict is not None:
            system, states = _replayed(supervisor, found.conflict.trace)
            kinds["conflict"] += 1
            ends = []
            for order in (found.conflict.chosen, found.conflict.other):
                targets: list[list[dict[Any, Any]]] = [[state] for state in states]
                for event in order.events:
                    targets = [_after(system, item, event) for item in targets]
                ends.append(targets)
                if order.end is not None:
                    assert any(item and _is_stable(system, item[0]) for item in targets), seed
                else:
                    assert order.cycle
            assert any(one and other and one != other for one, other in zip(*ends, strict=True)), seed
        if found.blocking is not None:
            kinds["blocking"] += 1
            assert _replayed(supervisor, found.blocking.trace)[1], seed
    assert all(count >= 10 for count in kinds.values()), kinds
    assert len(kinds) == 3


def _shortest_blocking(controller: Controller) -> int | None:
    """Fewest events to a stable state, or into a cycle, from which no marked one is reached: by relaxation."""
    distances: dict[Node, int] = {}
    good: set[Node] = set()
    sure: dict[Node, set[Node]] = {}
    cycles: list[int] = []

    def enter(before: Node | None, events: int, is_sure: bool, node: Node) -> bool:
        run = controller.run(node)
        length = (0 if before is None else distances[before]) + events + len(run.events)
        if before is not None and is_sure and run.is_marked:
            good.add(before)
        if run.end is None:
            cycles.extend([length] * (not run.is_marked))
            return False
        if controller.is_marked(run.end):
            good.add(run.end)
        if before is not None and is_sure:
            sure.setdefault(before, set()).add(run.end)
        is_nearer = length < distances.get(run.end, length + 1)
        if is_nearer:
            distances[run.end] = length
        return is_nearer

    enter(None, 0, True, controller.start)
    while True:
        changes = [
            enter(state, len(events), is_sure, node)
            for state in list(distances)
            for events, is_sure, node in controller.moves(state)
        ]
        if not any(changes):
            break
    while more := {state for state, targets in sure.items() if state not in good and targets & good}:
        good |= more
    return min([*cycles, *(length for state, length in distances.items() if state not in good)], default=None)


def test_the_way_to_where_no_task_is_completed_is_a_shortest_one() -> None:
    lengths: Counter[int | None] = Counter()
    for seed in range(150):
        supervisor = random_robot(seed)
        controller = Controller(ExecutableSystem(supervisor.model, Deployment.CONTROLLER), ())
        found = search(controller, limit=LIMIT, confluence=None)
        length = _shortest_blocking(controller)
        assert (None if found.blocking is None else len(found.blocking.trace)) == length, seed
        lengths[length] += 1
    assert sum(count for length, count in lengths.items() if length) > 10, lengths


def test_what_is_proved_by_structure_is_true(record_property: Callable[[str, object], None]) -> None:
    proved: Counter[str] = Counter()
    for seed in range(250):
        supervisor = random_robot(seed)
        controller = Controller(ExecutableSystem(supervisor.model, Deployment.CONTROLLER), ())
        found = search(controller, limit=LIMIT, confluence=ConfluenceSearch(controller, LIMIT))
        if always_end(controller.system):
            proved["ends"] += 1
            assert found.livelock is None, seed
            if never_conflict(controller, ()):
                proved["confluent"] += 1
                assert found.conflict is None, seed
        elif found.livelock is None:
            proved["ends, but not by structure"] += 1
    for seed in range(70):
        made = random_controller(seed, is_plain=True)
        if made is not None:
            controller = Controller(ExecutableSystem(made.model, Deployment.CONTROLLER), made.added)
            if stays_nonblocking(made.model, controller, made.added):
                proved["nonblocking"] += 1
                assert search(controller, limit=LIMIT, confluence=None).blocking is None, seed
    for name, count in sorted(proved.items()):
        record_property(name, count)
    assert min(proved["ends"], proved["confluent"]) > 50
    assert proved["nonblocking"] > 5


@pytest.mark.parametrize("seed", range(0, 60, 3))
def test_any_supervisor_is_judged(seed: int) -> None:
    """Supervisors that no synthesis made, with everything that the language has; the same whatever came before."""
    supervisor = random_supervisor(seed)
    used = Semantics(supervisor.executable.automata)
    before = verify_explicitly(used.system, {}, limit=150, semantics=used)
    assert before == verify_explicitly(used.system, {}, limit=150)
    seasoned = Controller(supervisor.executable, supervisor.added, used)
    first, second, third = (
        check_controller(
            supervisor.executable,
            supervisor.added,
            is_nonblocking=False,
            limit=150,
            controller=controller,
        )
        for controller in (None, seasoned, seasoned)
    )
    assert first == second == third
    assert len(first.method) < 500
