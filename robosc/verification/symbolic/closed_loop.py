"""The closed loop of a supervisor with its strategy, on sets of positions.

A position is a stable state with what is remembered of goals; there is one set of positions for each mode of the
strategy. The surroundings move by one middleware message each; all that they can do is followed, whatever a supervisor
would want. At its turn the controller does what the strategy chooses.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from robosc.automata.compile import Carried, State, subjects_read
from robosc.automata.decision import Decision
from robosc.automata.executable import ExecutableSystem
from robosc.automata.goal_memory import MEMORY, Place
from robosc.automata.state import Subject
from robosc.verification.symbolic.moves import Arrival, Move, Part, moving
from robosc.verification.symbolic.relations import Relation, Relations
from robosc.verification.symbolic.variables import Variables
from robosc.verification.symbolic.work import Work

Choices = Sequence[tuple[str, Decision]]
"""Requests of one mode, each with the condition for it: the first one whose condition is true is chosen."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """Event of a middleware message.

    Attributes:
        event: The event.
        options: Data that it can carry; None: any.
        may_be_left_out: True if it may as well not happen.
    """

    event: str
    options: tuple[Carried, ...] | None
    may_be_left_out: bool


Message = tuple[Occurrence, ...]
"""One move of the surroundings: events in source order, with no silent step in between."""


@dataclass(frozen=True, slots=True)
class _Growth:
    """Positions that were found at once.

    Attributes:
        mode: Mode in which they were found.
        added: The positions.
        move: Move that leads to them; None where the controller waits, or at the start.
        within: Positions from which that move was made; None at the start.
        source: Mode in which these were.
    """

    mode: int
    added: Any
    move: Move | None
    within: Any
    source: int


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn of the controller in a mode whose goal is not true.

    Attributes:
        requests: Each request that is chosen, with the positions in which it is.
        waits: Positions in which the controller waits.
    """

    requests: tuple[tuple[Move, Any], ...]
    waits: Any


