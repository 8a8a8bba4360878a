"""The game of a controller against its surroundings, on decision diagrams.

A position is a stable state of the controlled system, with the memory as it was observed there. The surroundings move
by batches (semantics 3.1): any of a batch's events may happen, in source order, with any data, and no silent step in
between. After a batch and after each request silent steps run to their end in the executor's order: own cancels,
resets, taus (semantics 3.3). At its turn the controller issues one enabled request, or none.

What the events of one batch carry is taken to be independent here, so the surroundings can do no less than they really
can.
"""

from collections.abc import Sequence
from typing import Any

from robosc.automata import ExecutableSystem
from robosc.automata.goal_memory import MEMORY, Cancel, Obligations
from robosc.automata.state import Subject
from robosc.expressions import Expression
from robosc.supervisor import AddedCondition
from robosc.synthesis.diagrams import predicate_of
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import FixedPoint, Problem, safe_states
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.transitions import Steps, transition_of


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
        self._observed = {
            encoding.subjects[Subject(MEMORY, place.name)].names[0]: encoder.holds(place.update)
            for place in owed.places
        }
        self._arrived: tuple[Any, Any] | None = None
        reachable = self._reachable()
        self._silent = tuple(self._silent_steps(executable, owed.cancels, encoder, reachable))
        self.positions = reachable & ~encoding.any_of(first for first, _ in self._silent)
        for group in owed.exclusive:
            self.positions = self.positions & self._at_most_one([encoder.holds(place.read) for place in group])
        self.observed = self.positions
        for place in owed.places:
            before, after = encoder.holds(place.read), encoder.holds(place.update)
            self.observed = self.observed & ((before & after) | (~before & ~after))
        self._batches = tuple(
            tuple(self._steps[event] for event in batch if self._steps[event].plant & reachable != self._manager.false)
            for batch in executable.batches
        )
        self.requests = tuple(event for event in executable.requests if event in self._steps)
        """Events of requests, in source order."""

    def _reachable(self) -> Any:
        """Return the states that the controlled system can reach, with any memory."""
        problem = Problem(tuple(self._steps.values()), safe_states(self._encoding, ()))
        states = FixedPoint(self._encoding, self._monitor).reachable_states(problem, self._manager.true)
        return self._manager.exist(self._observed, states) if self._observed else states

    def _at_most_one(self, predicates: Sequence[Any]) -> Any:
        none, one = self._manager.true, self._manager.false
        for item in predicates:
            none, one = none & ~item, (one & ~item) | (none & item)
        return none | one

    def _enabled(self, event: str) -> Any:
        steps = self._steps[event]
        return steps.plant & steps.condition

    def _silent_steps(
        self, executable: ExecutableSystem, cancels: Sequence[Cancel], encoder: ExpressionEncoder, reachable: Any
    ) -> Any:
        """Yield the silent steps in the executor's order, each with the states in which it is the next one."""
        left = reachable
        due = [(item.event, encoder.holds(item.is_due)) for item in cancels]
        # A reset or tau that would change nothing is not taken.
        due += [(event, self._steps[event].moving()) for event in executable.resets_and_taus if event in self._steps]
        for event, condition in due:
            here = left & condition & self._enabled(event)
            if here != self._manager.false:
                yield here, self._steps[event]
                left = left & ~here

    def condition(self, expression: Expression) -> Any:
        """Return the predicate that a condition over the state and the memory is true."""
        return ExpressionEncoder(self._encoding).holds(expression)

    def arriving(self, predicate: Any) -> Any:
        """Return the states from which silent steps end in a stable state that, once observed, is in a predicate."""
        if self._arrived is not None and self._arrived[0] == predicate:
            return self._arrived[1]
        observed = self._manager.let(self._observed, predicate) if self._observed else predicate
        found = self.positions & observed
        while True:
            wider = found
            for first, steps in self._silent:
                self._monitor.check_stop()
                wider = wider | (first & steps.some(wider))
            if wider == found:
                self._arrived = predicate, found
                return found
            found = wider

    def surroundings(self, predicate: Any) -> Any:
        """Return the positions from which every batch leads into a predicate."""
        arriving = self.arriving(predicate)
        found = self.positions
        for batch in self._batches:
            inside = arriving
            for steps in reversed(batch):
                self._monitor.check_stop()
                inside = inside & steps.only(inside)
            found = found & inside
        return found

    def turn(self, predicate: Any) -> Any:
        """Return the positions in which the controller can wait in a predicate, or issue a request that leads there."""
        found = predicate & self.positions
        for event in self.requests:
            found = found | self.choice(event, predicate)
        return found

    def choice(self, event: str, predicate: Any) -> Any:
        """Return the positions in which a request is enabled and leads into a predicate."""
        self._monitor.check_stop()
        steps = self._steps[event]
        arriving = self.arriving(predicate)
        found = self.positions & self._enabled(event) & steps.some(arriving)
        return found if steps.is_deterministic else found & steps.only(arriving)

    def together(self, predicate: Any) -> Any:
        """Return the positions from which a move of either side can lead into a predicate."""
        arriving = self.arriving(predicate)
        found = self.turn(predicate)
        for batch in self._batches:
            inside = arriving
            for steps in reversed(batch):
                self._monitor.check_stop()
                inside = inside | steps.some(inside)
            found = found | (self.positions & inside)
        return found

    def whatever_was(self, condition: Any) -> Any:
        """Return the states in which a condition is true once they are observed, whatever was remembered before."""
        if not self._observed:
            return condition
        return ~self._manager.exist(self._observed, ~self._manager.let(self._observed, condition))

    def behaviours(self, predicate: Any) -> Any:
        """Return the states from which the behaviours alone, without requirements, have an event into a predicate."""
        found = self._manager.false
        for steps in self._steps.values():
            self._monitor.check_stop()
            found = found | (steps.plant & steps.some(predicate))
        return found

    def can_begin(self, predicate: Any) -> bool:
        """Return True if the first position of the executor is in a predicate, wherever the system begins."""
        return bool(self.start & ~self.arriving(predicate) == self._manager.false)

    @property
    def start(self) -> Any:
        """The initial states; they may not be stable."""
        return FixedPoint(self._encoding, self._monitor).initial
