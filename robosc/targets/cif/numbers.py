"""Integers in CIF: sums of stored values, with their ranges and the conditions under which they are known.

A variable of `integer(-3..3)` is stored as 0..6, so every expression that reads it subtracts 3. Sums are kept as lists
of terms, so that constants are added up, and a comparison needs no negative number.
"""

from dataclasses import dataclass

from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER
from robosc.targets.cif.text import FALSE, TRUE, Level, Text, compared

_MIRRORED = {"=": "=", "!=": "!=", "<": ">", "<=": ">=", ">": "<", ">=": "<="}


@dataclass(frozen=True, slots=True)
class Term:
    """A multiple of something.

    Attributes:
        atom: The thing, as CIF text.
        low: Its least value.
        high: Its greatest value.
        factor: Number of times that it is taken.
    """

    atom: Text
    low: int
    high: int
    factor: int = 1

    @property
    def bounds(self) -> tuple[int, int]:
        """Least and greatest value of the multiple."""
        ends = self.factor * self.low, self.factor * self.high
        return min(ends), max(ends)

    @property
    def text(self) -> Text:
        """The multiple, its sign aside."""
        if abs(self.factor) == 1:
            return Text(self.atom.within(Level.PRODUCT), Level.PRODUCT)
        return Text(f"{abs(self.factor)} * {self.atom.within(Level.UNARY)}", Level.PRODUCT)


@dataclass(frozen=True, slots=True)
class Number:
    """A sum of terms and a constant.

    Attributes:
        terms: The terms, each atom once.
        constant: Constant that is added to them.
        known: Text that holds where the number is known; elsewhere the sum means nothing.
    """

    terms: tuple[Term, ...]
    constant: int = 0
    known: Text = TRUE

    @property
    def bounds(self) -> tuple[int, int]:
        """Least and greatest value."""
        bounds = [term.bounds for term in self.terms]
        return self.constant + sum(low for low, _ in bounds), self.constant + sum(high for _, high in bounds)


def combined(left: Number, right: Number, sign: int, known: Text) -> Number:
    """`left + sign * right`."""
    found = {term.atom.text: term for term in left.terms}
    for term in right.terms:
        factor = sign * term.factor + (found[term.atom.text].factor if term.atom.text in found else 0)
        found[term.atom.text] = Term(term.atom, term.low, term.high, factor)
    terms = tuple(term for term in found.values() if term.factor)
    return Number(terms, left.constant + sign * right.constant, known)


def scaled(number: Number, factor: int, known: Text) -> Number:
    """`factor * number`."""
    terms = tuple(Term(term.atom, term.low, term.high, factor * term.factor) for term in number.terms if factor)
    return Number(terms, factor * number.constant, known)


def fits(number: Number) -> bool:
    """Return True if neither its value nor a sum on the way to it can exceed 32 bits."""
    furthest = abs(number.constant) + sum(max(map(abs, term.bounds)) for term in number.terms)
    low, high = number.bounds
    return furthest <= MAXIMUM_INTEGER and low >= MINIMUM_INTEGER and high <= MAXIMUM_INTEGER


def number_text(number: Number) -> Text:
    """The sum as CIF text."""
    added = [term.text.text for term in number.terms if term.factor > 0]
    removed = [term.text.text for term in number.terms if term.factor < 0]
    rest = number.constant
    if not added:
        added, rest = [str(rest)], 0
    pieces = [" + ".join(added), *(f" - {text}" for text in removed)]
    if rest:
        pieces.append(f" {'+' if rest > 0 else '-'} {abs(rest)}")
    if len(pieces) == 1 and len(added) == 1:
        first = next((term for term in number.terms if term.factor > 0), None)
        if first is None:
            return Text(added[0], Level.UNARY if number.constant < 0 else Level.ATOM)
        return first.atom if first.factor == 1 else first.text
    return Text("".join(pieces), Level.SUM)


def comparison(operator: str, left: Number, right: Number) -> Text:
    """A comparison, with every term on the side where it counts as positive; whether they are known aside."""
    difference = combined(left, right, -1, TRUE)
    decided = _decided(operator, *difference.bounds)
    if decided is not None:
        return TRUE if decided else FALSE
    constant = difference.constant
    above = Number(tuple(term for term in difference.terms if term.factor > 0), max(constant, 0))
    below = scaled(Number(tuple(term for term in difference.terms if term.factor < 0), min(constant, 0)), -1, TRUE)
    if not above.terms:
        above, below, operator = below, above, _MIRRORED[operator]
    return compared(number_text(above).within(Level.SUM), operator, number_text(below).within(Level.SUM))


def _decided(operator: str, low: int, high: int) -> bool | None:
    """Return the constant outcome of comparing something from `low` to `high` with 0, or None if it depends."""
    match operator:
        case "<":
            return True if high < 0 else False if low >= 0 else None
        case "<=":
            return True if high <= 0 else False if low > 0 else None
        case ">":
            return True if low > 0 else False if high <= 0 else None
        case ">=":
            return True if low >= 0 else False if high < 0 else None
        case "=":
            return True if low == high == 0 else False if low > 0 or high < 0 else None
        case _:
            return False if low == high == 0 else True if low > 0 or high < 0 else None
