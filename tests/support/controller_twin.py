"""The obvious twin of the controller's properties: the reference executor, led through every choice of its world.

Every stable state is reached by replaying a whole history in a new executor, with its clock and middleware of tests.
Orders of silent steps that the executor does not take are tried on the interpreted system, one by one.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import Reading
from robosc.execution.runtime.requests import PolicyDecisions
from robosc.expressions.evaluate import evaluate
from robosc.model.structure import CommunicationKind
from robosc.supervisor import Supervisor
from support.execution import Bench

StateKey = tuple[Any, ...]
Move = tuple[str, ...]
Held = tuple[tuple[str, tuple[bool, ...]], ...]

ASKED = ()
"""Stands for the requirements that held, once the cancel of a goal was asked for."""


def _is_silent(event: str) -> bool:
    kind = event.rpartition(".")[2]
    return kind == "reset" or kind.startswith("tau_")


class _Watched(InterpretedSystem):
    """Remembers every step: its event, the state after it, and the goals as they were then."""

    def __init__(self, supervisor: Supervisor) -> None:
        super().__init__(supervisor)
        self.steps: list[tuple[str, dict[Any, Any], Held]] = []
        self.goals: Callable[[], Held] = lambda: ()
        self.supervisor = supervisor

    def step(self, event: str, reading: Reading | None = None) -> tuple[str, ...] | None:
        skipped = super().step(event, reading)
        if skipped is not None:
            self.steps.append((event, dict(self._state), self.goals()))
        return skipped

    def is_marked(self, state: dict[Any, Any]) -> bool:
        marked = {
            component.name: {item.name for item in component.behaviour.states if item.is_marked}
            for component in self.supervisor.model.components
            if component.behaviour
        }
        return all(
            value in marked[place] if place in marked else value == "idle"
            for (place, variable), value in state.items()
            if variable is None
        )


class _Wanted:
    """A policy that issues one request."""

    def __init__(self, number: int) -> None:
        self._number = number
        self.enabled = frozenset({number})

    def enable(self, request: int) -> None: ...

    def disable(self, request: int) -> None:
        assert request != self._number

    def choose(self, among: Any = None) -> int:
        assert among is None or self._number in among
        return self._number

    def withhold(self, request: int) -> None:
        raise AssertionError(request)

    def issued(self, request: int) -> None: ...

    def close(self) -> None: ...


def _nothing(*names: str) -> str:
    raise KeyError(names)


class World:
    """An executor after a history."""

    def __init__(self, supervisor: Supervisor, history: tuple[Move, ...]) -> None:
        self.system = _Watched(supervisor)
        self.bench = Bench(self.system, start=False, on_unknown="keep", service_timeout_s=None)
        self.executor = self.bench.executor
        self.system.goals = self.held
        self.executor.start()
        for move in history:
            self.do(move)

    @property
    def is_endless(self) -> bool:
        if self.executor.is_faulty:
            assert all("silent steps do not end" in reason for reason in self.executor.reasons), self.executor.reasons
        return self.executor.is_faulty

    def held(self) -> Held:
        goals = self.executor._replies._goals.open_goals()
        return tuple((goal.action, ASKED if goal.is_cancelling else goal.held) for goal in goals if goal.held)

    def forbidden(self) -> set[str]:
        """Return the actions whose cancel is asked for and not allowed, though a requirement does not hold."""
        return {
            name
            for name, kept in self.held()
            if kept is ASKED and not all(self.system.requirements(name)) and not self.system.enabled(f"{name}.cancel")
        }

    def open_actions(self) -> set[str]:
        """Return the actions of which a goal is not known to have ended."""
        return {goal.action for goal in self.executor._replies._goals.open_goals()}

    def key(self) -> StateKey:
        return (self.system.situation(), self.held())

    def do(self, move: Move) -> None:
        """Let one thing happen."""
        self.system.steps.clear()
        kind, name, *data = move
        if kind == "request":
            decisions = self.executor._decisions
            assert isinstance(decisions, PolicyDecisions)
            decisions.policy = _Wanted(self.executor._request_names.index(name))
            self.executor.tick()
        elif kind == "message":
            self.executor.receive(name, data[0])
        elif kind == "service":
            number = next(number for number, call in self._calls().items() if call.service == name)
            if data[0] == "reply":
                self.executor.on_reply(number, None)
            else:
                self.executor.on_call_failed(number, "lost")
        elif data[0] == "feedback":
            self.executor.on_feedback(self._goal(name), None)
        else:
            self.executor.on_goal_ended(self._goal(name), data[0])

    def _calls(self) -> Any:
        return self.executor._replies._calls._calls

    def _goal(self, action: str) -> int:
        return next(goal.number for goal in self.executor._replies._goals.open_goals() if goal.action == action)

    def _is_known(self, enum: str, data: dict[str, int]) -> bool:
        """Return True if every rule of an enum is true or false."""
        rules = self.system.supervisor.model.enum(enum).rules
        values = (evaluate(rule.condition, _nothing, _nothing, lambda path: data[str(path[0])]) for rule in rules)
        return None not in values

    def moves(self) -> Iterator[tuple[Move, bool]]:
        """Yield every move that may happen now, and True if it may under every setting."""
        model = self.system.supervisor.model
        for number in self.executor._system.enabled_requests():
            name = self.executor._request_names[number]
            if not self.executor._goals.is_open(name):
                yield ("request", name), True
        topics: dict[str, list[Any]] = {}
        for item in model.communications:
            if item.kind is CommunicationKind.OUTGOING_MESSAGE:
                topics.setdefault(item.identifier, []).append(item.response)
        for identifier, types in topics.items():
            if type(types[0]).__name__ == "EnumType":
                for n, m in product((0, 1, 6), repeat=2):
                    is_sure = all(self._is_known(type_.name, {"n": n, "m": m}) for type_ in types)
                    yield ("message", identifier, {"n": n, "m": m}), is_sure  # type: ignore[misc]
            else:
                for value in (False, True) if type(types[0]).__name__ == "BooleanType" else (None,):
                    yield ("message", identifier, value), True  # type: ignore[misc]
        for call in self._calls().values():
            yield ("service", call.service, "reply"), True
            yield ("service", call.service, "failed"), True
        for goal in self.executor._replies._goals.open_goals():
            for outcome in ("feedback", "succeeded", "aborted", "cancelled"):
                yield ("action", goal.action, outcome), True


@dataclass
class Twin:
    """Behaviour that the executor showed.

    Attributes:
        states: Stable states that it got to.
        has_livelock: True if silent steps did not end.
        has_conflict: True if their order mattered.
        is_blocking: True if it got to a state from which no marked one can be reached.
        forbidden: Actions whose cancel was asked for and forbidden somewhere.
    """

    states: set[StateKey] = field(default_factory=set)
    has_livelock: bool = False
    has_conflict: bool = False
    is_blocking: bool = False
    forbidden: set[str] = field(default_factory=set)


def twin_of(supervisor: Supervisor, limit: int) -> Twin | None:
    """Return the reference executor's behaviour in every world, or None if it gets to over `limit` stable states."""
    found = Twin()
    histories: dict[StateKey, tuple[Move, ...]] = {}
    sure: dict[StateKey, set[StateKey]] = {}
    good: set[StateKey] = set()
    tried: set[Any] = set()

    def look(world: World, before: StateKey | None, is_sure: bool) -> StateKey | None:
        """Judge what just happened, and return the stable state it led to."""
        steps = world.system.steps
        loud = [place for place, (event, _, _) in enumerate(steps) if not _is_silent(event)]
        begin = loud[-1] if loud else 0
        passed = [(state, held) for _, state, held in steps[begin:]]
        if not loud:
            passed.insert(0, (dict(world.system._initial), ()))
        raw, held = passed[0]
        if (before is None or loud) and _outcomes(world.system, raw, _live(world, raw, held), tried) > 1:
            found.has_conflict = True
        marked = any(world.system.is_marked(state) for state, _ in passed)
        if world.is_endless:
            found.has_livelock = True
            # The executor has gone round at least once before it stopped; the last half is in the cycle.
            cycle = _cycle(world.system, passed[-1][0], passed[-1][1])
            if not any(world.system.is_marked(state) for state in cycle):
                found.is_blocking = True
            elif before is not None and is_sure:
                good.add(before)
            return None
        key = world.key()
        found.forbidden |= world.forbidden()
        if world.system.is_marked(dict(world.system._state)):
            good.add(key)
        if before is not None and is_sure and loud:
            if marked:
                good.add(before)
            sure.setdefault(before, set()).add(key)
        return key

    first = World(supervisor, ())
    key = look(first, None, True)
    queue: list[StateKey] = []
    if key is not None:
        histories[key] = ()
        queue.append(key)
    for state in queue:
        for move, is_sure in list(World(supervisor, histories[state]).moves()):
            world = World(supervisor, histories[state])
            world.do(move)
            target = look(world, state, is_sure)
            if target is not None and target not in histories:
                histories[target] = (*histories[state], move)
                queue.append(target)
                if len(queue) > limit:
                    return None
    found.states = set(histories)
    while any(targets & good and source not in good for source, targets in sure.items()):
        good |= {source for source, targets in sure.items() if targets & good}
    found.is_blocking = found.is_blocking or not found.states <= good
    return found