class ClosedLoop:
    """Robot under its supervisor and strategy, with the positions that it can reach.

    Args:
        executable: Executable system of the robot.
        added: For each event to which the supervisor adds a condition, that condition.
        modes: Choices of the strategy in each mode.
        messages: Moves of the surroundings.
        engine: Engine of the decision diagrams.
        work: Count of the work.

    Attributes:
        variables: Variables of a position.
        reached: For each mode the positions that are reached in it.
        arrival: The way from moves to positions.
        moves: Moves of the surroundings that change something.
        turns: Turns of the controller, by modes.
        goals: For each goal and visit the states with their memory in which it is true.
        assumptions: The same for each assumption.
    """

    def __init__(
        self,
        executable: ExecutableSystem,
        added: Mapping[str, Decision],
        modes: Sequence[Choices],
        messages: Sequence[Message],
        engine: str,
        work: Work,
    ) -> None:
        owed, system = executable.obligations, executable.remembering_automata
        self.variables = Variables(system, engine, work, dict(_remembered(owed.places)))
        relations = Relations(self.variables, dict(added))
        self.arrival = Arrival(self.variables, relations, executable)
        events = {event.name: event for event in system.events}

        @cache
        def relation_of(item: Occurrence) -> Relation:
            return relations.relation(events[item.event], item.options)

        made = [self._message(relation_of, message) for message in dict.fromkeys(messages)]
        made += [
            self._end(relations.relation(events[item.event]), relations.truth(item.may_end)) for item in owed.cancels
        ]
        self.moves = tuple(item for item in made if item.parts)
        false = self.variables.manager.false
        requests = {
            event: Move((Part(relations.relation(events[event]), false),))
            for event in dict.fromkeys(event for choices in modes for event, _ in choices)
        }
        self.turns = tuple(self._turn(choices, requests) for choices in modes)
        self.goals = tuple(relations.truth(item.condition) for item in owed.aims)
        self.assumptions = tuple(relations.truth(item) for item in owed.assumptions)
        self.reached = [false] * len(modes)
        self._growth: list[_Growth] = []
        begins = relations.holds([system.initial, *system.plant_invariants])
        self._start = self.variables.all_of([*self.variables.initial(), begins])

    def _message(self, relation_of: Callable[[Occurrence], Relation], message: Message) -> Move:
        parts: list[Part] = []
        for item in message:
            # The surroundings do whatever the plants allow, without asking the supervisor.
            relation = relation_of(item)
            relation = replace(relation, guard=relation.enabled)
            passed_over = self.variables.manager.true if item.may_be_left_out else ~relation.enabled
            parts.append(Part(relation, passed_over))
        if not any(part.relation.names for part in parts):
            return Move(())
        if len(parts) == 1:
            # A message that changes nothing is no move.
            relation = moving(self.variables, parts[0].relation)
            is_possible = relation.guard != self.variables.manager.false
            return Move((Part(relation, self.variables.manager.false),) if is_possible else ())
        return Move(tuple(parts))

    def _end(self, relation: Relation, may_end: Any) -> Move:
        """Return the move that a goal ends as cancelled, which is its cancel only where the supervisor allows it."""
        guard = self.variables.work.count(relation.guard & may_end)
        false = self.variables.manager.false
        return Move((Part(replace(relation, guard=guard), false),) if guard != false else ())

    def _turn(self, choices: Choices, requests: Mapping[str, Move]) -> Turn:
        left = self.variables.manager.true
        found: list[tuple[Move, Any]] = []
        for event, decision in choices:
            condition = self.variables.work.count(self.variables.decision(decision))
            found.append((requests[event], self.variables.work.count(left & condition)))
            left = self.variables.work.count(left & ~condition)
        return Turn(tuple(found), left)

    def explore(self) -> None:
        """Find every position that can be reached."""
        false = self.variables.manager.false
        todo = [false] * len(self.reached)
        todo[0] = self._grown(0, self.arrival.forward(self._start), None, None, 0)
        while any(item != false for item in todo):
            for mode, fresh in enumerate(todo):
                if fresh != false:
                    todo[mode] = false
                    fresh = self._surrounded(mode, fresh)
                    for other, added in self._taken(mode, fresh):
                        todo[other] = todo[other] | added

    def _surrounded(self, mode: int, fresh: Any) -> Any:
        """Return some positions with all new ones that moves of the surroundings lead to."""
        false = self.variables.manager.false
        found = todo = fresh
        while todo != false:
            following = false
            for move in self.moves:
                within = todo | following
                led = self.arrival.forward(move.forward(self.variables, within))
                following = following | self._grown(mode, led, move, within, mode)
            found, todo = found | following, following
        return found

    def _taken(self, mode: int, positions: Any) -> Iterator[tuple[int, Any]]:
        """Yield the modes in which turns of the controller lead to new positions, with these."""
        for number, within in self._approached(mode, positions):
            turn = self.turns[number]
            yield number, self._grown(number, within & turn.waits, None, within, mode)
            for move, where in turn.requests:
                chosen = within & where
                if chosen != self.variables.manager.false:
                    led = self.arrival.forward(move.forward(self.variables, chosen))
                    yield number, self._grown(number, led, move, chosen, mode)

    def _approached(self, mode: int, positions: Any) -> Iterator[tuple[int, Any]]:
        """Yield the modes that turns of the controller go over to, each with the positions from which they do.

        Args:
            mode: Mode before.
            positions: Positions in that mode.
        """
        left = positions
        for number in (*range(mode, len(self.reached)), *range(mode)):
            within = self.variables.work.count(left & ~self.goals[number])
            if within != self.variables.manager.false:
                yield number, within
            left = left & self.goals[number]

    def _grown(self, mode: int, led: Any, move: Move | None, within: Any, source: int) -> Any:
        added = self.variables.work.count(led & ~self.reached[mode])
        if added != self.variables.manager.false:
            self.reached[mode] = self.variables.work.count(self.reached[mode] | added)
            self._growth.append(_Growth(mode, added, move, within, source))
        return added

    def positions(self) -> int:
        """Return the number of positions that are reached, each with its mode."""
        return sum(map(self.variables.count, self.reached))

    def run(self, positions: Any, mode: int) -> tuple[tuple[str, ...], State]:
        """Return events that lead to one of some positions that are reached in a mode, and its state."""
        last, found = self._found(positions, mode, len(self._growth))
        here = self.variables.states([found])
        runs: list[tuple[str, ...]] = []
        while True:
            growth = self._growth[last]
            if growth.within is None:
                runs.append(self.arrival.events(self._start))
                break
            if growth.move is None:
                last, _ = self._found(here, growth.source, last)
                continue
            landed = self.arrival.backward(here)
            before = growth.within & growth.move.backward(self.variables, landed)
            last, state = self._found(before, growth.source, last)
            earlier = self.variables.states([state])
            runs.append(self._events(growth.move, earlier, landed))
            here = earlier
        return tuple(event for run in reversed(runs) for event in run), found

    def _found(self, positions: Any, mode: int, before: int) -> tuple[int, State]:
        """Return where the first of some positions was found, and one of them."""
        for number, growth in enumerate(self._growth[:before]):
            within = growth.added & positions
            if mode == growth.mode and within != self.variables.manager.false:
                return number, self.variables.a_state(within)
        raise AssertionError("a position was found without a way to it")

    def _events(self, move: Move, before: Any, landed: Any) -> tuple[str, ...]:
        """Return the events of a move from a state into some, with the silent steps behind it."""
        end = self.variables.states([self.variables.a_state(move.forward(self.variables, before) & landed)])
        return (*move.events(self.variables, before, end), *self.arrival.events(end))

    def disabled_run(self) -> tuple[tuple[str, ...], State] | None:
        """Return events that lead to where a request is chosen that is not enabled, and the state there, or None."""
        for mode, reached in enumerate(self.reached):
            for move, where in self._chosen(mode, reached):
                (part,) = move.parts
                found = where & ~part.relation.guard
                if found != self.variables.manager.false:
                    return self.run(found, mode)
        return None

    def endless_run(self) -> tuple[tuple[str, ...], State] | None:
        """Return events that lead to silent steps without an end, and the state in which these begin, or None."""
        false, landed = self.variables.manager.false, self.arrival.endless()
        if landed == false:
            return None
        if self._start & landed != false:
            return (), self.variables.a_state(self._start)
        for mode, reached in enumerate(self.reached):
            for move, where in (*((move, reached) for move in self.moves), *self._chosen(mode, reached)):
                before = where & move.backward(self.variables, landed)
                if before != false:
                    trace, state = self.run(before, mode)
                    here = self.variables.states([state])
                    end = self.variables.a_state(move.forward(self.variables, here) & landed)
                    events = move.events(self.variables, here, self.variables.states([end]))
                    return (*trace, *events), end
        raise AssertionError("silent steps without an end were found without a way to them")

    def _chosen(self, mode: int, positions: Any) -> Iterator[tuple[Move, Any]]:
        """Yield the requests that are chosen in positions of a mode, with the positions in which they are."""
        for number, within in self._approached(mode, positions):
            yield from ((move, within & where) for move, where in self.turns[number].requests)


def _remembered(places: Iterable[Place]) -> Iterator[tuple[Subject, Set[Subject]]]:
    """Yield each place of the memory with what it is made of, of the state."""
    for place in places:
        read = {item for item in subjects_read(place.update) if item.automaton != MEMORY}
        yield Subject(MEMORY, place.name), read
