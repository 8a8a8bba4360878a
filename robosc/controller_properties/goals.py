"""Check of a strategy: under it every goal comes true again and again, as long as every assumption does.

A visit of a mission is a goal here, too: that the mission is not at it any more.

All that the surroundings can do is followed, state by state, on the automaton of the executor; of the controller only
what the strategy chooses. A goal is missed where a cycle has a turn of the controller on it and turns at which each
assumption is true, but none at which the goal is. Source of fair cycles: E. A. Emerson and C.-L. Lei, "Modalities for
model checking: branching time logic strikes back", Science of Computer Programming 8(3), 1987, pp. 275-306.

It shares nothing with the synthesis of strategies but the automata and what is remembered of goals.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from operator import ge

import msgspec

from robosc.automata.compile import NO_DATA, Function, State, compile_expression, subjects_read
from robosc.automata.executable import ExecutableSystem
from robosc.automata.goal_memory import MEMORY
from robosc.automata.semantics import TooManyChoicesError
from robosc.automata.state import Subject, subjects
from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.graphs import components
from robosc.controller_properties.search import STOP_INTERVAL
from robosc.errors import SynthesisCancelled
from robosc.expressions import Expression, Value, leaves, simple_parts
from robosc.supervisor import AddedCondition, PropertyResult, Strategy
from robosc.supervisor.predicates import state_predicate

DEFAULT_LIMIT = 20_000
"""Positions beyond which a check is given up."""

Memory = tuple[bool, ...]

_Look = tuple[Value | None, ...]
"""All that conditions read of a state."""

Position = tuple[Node, Memory, int]
"""A stable state, what is remembered of goals, and the goal that is approached."""


class MissedGoal(msgspec.Struct, frozen=True):
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


class StrategyCheck(msgspec.Struct, frozen=True):
    """Outcome of a check.

    Attributes:
        result: `passed`, `failed` or `not checked`.
        positions: Number of positions that were visited.
        missed: A run that misses a goal, or None.
        put_off: Numbers of visits that the robot may leave unmade for ever by its own doing: to get to such a visit it
            begins a detour of the mission or ends what `while` asks for, and comes back without making it, or not at
            all, though the surroundings interrupt nothing.
    """

    result: PropertyResult
    positions: int
    missed: MissedGoal | None = None
    put_off: tuple[int, ...] = ()


class _Group(msgspec.Struct, frozen=True):
    """Conditions that read the same of the state and the memory.

    Attributes:
        numbers: Their numbers among all.
        functions: Functions that evaluate them on a state with its memory.
        looks: Numbers of the parts of a look that they read.
        held: Numbers of the places of the memory that they read.
        known: Their truth values for what was read before.
    """

    numbers: tuple[int, ...]
    functions: tuple[Function, ...]
    looks: tuple[int, ...]
    held: tuple[int, ...]
    known: dict[tuple[Value | None, ...], tuple[bool, ...]] = msgspec.field(default_factory=dict)

    def of(self, look: _Look, state: State, memory: Memory) -> tuple[bool, ...]:
        """Return for each condition True if it is true; the arguments are those of `_Judgements.of`."""
        key = (*[look[item] for item in self.looks], *[memory[item] for item in self.held])
        found = self.known.get(key)
        if found is None:
            whole = _whole(state, memory)
            found = self.known[key] = tuple(holds(whole, NO_DATA) is True for holds in self.functions)
        return found


class _Judgements:
    """Truth values of some conditions over a state and the memory, worked out once for all states that look alike.

    Each long mission or detour has as many places as visits, and the update of each of them reads all of these. So what
    reads the same is worked out together, once for each stage that it can be at, and not for all combinations of them.

    Args:
        conditions: The conditions.
        places: Place of each subject in a state with its memory.
        read: Parts of a state that a look consists of.
    """

    def __init__(
        self, conditions: Sequence[Expression], places: Mapping[Subject, int], read: Sequence[Expression]
    ) -> None:
        number_of = {part: number for number, part in enumerate(read)}
        first = min((place for subject, place in places.items() if _is_remembered(subject)), default=0)
        groups: defaultdict[tuple[tuple[int, ...], tuple[int, ...]], list[int]] = defaultdict(list)
        for number, condition in enumerate(conditions):
            looks = {number_of[part] for part in _read_of_state(condition)}
            held = {places[subject] - first for subject in subjects_read(condition) if _is_remembered(subject)}
            groups[tuple(sorted(looks)), tuple(sorted(held))].append(number)
        functions = [compile_expression(item, places) for item in conditions]
        self._groups = tuple(
            _Group(tuple(numbers), tuple(functions[number] for number in numbers), looks, held)
            for (looks, held), numbers in groups.items()
        )
        self._count = len(conditions)
        self._known: dict[tuple[Value | None, ...], tuple[bool, ...]] = {}

    def of(self, look: _Look, state: State, memory: Memory) -> tuple[bool, ...]:
        """Return for each condition True if it is true.

        Args:
            look: All that conditions read of the state.
            state: The state.
            memory: The memory.
        """
        key = (*look, *memory)
        found = self._known.get(key)
        if found is None:
            values = [False] * self._count
            for group in self._groups:
                for number, value in zip(group.numbers, group.of(look, state, memory), strict=True):
                    values[number] = value
            found = self._known[key] = tuple(values)
        return found


class StrategyRun:
    """A strategy over explicit states: what it remembers, and what it chooses.

    Args:
        executable: Executable system of the robot.
        strategy: Its strategy.
    """

    def __init__(self, executable: ExecutableSystem, strategy: Strategy) -> None:
        owed, system = executable.obligations, executable.remembering_automata
        places = {subject: place for place, subject in enumerate(subjects(system))}
        conditions = (
            tuple(place.update for place in owed.places),
            tuple(item.condition for item in owed.aims),
            owed.assumptions,
        )
        self._places = places
        waiting = tuple(found for aim in owed.aims for found in (aim.interruption, *aim.occasions, aim.made) if found)
        every = (*conditions, waiting)
        self._parts = tuple(dict.fromkeys(part for items in every for item in items for part in _read_of_state(item)))
        self._updates, self._goals, self._assumptions = [
            _Judgements(items, places, self._parts) for items in conditions
        ]
        self._read = tuple(compile_expression(part, places) for part in self._parts)
        self._looks: dict[State, _Look] = {}
        self._modes = tuple(
            tuple((item.event, state_predicate(system, item.condition)) for item in mode) for mode in strategy.modes
        )
        self.memory: Memory = (False,) * len(owed.places)
        """Memory before the first stable state."""

    def look(self, state: State) -> _Look:
        """Return all that memory, goals and assumptions read of a state: where it is the same, so are they."""
        found = self._looks.get(state)
        if found is None:
            found = self._looks[state] = tuple(part(state, NO_DATA) for part in self._read)
        return found

    def judgements(self, conditions: Iterable[Expression]) -> _Judgements:
        """Return judgements of conditions that come with goals and visits."""
        return _Judgements(tuple(conditions), self._places, self._parts)

    def observed(self, state: State, memory: Memory) -> Memory:
        """Return the memory after a stable state."""
        return self._updates.of(self.look(state), state, memory)

    def goals(self, state: State, memory: Memory) -> tuple[bool, ...]:
        """Return for each goal and visit True if it is true."""
        return self._goals.of(self.look(state), state, memory)

    def assumptions(self, state: State, memory: Memory) -> tuple[bool, ...]:
        """Return for each assumption True if it is true."""
        return self._assumptions.of(self.look(state), state, memory)

    def decided(self, state: State, memory: Memory, mode: int) -> tuple[str | None, int]:
        """Return the request that is chosen, None for none, and the mode after it."""
        goals = self.goals(state, memory)
        following = (*range(mode, len(goals)), *range(mode))
        number = next((item for item in following if not goals[item]), None)
        if number is None:
            return None, mode
        whole = _whole(state, memory)
        return next((event for event, condition in self._modes[number] if condition(whole)), None), number


def _whole(state: State, memory: Memory) -> State:
    """Return a state with its memory, as a state of the remembering automata."""
    return (*state, "only", *memory)


def _read_of_state(condition: Expression) -> Iterator[Expression]:
    """Yield parts of a condition that read the state alone: with the memory they decide its value."""
    for part in simple_parts(condition):
        found = leaves(part) if any(map(_is_remembered, subjects_read(part))) else (part,)
        for item in found:
            read = subjects_read(item)
            if read and not any(map(_is_remembered, read)):
                yield item


def _is_remembered(subject: Subject) -> bool:
    return subject.automaton == MEMORY and subject.variable is not None


def check_strategy(
    executable: ExecutableSystem,
    added: Iterable[AddedCondition],
    strategy: Strategy,
    *,
    limit: int = DEFAULT_LIMIT,
    controller: Controller | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> StrategyCheck:
    """Check that a strategy reaches every goal of its model while the assumptions come true.

    Args:
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        strategy: The strategy.
        limit: Positions beyond which the check is given up.
        controller: The controller automaton, if it was made already.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    search = _Search(controller or Controller(executable, added), StrategyRun(executable, strategy))
    try:
        if not search.is_complete_within(limit, should_stop):
            result: PropertyResult = "not checked" if search.lost is None else "failed"
            return StrategyCheck(result, len(search.turns), search.lost)
    except TooManyChoicesError:
        return StrategyCheck("not checked", len(search.turns))
    missed = search.missed()
    if missed is not None:
        return StrategyCheck("failed", len(search.turns), missed)
    return StrategyCheck("passed", len(search.turns), put_off=tuple(search.put_off(executable)))


