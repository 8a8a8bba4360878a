"""Tree of an expression, built from the flat sequence of operands and operators that the parser reads.

Precedence climbing over the table of operators replaces one grammar rule for each precedence, which a
recursive-descent parser would pass through for every literal. Binary operators associate to the left. Long chains of
`and` and `or` become balanced trees: both are associative, and a chain of a thousand conditions must not need a
thousand levels of recursion.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

from robosc.language import syntax
from robosc.language.limits import MAXIMUM_NESTING
from robosc.source import Location

LEVELS: tuple[frozenset[str], ...] = (
    frozenset({"or"}),
    frozenset({"and"}),
    frozenset({"="}),
    frozenset({"!="}),
    frozenset({">", ">=", "<", "<="}),
    frozenset({"+", "-"}),
    frozenset({"*", "/"}),
)
"""Binary operators, loosest first."""

Report = Callable[[str, str, Location, str], None]
"""Takes code, message, place and fix."""

Operator = tuple[str, Location]

_BALANCED_FROM = 16


class TooDeepError(Exception):
    """A chain of operators would become a tree with too many levels."""


def build(operands: Sequence[syntax.Expression], operators: Sequence[Operator], report: Report) -> syntax.Expression:
    """The tree of `operands` with one operator between each two.

    Args:
        operands: At least one.
        operators: One less, each with its place.
        report: Takes what is wrong: a mixed `=>`.

    Raises:
        TooDeepError: A chain that cannot be balanced has more than `MAXIMUM_NESTING` operands.
    """
    if len(operands) == 1:
        return operands[0]
    if len(operators) == 1:
        text, location = operators[0]
        return syntax.Binary(text, operands[0], operands[1], location)
    if any(text == "=>" for text, _ in operators):
        return _implication(operands, operators, report)
    return _climb(operands, operators, 0)


def _climb(operands: Sequence[syntax.Expression], operators: Sequence[Operator], level: int) -> syntax.Expression:
    while level < len(LEVELS) and not any(text in LEVELS[level] for text, _ in operators):
        level += 1
    if level == len(LEVELS):
        return operands[0]
    cuts = [place for place, (text, _) in enumerate(operators) if text in LEVELS[level]]
    bounds = [-1, *cuts, len(operators)]
    parts = [
        _climb(operands[begin + 1 : end + 1], operators[begin + 1 : end], level + 1) for begin, end in pairwise(bounds)
    ]
    chain = [operators[cut] for cut in cuts]
    if level < 2 and len(parts) > _BALANCED_FROM:
        return _balanced(parts, chain)
    if len(parts) > MAXIMUM_NESTING:
        # Not even built: the interpreter would take such a tree apart level by level on its own stack.
        raise TooDeepError
    tree = parts[0]
    for (text, location), part in zip(chain, parts[1:], strict=True):
        tree = syntax.Binary(text, tree, part, location)
    return tree


def _balanced(parts: Sequence[syntax.Expression], chain: Sequence[Operator]) -> syntax.Expression:
    if len(parts) == 1:
        return parts[0]
    middle = len(parts) // 2
    text, location = chain[middle - 1]
    return syntax.Binary(
        text, _balanced(parts[:middle], chain[: middle - 1]), _balanced(parts[middle:], chain[middle:]), location
    )


def _implication(
    operands: Sequence[syntax.Expression], operators: Sequence[Operator], report: Report
) -> syntax.Expression:
    """`a => b` with plain operands; a chain or a mix is an error that shows the two readings (A.3)."""
    if len(operators) > 1:
        place = next(location for text, location in operators if text == "=>")
        words = " ".join(text for text, _ in operators)
        other = next((text for text, _ in operators if text != "=>"), "=>")
        first, second = (f"(a => b) {other} c", f"a => (b {other} c)")
        if operators[0][0] != "=>":
            first, second = (f"(a {other} b) => c", f"a {other} (b => c)")
        report(
            "ambiguous-implication",
            f"'=>' together with '{other}' ({words}) can be read as '{first}' or as '{second}'",
            place,
            "Put parentheses around the part that is meant.",
        )
        return operands[0]
    text, location = operators[0]
    return syntax.Binary(text, operands[0], operands[1], location)


def depth_of(expression: syntax.Expression) -> int:
    """Levels of a tree, found without recursion."""
    deepest, stack = 0, [(expression, 1)]
    while stack:
        node, depth = stack.pop()
        deepest = max(deepest, depth)
        match node:
            case syntax.Binary(left=left, right=right):
                stack += [(left, depth + 1), (right, depth + 1)]
            case syntax.Unary(operand=operand):
                stack.append((operand, depth + 1))
            case syntax.Conditional(condition=condition, then=then, otherwise=otherwise):
                stack += [(part, depth + 1) for part in (condition, then, otherwise)]
            case syntax.Call(arguments=arguments):
                stack += [(argument, depth + 1) for argument in arguments]
            case syntax.Quantifier(array=array, condition=condition):
                stack += [(array, depth + 1), (condition, depth + 1)]
            case syntax.Access(steps=steps):
                for step in steps:
                    if isinstance(step, syntax.Index):
                        stack.append((step.value, depth + 1))
                    elif isinstance(step, syntax.Slice):
                        stack += [(step.low, depth + 1), (step.high, depth + 1)]
    return deepest
