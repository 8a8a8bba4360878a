"""Reasons why a problem has no supervisor: a run into trouble, what is to blame, and what would have to go."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.explanation.analysis import Analysis
from robosc.explanation.conflict import minimal_conflict, minimal_removal
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint
from robosc.explanation.explanations import EmptyExplanation
from robosc.explanation.parts import Blamed, CounterexampleReport, Path, StateValues
from robosc.explanation.problems import Problems
from robosc.explanation.reports import Reporter
from robosc.explanation.subjects import Words
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.monitor import BoundedMonitor, EffortSpentError
from robosc.synthesis.result import SynthesisProgress
from robosc.synthesis.workspace import Workspace, workspace

EFFORT = 100
"""Steps that the search for what is to blame may take, as a multiple of those of one synthesis."""

LEAST_EFFORT = 20_000
"""Steps that it may take in any case."""

MAXIMUM_PARTS = 200
"""Parts of the model that an explanation lists: a search that was given up early may leave thousands."""

_ASKED = (ConstraintKind.REQUIREMENT, ConstraintKind.INVARIANT)
"""Kinds of constraints that are asked of the robot; the others are what it is."""


_NOWHERE = CounterexampleReport(
    kind="nowhere",
    way=Path((), is_shortest=True, state=StateValues({}, {}, {})),
    is_forced=True,
    messages=("there is no initial state: initial locations, values and predicates, or plant invariants, exclude it",),
    parts=(),
)


@dataclass(frozen=True, slots=True)
class Blame:
    """Constraints to blame for the lack of a supervisor: places in a list of constraints, in its order.

    Attributes:
        conflict: Constraints that, without any other, leave no supervisor.
        is_minimal: True if it is known that none of them can be missing.
        sufficing: Those of the conflict without which alone there is a supervisor, beside all others; None where
            that was not found out.
        removal: Those without which there is a supervisor, none of which can stay; None where that was not found out.
    """

    conflict: tuple[int, ...]
    is_minimal: bool
    sufficing: tuple[int, ...] | None
    removal: tuple[int, ...] | None


def find_blame(
    problems: Problems, constraints: Sequence[RelaxableConstraint], false: Any, monitor: BoundedMonitor
) -> Blame:
    """Find what is to blame for a problem without a supervisor.

    Args:
        problems: The problem.
        constraints: Constraints that it could be without; those to be blamed rather than others first.
        false: The predicate that is true nowhere.
        monitor: Monitor that bounds the work; beyond its limit what has been found so far is reported.

    Raises:
        SynthesisCancelled: The work is to end.
    """
    search = _Search(problems, constraints, false, monitor)
    conflict, sufficing, removal = None, None, None
    try:
        conflict = minimal_conflict(range(len(constraints)), search.is_empty)
        everything = frozenset(search.everything)
        sufficing = tuple(item for item in conflict if not search.is_empty(everything - {item}))
        asked = tuple(item for item in sufficing if constraints[item].kind in _ASKED)
        removal = asked[:1] or minimal_removal(_to_keep(constraints, conflict), search.is_empty)
    except EffortSpentError:
        pass
    found = search.smallest if conflict is None else conflict
    return Blame(
        tuple(sorted(found)), conflict is not None, sufficing, None if removal is None else tuple(sorted(removal))
    )


def _to_keep(constraints: Sequence[RelaxableConstraint], conflict: Sequence[int]) -> tuple[int, ...]:
    """Return the order in which constraints stay.

    What the robot is comes before what is asked of it; of this, what is not blamed comes first.
    """
    blamed = set(conflict)
    return tuple(sorted(range(len(constraints)), key=lambda item: (constraints[item].kind in _ASKED, item in blamed)))


class _Search:
    """Remembers what was asked, and the smallest set that was found to leave no supervisor."""

    def __init__(
        self, problems: Problems, constraints: Sequence[RelaxableConstraint], false: Any, monitor: BoundedMonitor
    ) -> None:
        self._problems = problems
        self._constraints = constraints
        self._false = false
        self._monitor = monitor
        self.everything = range(len(constraints))
        self.smallest = frozenset(self.everything)
        self._known: dict[frozenset[int], bool] = {}

    def is_empty(self, kept: frozenset[int]) -> bool:
        """Return True if there is no supervisor with these constraints alone."""
        found = self._known.get(kept)
        if found is None:
            found = self._known[kept] = self._solve(kept)
            if found and len(kept) < len(self.smallest):
                self.smallest = kept
        return found

    def _solve(self, kept: frozenset[int]) -> bool:
        dropped = (item for place, item in enumerate(self._constraints) if place not in kept)
        fixed_point, problem = self._problems.without(dropped)
        return bool(fixed_point.solution(problem, self._false).reason)


def explain_empty(
    words: Words,
    *,
    engine: str | EngineOptions = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
) -> EmptyExplanation:
    """Explain why a model, or automata, have no supervisor.

    Args:
        words: The automata, for which synthesis has found no supervisor, with the words for them.
        engine: Name of the engine for decision diagrams, or more about it.
        should_stop: Function called before each step; once true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    with workspace(words.system, engine, should_stop, on_progress) as place:
        monitor = BoundedMonitor(place.monitor)
        return explain_problem(place, monitor, Problems(place.encoding, monitor), words)


def explain_problem(place: Workspace, monitor: BoundedMonitor, problems: Problems, words: Words) -> EmptyExplanation:
    """Explain why a problem has no supervisor."""
    encoding, false = place.encoding, place.encoding.manager.false
    constraints, terms = words.terms.constraints, words.terms
    fixed_point, problem = problems.without(())
    if fixed_point.initial == false:
        return EmptyExplanation(_NOWHERE, (), is_minimal=True, removal=(), is_of_automata=words.is_of_automata)
    fixed_point.solution(problem, false)
    # What one synthesis takes, encoding and all, tells how large the problem is.
    monitor.limit = max(LEAST_EFFORT, EFFORT * monitor.steps)
    with place.reordering():
        blame = find_blame(problems, constraints, false, monitor)
    monitor.limit = None
    # The trouble is that of what is blamed alone: so both tell one story.
    blamed = set(blame.conflict)
    dropped = (item for place, item in enumerate(constraints) if place not in blamed)
    analysis = Analysis(encoding, monitor, problems, constraints, false, dropped)
    trouble = Reporter(analysis, terms).counterexample(analysis.counterexample_after(fixed_point.initial))
    sufficing, removal = blame.sufficing, blame.removal or ()
    return EmptyExplanation(
        trouble=trouble,
        blamed=tuple(
            Blamed(terms.part(constraints[item]), None if sufficing is None else item in sufficing)
            for item in blame.conflict[:MAXIMUM_PARTS]
        ),
        is_minimal=blame.is_minimal,
        removal=tuple(terms.part(constraints[item]) for item in removal) if len(removal) <= MAXIMUM_PARTS else (),
        left_out=max(0, len(blame.conflict) - MAXIMUM_PARTS),
        is_of_automata=words.is_of_automata,
    )
