"""Decision diagrams over locations and variables: evaluation, checks, and readable formulas where they are small."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import overload

from robosc.automata.structure import System
from robosc.expressions import (
    FALSE,
    TRUE,
    Binary,
    Constant,
    EnumValue,
    Expression,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.expressions.types import EnumType, IntegerType, Type, domain
from robosc.supervisor.structure import DecisionDiagram, DecisionNode

Subject = tuple[str, str | None]
"""An automaton, and one of its variables or None for its location."""

Domains = Mapping[Subject, "SubjectDomain"]


class SubjectDomain(Sequence[Value]):
    """What a place of the state can hold: its values in the order of their indices.

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
    """Whether a diagram is true in a state.

    Args:
        diagram: A valid diagram.
        read: The index of a location or of a variable's value in its domain.
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
            name = node.automaton if node.variable is None else f"{node.automaton}.{node.variable}"
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
        raise ValueError("the root is no node")


def to_expression(diagram: DecisionDiagram, domains: Domains, *, limit: int) -> Expression | None:
    """A formula with the same meaning, or None where it would have more than `limit` operands.

    The size is found before anything is built: a formula can be exponentially larger than its diagram.
    """
    if _size(diagram, domains, limit) > limit:
        return None
    built: list[Expression] = [FALSE, TRUE]
    for node in diagram.nodes:
        built.append(_formula(node, domains[node.automaton, node.variable], built))
    return built[diagram.root]


def _size(diagram: DecisionDiagram, domains: Domains, limit: int) -> int:
    """Operands of the formula, counted no further than just past the limit."""
    sizes = [0, 0]
    for node in diagram.nodes:
        domain = domains[node.automaton, node.variable]
        total = 0
        for child, indices in _branches(node, len(domain)):
            if child != 0:
                total += _test_size(domain, indices) + sizes[child]
        sizes.append(min(total, limit + 1))
    return sizes[diagram.root]


Indices = list[range]
"""Runs of indices, ascending and apart."""


def _branches(node: DecisionNode, count: int) -> list[tuple[int, Indices]]:
    """For each child the indices that lead to it, in the order of their first index."""
    found: dict[int, Indices] = {}
    ends = (*node.starts[1:], count)
    for start, end, child in zip(node.starts, ends, node.children, strict=True):
        found.setdefault(child, []).append(range(start, end))
    return list(found.items())


def _formula(node: DecisionNode, domain: SubjectDomain, built: Sequence[Expression]) -> Expression:
    branches = _branches(node, len(domain))
    if len(branches) == 1:  # A file may hold a node that decides nothing.
        return built[branches[0][0]]
    if len(branches) == 2:
        (first, where), (second, elsewhere) = branches
        if first == 1 or second == 0:
            return _choice(_test(node, domain, where), built[first], built[second])
        if second == 1 or first == 0:
            return _choice(_test(node, domain, elsewhere), built[second], built[first])
    parts = [_both(_test(node, domain, indices), built[child]) for child, indices in branches if child != 0]
    return _any(parts)


def _choice(test: Expression, then: Expression, otherwise: Expression) -> Expression:
    """`test and then`, or `test or otherwise`: one of the two branches is a constant."""
    if otherwise == FALSE:
        return _both(test, then)
    return Binary("or", test, otherwise)


def _both(a: Expression, b: Expression) -> Expression:
    return a if b == TRUE else Binary("and", a, b)


def _any(parts: Sequence[Expression]) -> Expression:
    result = parts[0]
    for part in parts[1:]:
        result = Binary("or", result, part)
    return result


def _all(parts: Sequence[Expression]) -> Expression:
    result = parts[0]
    for part in parts[1:]:
        result = Binary("and", result, part)
    return result


def _test_size(domain: SubjectDomain, indices: Indices) -> int:
    if isinstance(domain.type, IntegerType):
        return 2 * len(indices)
    inside = sum(len(run) for run in indices)
    return max(1, min(inside, len(domain) - inside))


def _test(node: DecisionNode, domain: SubjectDomain, indices: Indices) -> Expression:
    """Whether the subject has one of some indices."""
    inside = [index for run in indices for index in run] if not isinstance(domain.type, IntegerType) else []
    outside = [index for index in range(len(domain)) if index not in inside] if inside else []
    if node.variable is None:
        tests = [StateTest(node.automaton, str(domain[index])) for index in inside]
        others = [Unary("not", StateTest(node.automaton, str(domain[index]))) for index in outside]
        return _any(tests) if len(tests) <= len(others) else _all(others)
    variable = VariableRead(node.automaton, node.variable)
    match domain.type:
        case IntegerType():
            return _any([_between(variable, domain, run) for run in indices])
        case EnumType(name=name):
            equal = [Binary("=", variable, EnumValue(name, str(domain[index]))) for index in inside]
            unequal = [Binary("!=", variable, EnumValue(name, str(domain[index]))) for index in outside]
            return _any(equal) if len(equal) <= len(unequal) else _all(unequal)
        case _:
            return variable if inside == [1] else Unary("not", variable)


def _between(variable: VariableRead, domain: SubjectDomain, run: range) -> Expression:
    low, high = Constant(domain[run[0]]), Constant(domain[run[-1]])
    if len(run) == 1:
        return Binary("=", variable, low)
    if run[-1] == len(domain) - 1:
        return Binary(">=", variable, low)
    if run[0] == 0:
        return Binary("<=", variable, high)
    return Binary("and", Binary(">=", variable, low), Binary("<=", variable, high))
