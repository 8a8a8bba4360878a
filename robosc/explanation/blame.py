"""Reasons why a problem has no supervisor: a run into trouble, the blamed constraints, and a removal that helps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.explanation.analysis import Analysis
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint
from robosc.explanation.explanations import EmptyExplanation
from robosc.explanation.parts import Blamed, CounterexampleReport, Path, StateValues
from robosc.explanation.problems import Problems
from robosc.explanation.reports import Reporter
from robosc.explanation.subjects import Words
from robosc.synthesis.conflict import minimal_conflict, minimal_removal
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.monitor import BoundedMonitor, EffortSpentError
from robosc.synthesis.result import SynthesisProgress
from robosc.synthesis.workspace import Workspace, workspace

EFFORT = 100
"""Steps that the search for what is to blame may take, as a multiple of those of one synthesis."""

LEAST_EFFORT = 20_000
"""Least limit of these steps."""

MAXIMUM_PARTS = 200
"""Maximum number of parts of the model that an explanation lists: an unfinished search may leave thousands."""

_ASKED = (ConstraintKind.REQUIREMENT, ConstraintKind.INVARIANT)
"""Kinds of constraints that are requirements on the robot; the other kinds describe the robot."""


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
        conflict: Constraints that alone are enough to leave no supervisor.
        is_minimal: True if it is known that each of them is needed.
        sufficing: Constraints of the conflict each of which, removed alone, leaves a supervisor; None if that is not
            known.
        removal: Constraints that, removed together, leave a supervisor, and of which none can stay; None if that is
            not known.
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
        constraints: Constraints that can be left out; those that are preferred for blame come first.
        false: The predicate that is true nowhere.
        monitor: Monitor that bounds the work; at its limit the result so far is returned.

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
    """Return the order in which constraints are kept.

    Constraints that describe the robot come before requirements on it; of these, those that are not blamed come first.
    """
    blamed = set(conflict)
    return tuple(sorted(range(len(constraints)), key=lambda item: (constraints[item].kind in _ASKED, item in blamed)))


class _Search:
    """Search that remembers its results, and the smallest set found so far that leaves no supervisor."""

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
        words: The automata, which have no supervisor, with the words for them.
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
    # The steps of one synthesis, encoding included, measure the size of the problem.
    monitor.limit = max(LEAST_EFFORT, EFFORT * monitor.steps)
    with place.reordering():
        blame = find_blame(problems, constraints, false, monitor)
    monitor.limit = None
    # The counterexample is computed under the blamed constraints alone, so that it fits the blame.
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
