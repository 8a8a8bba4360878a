"""Integers in CIF: sums of stored values, with their ranges and the conditions under which they are known.

A variable of `integer(-3..3)` is stored as 0..6, so every expression that reads it subtracts 3. Sums are kept as lists
of terms, so that constants are added up, and a comparison needs no negative number.

CIF's synthesis takes subtraction only as the outermost operator of an assigned value, and no products. So nothing that
stands in something else is ever negative: a choice between sums is one between what they add, less one between what
they subtract, and a multiple is a sum.
"""

from dataclasses import dataclass

from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER
from robosc.targets.cif.text import FALSE, TRUE, Level, Text, chosen, compared

MAXIMUM_FACTOR = 100
"""Greatest multiple that is written as a sum."""

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
        return Text(" + ".join([self.atom.within(Level.PRODUCT)] * abs(self.factor)), Level.SUM)


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
    """`factor * number`; see `has_multiples`."""
    terms = tuple(Term(term.atom, term.low, term.high, factor * term.factor) for term in number.terms if factor)
    return Number(terms, factor * number.constant, known)


def halves(number: Number) -> tuple[Number, Number]:
    """The part that a sum adds, and the part that it subtracts."""
    added = Number(tuple(term for term in number.terms if term.factor > 0), max(number.constant, 0))
    taken = Number(tuple(term for term in number.terms if term.factor < 0), min(number.constant, 0))
    return added, scaled(taken, -1, TRUE)


def selected(test: Text, then: Number, otherwise: Number, known: Text) -> Number:
    """`then` where a test holds, else `otherwise`."""
    lowest, highest = sorted((then.constant, otherwise.constant))
    # A constant that both have stands outside.
    common = max(lowest, 0) + min(highest, 0)
    first, second = (halves(Number(item.terms, item.constant - common)) for item in (then, otherwise))
    found = Number((), common, known)
    for sign, one, other in zip((1, -1), first, second, strict=True):
        text = chosen([(test, number_text(one))], number_text(other))
        if text in (number_text(one), number_text(other)):
            part = one if text == number_text(one) else other
        else:
            ends = (*one.bounds, *other.bounds)
            part = Number((Term(text, min(ends), max(ends)),))
        found = combined(found, part, sign, known)
    return found


def has_multiples(number: Number) -> bool:
    """Return True if a factor of it is too large to be written as a sum."""
    return any(abs(term.factor) > MAXIMUM_FACTOR for term in number.terms)


def fits(number: Number) -> bool:
    """Return True if neither its value nor a sum on the way to it can exceed 32 bits."""
    furthest = abs(number.constant) + sum(max(map(abs, term.bounds)) for term in number.terms)
    low, high = number.bounds
    return furthest <= MAXIMUM_INTEGER and low >= MINIMUM_INTEGER and high <= MAXIMUM_INTEGER


def number_text(number: Number) -> Text:
    """The sum as CIF text."""
    added, taken = (_sum(half) for half in halves(number))
    if taken is None:
        return added or Text("0")
    return Text(f"{added or 0} - {taken.within(Level.PRODUCT)}", Level.SUM)


def _sum(half: Number) -> Text | None:
    """A sum in which nothing is negative; None if there is nothing in it."""
    texts = [term.text for term in half.terms]
    if half.constant:
        texts.append(Text(str(half.constant)))
    if not texts:
        return None
    if len(texts) > 1:
        return Text(" + ".join(item.text for item in texts), Level.SUM)
    # A single atom is as strong as it is by itself.
    return half.terms[0].atom if half.terms and half.terms[0].factor == 1 else texts[0]


def comparison(operator: str, left: Number, right: Number) -> Text:
    """A comparison, with every term on the side where it counts as positive; whether they are known aside."""
    difference = combined(left, right, -1, TRUE)
    decided = _decided(operator, *difference.bounds)
    if decided is not None:
        return TRUE if decided else FALSE
    above, below = halves(difference)
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
