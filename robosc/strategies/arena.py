"""The game of a controller against its surroundings, on decision diagrams.

A position is a stable state of the controlled system, with the memory as it was observed there. The surroundings move
by batches: events of one message, in source order, with any data that it can hold, and no silent step in between. They
also end goals as cancelled, once the executor may have asked for that. After each move silent steps run to their end in
the executor's order: resets, taus. At its turn the controller issues one enabled request, or none.

The events of one batch carry what one message can hold (`robosc.controller_properties.messages`). Where that would make
too many cases, their data is taken to be independent, so the surroundings can do no less than they really can.
"""

from collections.abc import Collection, Sequence
from typing import Any

import msgspec

from robosc.automata import ExecutableSystem, System
from robosc.automata.goal_memory import Cancel, Obligations
from robosc.controller_properties.messages import MAXIMUM_CASES, PossibleData, choices_together
from robosc.expressions import Expression
from robosc.model.structure import EventKind
from robosc.strategies.memory import ObservedMemory
from robosc.strategies.pairs import MAXIMUM_NODES, Pairs
from robosc.supervisor import AddedCondition
from robosc.synthesis.diagrams import predicate_of
from robosc.synthesis.encoding import Encoding, next_name
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import FixedPoint, Problem, safe_states
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import implies
from robosc.synthesis.transitions import Steps, transition_of

_REMEMBERED = 8
"""Predicates of which it is remembered from where moves lead into them."""


class Happening(msgspec.Struct, frozen=True):
    """An event of a batch, as one message can bring it about.

    Attributes:
        event: The event.
        options: Data that it can carry; None: any.
        may_be_left_out: True if it may as well not happen.
    """

    event: str
    options: tuple[PossibleData, ...] | None
    may_be_left_out: bool


def message_cases(executable: ExecutableSystem, system: System, batch: Sequence[str]) -> list[tuple[Happening, ...]]:
    """Return the moves of the surroundings that are one batch, without those that others contain.

    Args:
        executable: Executable system of the robot.
        system: Its automata, as they are executed.
        batch: Events of one message, in source order.
    """
    messages = {item.event(EventKind.RESPONSE): item for item in executable.model.communications}
    choices = None
    if len(batch) > 1:
        choices = choices_together(executable.model, system, [messages[event] for event in batch])
    if choices is None or len(choices) > MAXIMUM_CASES:
        return [tuple(Happening(event, None, may_be_left_out=True) for event in batch)]
    # Under the setting `on_unknown: keep` an event does not happen whose enum is unknown.
    return [
        tuple(
            Happening(event, tuple(item for item in options if not (keeps and item.is_unknown)), left_out)
            for event, options in zip(batch, choice, strict=True)
            for left_out in [keeps and any(item.may_be_left_out for item in options)]
        )
        for choice in choices
        for keeps in (False, True)
        if not keeps or any(item.may_be_left_out for options in choice for item in options)
    ]


class _Part(msgspec.Struct, frozen=True):
    """An event of a batch, as one message can bring it about.

    Attributes:
        steps: The event with the data that it can carry.
        may_be_left_out: True if it may as well not happen.
    """

    steps: Steps
    may_be_left_out: bool


