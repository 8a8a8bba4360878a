"""Troubles that keep synthesis from allowing an event, each in one sentence: what can follow, and what is stuck then.

`explain_synthesis` shows the same runs with every state on their way.
"""

from collections.abc import Callable, Sequence

import msgspec

from robosc.automata.compile import State
from robosc.automata.state import subjects
from robosc.explanation.analysis import Analysis, BlockingCause, BlockingCauseKind, Counterexample
from robosc.explanation.notation import MAXIMUM_NAMES, events_text
from robosc.explanation.problems import Problems
from robosc.explanation.reports import Reporter
from robosc.explanation.subjects import ModelWords
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.monitor import BoundedMonitor
from robosc.synthesis.result import SynthesisProgress
from robosc.synthesis.workspace import workspace


class Trouble(msgspec.Struct, frozen=True):
    """Trouble that an event leads into.

    Attributes:
        words: The events that can follow, and what comes of them, in one sentence.
        events: The events that can follow it, up to the trouble.
        state: The state at their end; None where the event itself cannot be taken.
        stuck: Components, services and actions that never get to a marked state from there by any event.
    """

    words: str
    events: tuple[str, ...]
    state: State | None
    stuck: tuple[str, ...]


def troubles_after(
    words: ModelWords,
    asked: Sequence[tuple[str, State | None]],
    *,
    engine: str | EngineOptions = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
) -> tuple[Trouble | None, ...]:
    """Return for each event the trouble because of which synthesis forbids it; None where there is none.

    Args:
        words: The automata of a model that has a supervisor, with the words for them.
        asked: Controllable events, each with the state in which it is forbidden; None: anywhere in the controlled
            system.
        engine: Name of the engine for decision diagrams, or more about it.
        should_stop: Function called before each step; once true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the engine's options allow.
    """
    with workspace(words.system, engine, should_stop, on_progress) as place:
        monitor = BoundedMonitor(place.monitor)
        problems = Problems(place.encoding, monitor)
        fixed_point, problem = problems.without(())
        with place.reordering():
            good = fixed_point.solution(problem, place.encoding.manager.false)
            if good.reason:
                return (None,) * len(asked)
            everywhere = fixed_point.reachable_states(problem, good.states)
        analysis = Analysis(place.encoding, monitor, problems, words.terms.constraints, good.states)
        teller = _Teller(words, analysis)
        return tuple(
            teller.trouble(event, everywhere if state is None else analysis.predicate(state), state)
            for event, state in asked
        )


class _Teller:
    """Words for the troubles of one problem."""

    def __init__(self, words: ModelWords, analysis: Analysis) -> None:
        self._terms = words.terms
        self._analysis = analysis
        self._reporter = Reporter(analysis, words.terms)
        self._system = words.system

    def trouble(self, event: str, states: object, state: State | None) -> Trouble | None:
        """Return the trouble because of which an event is forbidden in some states, or None.

        Args:
            event: The event.
            states: The states.
            state: The only one of them, if it is known.
        """
        causes = self._analysis.blocking_causes(event, states)
        for item in causes:
            if item.kind is BlockingCauseKind.SUPERVISOR:
                return self._after(event, item)
        for item in causes:
            if item.kind is BlockingCauseKind.RANGE and state is not None:
                return Trouble(self._terms.blocked(item, state)[0], (), None, ())
        return None

    def _after(self, event: str, cause: BlockingCause) -> Trouble:
        lost = self._analysis.bad_after(event, cause.where, self._analysis.good)
        found = self._analysis.counterexample_after(lost)
        events, state = found.run.events, found.run.states[-1]
        stuck = self._analysis.stuck(state) if found.is_blocking and found.detour is None else {}
        what = self._what(found, state, stuck)
        if not events:
            return Trouble(what, events, state, tuple(stuck))
        lead = f"{events_text(events)} can follow, and" if found.is_forced else f"after {events_text(events)}"
        return Trouble(f"{lead} {what}", events, state, tuple(stuck))

    def _what(self, found: Counterexample, state: State, stuck: dict[str, bool]) -> str:
        """Return what the trouble is at the end of a run."""
        if not found.is_blocking:
            return self._reporter.counterexample(found).messages[0]
        if found.detour is not None:
            told = self._reporter.stopped(found.detour, self._analysis.safe)
            event = told.events[told.stopped_at]
            why = f": {told.reasons[0].message}" if told.reasons else ""
            return f"{event}, on the only way back to a marked state, must not happen then{why}"
        values = zip(subjects(self._system), state, strict=True)
        where = {item.automaton: str(value) for item, value in values if item.variable is None}
        for name, stays in stuck.items():
            part = self._terms.automaton(name)
            if stays:
                return f"{part} stays in {where[name]}: nothing leaves it"
            return f"{part}, then in {where[name]}, never gets to a marked state again"
        if found.is_detour_unknown or len(found.unmarked) < 2:
            return "no marked state can be reached any more"
        names = ", ".join(self._terms.automaton(name) for name in found.unmarked[:MAXIMUM_NAMES])
        return f"{names} never get to marked states together again"
