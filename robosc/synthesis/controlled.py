"""Answers to questions about the controlled system, computed on predicates instead of single states."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.errors import InternalError
from robosc.synthesis.causes import Causes
from robosc.synthesis.conjuncts import MAXIMUM_NODES, Conjuncts
from robosc.synthesis.fixed_point import SolvedProblem, initial_states
from robosc.synthesis.nodes import meets
from robosc.synthesis.questions import Answers, EnabledTogether, NeverEnabled, Questions, Unprompted
from robosc.synthesis.restrictions import UnusedRestrictions
from robosc.synthesis.runs import ShortestRuns, SystemRun
from robosc.synthesis.transitions import Steps

MAXIMUM_TOGETHER = 100
"""Pairs of rivals that are reported: a hundred requests on one identifier make thousands that say nothing new."""

MAXIMUM_EFFORT = 300_000
"""Nodes of the searches for loops together, counted once for each event: a third of a second with the faster engine."""


@dataclass(eq=False)
class ControlledSystem(SolvedProblem):
    """The system under its supervisor.

    Attributes:
        conjuncts: Conjuncts of its good states.
    """

    def __post_init__(self) -> None:
        self._manager = self.encoding.manager
        self._steps = {steps.event.name: steps for steps in self.problem.steps}
        self._causes = Causes(self.encoding, self.monitor, self.problem, self.good, self.reachable)
        self.conjuncts = Conjuncts(self)
        self._effort = 0

    def answers(self, questions: Questions) -> Answers:
        """The answers to some questions.

        Raises:
            SynthesisCancelled: The work is to end.
            KeyError: A question names an event or a location that there is not.
        """
        return Answers(
            never=tuple(self._never(questions.events)),
            unused=UnusedRestrictions(self, self.conjuncts).among(questions.restrictions),
            together=self._together(questions.rivals),
            unreached=tuple(self._unreached(questions.locations)),
            unprompted=tuple(self._unprompted(questions)),
        )

    def _possible(self, event: str) -> Any:
        """A predicate that is true of those states of the controlled system in which an event can happen."""
        self.monitor.check_stop()
        return self.conjuncts.possible(self._steps[event])

    def is_disabled(self, steps: Steps) -> bool:
        """Return True if the supervisor disables an event in some state where its plants and conditions allow it."""
        if not steps.event.is_controllable:
            return False
        return self._is_reached(steps.plant & steps.condition & ~self.conjuncts.only(steps))

    def _is_reached(self, states: Any) -> bool:
        self.monitor.check_stop()
        return meets(self._manager, self.reachable, states)

    def _never(self, events: Iterable[str]) -> Iterator[NeverEnabled]:
        for event in events:
            if not self._is_reached(self._possible(event)):
                yield self._causes.of(self._steps[event])

    def _unreached(self, locations: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
        for automaton, location in locations:
            if not self._is_reached(self.encoding.in_location(automaton, location)):
                yield automaton, location

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
            if self._effort > MAXIMUM_EFFORT:
                return
            steps = self._steps[event]
            start = executed[event] & steps.moving() if event in questions.changing else executed[event]
            states = self._again(steps, inside, executed, start) if event not in reported else self._manager.false
            run = runs.run_to(states) if states != self._manager.false else None
            if run is None:
                continue
            state, loop = self._loop(steps, inside, executed, states, run)
            reported.update(loop)
            yield Unprompted(event, runs.trace_to(state), loop)

    def _executed(self, silent: Sequence[str]) -> "_Executed":
        """Return for each event the states in which an executor may take it: silent events go first."""
        first = {name: self._possible(name) & self._steps[name].moving() for name in silent}
        stable = self.reachable & ~self.encoding.any_of(first.values())
        possible = {name: self._possible(name) for name in self._steps if name not in first}
        return _Executed(self.reachable, first, stable, possible)

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
        # Runs never leave the states of the controlled system.
        possible = {name: self._possible(name) for name in self._steps}
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
                rivals = group[:number] if self._is_reached(here & earlier) else ()
                for first in rivals:
                    both = here & self._possible(first)
                    if self._is_reached(both):
                        yield first, second, self.reachable & both
                        count += 1
                        if count == MAXIMUM_TOGETHER:
                            return
                earlier = earlier | here


class _Executed(Mapping[str, Any]):
    """For each event the states in which an executor may take it, made when they are asked for: each may be large.

    Args:
        reachable: States of the controlled system.
        first: For the silent events where they are taken before all others, among the states of the controlled system.
        stable: Its states in which none of them is.
        possible: For the other events where they can happen, among its states.
    """

    def __init__(self, reachable: Any, first: Mapping[str, Any], stable: Any, possible: Mapping[str, Any]) -> None:
        self._reachable = reachable
        self._first = first
        self._stable = stable
        self._possible = possible
        self._small: dict[str, Any] = {}

    def __getitem__(self, event: str) -> Any:
        found = self._small.get(event)
        if found is None:
            among, states = (self._reachable, self._first) if event in self._first else (self._stable, self._possible)
            found = among & states[event]
            if found.dag_size <= MAXIMUM_NODES:
                self._small[event] = found
        return found

    def __iter__(self) -> Iterator[str]:
        yield from self._first
        yield from self._possible

    def __len__(self) -> int:
        return len(self._first) + len(self._possible)
