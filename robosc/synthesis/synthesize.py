"""Synthesis of the maximally permissive supervisor: encoding, fixed point, added conditions, figures."""

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from typing import Any, NamedTuple

from robosc.automata.structure import System
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.synthesis.blocks import blocks_of
from robosc.synthesis.closure import closure_in
from robosc.synthesis.controlled import ControlledSystem
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.fixed_point import FixedPoint, GoodStates, Problem, safe_states
from robosc.synthesis.nodes import count_models
from robosc.synthesis.order import other_order
from robosc.synthesis.questions import Questions
from robosc.synthesis.race import Race, Runner
from robosc.synthesis.result import (
    Order,
    Search,
    Statistics,
    Strategy,
    SynthesisProgress,
    SynthesisResult,
    SynthesisStatus,
)
from robosc.synthesis.simplify import Simplifier
from robosc.synthesis.transitions import Steps, transition_of
from robosc.synthesis.workspace import Workspace, Workspaces

_NOTHING = Questions()


def _never() -> bool:
    return False


def _silent(progress: SynthesisProgress) -> None:
    """Report nothing."""


def synthesize(
    system: System,
    *,
    engine: str | EngineOptions = "auto",
    questions: Questions = _NOTHING,
    should_stop: Callable[[], bool] = _never,
    on_progress: Callable[[SynthesisProgress], None] = _silent,
) -> SynthesisResult:
    """Synthesize the safe, controllable, nonblocking and maximally permissive supervisor of a system.

    Args:
        system: Plants and event conditions.
        engine: Name of the engine for decision diagrams, or its options; `auto` is the fastest installed.
        questions: Other questions about the controlled system.
        should_stop: Function called before each step of the work with one event; once it returns true, the work ends.
        on_progress: Function called after each event's encoding and after each round.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: An expression computes with too many doubles, or a condition would be too large.
    """
    places = Workspaces(engine, should_stop, on_progress)
    solved, race = _Portfolio(system, places).solved()
    synthesis = _Synthesis(solved, race)
    return places.limited(solved.attempt.place, lambda: synthesis.result(questions))


class _Attempt:
    """The system in one variable order: its manager is its own.

    Args:
        place: The system, encoded.
    """

    def __init__(self, place: Workspace) -> None:
        self.place = place
        self.encoding = place.encoding
        self.problem = Problem(self._steps(), safe_states(self.encoding, self.encoding.system.invariants))
        self.fixed_point = FixedPoint(self.encoding, place.monitor)
        place.monitor.spend(self.fixed_point.initial.dag_size)

    def _steps(self) -> tuple[Steps, ...]:
        monitor, found = self.place.monitor, list[Steps]()
        for event in self.encoding.system.events:
            monitor.check_stop()
            found.append(Steps(self.encoding, transition_of(self.encoding, event)))
            monitor.report("encoding", len(found), found[-1].plant)
            monitor.spend(found[-1].plant.dag_size)
        return tuple(found)

    def solved(self, search: Search) -> "_Solved":
        """The solution, found in one direction."""
        fixed_point, nothing = self.fixed_point, self.encoding.manager.false
        if search is Search.BACKWARDS:
            good = fixed_point.good_states(self.problem, nothing)
        else:
            good = fixed_point.reached_good_states(self.problem, nothing)
        reachable = None if good.reason else fixed_point.reachable_states(self.problem, good.states)
        return _Solved(self, good, reachable)


class _Solved(NamedTuple):
    """A solved system: the good states, and those of the controlled system, None if it is empty."""

    attempt: _Attempt
    good: GoodStates
    reachable: Any


