"""The controlled system as a Kripke structure of predicates: its states, its steps, and the states of a predicate.

Every event of the controlled system is a step. A state without events has itself as its only successor, because every
state of a Kripke structure needs one: its runs stay there for ever. Spin does the same when it lets a finished run
stutter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import starmap
from typing import Any

from robosc.automata.structure import System
from robosc.expressions import Value
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.synthesis.closure import closure_under
from robosc.synthesis.encoding import Bits, Encoding
from robosc.synthesis.fixed_point import initial_states
from robosc.synthesis.runs import decoded, one_of
from robosc.synthesis.step import Step
from robosc.synthesis.transitions import Steps, transition_of
from robosc.synthesis.workspace import Workspace


@dataclass(frozen=True, slots=True)
class Move:
    """A way on from some states.

    Attributes:
        event: The event, or None where nothing happens any more.
        image: The states that it leads to from a set of states.
        sources: The states of the structure from which it can lead into a set of states.
    """

    event: str | None
    image: Callable[[Any], Any]
    sources: Callable[[Any], Any]


class KripkeStructure:
    """The reachable states of a controlled system and the moves between them.

    Args:
        system: Plants and event conditions.
        place: Workspace in which it is encoded.
        added: Conditions that the supervisor adds.

    Attributes:
        manager: The manager of all predicates.
        initial: The initial states.
        states: Every state.
        moves: Every way on, in the system's order of events; last the one of states without events.
    """

    def __init__(self, system: System, place: Workspace, added: Sequence[AddedCondition]) -> None:
        encoding, monitor = place.encoding, place.monitor
        self.encoding = encoding
        self.manager = encoding.manager
        self.monitor = monitor
        self.initial = initial_states(encoding)
        conditions = {item.event: item.condition for item in added}
        steps: list[tuple[Steps, Any]] = []
        for event in system.events:
            monitor.check_stop()
            found = Steps(encoding, transition_of(encoding, event))
            allowed = found.plant & found.condition if event.is_controllable else self.manager.true
            if event.name in conditions:
                allowed = allowed & diagram_predicate(encoding, conditions[event.name])
            steps.append((found, allowed))
            monitor.report("encoding", len(steps), found.plant)
        with place.reordering():
            closure = closure_under(encoding, starmap(self._onwards, steps), self.manager.true, monitor)
            self.states = closure.of(self.initial, "reachability")
        self._backwards = tuple(starmap(self._towards, steps))
        moves = [self._move(found, self.states & allowed) for found, allowed in steps]
        self._enabled = {str(move.event): move.sources(self.manager.true) for move in moves}
        # No closure over the structure itself: the cycle could let the manager go before its predicates.
        ends = self.states & ~encoding.any_of(self._enabled.values())
        end = Move(None, lambda states: states & ends, lambda states: states & ends)
        self.moves = (*moves, end)

    def _onwards(self, steps: Steps, allowed: Any) -> Step:
        return Step(steps.forwards(allowed), self._names(steps, allowed))

    def _towards(self, steps: Steps, allowed: Any) -> Step:
        return Step(steps.backwards(allowed), self._names(steps, allowed))

    def _names(self, steps: Steps, allowed: Any) -> frozenset[str]:
        return steps.names | self.manager.support(allowed)

    def leading_to(self, goal: Any, through: Any, until: Any = None) -> Any:
        """Return a goal, and the states from which runs through some states lead to it.

        Args:
            goal: States in which the runs end.
            through: States in which they may be before.
            until: States once all of which are found the rest is not; None to find everything.
        """
        closure = closure_under(self.encoding, self._backwards, goal | (through & self.states), self.monitor)
        return closure.of(goal, "states that lead there", until)

    def _move(self, steps: Steps, allowed: Any) -> Move:
        return Move(
            steps.event.name,
            steps.forwards(allowed),
            steps.backwards(allowed),
        )

    def enabled(self, event: str) -> Any:
        """The states in which an event can happen."""
        return self._enabled[event]

    def lasting(self, states: Any, step: Callable[[Any], Any], phase: str) -> Any:
        """The greatest set within `states` that lies in what `step` makes of it.

        Args:
            states: States to begin with.
            step: Such as `before` or `after`.
            phase: Name of the work, for its progress.
        """
        rounds = 0
        while True:
            kept = states & step(states)
            rounds += 1
            self.monitor.report(phase, rounds, kept)
            if kept == states:
                return kept
            states = kept

    def before(self, states: Any) -> Any:
        """The states that some move leads into `states` from."""
        found = self.manager.false
        for move in self.moves:
            self.monitor.check_stop()
            found = found | move.sources(states)
        return found

    def after(self, states: Any) -> Any:
        """The states that some move leads to from `states`."""
        found = self.manager.false
        for move in self.moves:
            self.monitor.check_stop()
            found = found | move.image(states)
        return found

    def one(self, states: Any) -> Any:
        """One of some states, as a predicate: the one whose bits read as the lowest number, whatever the engine."""
        return one_of(self.encoding, states)[0]

    def values(self, state: Any) -> tuple[Value, ...]:
        """The state that is alone in a predicate, as a tuple in the order of `subjects`."""
        return decoded(self.encoding, state)


def diagram_predicate(encoding: Encoding, diagram: DecisionDiagram) -> Any:
    """Return the predicate that is true where a decision diagram over locations and variables is true."""
    manager = encoding.manager
    by_name = {(subject.automaton, subject.variable): bits for subject, bits in encoding.subjects.items()}
    built = [manager.false, manager.true]
    for node in diagram.nodes:
        bits = by_name[node.automaton, node.variable]
        found = built[node.children[0]]
        for start, child in zip(node.starts[1:], node.children[1:], strict=True):
            found = manager.ite(_at_least(manager, bits, start), built[child], found)
        built.append(found)
    return built[diagram.root]


def _at_least(manager: Any, bits: Bits, index: int) -> Any:
    """Return the predicate that is true where the index encoded by some bits is not below `index`."""
    found = manager.true
    for place, name in enumerate(reversed(bits.names)):
        variable = manager.var(name)
        has_bit = (index >> place) & 1
        found = manager.ite(variable, found, manager.false) if has_bit else manager.ite(variable, manager.true, found)
    return found