class _Search:
    """Positions under a strategy, with the moves between them; each position has a number.

    Attributes:
        positions: The positions by their numbers, in the order in which they were found.
        moves: For each position that was visited the targets of the surroundings' moves.
        turns: For each of them the target of the controller's turn, and True if the approached goal is not true yet.
        lost: A run that ends in silent steps without end or a request that is not enabled, or None.
    """

    def __init__(self, controller: Controller, run: StrategyRun) -> None:
        self._controller = controller
        self._run = run
        self.positions: list[Position] = []
        self.moves: list[list[int]] = []
        self.turns: list[tuple[int, bool]] = []
        self.lost: MissedGoal | None = None
        self._numbers: dict[tuple[int, Memory, int], int] = {}
        self._parents: list[tuple[int | None, tuple[str, ...]]] = []
        # Nodes are numbered, too: a state takes long to look up.
        self._nodes: dict[Node, int] = {}
        self._surroundings: dict[int, list[tuple[Node, int, tuple[str, ...]]]] = {}

    def is_complete_within(self, limit: int, should_stop: Callable[[], bool]) -> bool:
        """Visit the positions; return False if they are more than a limit, or one was found from which nothing goes on.

        Raises:
            SynthesisCancelled: `should_stop` became true.
        """
        start = self._arrived(self._controller.start, self._run.memory, 0, None, ())
        if start is None:
            return False
        for place, position in enumerate(self.positions):
            if place % STOP_INTERVAL == 0 and should_stop():
                raise SynthesisCancelled("the check of the strategy was stopped")
            if place >= limit or not self._follow(place, position):
                return False
        return True

    def _follow(self, number: int, position: Position) -> bool:
        """Find all that follows a position; return False where something does not go on."""
        (state, held), memory, mode = position
        event, after = self._run.decided(state, memory, mode)
        moves = self._moves(number)
        if moves is None:
            return False
        targets = [
            self._known(end, node, self._run.observed(end[0], memory), mode, number, events)
            for end, node, events in moves
        ]
        turn: int | None
        if event is None:
            turn = self._known((state, held), self._nodes[state, held], memory, after, number, ())
        else:
            target = self._controller.after(state, event)
            if target is None:
                self.lost = MissedGoal(None, self._trace(number), state)
                return False
            # Bits that are held for goals of other actions stay.
            held = held if target == state else self._controller.judged(target, held)
            turn = self._arrived((target, held), memory, after, number, (event,))
        if turn is None:
            return False
        self.moves.append(targets)
        self.turns.append((turn, not self._run.goals(state, memory)[mode]))
        return True

    def _moves(self, number: int) -> list[tuple[Node, int, tuple[str, ...]]] | None:
        """Return what the surroundings' moves from a position lead to, with the events; None where one does not end."""
        node = self.positions[number][0]
        found = self._surroundings.get(self._nodes[node])
        if found is None:
            found = []
            for events, _, target in self._controller.moves(node):
                if events[0] not in self._controller.requests:
                    run = self._controller.run(target)
                    if run.end is None:
                        self._lose(number, events, target)
                        return None
                    found.append((run.end, self._number(run.end), (*events, *run.events)))
            self._surroundings[self._nodes[node]] = found
        return found

    def _number(self, node: Node) -> int:
        return self._nodes.setdefault(node, len(self._nodes))

    def _arrived(
        self, node: Node, memory: Memory, mode: int, before: int | None, events: tuple[str, ...]
    ) -> int | None:
        run = self._controller.run(node)
        if run.end is None:
            self._lose(before, events, node)
            return None
        memory = self._run.observed(run.end[0], memory)
        return self._known(run.end, self._number(run.end), memory, mode, before, (*events, *run.events))

    def _lose(self, before: int | None, events: tuple[str, ...], node: Node) -> None:
        self.lost = MissedGoal(None, (*(() if before is None else self._trace(before)), *events), node[0])

    def _known(
        self, node: Node, place: int, memory: Memory, mode: int, before: int | None, events: tuple[str, ...]
    ) -> int:
        """Return the number of a position, `place` being that of its node."""
        key = place, memory, mode
        number = self._numbers.get(key)
        if number is None:
            number = self._numbers[key] = len(self.positions)
            self.positions.append((node, memory, mode))
            self._parents.append((before, events))
        return number

    def _trace(self, number: int) -> tuple[str, ...]:
        found: list[tuple[str, ...]] = []
        before: int | None = number
        while before is not None:
            before, events = self._parents[before]
            found.append(events)
        return tuple(event for events in reversed(found) for event in events)

    def missed(self) -> MissedGoal | None:
        """Return a run that misses a goal although every assumption comes true again and again, or None.

        The mode never passes over a goal that is not true. On a cycle that misses a goal it therefore stays the same,
        and the goal of that mode is missed, too: only turns count at which the approached goal is not true.
        """
        graph = {
            number: (*targets, turn) if is_owed else targets
            for number, (targets, (turn, is_owed)) in enumerate(zip(self.moves, self.turns, strict=True))
        }
        numbers = components(graph)
        met: dict[int, list[int]] = {}
        for number, (turn, is_owed) in enumerate(self.turns):
            if is_owed and numbers[turn] == numbers[number]:
                met.setdefault(numbers[number], []).append(number)
        for found in sorted(met.values(), key=lambda found: self.positions[found[0]][2]):
            positions = [self.positions[number] for number in found]
            owed = {self._run.assumptions(node[0], memory) for node, memory, _ in positions}
            if all(map(any, zip(*owed, strict=True))):
                return MissedGoal(positions[0][2], self._trace(found[0]), positions[0][0][0])
        return None

    def put_off(self, executable: ExecutableSystem) -> Iterator[int]:
        """Yield the visits that the robot may leave unmade for ever by its own doing.

        Args:
            executable: Executable system of the robot.
        """
        judged: dict[tuple[Expression, ...], list[tuple[bool, ...]]] = {}
        for number, aim in enumerate(executable.obligations.aims):
            turned = [place for place, (turn, _) in enumerate(self.turns) if self.positions[turn][2] == number]
            if aim.interruption is None or aim.made is None or not turned:
                continue
            # Visits of one mission wait for the same.
            causes = (aim.interruption, *aim.occasions)
            if causes not in judged:
                judgements = self._run.judgements(causes)
                judged[causes] = [
                    judgements.of(self._run.look(state), state, memory) for (state, _), memory, _ in self.positions
                ]
            caused = judged[causes]
            is_made = self._made(aim.made)
            begun = [
                turn
                for place in turned
                for turn, _ in [self.turns[place]]
                if caused[turn][0] and not caused[place][0] and not is_made(place, turn)
            ]
            if begun and self._goes_on(begun, caused, is_made):
                yield number

    def _made(self, condition: Expression) -> Callable[[int, int], bool]:
        """Return the function that says if a visit is made on the way from one position to another one."""
        judgements = self._run.judgements((condition,))

        def is_made(before: int, after: int) -> bool:
            state = self.positions[after][0][0]
            return judgements.of(self._run.look(state), state, self.positions[before][1])[0]

        return is_made

    def _goes_on(
        self, begun: Iterable[int], caused: Sequence[tuple[bool, ...]], is_made: Callable[[int, int], bool]
    ) -> bool:
        """Return True if a run goes on for ever from some positions without making a visit.

        The surroundings keep to every assumption, and make none of the causes come true for which the visit waits.

        Args:
            begun: Numbers of the positions.
            caused: For each position the causes that are true there.
            is_made: Function that says if the visit is made on the way from one position to another one.
        """
        graph: dict[int, list[int]] = {}
        queue = list(dict.fromkeys(begun))
        for place in queue:
            if place not in graph:
                before = caused[place]
                moves = [item for item in self.moves[place] if all(map(ge, before, caused[item]))]
                graph[place] = [item for item in (*moves, self.turns[place][0]) if not is_made(place, item)]
                queue += graph[place]
        numbers = components(graph)
        owed: dict[int, set[tuple[bool, ...]]] = {}
        for place, targets in graph.items():
            turn = self.turns[place][0]
            if turn in targets and numbers[turn] == numbers[place]:
                (state, _), memory, _ = self.positions[place]
                owed.setdefault(numbers[place], set()).add(self._run.assumptions(state, memory))
        return any(all(map(any, zip(*met, strict=True))) for met in owed.values())
