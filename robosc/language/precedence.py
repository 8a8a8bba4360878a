"""Builds the tree of an expression from the flat run of operands, operators and parentheses that the grammar reads.

One climber over A.3's table replaces a tower of grammar rules, which a recursive-descent parser would walk down for
every literal; parentheses are matched with a stack, so their depth costs no recursion either (E. W. Dijkstra,
Algol 60 translation, Mathematisch Centrum report MR 34/61, 1961: the shunting-yard). Binary operators associate to
the left. Long chains of `and` and `or` become balanced trees: both are associative, and a chain of a thousand
conditions must not need a thousand levels of recursion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from robosc.language import syntax
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
"""Takes code, message, place and mend."""

Operator = tuple[str, Location]

_BALANCED_FROM = 16


@dataclass(slots=True)
class _Group:
    """What stands inside one pair of parentheses, as far as it has been read."""

    opening: Location | None
    operands: list[syntax.Expression] = field(default_factory=list)
    operators: list[Operator] = field(default_factory=list)
    signs: list[Operator] = field(default_factory=list)


class ExpressionBuilder:
    """Takes the tokens of one expression from left to right.

    The grammar has made sure that operands and operators take turns, so every group holds an operand when it is closed.

    Args:
        report: Takes what is wrong: parentheses without a partner, `-` before `!`, a mixed `=>`.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self._groups = [_Group(None)]

    def prefix(self, sign: str, location: Location) -> None:
        """A `!`, `-` or `(` before an operand."""
        if sign == "(":
            self._groups.append(_Group(location))
        else:
            self._groups[-1].signs.append((sign, location))

    def operand(self, tree: syntax.Expression) -> None:
        """A literal or an access, or what a pair of parentheses has become."""
        group = self._groups[-1]
        for (sign, _), (following, place) in pairwise(group.signs):
            if sign == "-" and following == "!":
                self._report("syntax-error", "'-' cannot stand before '!'; expected a number", place, "Remove the '-'.")
        for sign, location in reversed(group.signs):
            tree = syntax.Unary(sign, tree, location)
        group.signs.clear()
        group.operands.append(tree)

    def closing(self, location: Location) -> None:
        """A `)` behind an operand."""
        if len(self._groups) == 1:
            self._report("syntax-error", "this ')' closes nothing", location, "Remove it, or open it with '('.")
        else:
            self._close()

    def operator(self, text: str, location: Location) -> None:
        """A binary operator."""
        self._groups[-1].operators.append((text, location))

    def finish(self) -> syntax.Expression:
        """The whole tree."""
        while len(self._groups) > 1:
            opening = self._groups[-1].opening
            if opening is not None:
                self._report("syntax-error", "this '(' is never closed", opening, "Close it with ')'.")
            self._close()
        return self._tree(self._groups[0])

    def _close(self) -> None:
        group = self._groups.pop()
        self.operand(self._tree(group))

    def _tree(self, group: _Group) -> syntax.Expression:
        return _build(group.operands, group.operators, self._report)


def _build(operands: Sequence[syntax.Expression], operators: Sequence[Operator], report: Report) -> syntax.Expression:
    """The tree of `operands` with one operator between each two."""
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
    return deepest
