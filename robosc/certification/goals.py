"""Explanation of goals that cannot be reached, in the model's words: what is to blame, and what would help."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from robosc.conditions.goals import aims_in_words, assumption_text
from robosc.conditions.rendering import in_words
from robosc.conditions.requirements import requirement_text
from robosc.explanation.notation import events_text, value_text
from robosc.explanation.parts import Part
from robosc.expressions import Value
from robosc.model.places import Places
from robosc.source import visible
from robosc.strategies import CounterStrategy, GoalBlame, StrategyResult
from robosc.supervisor import Supervisor
from robosc.tables import html_text


@dataclass(frozen=True, slots=True)
class NearestPlace:
    """The nearest to a goal that can be reached.

    Attributes:
        goal: The goal, as a user writes it.
        is_reached: True if the goal is true there: it can be reached, but not again and again, or not with the others.
        has_others: True if there are other goals, with which it cannot be reached again and again.
        events: Events that lead there.
        state: State there, by part of the model.
        missing: Events by which the behaviours alone would lead on to the goal; the first of them is not allowed.
    """

    goal: str
    is_reached: bool
    has_others: bool
    events: tuple[str, ...]
    state: Mapping[str, Value] = field(hash=False)
    missing: tuple[str, ...]

    def __str__(self) -> str:
        where = f"after {events_text(self.events)}" if self.events else "in the initial state"
        state = ", ".join(f"{name} = {value_text(value)}" for name, value in self.state.items())
        if self.is_reached:
            others = " together with the others" if self.has_others else ""
            return f"{self.goal}: it is true {where} ({state}), but not again and again{others}"
        onwards = events_text(self.missing)
        return f"{self.goal} that can be reached: {where} ({state}); {self.missing[0]} is not allowed there" + (
            f", with which the behaviours alone would go on: {onwards}" if len(self.missing) > 1 else ""
        )


@dataclass(frozen=True, slots=True, repr=False)
class GoalExplanation:
    """Explanation why goals cannot be reached.

    Attributes:
        goals: The goals, as a user writes them: they cannot be reached together, and none can be left out.
        is_hopeless: True if they cannot be reached even if the surroundings do all they can for it.
        blamed: Requirements that alone, without any others, exclude the goals.
        is_minimal: True if it is known that each of them is needed for that; without any, the goals cannot be reached
            even without requirements. False if the search was given up, and none are listed.
        helpful: Assumptions with which the goals can be reached, as a user writes them; empty if none are known.
        nearest: The nearest that can be reached if it is hopeless, where it is known.
        has_counter_strategy: True if the surroundings have a counter-strategy that is not too large to be played.
        supervisor: Supervisor that has no strategy for the goals; None if a server has sent the explanation.
        counter: Counter-strategy of the surroundings against the goals; None if it would be too large, or if a server
            has sent the explanation.
    """

    goals: tuple[Part, ...]
    is_hopeless: bool
    blamed: tuple[Part, ...]
    is_minimal: bool
    helpful: tuple[str, ...]
    nearest: NearestPlace | None
    has_counter_strategy: bool
    supervisor: Supervisor | None = field(default=None, hash=False, compare=False)
    counter: CounterStrategy | None = field(default=None, hash=False, compare=False)

    def __repr__(self) -> str:
        return f"<{len(self.goals)} goals cannot be reached; {len(self.blamed)} requirements are to blame>"

    def __str__(self) -> str:
        return "\n".join(visible(line) for line in self._lines())

    def _repr_html_(self) -> str:
        return html_text(str(self))

    def document(self) -> dict[str, Any]:
        """Return the explanation as JSON values."""
        nearest = self.nearest
        return {
            "goals": [_part(item) for item in self.goals],
            "is_hopeless": self.is_hopeless,
            "blamed": [_part(item) for item in self.blamed],
            "is_minimal": self.is_minimal,
            "helpful": list(self.helpful),
            "nearest": None
            if nearest is None
            else {
                "goal": nearest.goal,
                "is_reached": nearest.is_reached,
                "events": list(nearest.events),
                "state": dict(nearest.state),
                "missing": list(nearest.missing),
            },
            "has_counter_strategy": self.has_counter_strategy,
        }

    def _lines(self) -> Iterator[str]:
        yield (
            "cannot be reached, whatever the surroundings do:" if self.is_hopeless else "can be kept from coming true:"
        )
        for item in self.goals:
            yield f"  {_line(item)}"
        if not self.is_minimal:
            yield "which requirements are to blame is not known: the search was given up"
        elif not self.blamed:
            yield "no requirement is to blame: without any it is the same"
        else:
            is_one = len(self.blamed) == 1
            yield f"to blame: {'this alone is' if is_one else 'each of these is needed, and together they are'} enough"
            for item in self.blamed:
                yield f"  {_line(item)}"
        if self.nearest is not None:
            yield f"the nearest to {self.nearest}"
        if self.helpful:
            yield "can be reached, if the surroundings do so, with:"
            for text in self.helpful:
                yield f"  assume {text}"


def goal_explanation(
    supervisor: Supervisor, places: Places, result: StrategyResult, blame: GoalBlame
) -> GoalExplanation:
    """Return the explanation of goals that cannot be reached.

    Args:
        supervisor: Supervisor that has no strategy for them.
        places: Source locations of the model's parts.
        result: Result of the synthesis of a strategy.
        blame: Findings about what is to blame.
    """
    model = supervisor.model
    components = frozenset(item.name for item in model.components)
    requirements = (
        Part("requirement", requirement_text(model.requirements[item], components), places.requirements[item])
        for item in blame.requirements
    )
    invariants = (
        Part("invariant", f"requirement {_invariant(supervisor, item)}", places.invariants[item])
        for item in blame.invariants
    )
    near = blame.nearest
    return GoalExplanation(
        goals=tuple(_aim(supervisor, places, item) for item in result.unreached),
        is_hopeless=result.is_hopeless,
        blamed=(*requirements, *invariants),
        is_minimal=blame.is_known,
        helpful=tuple(map(assumption_text, blame.helpful)),
        nearest=None
        if near is None
        else NearestPlace(
            _aim(supervisor, places, near.goal).text,
            near.is_reached,
            len(result.unreached) > 1,
            *(near.events, near.state, near.missing),
        ),
        has_counter_strategy=blame.counter is not None,
        supervisor=supervisor,
        counter=blame.counter,
    )


def _aim(supervisor: Supervisor, places: Places, number: int) -> Part:
    aim = supervisor.executable.obligations.aims[number]
    name, words = aims_in_words(supervisor)[number]
    if aim.mission is None:
        return Part("goal", f"goal {words}", places.goals[aim.number])
    return Part("visit", f"visit {words} ({name})", places.visits[aim.mission][aim.number])


def _invariant(supervisor: Supervisor, number: int) -> str:
    item = supervisor.model.invariants[number]
    components = frozenset(item.name for item in supervisor.model.components)
    return f"{'never' if item.is_never else 'always'} {in_words(item.expression, components)}"


def _line(part: Part) -> str:
    return part.text if part.location is None else f"{part.location}: {part.text}"


def _part(part: Part) -> dict[str, object]:
    place = part.location
    return {
        "kind": part.kind,
        "text": part.text,
        "location": None
        if place is None
        else {"file": place.file, "line": place.line, "column": place.column, "length": place.length},
    }