class ControllerArena:
    """Game on the controlled system under its executor.

    Args:
        executable: Executable system of the robot.
        added: The conditions that synthesis adds.
        owed: Its aims and assumptions, with the memory.
        encoding: Variables of its executed automata with the memory.
        monitor: Monitor of the waiting caller.

    Attributes:
        positions: Stable states that the controlled system can reach, with any memory of which places that exclude each
            other are not true together.
        observed: Those whose memory can be that of the controller at its turn: to observe them again changes nothing.
    """

    def __init__(
        self,
        executable: ExecutableSystem,
        added: Sequence[AddedCondition],
        owed: Obligations,
        encoding: Encoding,
        monitor: ProgressMonitor,
    ) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._monitor = monitor
        encoder = ExpressionEncoder(encoding)
        conditions = {item.event: predicate_of(encoding, item.condition) for item in added}
        self._steps: dict[str, Steps] = {}
        for event in encoding.system.events:
            monitor.check_stop()
            steps = Steps(encoding, transition_of(encoding, event))
            if event.name in conditions:
                steps = steps.under(steps.condition & conditions[event.name])
            self._steps[event.name] = steps
        self._memory = ObservedMemory(encoding, owed)
        self._arrived: list[tuple[Any, Any]] = []
        self._surrounded: list[tuple[Any, Any, Any]] = []
        self._followed: dict[Any, Any] = {}
        reachable = self._reachable()
        self._silent = tuple(self._silent_steps(executable, reachable))
        self._led = tuple(steps.image(first) for first, steps in self._silent)
        """For each silent step the states that it leads to."""
        self._ends_alike = all(steps.is_deterministic for _, steps in self._silent)
        self._stable = reachable & ~encoding.any_of(first for first, _ in self._silent)
        """Stable states, with any memory."""
        self.positions = self._stable & self._memory.possible
        self.observed = self.positions
        for place in owed.places:
            before, after = encoder.holds(place.read), encoder.holds(place.update)
            self.observed = self.observed & ((before & after) | (~before & ~after))
        self._cases = tuple(
            tuple(part for part in case if part.steps.plant & reachable != self._manager.false)
            for case in (
                *(case for batch in executable.batches for case in self._cases_of(executable, batch)),
                *(self._ending_as_cancelled(item, encoder) for item in owed.cancels),
            )
        )
        """Moves of the surroundings: for each, the events of one message, with data that it can hold."""
        self.requests = tuple(event for event in executable.requests if event in self._steps)
        """Events of requests, in source order."""
        self._possible = {event: self._stable & self._enabled(event) for event in self.requests}
        # Moves without pairs are looked at event by event.
        self._next = self._next_variables()
        self._observed_next = self._memory.updates_of(self._next)
        self._turns: dict[str, Pairs] = {}
        self._turn, self._batches = Pairs(self._manager, self._next), Pairs(self._manager, self._next)
        self._other_cases, self._ending_batches = self._cases, self.positions
        if self._next and self._ends_alike:
            self._pair()

    def _next_variables(self) -> dict[str, str]:
        """Return the variables that events change with their next-state variables; none if one has none."""
        changed = {name for steps in self._steps.values() for name in steps.changed}
        found = {name: next_name(name) for name in self._encoding.state_names if name in changed}
        return found if found.keys() and set(self._encoding.order).issuperset(found.values()) else {}

    def _pair(self) -> None:
        """Look at moves as pairs, as far as these have small diagrams."""
        pairs = self._manager.true
        for name, new in reversed(self._next.items()):
            before, after = self._manager.var(name), self._manager.var(new)
            pairs = pairs & self._manager.ite(before, after, ~after)
        ending = self._ending(self._stable & pairs)
        if ending.dag_size > MAXIMUM_NODES:
            return
        for event in self.requests:
            steps, turn = self._steps[event], Pairs(self._manager, self._next)
            # Requests whose data decides where they lead must lead into a predicate with all data: pairs do not tell.
            if steps.is_deterministic and turn.add(self._possible[event] & steps.some(ending)):
                self._turns[event] = turn
                self._turn.join(turn)
        unending = ~self._ending(self._stable)
        other_cases = []
        for case in self._cases:
            if self._batches.add(self._stable & self._leading(case, ending)):
                # Silent steps that never end lead nowhere.
                self._ending_batches = self._ending_batches & ~self._leading(case, unending)
            else:
                other_cases.append(case)
        self._other_cases = tuple(other_cases)

    def _cases_of(self, executable: ExecutableSystem, batch: tuple[str, ...]) -> list[tuple[_Part, ...]]:
        """Return the cases of a batch, without those that others contain."""
        return [
            tuple(
                _Part(
                    self._steps[item.event] if item.options is None else self._carrying(item.event, item.options),
                    item.may_be_left_out,
                )
                for item in case
            )
            for case in message_cases(executable, self._encoding.system, batch)
        ]

    def _ending_as_cancelled(self, cancel: Cancel, encoder: ExpressionEncoder) -> tuple[_Part, ...]:
        """Return the case that a goal ends as cancelled."""
        steps = self._steps[cancel.event]
        return (_Part(steps.carrying(steps.condition & encoder.holds(cancel.may_end)), may_be_left_out=False),)

    def _carrying(self, event: str, options: Sequence[PossibleData]) -> Steps:
        """Return the steps of an event with some data."""
        inputs = self._encoding.inputs_of(event)
        data = self._manager.false
        for option in options:
            found = self._manager.true
            for path, value in option.data:
                bits = inputs[path]
                if bits.known is not None:
                    known = self._manager.var(bits.known)
                    found = found & (~known if value is None else known)
                if value is not None:
                    found = found & self._encoding.equals(bits, value)
            data = data | found
        return self._steps[event].carrying(data)

    def _reachable(self) -> Any:
        """Return the states that the controlled system can reach, with any memory."""
        problem = Problem(tuple(self._steps.values()), safe_states(self._encoding, ()))
        states = FixedPoint(self._encoding, self._monitor).reachable_states(problem, self._manager.true)
        return self._memory.forgetting(states, self._memory.updates)

    def _enabled(self, event: str) -> Any:
        steps = self._steps[event]
        return steps.plant & steps.condition

    def _silent_steps(self, executable: ExecutableSystem, reachable: Any) -> Any:
        """Yield the silent steps in the executor's order, each with the states in which it is the next one."""
        left = reachable
        for event in executable.resets_and_taus:
            if event not in self._steps:
                continue
            # A reset or tau that would change nothing is not taken.
            here = left & self._steps[event].moving() & self._enabled(event)
            if here != self._manager.false:
                yield here, self._steps[event]
                left = left & ~here

    def condition(self, expression: Expression) -> Any:
        """Return the predicate that a condition over the state and the memory is true."""
        return ExpressionEncoder(self._encoding).holds(expression)

    def arriving(self, predicate: Any) -> Any:
        """Return the states from which silent steps end in a stable state that, once observed, is in a predicate."""
        for number, (other, arrived) in enumerate(self._arrived):
            if other == predicate:
                self._arrived.append(self._arrived.pop(number))
                return arrived
        found = None
        for other, arrived in reversed(self._arrived):
            # Steps that may lead into a union may lead into one of its parts, and the other way round.
            if implies(self._manager, other, predicate):
                found = arrived | self._newly_arriving(predicate & ~other)
                break
            if self._ends_alike and implies(self._manager, predicate, other):
                found = arrived & ~self._newly_arriving(other & ~predicate)
                break
        if found is None:
            found = self._newly_arriving(predicate)
        self._arrived.append((predicate, found))
        del self._arrived[:-_REMEMBERED]
        return found

    def _newly_arriving(self, predicate: Any) -> Any:
        return self._ending(self.positions & self._memory.before(predicate))

    def _ending(self, stable: Any) -> Any:
        """Return the states from which silent steps end in some stable states."""
        found = fresh = stable
        while fresh != self._manager.false:
            before = self._manager.false
            for (first, steps), led in zip(self._silent, self._led, strict=True):
                self._monitor.check_stop()
                within = fresh & led
                if within != self._manager.false:
                    before = before | (first & steps.some(within))
            fresh = before & ~found
            found = found | fresh
        return found

    def _following(self, predicate: Any) -> Any:
        """Return the stable states that, once observed, are in a predicate, in next-state variables."""
        found = self._followed.pop(predicate, None)
        if found is None:
            found = self._manager.let(self._observed_next, predicate)
        self._followed[predicate] = found
        if len(self._followed) > _REMEMBERED:
            del self._followed[next(iter(self._followed))]
        return found

    def _leading(self, case: Sequence[_Part], states: Any) -> Any:
        """Return the states from which a batch can lead into some states, before silent steps."""
        for part in reversed(case):
            self._monitor.check_stop()
            before = part.steps.some(states)
            # An event that cannot happen here changes nothing.
            states = before | (states if part.may_be_left_out else states & ~part.steps.sources)
        return states

    def surroundings(self, predicate: Any) -> Any:
        """Return the positions from which every batch leads into a predicate."""
        self._monitor.check_stop()
        found = self._ending_batches
        if self._batches:
            found = found & ~self._batches.into(~self._following(predicate))
        return found & self._otherwise_surrounded(predicate) if self._other_cases else found

    def _otherwise_surrounded(self, predicate: Any) -> Any:
        """Return the positions from which the batches without pairs lead into a predicate."""
        arriving = self.arriving(predicate)
        found, bad = self.positions, ~arriving
        for number in reversed(range(len(self._surrounded))):
            wider, arrived, inside = self._surrounded[number]
            if implies(self._manager, predicate, wider):
                # The rest of what leads out of the predicate leads out of the wider one, too.
                self._surrounded.append(self._surrounded.pop(number))
                found, bad = inside, arrived & ~arriving
                break
        for case in self._other_cases:
            found = found & ~self._leading(case, bad)
        self._surrounded.append((predicate, arriving, found))
        del self._surrounded[:-_REMEMBERED]
        return found

    def turn(self, predicate: Any) -> Any:
        """Return the positions in which the controller can wait in a predicate, or issue a request that leads there."""
        self._monitor.check_stop()
        found = predicate & self.positions
        if self._turn:
            found = found | (self.positions & self._turn.into(self._following(predicate)))
        for event in self.requests:
            if event not in self._turns:
                found = found | self.choice(event, predicate)
        return found

    def choice(self, event: str, predicate: Any) -> Any:
        """Return the positions in which a request is enabled and leads into a predicate."""
        self._monitor.check_stop()
        if event in self._turns:
            return self.positions & self._turns[event].into(self._following(predicate))
        steps = self._steps[event]
        arriving = self.arriving(predicate)
        found = self.positions & self._possible[event] & steps.some(arriving)
        return found if steps.is_deterministic else found & steps.only(arriving)

    def together(self, predicate: Any) -> Any:
        """Return the positions from which a move of either side can lead into a predicate."""
        return self.turn(predicate) | self.responses(predicate)

    def responses(self, predicate: Any) -> Any:
        """Return the positions from which a move of the surroundings can lead into a predicate."""
        self._monitor.check_stop()
        found = self._manager.false
        if self._batches:
            found = self._batches.into(self._following(predicate))
        if self._other_cases:
            arriving = self.arriving(predicate)
            for case in self._other_cases:
                found = found | self._leading(case, arriving)
        return self.positions & found

    def whatever_was(self, condition: Any) -> Any:
        """Return the states in which a condition is true once they are observed, whatever was remembered before."""
        return ~self._memory.forgetting(~self._memory.before(condition), self._memory.updates)

    def behaviours(self, predicate: Any) -> Any:
        """Return the states from which the behaviours alone, without requirements, have an event into a predicate."""
        found = self._manager.false
        for steps in self._steps.values():
            self._monitor.check_stop()
            found = found | (steps.plant & steps.some(predicate))
        return found

    def reachable_positions(self) -> Any:
        """Return the positions that moves of both sides can lead to, each with the memory that it can have there.

        Of each mission and each detour, the memory is exact; where their stages are very many together, combinations of
        them may be among the positions that no run has.
        """
        found = self.positions
        for forgotten in self._memory.apart():
            found = found & self._reachable_without(forgotten)
        return found

    def _reachable_without(self, forgotten: Collection[str]) -> Any:
        """Return the stable states that can be reached, as they are observed, with any value of some of the memory."""
        start = self._memory.forgetting(self._settled(self.start), forgotten)
        found = fresh = self._memory.after(start, forgotten)
        while fresh != self._manager.false:
            self._monitor.check_stop()
            fresh = self._memory.after(self._ends(fresh), forgotten) & ~found
            found = found | fresh
        return found

    def unobserved(self, reachable: Any) -> Any:
        """Return the stable states that the executor begins in and that moves lead to, with the memory before.

        Args:
            reachable: The positions in which moves begin.
        """
        return self._settled(self.start) | self._ends(reachable)

    def _ends(self, positions: Any) -> Any:
        """Return the stable states in which moves from positions end, with the memory before."""
        following = found = self._manager.false
        for event in self.requests:
            if event not in self._turns:
                following = following | self._steps[event].image(positions & self._enabled(event))
        for case in self._other_cases:
            inside = positions
            for part in case:
                stays = inside if part.may_be_left_out else inside & ~part.steps.sources
                inside = stays | part.steps.image(inside)
            following = following | inside
        for pairs in (self._turn, self._batches):
            found = found | pairs.ends(positions)
        return found | self._settled(following)

    def _settled(self, states: Any) -> Any:
        """Return the stable states in which silent steps from states end."""
        found, left = states & self._stable, states & ~self._stable
        seen = left
        while left != self._manager.false:
            self._monitor.check_stop()
            after = self._manager.false
            for first, steps in self._silent:
                after = after | steps.image(left & first)
            found = found | (after & self._stable)
            left = after & ~self._stable & ~seen
            seen = seen | left
        return found

    def can_begin(self, predicate: Any) -> bool:
        """Return True if the first position of the executor is in a predicate, wherever the system begins."""
        return bool(self.start & ~self.arriving(predicate) == self._manager.false)

    @property
    def start(self) -> Any:
        """The initial states; they may not be stable."""
        return FixedPoint(self._encoding, self._monitor).initial
