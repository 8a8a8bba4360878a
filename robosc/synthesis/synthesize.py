"""Synthesis of the maximally permissive supervisor: the symbolic fixed point.

Source: L. Ouedraogo, R. Kumar, R. Malik and K. Akesson, "Nonblocking and safe control of discrete-event systems
modeled as extended finite automata", IEEE T-ASE 8(3), 2011, pp. 560-569, Algorithm 1, on predicates instead of
guards. Predecessors are found by substitution, forward images with a relation for each event. Events are chained:
each works on what the ones before it have found, backwards in the opposite order, since a system's events mostly
follow each other in the order in which they are given.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.automata.structure import System
from robosc.errors import SynthesisCancelled
from robosc.supervisor.structure import AddedCondition
from robosc.synthesis.diagrams import extract
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager, resolve_engine
from robosc.synthesis.nodes import count_models, node_count, restrict
from robosc.synthesis.result import Progress, Statistics, SynthesisResult, SynthesisStatus
from robosc.synthesis.transitions import Steps, transition_of


def _never() -> bool:
    return False


def _silent(progress: Progress) -> None:
    """Tell nobody."""


def synthesize(
    system: System,
    *,
    engine: str = "auto",
    should_stop: Callable[[], bool] = _never,
    on_progress: Callable[[Progress], None] = _silent,
) -> SynthesisResult:
    """The safe, controllable, nonblocking and maximally permissive supervisor of a system.

    Args:
        system: Plants and event conditions.
        engine: Name of the engine for decision diagrams; `auto` is the fastest installed.
        should_stop: Asked before each step of the work with one event; once true, the work ends.
        on_progress: Told after each event's encoding and after each round.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: An expression computes with too many doubles, or a condition would be too large.
    """
    name = resolve_engine(engine)
    return _Synthesis(system, name, should_stop, on_progress).result()


Step = Callable[[Any], Any]
"""What one event adds to a set of states."""


@dataclass(slots=True)
class _Figures:
    """Counts rounds of the fixed point, and nodes."""

    iterations: int = 0
    peak_nodes: int = 0


class _Synthesis:
    """One synthesis: its manager lives and ends with it."""

    def __init__(
        self, system: System, engine: str, should_stop: Callable[[], bool], on_progress: Callable[[Progress], None]
    ) -> None:
        self._engine = engine
        self._should_stop = should_stop
        self._on_progress = on_progress
        self._figures = _Figures()
        self._manager = make_manager(engine)
        self._encoding = Encoding(system, self._manager)
        self._steps: list[Steps] = []
        for number, event in enumerate(system.events):
            self._check_stop()
            self._steps.append(Steps(self._encoding, transition_of(self._encoding, event)))
            self._progress("encoding", number + 1, self._steps[-1].plant)
        self._initial = self._encoding.initial_states()
        self._marked = self._encoding.marked_states()

    def result(self) -> SynthesisResult:
        """The supervisor, or why there is none."""
        good, reason = self._good_states()
        if reason:
            return SynthesisResult(SynthesisStatus.EMPTY, (), self._statistics(0), reason)
        reachable = self._reachable_states(good)
        states = count_models(self._manager, reachable, self._encoding.state_names)
        added = tuple(
            AddedCondition(steps.event.name, extract(self._encoding, condition))
            for steps in self._each()
            if (condition := self._added(steps, good, reachable)) is not None
        )
        return SynthesisResult(SynthesisStatus.SUPERVISOR, added, self._statistics(states))

    def _statistics(self, states: int) -> Statistics:
        bits = len(self._encoding.state_names)
        return Statistics(self._engine, bits, self._figures.iterations, self._figures.peak_nodes, states)

    # The fixed point

    def _good_states(self) -> tuple[Any, str]:
        """The good states, or why the initial state is none of them."""
        good = self._encoding.valid_states()
        for steps in self._steps:
            good = good & ~steps.bad
            if self._is_lost(good):
                return good, f"{steps.event.name} can do harm in the initial state already"
        while True:
            before = good
            good = self._nonblocking(good)
            if self._is_lost(good):
                return good, "from the initial state no marked state can be reached safely"
            good = self._controllable(good)
            if self._is_lost(good):
                return good, "uncontrollable events can lead from the initial state into states to be avoided"
            self._figures.iterations += 1
            self._progress("fixed point", self._figures.iterations, good)
            if good == before:
                return good, ""

    def _is_lost(self, good: Any) -> bool:
        return bool(self._initial & good == self._manager.false)

    def _nonblocking(self, good: Any) -> Any:
        """The states of `good` that reach a marked state through transitions that stay in `good`."""
        steps = [self._towards(steps, self._from(steps, good)) for steps in self._each()]
        return self._closure(good & self._marked, steps[::-1], "coreachability")

    def _from(self, steps: Steps, good: Any) -> Any:
        """The states of `good` in which an event may happen as far as the supervisor goes."""
        return good & steps.condition & steps.only(good) & steps.plant if steps.event.is_controllable else good

    def _towards(self, steps: Steps, source: Any) -> Step:
        return lambda states: source & steps.some(states)

    def _controllable(self, good: Any) -> Any:
        """The states of `good` that no run of uncontrollable events leaves."""
        steps = [steps.some for steps in self._each() if not steps.event.is_controllable]
        return ~self._closure(~good, steps[::-1], "controllability")

    def _closure(self, states: Any, steps: Sequence[Step], phase: str) -> Any:
        """`states` and all that steps from them add, one step after the other until none adds anything."""
        rounds = unchanged = 0
        while unchanged < len(steps):
            for step in steps:
                self._check_stop()
                grown = states | step(states)
                unchanged = unchanged + 1 if grown == states else 0
                states = grown
                if unchanged == len(steps):
                    break
            rounds += 1
            self._progress(phase, rounds, states)
        return states

    # The controlled system

    def _reachable_states(self, good: Any) -> Any:
        """Every state of the controlled system."""
        steps = [self._onwards(steps, self._from(steps, good)) for steps in self._each()]
        return self._closure(self._initial, steps, "reachability")

    def _onwards(self, steps: Steps, source: Any) -> Step:
        return lambda states: steps.image(states & source)

    def _added(self, steps: Steps, good: Any, reachable: Any) -> Any | None:
        """The condition to add to an event, simplified where it does not matter; None if there is nothing to add."""
        if not steps.event.is_controllable:
            return None
        care = reachable & steps.plant & steps.condition
        wanted = steps.only(good)
        if care & ~wanted == self._manager.false:
            return None
        if care & wanted == self._manager.false:
            return self._manager.false
        simplified = restrict(self._manager, wanted, care)
        plain = wanted & self._encoding.valid_states()
        return simplified if node_count(self._manager, simplified) <= node_count(self._manager, plain) else plain

    def _each(self) -> Iterator[Steps]:
        for steps in self._steps:
            self._check_stop()
            yield steps

    def _check_stop(self) -> None:
        if self._should_stop():
            raise SynthesisCancelled("synthesis was stopped")

    def _progress(self, phase: str, rounds: int, states: Any) -> None:
        nodes = states.dag_size
        self._figures.peak_nodes = max(self._figures.peak_nodes, nodes)
        self._on_progress(Progress(phase, rounds, nodes))