class _Portfolio:
    """Strategies that race for the solution of a system: the likeliest one, its other direction, and another order.

    There are three at most, so that all of them work on at most three times the nodes of the quickest one. Measured on
    the families of the benchmarks, the search from the marked states is nearly always the quicker one in a good order,
    so that the second order is tried in this direction alone.

    Args:
        system: The system.
        places: Workspaces, none of which is open.
    """

    def __init__(self, system: System, places: Workspaces) -> None:
        self._system = system
        self._places = places
        self._race = Race(places.monitor)
        self._first: Workspace | None = places.opened(system, self._race)
        self._best = self._first.encoding.order_name, self._first.encoding.blocks
        self._attempts: dict[bool, _Attempt] = {}
        self._names: dict[bool, Order] = {}

    def solved(self) -> tuple[_Solved, tuple[Strategy, ...]]:
        """The solution that is found first, and all strategies that have begun."""
        ways = self._ways()
        runners = [Runner(partial(self._solved, *way)) for way in ways]
        is_reordering = self._places.options.is_reordering
        with self._attempt(is_other=False).place.reordering() if is_reordering else nullcontext():
            found = self._race.first_of(runners)
        self._places.keep(found.attempt.place)
        race = tuple(
            Strategy(self._names[is_other], search, runner.nodes, int(runner.has_won), int(runner.is_given_up))
            for (is_other, search), runner in zip(ways, runners, strict=True)
            if is_other in self._names and runner.has_begun
        )
        return found, race

    def _ways(self) -> list[tuple[bool, Search]]:
        """The strategies, the likeliest first: whether the order is the other one, and the direction."""
        ways = [(False, Search.BACKWARDS)]
        if not self._system.is_controlled:
            ways.append((False, Search.REACHABLE_FIRST))
            # An engine that changes the order needs no other one to begin with.
            if len(self._best[1]) > 1 and not self._places.options.is_reordering:
                ways.append((True, Search.BACKWARDS))
        return ways

    def _solved(self, is_other: bool, search: Search) -> _Solved:
        attempt = self._attempt(is_other=is_other)
        try:
            return self._places.limited(attempt.place, lambda: attempt.solved(search))
        except BaseException:
            # Two strategies share the best order, and one of them may go on.
            if is_other:
                del self._attempts[is_other]
                self._places.close(attempt.place)
            raise

    def _attempt(self, *, is_other: bool) -> _Attempt:
        """The system in the best order or the other one, encoded once."""
        if is_other not in self._attempts:
            place = order = None
            if is_other:
                order = other_order(self._system, blocks_of(self._system).places, self._best)
            else:
                place, self._first = self._first, None
            if place is None:
                place = self._places.opened(self._system, self._race, order=order)
            self._names[is_other] = place.encoding.order_name
            try:
                self._attempts[is_other] = self._places.limited(place, lambda: _Attempt(place))
            except BaseException:
                self._places.close(place)
                raise
        return self._attempts[is_other]


class _Synthesis:
    """The supervisor of a solved system.

    Args:
        solved: The solution.
        race: The strategies that have raced for it.
    """

    def __init__(self, solved: _Solved, race: tuple[Strategy, ...]) -> None:
        self._attempt, self._good, self._reachable = solved
        self._race = race
        self._place = self._attempt.place
        self._monitor = self._place.monitor
        self._encoding = self._place.encoding
        self._problem = self._attempt.problem

    def result(self, questions: Questions) -> SynthesisResult:
        """The supervisor, or why there is none."""
        good, reachable = self._good, self._reachable
        if good.reason:
            return SynthesisResult(SynthesisStatus.EMPTY, (), self._statistics(0), good.reason)
        states = count_models(self._encoding.manager, reachable, self._encoding.state_names)
        added: list[AddedCondition] = []
        simplifier = Simplifier(self._encoding, self._place.condition_seconds)
        controlled = ControlledSystem(self._encoding, self._monitor, self._problem, good.states, reachable)
        for steps in self._problem.steps:
            self._monitor.check_stop()
            condition = self._added(simplifier, steps, controlled)
            if condition is not None:
                added.append(AddedCondition(steps.event.name, condition))
        initial = simplifier.condition(good.states, self._attempt.fixed_point.initial)
        # The figures are those of the synthesis: what the questions take on top is not in them.
        statistics = self._statistics(states)
        return SynthesisResult(
            SynthesisStatus.SUPERVISOR,
            tuple(added),
            statistics,
            answers=controlled.answers(questions),
            initial=initial,
        )

    def _statistics(self, states: int) -> Statistics:
        return Statistics(
            engine=self._place.engine,
            state_bits=len(self._encoding.state_names),
            iterations=self._good.rounds,
            peak_nodes=self._monitor.peak_nodes,
            states=states,
            search=Search.REACHABLE_FIRST if self._good.is_of_reached else Search.BACKWARDS,
            order=self._encoding.order_name,
            race=self._race,
            closure=closure_in(self._encoding.manager, is_reordering=self._place.is_reordering),
        )

    def _added(self, simplifier: Simplifier, steps: Steps, controlled: ControlledSystem) -> DecisionDiagram | None:
        """The condition to add to an event, simplified where it does not matter; None if there is nothing to add."""
        if not controlled.is_disabled(steps):
            return None
        care = controlled.reachable & steps.plant & steps.condition
        return simplifier.condition(controlled.conjuncts.only(steps), care)