def _live(world: World, state: dict[Any, Any], held: Held) -> Held:
    """Return the data that is remembered of goals that still run, once the cancels are asked for that are due."""
    running = [(name, kept) for name, kept in held if state[f"action {name}", None] == "executing"]
    return tuple((name, _asked(world.system, state, name, kept)) for name, kept in running)


def _asked(system: _Watched, state: dict[Any, Any], name: str, kept: tuple[bool, ...]) -> tuple[bool, ...]:
    if kept is ASKED:
        return ASKED
    pairs = zip(kept, _requirements(system, state, name), strict=True)
    return ASKED if any(before and not now for before, now in pairs) else kept


def _silent_steps(system: _Watched, state: dict[Any, Any], held: Held) -> list[tuple[dict[Any, Any], Held]]:
    """Return the target of every enabled silent step; the executor's choice first."""
    found = []
    kept = system._state
    for event in (*system.description.resets, *system.description.taus):
        system._state = state
        if system.enabled(event):
            # The class's own step is not reported: this is only tried.
            assert InterpretedSystem.step(system, event) is not None
            target = dict(system._state)
            found.append((target, tuple((name, _asked(system, target, name, kept)) for name, kept in held)))
    system._state = kept
    return found


def _requirements(system: _Watched, state: dict[Any, Any], name: str) -> tuple[bool, ...]:
    kept, system._state = system._state, state
    try:
        return system.requirements(name)
    finally:
        system._state = kept


def _outcomes(system: _Watched, state: dict[Any, Any], held: Held, tried: set[Any]) -> int:
    """Count the outcomes of the orders of silent steps from a state: stable states, and `without end`."""
    start = (tuple(state.items()), held)
    if start in tried:
        return 1
    tried.add(start)
    after: dict[Any, list[Any]] = {}
    queue = [start]
    for node in queue:
        if node not in after:
            after[node] = [(tuple(s.items()), h) for s, h in _silent_steps(system, dict(node[0]), node[1])]
            queue += after[node]
    ends = {node for node, targets in after.items() if not targets}
    left = dict(after)
    while done := [node for node, targets in left.items() if not any(target in left for target in targets)]:
        for node in done:
            del left[node]
    return len(ends) + bool(left)


def _cycle(system: _Watched, state: dict[Any, Any], held: Held) -> list[dict[Any, Any]]:
    """The states that the executor's own order passes again and again, from one that may lead to them."""
    states = []
    for _ in range(2000):
        states.append(state)
        steps = _silent_steps(system, state, held)
        assert steps
        state, held = steps[0]
    last = states[-1]
    return states[max(place for place, item in enumerate(states[:-1]) if item == last) + 1 :]
