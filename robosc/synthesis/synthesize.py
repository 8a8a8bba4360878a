"""Synthesis of the maximally permissive supervisor: the symbolic fixed point.

Source: L. Ouedraogo, R. Kumar, R. Malik and K. Akesson, "Nonblocking and safe control of discrete-event systems
modeled as extended finite automata", IEEE T-ASE 8(3), 2011, pp. 560-569, Algorithm 1, on predicates instead of
guards. Predecessors are found by substitution, forward images with a relation for each event; events are chained:
each works on what the ones before it have found.
"""

from collections.abc import Callable
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
from robosc.synthesis.transitions import Steps, transitions_of


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
        should_stop: Asked once for each event in each round; once true, the work ends.
        on_progress: Told after each round.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: An expression computes with too many doubles.
    """
    name = resolve_engine(engine)
    return _Synthesis(system, name, should_stop, on_progress).result()


@dataclass(slots=True)
class _Round:
    """Counts rounds and nodes."""

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
        self._round = _Round()
        self._manager = make_manager(engine)
        self._encoding = Encoding(system, self._manager)
        self._steps: list[Steps] = []
        for transition in transitions_of(self._encoding):
            self._check_stop()
            self._steps.append(Steps(self._encoding, transition))
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
            for steps in self._steps
            if (condition := self._added(steps, good, reachable)) is not None
        )
        return SynthesisResult(SynthesisStatus.SUPERVISOR, added, self._statistics(states))

    def _statistics(self, states: int) -> Statistics:
        bits = len(self._encoding.state_names)
        return Statistics(self._engine, bits, self._round.iterations, self._round.peak_nodes, states)

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
            self._round.iterations += 1
            self._progress("fixed point", self._round.iterations)
            if good == before:
                return good, ""

    def _is_lost(self, good: Any) -> bool:
        return bool(self._initial & good == self._manager.false)

    def _nonblocking(self, good: Any) -> Any:
        """The states of `good` that reach a marked state through transitions that stay in `good`."""
        allowed = [
            steps.plant & steps.condition & steps.only(good) if steps.event.is_controllable else self._manager.true
            for steps in self._steps
        ]
        found = good & self._marked
        while True:
            before = found
            for steps, allows in zip(self._steps, allowed, strict=True):
                self._check_stop()
                found = found | (good & allows & steps.some(found))
            if found == before:
                return found

    def _controllable(self, good: Any) -> Any:
        """The states of `good` that no run of uncontrollable events leaves."""
        while True:
            before = good
            for steps in self._steps:
                if not steps.event.is_controllable:
                    self._check_stop()
                    good = good & ~steps.some(~good)
            if good == before:
                return good

    # The controlled system

    def _allowed(self, steps: Steps, good: Any) -> Any:
        """Where the controlled system lets an event happen."""
        if not steps.event.is_controllable:
            return steps.plant
        return steps.plant & steps.condition & steps.only(good)

    def _reachable_states(self, good: Any) -> Any:
        """Every state of the controlled system."""
        allowed = [self._allowed(steps, good) for steps in self._steps]
        found = self._initial
        rounds = 0
        while True:
            before = found
            for steps, allows in zip(self._steps, allowed, strict=True):
                self._check_stop()
                found = found | steps.image(found & allows)
            rounds += 1
            self._progress("reachability", rounds)
            if found == before:
                return found

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

    def _check_stop(self) -> None:
        if self._should_stop():
            raise SynthesisCancelled("synthesis was stopped")

    def _progress(self, phase: str, rounds: int) -> None:
        nodes = len(self._manager)
        self._round.peak_nodes = max(self._round.peak_nodes, nodes)
        self._on_progress(Progress(phase, rounds, nodes))
