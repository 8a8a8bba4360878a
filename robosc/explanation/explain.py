"""Effect of synthesis on a model: restrictions of events, reasons why an event cannot happen in a state, warnings.

Everything is computed on predicates over the states of the controlled system; each answer comes with a shortest run.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from robosc.automata.state import subjects
from robosc.errors import InternalError
from robosc.explanation.analysis import Analysis, BlockingCause, BlockingCauseKind
from robosc.explanation.blame import explain_problem
from robosc.explanation.explanations import Explanation
from robosc.explanation.notation import events_text
from robosc.explanation.parts import EventHere, EventReport, Reason, Remark, StateReport, Stopped
from robosc.explanation.problems import Problems
from robosc.explanation.reports import Reporter
from robosc.explanation.requests import MAXIMUM_SHOWN, RequestError
from robosc.explanation.subjects import Words
from robosc.source import visible
from robosc.synthesis.conflict import minimal_conflict
from robosc.synthesis.controlled import ControlledSystem
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.monitor import BoundedMonitor, ProgressMonitor
from robosc.synthesis.nodes import count_models
from robosc.synthesis.result import SynthesisProgress
from robosc.synthesis.runs import SystemRun, decoded
from robosc.synthesis.ways import WayNotFoundError
from robosc.synthesis.workspace import workspace

MAXIMUM_STATES = 5
"""Maximum number of states of one kind that warnings show: all of them could be too many to read."""


def explain_synthesis(
    words: Words,
    *,
    engine: str | EngineOptions = "auto",
    event: str | None = None,
    state: str | None = None,
    after: str | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
) -> Explanation:
    """Explain what synthesis did to a model or to automata.

    Args:
        words: The automata, with the words for them.
        engine: Name of the engine for decision diagrams, or more about it.
        event: The event to explain; empty: all events, and warnings.
        state: Description of a state in which to explain what can happen, such as `Door.closed, Lift.n = 2`.
        after: Run after which to explain what can happen, such as `open, jam.response`.
        should_stop: Function called before each step; once true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        RequestError: The event, the part of the model, the state or the run does not exist.
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the engine's options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: The model is outside what synthesis handles.
    """
    requests = words.requests
    name = None if event is None else requests.event(event)
    condition = None if state is None else requests.state(state)
    run = None if after is None else requests.run(after)
    with workspace(words.system, engine, should_stop, on_progress) as place:
        encoding, monitor = place.encoding, BoundedMonitor(place.monitor)
        problems = Problems(encoding, monitor)
        fixed_point, problem = problems.without(())
        with place.reordering():
            good = fixed_point.solution(problem, encoding.manager.false)
            reachable = None if good.reason else fixed_point.reachable_states(problem, good.states)
        if good.reason:
            empty = explain_problem(place, monitor, problems, words)
            return Explanation(empty=empty, is_of_automata=words.is_of_automata)
        analysis = Analysis(encoding, monitor, problems, words.terms.constraints, good.states)
        explainer = _Explainer(encoding, monitor, words, analysis, reachable, fixed_point.initial & good.states)
        if condition is not None or run is not None:
            fitting = reachable
            if run is not None:
                fitting = explainer.after(run)
            if condition is not None:
                fitting = explainer.fitting(fitting, ExpressionEncoder(encoding).holds(condition), str(state))
            return Explanation(state=explainer.state(fitting, name, run), is_of_automata=words.is_of_automata)
        if name is not None:
            report = explainer.event(name, has_behaviours=True)
            return Explanation(events=(report,), is_of_automata=words.is_of_automata)
        controlled = ControlledSystem(encoding, monitor, problem, good.states, reachable)
        return Explanation(
            events=tuple(explainer.event(item.name) for item in words.system.events if item.is_controllable),
            remarks=(
                *words.remarks(controlled.answers(words.questions)),
                *explainer.unreachable_states(),
                *explainer.left_to_the_environment(),
            ),
            is_of_automata=words.is_of_automata,
        )


class _Explainer:
    """Answers about one controlled system."""

    def __init__(
        self,
        encoding: Encoding,
        monitor: ProgressMonitor,
        words: Words,
        analysis: Analysis,
        reachable: Any,
        initial: Any,
    ) -> None:
        self._encoding = encoding
        self._monitor = monitor
        self._false = encoding.manager.false
        self._words = words
        self._system = words.system
        self._analysis = analysis
        self._reporter = Reporter(analysis, words.terms)
        self._reachable = reachable
        self._initial = initial
        self._possible = {event.name: reachable & analysis.possible(event.name) for event in words.system.events}
        self._runs = analysis.runs(initial, self._possible)

    def _run_to(self, states: Any) -> SystemRun:
        run = self._runs.run_to(states)
        if run is None:
            raise InternalError("a state of the controlled system is not reachable")
        return run

    def _stopped(self, goal: Any) -> tuple[Stopped | None, str]:
        """Return a way of the plants to a goal and where it is stopped, or a sentence if there is none to report."""
        try:
            detour = self._analysis.detour(self._initial, goal, self._analysis.good, self._reachable, self._runs)
        except WayNotFoundError:
            return None, self._reporter.unfound
        return None if detour is None else self._reporter.stopped(detour, self._analysis.good), ""

    # Events

    def event(self, event: str, *, has_behaviours: bool = False) -> EventReport:
        """Report what restricts an event, with or without restrictions by behaviours."""
        possible, wanted = self._possible[event], self._reachable & self._analysis.wanted(event)
        causes = self._analysis.blocking_causes(event, self._reachable)
        # Invariants of a supervisor are no matter of the plants.
        kept = [item for item in causes if item.is_impossible and self._system.is_controlled]
        found = [
            item for item in causes if item.kind is not BlockingCauseKind.BEHAVIOUR or has_behaviours or item in kept
        ]
        is_never = possible == self._false
        status = "never" if is_never else "free" if possible == wanted and not kept else "restricted"
        if is_never:
            found = self._decisive(event, found, wanted)
        stopped, unfound = None, ""
        if is_never and wanted == self._false:
            stopped, unfound = self._stopped(self._analysis.wanted(event))
        return EventReport(
            event=event,
            is_controllable=self._system.event(event).is_controllable,
            status=status,
            reasons=tuple(self._reason(item) for item in found),
            stopped=stopped,
            unfound=unfound,
        )

    def _decisive(self, event: str, found: list[BlockingCause], wanted: Any) -> list[BlockingCause]:
        """Return the causes that together block an event everywhere; only behaviours, if they are enough."""
        candidates = [item for item in found if item.kind is not BlockingCauseKind.BEHAVIOUR]
        if wanted == self._false:
            candidates = found or list(self._analysis.blocking_causes(event, self._reachable))
            wanted = self._reachable

        def is_never(kept: frozenset[int]) -> bool:
            left = wanted
            for place in kept:
                left = left & ~candidates[place].where
            return bool(left == self._false)

        if not is_never(frozenset(range(len(candidates)))):
            return candidates
        return [candidates[place] for place in minimal_conflict(range(len(candidates)), is_never)]

    def _reason(self, item: BlockingCause) -> Reason:
        run = self._run_to(item.where)
        return self._reporter.reason(item, run.states[-1], self._analysis.good, run)

    # States

    def after(self, run: tuple[str, ...]) -> Any:
        """The states that a run leads to.

        Raises:
            RequestError: The run is not possible.
        """
        states = self._initial
        for place, event in enumerate(run):
            following = self._analysis.image(event, states & self._possible[event])
            if following == self._false:
                before = f"after {events_text(run[:place])}" if place else "in the initial state"
                here = decoded(self._encoding, states)
                blocking_causes = self._analysis.blocking_causes(event, self._analysis.predicate(here))
                reasons = [self._reporter.reason(item, here, self._analysis.good) for item in blocking_causes]
                raise RequestError(f"'{event}' cannot happen {before}: {_messages(reasons)}")
            states = following
        return states

    def fitting(self, states: Any, condition: Any, text: str) -> Any:
        """The states, out of given ones, where a condition is true.

        Raises:
            RequestError: There is none.
        """
        found = states & condition
        if found != self._false:
            return found
        problem = f"the controlled system is never in a state that fits '{visible(text[:MAXIMUM_SHOWN])}'"
        stopped, unfound = self._stopped(condition) if states == self._reachable else (None, "")
        if unfound:
            problem += f"; {unfound}"
        if stopped is not None:
            event = stopped.events[stopped.stopped_at]
            problem += (
                f": the {self._words.terms.plants} would have the way {events_text(stopped.events)}, but {event} must "
                "not happen: "
                f"{_messages(stopped.reasons) or 'it leads into trouble'}"
            )
        raise RequestError(problem)

    def state(self, states: Any, event: str | None, after: tuple[str, ...] | None = None) -> StateReport:
        """Report what can happen in one of some states; if an event is given, preferably where it cannot happen.

        Args:
            states: The states.
            event: The event, or None for all.
            after: The run that led there, if one was given; else a shortest one is reported.
        """
        chosen = states
        if event is not None and states & ~self._possible[event] != self._false:
            chosen = states & ~self._possible[event]
        run = self._run_to(chosen)
        if after is not None:
            # Only the state after it is reported, so the states on its way need not be found.
            run = SystemRun(after, (run.states[-1],), is_shortest=len(after) == len(run.events) and run.is_shortest)
        here = self._analysis.predicate(run.states[-1])
        names = [item.name for item in self._system.events] if event is None else [event]
        return StateReport(
            way=self._reporter.path(run),
            fitting=str(count_models(self._encoding.manager, states, self._encoding.state_names)),
            events=tuple(self._here(name, here, run.states[-1]) for name in names),
        )

    def _here(self, event: str, here: Any, state: Any) -> EventHere:
        can_happen = here & self._possible[event] != self._false
        reasons = () if can_happen else self._analysis.blocking_causes(event, here)
        return EventHere(
            event=event,
            is_controllable=self._system.event(event).is_controllable,
            can_happen=can_happen,
            reasons=tuple(self._reporter.reason(item, state, self._analysis.good) for item in reasons),
        )

    # Warnings

    def unreachable_states(self) -> Iterator[Remark]:
        """Locations that the controlled system never reaches."""
        for automaton, location, place in self._words.locations():
            self._monitor.check_stop()
            goal = self._encoding.in_location(automaton, location)
            if goal & self._reachable != self._false:
                continue
            stopped, unfound = self._stopped(goal)
            plants = self._words.terms.plants
            whose = "its behaviour has" if plants == "behaviours" else f"the {plants} have"
            yield Remark(
                "unreachable-state",
                f"{self._words.terms.automaton(automaton)} never gets to '{location}'"
                + ("" if stopped else f": {unfound}" if unfound else f": {whose} no way there"),
                place,
                stopped=stopped,
            )

    def left_to_the_environment(self) -> Iterator[Remark]:
        """States in which no own event of the controller changes the state, grouped by the locations of automata."""
        controllable, uncontrollable = (
            self._encoding.any_of(
                self._possible[event.name] & self._moving(event.name)
                for event in self._system.events
                if self._words.terms.is_own(event.name) is kind
            )
            for kind in (True, False)
        )
        waiting = self._reachable & ~controllable
        yield from self._remarks("only-uncontrollable", waiting & uncontrollable, "only the environment can move on")
        yield from self._remarks("deadlock", waiting & ~uncontrollable, "nothing at all can happen")

    def _moving(self, event: str) -> Any:
        """Return the states where an event counts as a step: a silent step that changes nothing is never taken."""
        if self._words.terms.is_silent(event):
            return self._analysis.moving(event)
        return self._encoding.manager.true

    def _remarks(self, kind: str, states: Any, what: str) -> Iterator[Remark]:
        count = count_models(self._encoding.manager, states, self._encoding.state_names)
        left, shown = states, 0
        while left != self._false and shown < MAXIMUM_STATES:
            self._monitor.check_stop()
            run = self._run_to(left)
            shown += 1
            where = f"after {events_text(run.events)}" if run.events else "in the initial state"
            of_all = f" (one of {count} such states)" if count > 1 else ""
            yield Remark(kind, f"{where} {what}{of_all}", None, self._reporter.path(run))
            left = left & ~self._locations(run.states[-1])

    def _locations(self, state: Any) -> Any:
        """The states with the same locations as this one."""
        values = zip(subjects(self._system), state, strict=True)
        return self._encoding.all_of(
            self._encoding.in_location(subject.automaton, value)
            for subject, value in values
            if subject.variable is None
        )


def _messages(reasons: Iterable[Reason]) -> str:
    return "; ".join(item.message for item in reasons)
