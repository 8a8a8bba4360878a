"""The part of CIF that its data-based synthesis takes, as its manual lists it under supported specifications.

Integers are never negative, are added, and are divided by constants above zero; a subtraction is the outermost operator
of an assigned value and stands nowhere else; what is constant may be computed in any way.
"""

from collections.abc import Iterator

from support.cif_parser import Apply, Name, Node, Specification, parse

_LOGIC = ("and", "or", "=>", "<=>", "not")
_EQUAL = ("=", "!=")
_ORDERED = ("<", "<=", ">", ">=")


def problems(text: str) -> list[str]:
    """The parts of a text that synthesis of CIF refuses."""
    return [*_problems(parse(text))]


def _problems(read: Specification) -> Iterator[str]:
    if not any(item.kind == "plant" for item in read.automata):
        yield "there is no plant"
    for name, node in read.algebraics:
        yield from _refused(node, f"algebraic variable {name}")
    for event, node in read.requirements:
        yield from _refused(node, f"requirement on {event}")
    for automaton in read.automata:
        variables = [(name, type_) for name, type_, _ in automaton.variables]
        for name, type_ in (*automaton.inputs, *variables):
            if type_.name == "int" and (type_.low < 0 or type_.high == 2**31 - 1):
                yield f"{automaton.name}.{name}: the range {type_.low}..{type_.high}"
        for name, _, value in automaton.variables:
            yield from _refused(value, f"initial value of {automaton.name}.{name}")
        for place in automaton.locations:
            for edge in place.edges:
                yield from _refused(edge.guard, f"a guard of {automaton.name}.{place.name}")
                names = [name for name, _ in edge.updates]
                if len(names) != len(set(names)):
                    yield f"an edge of {automaton.name}.{place.name} assigns twice"
                for name, value in edge.updates:
                    where = f"an update of {automaton.name}.{name}"
                    if isinstance(value, Apply) and value.operator == "-" and _constant(value) is None:
                        for operand in value.operands:
                            yield from _refused(operand, where)
                    else:
                        yield from _refused(value, where)


def _constant(node: Node) -> int | None:
    """The value of an integer expression that reads nothing."""
    if isinstance(node, int) and not isinstance(node, bool):
        return node
    if not isinstance(node, Apply) or node.operator not in ("+", "-", "*", "negative"):
        return None
    values = [_constant(item) for item in node.operands]
    if None in values:
        return None
    first, *rest = (item for item in values if item is not None)
    if node.operator == "negative":
        return -first
    return {"+": first + sum(rest), "-": first - sum(rest), "*": first * (rest or [1])[0]}[node.operator]


def _refused(node: Node, where: str) -> Iterator[str]:
    """Yield what is refused in an expression, a condition or a value."""
    if isinstance(node, bool | Name):
        return
    constant = _constant(node)
    if constant is not None:
        if constant < 0:
            yield f"{where}: {constant} is negative"
        return
    assert isinstance(node, Apply)
    match node.operator:
        case "div" | "mod":
            divisor = _constant(node.operands[1])
            if divisor is None or divisor <= 0:
                yield f"{where}: {node.operator} by {node.operands[1]}"
            yield from _refused(node.operands[0], where)
        case "+" | "if":
            for item in node.operands:
                yield from _refused(item, where)
        case operator if operator in (*_LOGIC, *_EQUAL, *_ORDERED):
            for item in node.operands:
                yield from _refused(item, where)
        case operator:
            yield f"{where}: {operator} in {node}"
