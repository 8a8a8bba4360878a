"""Pieces of CIF text: names, comments, and expressions with their precedence.

CIF (Compositional Interchange Format) is the modelling language of Eclipse ESCET: D. A. van Beek, W. J. Fokkink,
D. Hendriks, A. Hofkamp, J. Markovski, J. M. van de Mortel-Fronczak and M. A. Reniers, "CIF 3: model-based engineering
of supervisory controllers", TACAS 2014, LNCS 8413, pp. 575-580.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from robosc.targets.text import ascii_line

KEYWORDS = frozenset(
    """
    alg alphabet and any assert attr automaton bool break case const cont continue controllable def dict disables disc
    dist div do edge elif else end enum equation event external false file final for forward func goto group id if
    import in initial input int invariant list location marked mod monitor namespace needs not now null on once or
    outside plant post pre print printfile real requirement return sample self set start startonce string sub supervisor
    svgcopy svgfile svgin svgmove svgout switch tau text then time to true tuple type uncontrollable urgent value void
    when while
    abs acos acosh asin asinh atan atanh cbrt ceil cos cosh del empty exp floor fmt ln log max min pop pow round scale
    sign sin sinh size sqrt tan tanh
    bernoulli beta binomial constant erlang exponential gamma geometric lognormal normal poisson random triangle uniform
    weibull
    """.split()
)
"""Words that a CIF name must escape with `$`; to escape a word that is none is harmless."""

LINE_WIDTH = 120
_MAXIMUM_WORDS = 200


def escaped(name: str) -> str:
    """A name as CIF reads it."""
    return f"${name}" if name in KEYWORDS else name


def printable(text: str) -> str:
    """A text for a `//` comment: one line of printable ASCII, in which no comment begins or ends."""
    return ascii_line(text).replace("*/", "* /").replace("/*", "/ *")


def shortened(text: str) -> str:
    """A printable text, cut where it is long."""
    shown = printable(text)
    return shown if len(shown) <= _MAXIMUM_WORDS else f"{shown[: _MAXIMUM_WORDS - 3]}..."


class Level(IntEnum):
    """Binding strength of the outermost operator of a text."""

    IMPLICATION = 0
    OR = 1
    AND = 2
    COMPARISON = 3
    SUM = 4
    PRODUCT = 5
    UNARY = 6
    ATOM = 7


@dataclass(frozen=True, slots=True)
class Text:
    """An expression as CIF text.

    Attributes:
        text: The text.
        level: Binding strength of the text.
        parts: Parts that a conjunction or disjunction joins.
        opposite: Text of the negation of a comparison.
    """

    text: str
    level: Level = Level.ATOM
    parts: tuple["Text", ...] = ()
    opposite: str = ""

    def __str__(self) -> str:
        return self.text

    def within(self, level: Level) -> str:
        """The text for a place that requires `level`, in parentheses where it binds less tightly."""
        return self.text if self.level >= level else f"({self.text})"


TRUE = Text("true")
FALSE = Text("false")


def all_of(parts: Iterable[Text]) -> Text:
    """A conjunction without what is always true."""
    return _joined(parts, "and", Level.AND, TRUE, FALSE)


def any_of(parts: Iterable[Text]) -> Text:
    """A disjunction without what is never true."""
    return _joined(parts, "or", Level.OR, FALSE, TRUE)


def _joined(parts: Iterable[Text], word: str, level: Level, neutral: Text, decisive: Text) -> Text:
    kept: dict[str, Text] = {}
    for part in parts:
        if part == decisive:
            return decisive
        for item in part.parts if part.level == level else (part,):
            if item != neutral:
                kept.setdefault(item.text, item)
    if len(kept) < 2:
        return next(iter(kept.values()), neutral)
    # A disjunction in a conjunction, or the reverse, stands in parentheses: readers need not know which binds first.
    texts = (item.within(Level.COMPARISON) for item in kept.values())
    return Text(f" {word} ".join(texts), level, tuple(kept.values()))


_OPPOSITES = {"=": "!=", "!=": "=", "<": ">=", "<=": ">", ">": "<=", ">=": "<"}


def compared(left: str, operator: str, right: str) -> Text:
    """A comparison of two texts that bind at least as tightly as a sum."""
    opposite = f"{left} {_OPPOSITES[operator]} {right}"
    return Text(f"{left} {operator} {right}", Level.COMPARISON, opposite=opposite)


def negated(text: Text) -> Text:
    """The negation."""
    if text in (TRUE, FALSE):
        return FALSE if text == TRUE else TRUE
    if text.opposite:
        return Text(text.opposite, text.level, opposite=text.text)
    if text.level == Level.UNARY and text.text.startswith("not "):
        return Text(text.text[4:])  # Its operand is a name, or stands in parentheses.
    return Text(f"not {text.within(Level.UNARY)}", Level.UNARY)


def implied(condition: Text, result: Text) -> Text:
    """`condition => result`."""
    if condition == TRUE or result == TRUE:
        return result
    if condition == FALSE:
        return TRUE
    if result == FALSE:
        return negated(condition)
    return Text(f"{condition.within(Level.UNARY)} => {result.within(Level.UNARY)}", Level.IMPLICATION)


def equivalent(left: Text, right: Text) -> Text:
    """Return the condition that two predicates are equal."""
    if TRUE in (left, right):
        return right if left == TRUE else left
    if FALSE in (left, right):
        return negated(right if left == FALSE else left)
    return Text(f"{left.within(Level.UNARY)} <=> {right.within(Level.UNARY)}", Level.IMPLICATION)


def chosen(cases: Iterable[tuple[Text, Text]], otherwise: Text) -> Text:
    """`if ... elif ... else ... end`, without cases that never apply and those behind one that always does."""
    kept: list[tuple[Text, Text]] = []
    for condition, result in cases:
        if condition == TRUE:
            otherwise = result
            break
        if condition != FALSE:
            kept.append((condition, result))
    while kept and kept[-1][1] == otherwise:
        kept.pop()
    if not kept:
        return otherwise
    words = "".join(
        f"{'elif' if place else 'if'} {condition}: {result} " for place, (condition, result) in enumerate(kept)
    )
    return Text(f"{words}else {otherwise} end")


def comment(text: str) -> str:
    """A comment line."""
    return f"// {printable(text)}".rstrip()
