"""Check of a strategy: under it every goal comes true again and again, as long as every assumption does.

A visit of a mission is a goal here, too: that the mission is not at it any more.

All that the surroundings can do is followed, state by state, on the automaton of the executor; of the controller only
what the strategy chooses. A goal is missed where a cycle has a turn of the controller on it and turns at which each
assumption is true, but none at which the goal is. Source of fair cycles: E. A. Emerson and C.-L. Lei, "Modalities for
model checking: branching time logic strikes back", Science of Computer Programming 8(3), 1987, pp. 275-306.

It shares nothing with the synthesis of strategies but the automata and what is remembered of goals.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from robosc.automata.compile import NO_DATA, State, compile_expression
from robosc.automata.executable import ExecutableSystem
from robosc.automata.semantics import Semantics, TooManyChoicesError
from robosc.automata.state import subjects
from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.graphs import components
from robosc.controller_properties.search import STOP_INTERVAL
from robosc.errors import SynthesisCancelled
from robosc.expressions import Expression
from robosc.supervisor import AddedCondition, PropertyResult, Strategy
from robosc.supervisor.predicates import state_predicate

DEFAULT_LIMIT = 20_000
"""Positions beyond which a check is given up."""

Memory = tuple[bool, ...]

Position = tuple[Node, Memory, int]
"""A stable state, what is remembered of goals, and the goal that is approached."""


@dataclass(frozen=True, slots=True)
class MissedGoal:
    """Run under a strategy that misses a goal for ever.

    Attributes:
        goal: Number of the goal or visit, from 0; None where silent steps do not end, or a chosen request is not
            enabled.
        trace: Events that lead to where it begins.
        state: The state there.
    """

    goal: int | None
    trace: tuple[str, ...]
    state: State


@dataclass(frozen=True, slots=True)
class StrategyCheck:
    """Outcome of a check.

    Attributes:
        result: `passed`, `failed` or `not checked`.
        positions: Number of positions that were visited.
        missed: A run that misses a goal, or None.
    """

    result: PropertyResult
    positions: int
    missed: MissedGoal | None = None


class StrategyRun:
    """A strategy over explicit states: what it remembers, and what it chooses.

    Args:
        executable: Executable system of the robot.
        strategy: Its strategy.
    """

    def __init__(self, executable: ExecutableSystem, strategy: Strategy) -> None:
        owed, system = executable.obligations, executable.remembering_automata
        places = {subject: place for place, subject in enumerate(subjects(system))}

        def compiled(conditions: Iterable[Expression]) -> tuple[Callable[[State], bool], ...]:
            functions = [compile_expression(item, places) for item in conditions]
            return tuple(lambda state, holds=holds: holds(state, NO_DATA) is True for holds in functions)

        self._updates = compiled(place.update for place in owed.places)
        self._goals = compiled(item.condition for item in owed.aims)
        self._assumptions = compiled(owed.assumptions)
        self._modes = tuple(
            tuple((item.event, state_predicate(system, item.condition)) for item in mode) for mode in strategy.modes
        )
        self.memory: Memory = (False,) * len(owed.places)
        """Memory before the first stable state."""

    @staticmethod
    def _whole(state: State, memory: Memory) -> State:
        return (*state, "only", *memory)

    def observed(self, state: State, memory: Memory) -> Memory:
        """Return the memory after a stable state."""
        whole = self._whole(state, memory)
        return tuple(update(whole) for update in self._updates)

    def goals(self, state: State, memory: Memory) -> tuple[bool, ...]:
        """Return for each goal and visit True if it is true."""
        whole = self._whole(state, memory)
        return tuple(goal(whole) for goal in self._goals)

    def assumptions(self, state: State, memory: Memory) -> tuple[bool, ...]:
        """Return for each assumption True if it is true."""
        whole = self._whole(state, memory)
        return tuple(item(whole) for item in self._assumptions)

    def decided(self, state: State, memory: Memory, mode: int) -> tuple[str | None, int]:
        """Return the request that is chosen, None for none, and the mode after it."""
        goals = self.goals(state, memory)
        following = (*range(mode, len(goals)), *range(mode))
        number = next((item for item in following if not goals[item]), None)
        if number is None:
            return None, mode
        whole = self._whole(state, memory)
        return next((event for event, condition in self._modes[number] if condition(whole)), None), number


def check_strategy(
    executable: ExecutableSystem,
    added: Iterable[AddedCondition],
    strategy: Strategy,
    *,
    limit: int = DEFAULT_LIMIT,
    semantics: Semantics | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> StrategyCheck:
    """Check that a strategy reaches every goal of its model while the assumptions come true.

    Args:
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        strategy: The strategy.
        limit: Positions beyond which the check is given up.
        semantics: Semantics of its automata, if it was made already.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    search = _Search(Controller(executable, added, semantics), StrategyRun(executable, strategy))
    try:
        if not search.is_complete_within(limit, should_stop):
            result: PropertyResult = "not checked" if search.lost is None else "failed"
            return StrategyCheck(result, len(search.turns), search.lost)
    except TooManyChoicesError:
        return StrategyCheck("not checked", len(search.turns))
    missed = search.missed(len(executable.obligations.aims))
    return StrategyCheck("passed" if missed is None else "failed", len(search.turns), missed)


