"""Integers as vectors of predicates: two's complement, least significant bit first, exact in width.

Ripple-carry addition, shift-and-add multiplication, comparison by the sign of a difference. No operation wraps
around: the width of a result always suffices for its bounds.
"""

from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from robosc.synthesis.engines import Manager


class Vector(msgspec.Struct, frozen=True):
    """An integer that depends on the state.

    Attributes:
        bits: Predicates, least significant first, the last one the sign.
        low: A lower bound of its value.
        high: An upper bound.
    """

    bits: tuple[Any, ...]
    low: int
    high: int


def width_for(low: int, high: int) -> int:
    """Bits of two's complement that hold every value from `low` to `high`."""
    return max((low if low >= 0 else ~low).bit_length(), (high if high >= 0 else ~high).bit_length()) + 1


class Arithmetic:
    """Operations on vectors of one manager.

    Args:
        manager: The manager.
        pause: Called before each bit of a sum, which is where diagrams grow: it may end the work with an error.
    """

    def __init__(self, manager: Manager, pause: Callable[[], None]) -> None:
        self._manager = manager
        self._pause = pause

    def constant(self, value: int) -> Vector:
        """A number."""
        bits = tuple(self._truth((value >> place) & 1) for place in range(width_for(value, value)))
        return Vector(bits, value, value)

    def unsigned(self, bits: Sequence[Any], high: int) -> Vector:
        """A number from 0 to `high` of plain bits, least significant first."""
        return Vector((*bits, self._manager.false), 0, high)

    def add(self, a: Vector, b: Vector) -> Vector:
        """The sum."""
        low, high = a.low + b.low, a.high + b.high
        width = width_for(low, high)
        return Vector(self._sum(self._extend(a, width), self._extend(b, width), self._manager.false), low, high)

    def negate(self, a: Vector) -> Vector:
        """The opposite number."""
        low, high = -a.high, -a.low
        width = width_for(min(low, a.low), max(high, a.high))
        inverted = tuple(~bit for bit in self._extend(a, width))
        zero = (self._manager.false,) * width
        return Vector(self._sum(inverted, zero, self._manager.true), low, high)

    def subtract(self, a: Vector, b: Vector) -> Vector:
        """The difference."""
        return self.add(a, self.negate(b))

    def multiply(self, a: Vector, b: Vector) -> Vector:
        """The product."""
        corners = (a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high)
        low, high = min(corners), max(corners)
        width = width_for(low, high)
        first, second = self._extend(a, width), self._extend(b, width)
        total = (self._manager.false,) * width
        for place, bit in enumerate(second):
            shifted = ((self._manager.false,) * place + first)[:width]
            total = self._sum(total, tuple(bit & other for other in shifted), self._manager.false)
        return Vector(total, low, high)

    def divide(self, a: Vector, b: Vector) -> tuple[Vector, Vector]:
        """The quotient, towards zero, and the remainder, with the sign of `a`; both 0 where `b` is 0.

        Restoring division, a bit of the quotient at a time.
        """
        zero = self.constant(0)
        negative_a, negative_b = self.less(a, zero), self.less(b, zero)
        dividend, divisor = self._magnitude(a, negative_a), self._magnitude(b, negative_b)
        defined = ~self.equal(b, zero)
        rest, quotient = zero, []
        for bit in reversed(dividend.bits):
            doubled = Vector((bit, *rest.bits), 0, 2 * rest.high + 1)
            fits = ~self.less(doubled, divisor) & defined
            kept = self.choose(fits, self.subtract(doubled, divisor), doubled)
            # Less than the divisor, and no more than what was brought down of the dividend.
            rest = self.within(kept, 0, max(0, min(doubled.high, divisor.high - 1)))
            quotient.append(fits)
        whole = self.unsigned(quotient[::-1], dividend.high)
        differ = self._manager.ite(negative_a, ~negative_b, negative_b)
        most = min(dividend.high, max(0, divisor.high - 1))
        remainder = self.choose(negative_a, self.negate(rest), rest)
        masked = tuple(bit & defined for bit in self._extend(remainder, width_for(-most, most)))
        return self.choose(differ, self.negate(whole), whole), Vector(masked, -most, most)

    def _magnitude(self, a: Vector, negative: Any) -> Vector:
        return self.within(self.choose(negative, self.negate(a), a), 0, max(abs(a.low), abs(a.high)))

    def choose(self, condition: Any, a: Vector, b: Vector) -> Vector:
        """`a` where the condition is true, else `b`."""
        low, high = min(a.low, b.low), max(a.high, b.high)
        width = width_for(low, high)
        pairs = zip(self._extend(a, width), self._extend(b, width), strict=True)
        return Vector(tuple(self._manager.ite(condition, first, second) for first, second in pairs), low, high)

    def within(self, a: Vector, low: int, high: int) -> Vector:
        """The same number with closer bounds, which it is known to keep where it matters."""
        return Vector(self._extend(a, width_for(low, high)), low, high)

    def less(self, a: Vector, b: Vector) -> Any:
        """Return the predicate that a < b."""
        if a.high < b.low:
            return self._manager.true
        if a.low >= b.high:
            return self._manager.false
        return self.subtract(a, b).bits[-1]

    def equal(self, a: Vector, b: Vector) -> Any:
        """Return the predicate that a = b."""
        width = max(len(a.bits), len(b.bits))
        result = self._manager.true
        for first, second in zip(self._extend(a, width), self._extend(b, width), strict=True):
            result = result & self._manager.ite(first, second, ~second)
        return result

    def _truth(self, bit: int) -> Any:
        return self._manager.true if bit else self._manager.false

    def _extend(self, a: Vector, width: int) -> tuple[Any, ...]:
        return (*a.bits[:width], *(a.bits[-1],) * (width - len(a.bits)))

    def _sum(self, a: Sequence[Any], b: Sequence[Any], carry: Any) -> tuple[Any, ...]:
        result = []
        for first, second in zip(a, b, strict=True):
            self._pause()
            differ = self._manager.ite(first, ~second, second)
            result.append(self._manager.ite(differ, ~carry, carry))
            carry = self._manager.ite(differ, carry, first)
        return tuple(result)
