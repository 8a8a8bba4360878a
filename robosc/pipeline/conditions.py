"""Conditions that a supervisor adds to events, in the model's words."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from robosc.automata import System
from robosc.conditions.literals import Vocabulary
from robosc.conditions.rendering import Line, diagram_lines
from robosc.conditions.summary import ELSEWHERE, FROM_THE_FIRST, added_formulas, condition_line, short_diagrams
from robosc.errors import UnknownNameError
from robosc.expressions import TRUE, Expression
from robosc.expressions.text import cif_text
from robosc.model.findings import did_you_mean
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.diagram import diagram_domains
from robosc.tables import html_table, html_text


@dataclass(frozen=True, slots=True, repr=False)
class Condition:
    """Condition that a supervisor adds to one event.

    Attributes:
        event: The event.
        text: The condition in one line, in the model's words; `true` if nothing is added; the size of the diagram if
            there is no readable formula.
        formula: The condition as an expression, or None if there is no readable one.
        diagram: The condition as a decision diagram, which is authoritative.
        vocabulary: Vocabulary that puts the diagram's nodes into words.
    """

    event: str
    text: str
    formula: Expression | None = field(hash=False)
    diagram: DecisionDiagram
    vocabulary: Vocabulary = field(hash=False, compare=False)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The diagram's nodes in words, the root first; empty if there is a formula."""
        return () if self.formula is not None else diagram_lines(self.diagram, self.vocabulary)

    @property
    def adds_nothing(self) -> bool:
        """True if the supervisor does not restrict the event beyond plants and requirements."""
        return self.formula == TRUE

    def __repr__(self) -> str:
        return f"<{self.event} needs {self.text}>"

    def __str__(self) -> str:
        if self.formula is not None:
            return self.text
        return "\n".join([f"{self.text}{FROM_THE_FIRST}", *map(str, self.lines)])

    def _repr_html_(self) -> str:
        return html_text(str(self))


class Conditions(Mapping[str, Condition]):
    """Conditions that a supervisor adds to each controllable event, in source order."""

    __slots__ = ("_conditions",)

    def __init__(self, conditions: Sequence[Condition]) -> None:
        self._conditions = {item.event: item for item in conditions}

    def __getitem__(self, event: str) -> Condition:
        try:
            return self._conditions[event]
        except KeyError:
            raise UnknownNameError(unknown_event(event, self._conditions, "controllable event")) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._conditions)

    def __len__(self) -> int:
        return len(self._conditions)

    def __contains__(self, event: object) -> bool:
        return event in self._conditions

    def __repr__(self) -> str:
        added = sum(not item.adds_nothing for item in self._conditions.values())
        return f"<conditions of {len(self)} controllable events; something is added to {added}>"

    def __str__(self) -> str:
        return "\n".join(f"{event} needs {text}" for event, text in self._texts())

    def _repr_html_(self) -> str:
        return html_table(("event", "the supervisor adds"), self._texts())

    def _texts(self) -> list[tuple[str, str]]:
        """Each event with its condition; diagrams node by node as long as they have few nodes together."""
        short = short_diagrams(item.diagram for item in self._conditions.values() if item.formula is None)
        return [
            (event, str(item) if item.formula is not None or item.diagram in short else f"{item.text}{ELSEWHERE}")
            for event, item in self._conditions.items()
        ]


def unknown_event(event: object, known: Sequence[str] | Mapping[str, object], what: str = "event") -> str:
    """Return the message that an event does not exist, with the most similar event."""
    near = did_you_mean(str(event), known)
    hint = f"did you mean '{near}'?" if near else f"there are {', '.join(known) or 'none'}"
    return f"there is no {what} {str(event)!r:.100}; {hint}"


def conditions_of(
    added: Sequence[AddedCondition],
    system: System,
    components: frozenset[str],
    *,
    is_cif: bool = False,
) -> Conditions:
    """Return the conditions that a supervisor adds to each controllable event.

    Args:
        added: Conditions that the supervisor adds.
        system: Automata that it supervises.
        components: Names of the automata that go by their own names in conditions.
        is_cif: True if texts are in CIF's notation.
    """
    found = added_formulas(added, system)
    vocabulary = Vocabulary(diagram_domains(system), components, is_cif=is_cif)
    return Conditions(
        [
            Condition(event, _line(diagram, formula, components, is_cif=is_cif), formula, diagram, vocabulary)
            for event, diagram, formula in found
        ]
    )


def condition_of(
    event: str,
    diagram: DecisionDiagram,
    formula: Expression | None,
    system: System,
    components: frozenset[str],
    *,
    is_cif: bool = False,
) -> Condition:
    """Return a condition in words.

    Args:
        event: Event that it is about.
        diagram: The condition.
        formula: The same as an expression, or None where none reads well.
        system: Automata that it is about.
        components: Names of the automata that go by their own names in conditions.
        is_cif: True if texts are in CIF's notation.
    """
    vocabulary = Vocabulary(diagram_domains(system), components, is_cif=is_cif)
    return Condition(event, _line(diagram, formula, components, is_cif=is_cif), formula, diagram, vocabulary)


def _line(diagram: DecisionDiagram, formula: Expression | None, components: frozenset[str], *, is_cif: bool) -> str:
    if formula is None or not is_cif:
        return condition_line(diagram, formula, components)
    return cif_text(formula)