class _Search:
    """Positions under a strategy, with the moves between them.

    Attributes:
        moves: Targets of the surroundings' moves from each position.
        turns: Target of the controller's turn in each position.
        lost: A run that ends in silent steps without end or a request that is not enabled, or None.
    """

    def __init__(self, controller: Controller, run: StrategyRun) -> None:
        self._controller = controller
        self._run = run
        self.moves: dict[Position, tuple[Position, ...]] = {}
        self.turns: dict[Position, Position] = {}
        self.lost: MissedGoal | None = None
        self._parents: dict[Position, tuple[Position | None, tuple[str, ...]]] = {}
        self._queue: list[Position] = []

    def is_complete_within(self, limit: int, should_stop: Callable[[], bool]) -> bool:
        """Visit the positions; return False if they are more than a limit, or one was found from which nothing goes on.

        Raises:
            SynthesisCancelled: `should_stop` became true.
        """
        self._arrived(self._controller.start, self._run.memory, 0, None, ())
        for place, position in enumerate(self._queue):
            if place % STOP_INTERVAL == 0 and should_stop():
                raise SynthesisCancelled("the check of the strategy was stopped")
            if place >= limit:
                return False
            self._follow(position)
            if self.lost is not None:
                return False
        return self.lost is None

    def _follow(self, position: Position) -> None:
        (state, held), memory, mode = position
        event, after = self._run.decided(state, memory, mode)
        targets = []
        for events, _, node in self._controller.moves((state, held)):
            if events[0] not in self._controller.requests:
                targets.append(self._arrived(node, memory, mode, position, events))
        self.moves[position] = tuple(item for item in targets if item is not None)
        if event is None:
            self.turns[position] = self._known((state, held), memory, after, position, ())
            return
        target = self._controller.after(state, event)
        if target is None:
            self.lost = MissedGoal(None, self._trace(position), state)
            return
        # Bits that are held for goals of other actions stay.
        held = held if target == state else self._controller.forgotten(target, held)
        found = self._arrived((target, held), memory, after, position, (event,))
        if found is not None:
            self.turns[position] = found

    def _arrived(
        self, node: Node, memory: Memory, mode: int, before: Position | None, events: tuple[str, ...]
    ) -> Position | None:
        run = self._controller.run(node)
        if run.end is None:
            self.lost = MissedGoal(None, (*(() if before is None else self._trace(before)), *events), node[0])
            return None
        return self._known(run.end, self._run.observed(run.end[0], memory), mode, before, (*events, *run.events))

    def _known(
        self, node: Node, memory: Memory, mode: int, before: Position | None, events: tuple[str, ...]
    ) -> Position:
        position = (node, memory, mode)
        if position not in self._parents:
            self._parents[position] = before, events
            self._queue.append(position)
        return position

    def _trace(self, position: Position) -> tuple[str, ...]:
        found: list[tuple[str, ...]] = []
        before: Position | None = position
        while before is not None:
            before, events = self._parents[before]
            found.append(events)
        return tuple(event for events in reversed(found) for event in events)

    def missed(self, goals: int) -> MissedGoal | None:
        """Return a run that misses a goal although every assumption comes true again and again, or None."""
        positions = list(self.turns)
        judged = {item: self._run.goals(item[0][0], item[1]) for item in positions}
        owed = {item: self._run.assumptions(item[0][0], item[1]) for item in positions}
        for goal in range(goals):
            passing = {item: target for item, target in self.turns.items() if not judged[item][goal]}
            graph: dict[Position, Sequence[Position]] = {
                item: (*self.moves[item], *((passing[item],) if item in passing else ())) for item in positions
            }
            numbers = components(graph)
            met: dict[int, list[Position]] = {}
            for item, target in passing.items():
                if numbers[target] == numbers[item]:
                    met.setdefault(numbers[item], []).append(item)
            for found in met.values():
                if all(any(holding) for holding in zip(*(owed[item] for item in found), strict=True)):
                    return MissedGoal(goal, self._trace(found[0]), found[0][0][0])
        return None
