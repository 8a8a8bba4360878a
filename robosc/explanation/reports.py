"""Conversion of answers about automata to explanations in the model's words."""

from typing import Any

from robosc.automata.compile import State
from robosc.explanation.analysis import Analysis, BlockingCause, BlockingCauseKind, Counterexample, Detour
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint
from robosc.explanation.notation import value_text
from robosc.explanation.parts import CounterexampleReport, Path, Reason, Stopped
from robosc.explanation.terms import Terms
from robosc.synthesis.runs import SystemRun

MAXIMUM_REASONS = 20
"""Maximum number of reasons, and of violated parts, that are reported about one state: more would not help a reader."""


_MARKER = RelaxableConstraint(ConstraintKind.MARKING, is_marker=True)


class Reporter:
    """Words for the answers of one analysis.

    Args:
        analysis: The answers.
        terms: The words.
    """

    def __init__(self, analysis: Analysis, terms: Terms) -> None:
        self._analysis = analysis
        self._terms = terms
        self.unfound = f"no way of the {terms.plants} is shown: finding one takes too long"
        """Sentence in place of a way that takes too long to find."""

    def path(self, run: SystemRun) -> Path:
        """A run."""
        return Path(run.events, run.is_shortest, self._terms.state(run.states[-1]))

    def reason(self, item: BlockingCause, state: State, good: Any, run: SystemRun | None = None) -> Reason:
        """Return the reason why an event cannot happen in a state, to which a run leads."""
        message, part = self._terms.blocked(item, state)
        trouble = None
        if item.kind is BlockingCauseKind.SUPERVISOR:
            lost = self._analysis.bad_after(item.event, self._analysis.predicate(state), good)
            trouble = self.counterexample(self._analysis.counterexample_after(lost))
        return Reason(str(item.kind), message, part, self.path(run) if run else None, trouble)

    def stopped(self, item: Detour, good: Any) -> Stopped:
        """A way of the behaviours, and where it is stopped."""
        reasons = tuple(self.reason(cause, item.state, good) for cause in item.blocking_causes[:MAXIMUM_REASONS])
        return Stopped(item.events, item.stopped_at, self._terms.state(item.state), reasons)

    def counterexample(self, item: Counterexample) -> CounterexampleReport:
        """A run into trouble."""
        state = item.run.states[-1]
        parts = [self._terms.invariant_part(place) for place in item.invariants[:MAXIMUM_REASONS]]
        messages = [f"'{part.text}' is broken" for part in parts]
        for event, constraint in item.leaving[:MAXIMUM_REASONS]:
            part = self._terms.part(constraint)
            subject = str(constraint.range)
            value = self._terms.state(state).variables[subject]
            messages.append(f"{event} can take {subject}, which is {value_text(value)}, out of its range")
            parts.append(part)
        for event, place in item.forbidden[:MAXIMUM_REASONS]:
            part = self._terms.condition_part(place)
            messages.append(f"{event} cannot be prevented, against '{part.text}'")
            parts.append(part)
        stopped = None
        if item.is_blocking:
            unmarked = item.unmarked[:MAXIMUM_REASONS]
            names = [self._terms.automaton(name) for name in unmarked]
            names += ["..."] if len(unmarked) < len(item.unmarked) else []
            parts += [self._terms.automaton_part(name) for name in unmarked]
            whose = f"; not marked now: {', '.join(names)}" if names else ""
            messages.append(f"no marked state can be reached from there{whose}")
            if item.is_marker_missed:
                parts.append(self._terms.part(_MARKER))
                messages.append(f"'{parts[-1].text}' is not so there")
            if item.is_detour_unknown:
                messages.append(self.unfound)
            elif item.detour is None:
                messages.append(f"the {self._terms.plants} by themselves have no way to one")
            else:
                stopped = self.stopped(item.detour, self._analysis.safe)
        return CounterexampleReport(
            kind="blocking" if item.is_blocking else "bad",
            way=self.path(item.run),
            is_forced=item.is_forced,
            messages=tuple(messages),
            parts=tuple(dict.fromkeys(parts)),
            stopped=stopped,
        )
