"""Decision diagrams over locations and variables: domains, evaluation and checks."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import overload

from robosc.automata.structure import System
from robosc.expressions.text import variable_text
from robosc.expressions.types import Type, Value, domain
from robosc.supervisor.structure import DecisionDiagram

Subject = tuple[str, str | None]
"""An automaton, and one of its variables or None for its location."""

Domains = Mapping[Subject, "SubjectDomain"]


class SubjectDomain(Sequence[Value]):
    """Values that a place of the state can hold, in the order of their indices.

    Args:
        values: The values.
        type: The variable's type, or None for a location.
    """

    __slots__ = ("_values", "type")

    def __init__(self, values: Sequence[Value], type: Type | None) -> None:  # noqa: A002  # the field's word
        self._values = values
        self.type = type

    def __len__(self) -> int:
        return len(self._values)

    @overload
    def __getitem__(self, index: int) -> Value: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Value]: ...

    def __getitem__(self, index: int | slice) -> Value | Sequence[Value]:
        return self._values[index]


def diagram_domains(system: System) -> dict[Subject, SubjectDomain]:
    """The domain of every place of a system's state."""
    found: dict[Subject, SubjectDomain] = {}
    for automaton in system.automata:
        found[automaton.name, None] = SubjectDomain(automaton.locations, None)
        for variable in automaton.variables:
            found[automaton.name, variable.name] = SubjectDomain(domain(variable.type), variable.type)
    return found


def evaluate(diagram: DecisionDiagram, read: Callable[[str, str | None], int]) -> bool:
    """Return True if a diagram is true in a state.

    Args:
        diagram: A valid diagram.
        read: Function that returns the index of a location or of a variable's value in its domain.
    """
    number = diagram.root
    while number > 1:
        node = diagram.nodes[number - 2]
        number = node.children[bisect_right(node.starts, read(node.automaton, node.variable)) - 1]
    return number == 1


def validate(diagram: DecisionDiagram, domains: Domains) -> None:
    """Check that a diagram can be evaluated and is ordered.

    Raises:
        ValueError: It cannot; the message says what is wrong.
    """
    for place, node in enumerate(diagram.nodes):
        number = place + 2
        domain = domains.get((node.automaton, node.variable))
        if domain is None:
            name = node.automaton if node.variable is None else variable_text(node.automaton, node.variable)
            raise ValueError(f"node {number} tests '{name}', which does not exist or takes no part in synthesis")
        if not node.starts or node.starts[0] != 0 or len(node.starts) != len(node.children):
            raise ValueError(f"node {number} needs one child for each start, and its first start must be 0")
        if any(later <= earlier for earlier, later in zip(node.starts, node.starts[1:], strict=False)):
            raise ValueError(f"the starts of node {number} do not ascend")
        if node.starts[-1] >= len(domain):
            raise ValueError(f"node {number} has a start outside its domain of {len(domain)} values")
        if any(child >= number for child in node.children):
            raise ValueError(f"node {number} has a child that does not stand before it")
    if diagram.root >= len(diagram.nodes) + 2:
        raise ValueError("the root is not a node")
    _require_order(diagram)


def _require_order(diagram: DecisionDiagram) -> None:
    """Check that there is an order of places in which every path tests them, each at most once.

    So no path is longer than the number of places, even in an untrusted diagram.

    Raises:
        ValueError: There is none.
    """
    places = [(node.automaton, node.variable) for node in diagram.nodes]
    sorter = TopologicalSorter[Subject]()
    for place, node in zip(places, diagram.nodes, strict=True):
        sorter.add(place, *(places[child - 2] for child in node.children if child > 1))
    try:
        sorter.prepare()
    except CycleError as error:
        name = ".".join(part for part in error.args[1][0] if part is not None)
        raise ValueError(f"'{name}' is tested before and after something else, or twice, on one path") from None
