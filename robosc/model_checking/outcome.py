"""Results of verification: verdicts with the runs that show them, as plain values."""

from dataclasses import dataclass
from enum import StrEnum

from robosc.expressions import Value
from robosc.model_checking.formulas import Formula, Property

State = tuple[Value, ...]
"""A state, in the order of `robosc.automata.state.subjects`."""


class RunKind(StrEnum):
    """Kind of run, by what it shows."""

    WITNESS = "witness"
    """Run that shows that the property holds."""
    COUNTEREXAMPLE = "counterexample"
    """Run that shows that the property does not hold."""


@dataclass(frozen=True, slots=True)
class Remainder:
    """Fact that must hold for a run to show what it is to show, and that this run does not show.

    Attributes:
        place: Place of the state in the run.
        formula: Part of the property.
        holds: True if it holds in that state.
    """

    place: int
    formula: Formula
    holds: bool


@dataclass(frozen=True, slots=True)
class EvidenceRun:
    """A run of the controlled system from an initial state.

    Attributes:
        kind: Kind of run, by what it shows.
        states: The states that it goes through, one more than events.
        events: Event between each two; None where nothing can happen and the state stays as it is.
        loop: Place of the state to which the run comes back from its last one, which is that state again; None for a
            run that ends.
        left: Facts that it leaves to be shown; empty if it shows everything.
    """

    kind: RunKind
    states: tuple[State, ...]
    events: tuple[str | None, ...]
    loop: int | None = None
    left: tuple[Remainder, ...] = ()


@dataclass(frozen=True, slots=True)
class Verdict:
    """The outcome for one property.

    Attributes:
        property: The property.
        holds: True if it holds in every initial state.
        run: A run that shows why, or None where no single run does.
    """

    property: Property
    holds: bool
    run: EvidenceRun | None
