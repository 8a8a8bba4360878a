"""Answers to questions about the controlled system, computed on predicates instead of single states."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.errors import InternalError
from robosc.expressions import Expression
from robosc.synthesis.causes import Causes
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import FixedPoint, Problem, SolvedProblem, allowed, initial_states
from robosc.synthesis.questions import Answers, EnabledTogether, NeverEnabled, Questions, Restriction, Unprompted
from robosc.synthesis.runs import ShortestRuns, SystemRun
from robosc.synthesis.transitions import Steps

MAXIMUM_TOGETHER = 100
"""Pairs of rivals that are reported: a hundred requests on one identifier make thousands that say nothing new."""

MAXIMUM_EFFORT = 300_000
"""Nodes of the searches for loops together, counted once for each event: a third of a second with the faster engine."""


@dataclass(eq=False)
class ControlledSystem(SolvedProblem):
    """The system under its supervisor."""

    def __post_init__(self) -> None:
        self._manager = self.encoding.manager
        self._encoder = ExpressionEncoder(self.encoding)
        self._steps = {steps.event.name: steps for steps in self.problem.steps}
        self._causes = Causes(self.encoding, self.monitor, self.problem, self.good, self.reachable)
        self._fixed_point = FixedPoint(self.encoding, self.monitor)
        self._known: dict[str, Any] = {}
        self._held: dict[int, Any] = {}
        """Predicates of the system's own conditions, by their identity: they stay as long as the system does."""
        self._effort = 0

    def answers(self, questions: Questions) -> Answers:
        """The answers to some questions.

        Raises:
            SynthesisCancelled: The work is to end.
            KeyError: A question names an event or a location that there is not.
        """
        return Answers(
            never=tuple(self._never(questions.events)),
            unused=self._unused(questions.restrictions),
            together=self._together(questions.rivals),
            unreached=tuple(self._unreached(questions.locations)),
            unprompted=tuple(self._unprompted(questions)),
        )

    def _possible(self, event: str) -> Any:
        """The states of the controlled system in which an event can happen."""
        found = self._known.get(event)
        if found is None:
            self.monitor.check_stop()
            steps = self._steps[event]
            found = self._known[event] = self.reachable & steps.plant & allowed(steps, self.good)
        return found

    def _never(self, events: Iterable[str]) -> Iterator[NeverEnabled]:
        for event in events:
            if self._possible(event) == self._manager.false:
                yield self._causes.of(self._steps[event])

    def _unreached(self, locations: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
        for automaton, location in locations:
            self.monitor.check_stop()
            if self.reachable & self.encoding.in_location(automaton, location) == self._manager.false:
                yield automaton, location

    # Restrictions

    def _unused(self, restrictions: Sequence[Restriction]) -> tuple[int, ...]:
        """Those that forbid nothing in any state of the controlled system, nor anywhere that synthesis looks ahead to.

        What a restriction forbids in states beyond can make these states bad, so that synthesis keeps away from
        them: then the system would do more without it, although it never shows itself. All that are named can go
        together; of two that could stand in for each other the later one is named.
        """
        candidates = tuple(place for place, item in enumerate(restrictions) if not self._restricts(item))
        if not self._supervisor_disables():
            # The reachable states are those that plants and conditions allow, and no others.
            return candidates
        found = self._removable(restrictions, [item for item in candidates if not restrictions[item].invariants], [])
        for place in reversed(candidates):
            # Invariants always are candidates, but mostly needed: to try several at once would be in vain.
            if restrictions[place].invariants:
                found = self._removable(restrictions, [place], found)
        return tuple(sorted(found))

    def _restricts(self, restriction: Restriction) -> bool:
        """Return True if, in a controlled system state, the plant enables an event and a condition is not true."""
        condition, broken = None, self._manager.false
        conditions = self.encoding.system.conditions
        for item in (*(conditions[place] for place in restriction.conditions), *restriction.watched):
            # A requirement is mostly one condition on many events.
            if item.condition is not condition:
                condition, broken = item.condition, self.reachable & ~self._holds(item.condition)
            if broken & self._steps[item.event].plant != self._manager.false:
                return True
        return False

    def _holds(self, condition: Expression) -> Any:
        self.monitor.check_stop()
        found = self._held.get(id(condition))
        if found is None:
            found = self._held[id(condition)] = self._encoder.holds(condition)
        return found

    def _supervisor_disables(self) -> bool:
        return any(
            self.reachable & steps.plant & steps.condition & ~self._possible(name) != self._manager.false
            for name, steps in self._steps.items()
            if steps.event.is_controllable
        )

    def _removable(self, restrictions: Sequence[Restriction], more: list[int], removed: list[int]) -> list[int]:
        """Return the restrictions that can be removed without any change to the controlled system.

        They are those that are removed already, and of `more` those that can go beside them, later ones first. Where
        all of them can go together, each can: the less is forbidden, the more is allowed. Else they are tried by
        halves.
        """
        if not more or self._is_the_same_without([restrictions[place] for place in (*removed, *more)]):
            return [*removed, *more]
        middle = len(more) // 2
        if middle == 0:
            return removed
        return self._removable(restrictions, more[:middle], self._removable(restrictions, more[middle:], removed))

    def _is_the_same_without(self, restrictions: Sequence[Restriction]) -> bool:
        """Return True if the controlled system of the problem without some restrictions allows nothing more."""
        problem = self._without(restrictions)
        good = self._fixed_point.solution_of_less(problem, self.good)
        if good.states == self.good:
            changed = [steps for steps in problem.steps if steps is not self._steps[steps.event.name]]
        else:
            # An event that changes what they read is the likeliest to be allowed where it was not.
            read = self._read(restrictions)
            changed = sorted(problem.steps, key=lambda steps: -len(read.intersection(steps.changed)))
        return all(
            self.reachable & steps.plant & allowed(steps, good.states) == self._possible(steps.event.name)
            for steps in changed
        )

    def _read(self, restrictions: Sequence[Restriction]) -> set[str]:
        """The variables that restrictions read."""
        system = self.encoding.system
        conditions = [system.conditions[place].condition for item in restrictions for place in item.conditions]
        invariants = [system.invariants[place] for item in restrictions for place in item.invariants]
        return set().union(*(self._manager.support(self._holds(item)) for item in (*conditions, *invariants)))

    def _without(self, restrictions: Sequence[Restriction]) -> Problem:
        """The problem without some restrictions; what they are watched for stays as it is."""
        system = self.encoding.system
        dropped = {place for item in restrictions for place in item.conditions}
        touched = {system.conditions[place].event for place in dropped}
        left = [item for place, item in enumerate(system.conditions) if place not in dropped]

        def under_what_is_left(steps: Steps) -> Steps:
            conditions = [item.condition for item in left if item.event == steps.event.name]
            return steps.under(self.encoding.all_of(self._holds(condition) for condition in conditions))

        steps = tuple(
            under_what_is_left(steps) if steps.event.name in touched else steps for steps in self.problem.steps
        )
        dropped = {place for item in restrictions for place in item.invariants}
        if not dropped:
            return Problem(steps, self.problem.safe)
        left_over = (self._holds(item) for place, item in enumerate(system.invariants) if place not in dropped)
        return Problem(steps, self.encoding.all_of([self.encoding.valid_states(), *left_over]))

    # Prompts

    def _unprompted(self, questions: Questions) -> Iterator[Unprompted]:
        """Those of some events that can happen again and again while no prompt does.

        A loop that was reported names the events that are in it. Beyond `MAXIMUM_EFFORT` none is reported any more.

        Silent events go before all others wherever they change anything.
        """
        if not questions.prompted:
            return
        executed = self._executed(questions.silent)
        inside = [steps for steps in self.problem.steps if steps.event.name not in questions.prompts]
        runs = self._runs_from(self._start, self.problem.steps, executed)
        reported: set[str] = set()
        for event in questions.prompted:
            steps = self._steps[event]
            start = executed[event] & steps.moving() if event in questions.changing else executed[event]
            states = self._again(steps, inside, executed, start) if event not in reported else self._manager.false
            run = runs.run_to(states) if states != self._manager.false else None
            if run is None:
                continue
            state, loop = self._loop(steps, inside, executed, states, run)
            reported.update(loop)
            yield Unprompted(event, runs.trace_to(state), loop)

    def _executed(self, silent: Sequence[str]) -> dict[str, Any]:
        """Return for each event the states in which an executor may take it: silent events go first."""
        possible = {name: self.reachable & allowed(steps, self.good) for name, steps in self._steps.items()}
        first = {name: self._possible(name) & self._steps[name].moving() for name in silent}
        stable = ~self.encoding.any_of(first.values())
        return {name: first[name] if name in first else states & stable for name, states in possible.items()}

    def _again(self, steps: Steps, inside: Sequence[Steps], executed: Mapping[str, Any], start: Any) -> Any:
        """Return the states, of some in which an event can happen, where it can again and again, by some events alone.

        Source: E. A. Emerson and C.-L. Lei, "Efficient model checking in fragments of the propositional mu-calculus",
        LICS 1986, pp. 267-278: the largest set from which the event leads to where the set can be reached.
        """
        found, narrowed = self._manager.true, start
        while narrowed != found:
            found = leading = narrowed
            wider = self._manager.true
            while wider != leading:
                wider = leading
                self._effort += leading.dag_size * len(inside)
                if self._effort > MAXIMUM_EFFORT:
                    return self._manager.false
                for other in inside:
                    self.monitor.check_stop()
                    leading = leading | (executed[other.event.name] & other.some(leading))
            narrowed = found & steps.some(leading)
        return found

    def _loop(
        self, steps: Steps, inside: Sequence[Steps], executed: Mapping[str, Any], states: Any, run: SystemRun
    ) -> tuple[Any, tuple[str, ...]]:
        """Return a state from which an event, and some that follow it, lead back to it; and these events.

        Where nothing leads back, a state further on is tried; there is no way back from that one, so it ends.

        Args:
            steps: The event.
            inside: The events that may follow it.
            executed: The states in which each event may be taken.
            states: States that `_again` has found for them.
            run: A run to one of these.
        """
        further: SystemRun | None = run
        while further is not None:
            state = self.encoding.state(further.states[-1])
            runs = self._runs_from(steps.image(state), inside, executed)
            back = runs.run_to(state)
            if back is not None:
                return state, (steps.event.name, *back.events)
            further = runs.run_to(states)
        raise InternalError("from a state of a loop there is no way on to a state of one")

    # Rivals

    def _together(self, groups: Iterable[Sequence[str]]) -> tuple[EnabledTogether, ...]:
        pairs = list(self._pairs(groups))
        if not pairs:
            return ()
        possible = {name: self.reachable & allowed(steps, self.good) for name, steps in self._steps.items()}
        runs = self._runs_from(self._start, self.problem.steps, possible)
        return tuple(EnabledTogether(first, second, runs.trace_to(states)) for first, second, states in pairs)

    @property
    def _start(self) -> Any:
        """The initial states in which the supervisor lets the system begin."""
        return initial_states(self.encoding) & self.good

    def _runs_from(self, start: Any, events: Sequence[Steps], possible: Mapping[str, Any]) -> ShortestRuns:
        return ShortestRuns(self.encoding, self.monitor, events, possible, start)

    def _pairs(self, groups: Iterable[Sequence[str]]) -> Iterator[tuple[str, str, Any]]:
        """Rivals that are possible together, and where: the first `MAXIMUM_TOGETHER` of them."""
        count = 0
        for group in groups:
            earlier = self._manager.false
            for number, second in enumerate(group):
                here = self._possible(second)
                # One test of all earlier events first: in most groups no two events are ever possible together.
                rivals = group[:number] if here & earlier != self._manager.false else ()
                for first in rivals:
                    both = here & self._possible(first)
                    if both != self._manager.false:
                        yield first, second, both
                        count += 1
                        if count == MAXIMUM_TOGETHER:
                            return
                earlier = earlier | here
