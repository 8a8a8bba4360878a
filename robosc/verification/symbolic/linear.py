"""Integers as linear forms over single bits, by cases; a relation between two is one inequality or congruence.

Numbers are not added bit by bit: a comparison is a weighted sum of bits against a bound. Its diagram is built from the
top down, and nodes with the same rest of the bound are merged. Minima, choices, quotients and remainders by a constant
are cases, each with its own linear form.

Source: I. Abio, R. Nieuwenhuis, A. Oliveras, E. Rodriguez-Carbonell and V. Mayer-Eichberger, "A new look at BDDs for
pseudo-Boolean constraints", J. Artificial Intelligence Research 45, 2012, pp. 443-480 (section 5, for intervals of
bounds; here each bound is a node, and weights of one power of two next to each other keep their number small).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import lcm
from typing import Any

from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER
from robosc.verification.symbolic.variables import Digits, Variables

MAXIMUM_CASES = 2_000
"""Cases that one integer may have."""


class NotLinearError(Exception):
    """An expression is no integer of linear forms, or has too many cases."""


@dataclass(frozen=True, slots=True)
class Form:
    """A sum of bits, each with its weight, and a constant, all divided by a number: whole wherever it is used.

    Attributes:
        weights: Bits and their weights, none of them 0; in the order of their names.
        constant: Constant that is added to them.
        divisor: Positive number by which the sum is divided.
    """

    weights: tuple[tuple[str, int], ...]
    constant: int
    divisor: int = 1

    def plus(self, other: "Form", factor: int = 1) -> "Form":
        """This form and another one times a factor."""
        divisor = lcm(self.divisor, other.divisor)
        mine, its = divisor // self.divisor, factor * (divisor // other.divisor)
        weights = {name: weight * mine for name, weight in self.weights}
        for name, weight in other.weights:
            weights[name] = weights.get(name, 0) + weight * its
        kept = tuple(sorted((name, weight) for name, weight in weights.items() if weight))
        return Form(kept, self.constant * mine + other.constant * its, divisor)

    def times(self, factor: int) -> "Form":
        """This form times a number."""
        return Form((), 0).plus(self, factor)

    def divided(self, number: int) -> "Form":
        """This form, which is a multiple of a number, divided by that."""
        signed = self if number > 0 else self.times(-1)
        return Form(signed.weights, signed.constant, signed.divisor * abs(number))

    def bounds(self) -> tuple[int, int]:
        """Return a lower and an upper bound of the undivided sum."""
        low = sum(weight for _, weight in self.weights if weight < 0)
        return low + self.constant, sum(weight for _, weight in self.weights if weight > 0) + self.constant


Cases = tuple[tuple[Any, Form], ...]
"""Predicates for where an integer has a form; they exclude each other, and beyond all of them it is unknown."""


class Linear:
    """Relations between forms.

    Args:
        variables: The variables.
    """

    def __init__(self, variables: Variables) -> None:
        self._variables = variables
        self._manager = variables.manager

    def form(self, digits: Digits) -> Form:
        """The integer that some digits hold."""
        weights = ((name, 1 << rank) for rank, name in enumerate(reversed(digits.names)))
        return Form(tuple(sorted(weights)), int(digits.values[0]))

    # Predicates

    def compared(self, operator: str, a: Form, b: Form) -> Any:
        """Return the predicate that a comparison of two forms is true."""
        difference = a.plus(b, -1)
        match operator:
            case "=":
                return self._zero(difference)
            case "!=":
                return ~self._zero(difference)
            case "<=":
                return self._at_most(difference, 0)
            case "<":
                return self._at_most(difference, -1)
            case ">":
                return ~self._at_most(difference, 0)
            case _:
                return ~self._at_most(difference, -1)

    def between(self, a: Form, low: int, high: int) -> Any:
        """Return the predicate that a form is between two numbers."""
        return self.compared(">=", a, Form((), low)) & self.compared("<=", a, Form((), high))

    def _at_most(self, form: Form, most: int) -> Any:
        """Return the predicate that the undivided sum is at most a number."""

        def known(left: int, least: int, greatest: int) -> bool | None:
            return True if left >= greatest else False if left < least else None

        return self._held(form.weights, most - form.constant, known, lambda left: left)

    def _zero(self, form: Form) -> Any:
        """Return the predicate that the sum is 0."""

        def known(left: int, least: int, greatest: int) -> bool | None:
            return left == 0 if least == greatest else None if least <= left <= greatest else False

        return self._held(form.weights, -form.constant, known, lambda left: left)

    def congruent(self, form: Form, number: int, modulus: int) -> Any:
        """Return the predicate that a form, which is whole, and a number leave the same remainder."""
        whole = modulus * form.divisor

        def known(left: int, least: int, greatest: int) -> bool | None:
            return left == 0 if least == greatest else None

        left = number * form.divisor - form.constant
        return self._held(form.weights, left % whole, known, lambda left: left % whole)

    def _held(
        self,
        weights: Sequence[tuple[str, int]],
        left: int,
        known: Callable[[int, int, int], bool | None],
        reduced: Callable[[int], int],
    ) -> Any:
        """Return the predicate that the weights of the bits that are set relate to a number as wanted.

        Args:
            weights: Bits and weights.
            left: The number.
            known: The outcome for what is left of the number beneath some bits, given the least and the greatest sum
                of the bits there; None where it depends on them. Without bits it is known.
            reduced: Function that returns the number that stands for all numbers that make no difference.
        """
        ordered = sorted(weights, key=lambda item: self._variables.level[item[0]])
        least, greatest = [0], [0]
        for _, weight in reversed(ordered):
            least.append(least[-1] + min(weight, 0))
            greatest.append(greatest[-1] + max(weight, 0))
        least.reverse()
        greatest.reverse()
        # The remainders after each bit, then the nodes from the lowest bit up.
        layers: list[dict[int, None]] = [{left: None}]
        for place, (_, weight) in enumerate(ordered):
            open_ = [item for item in layers[-1] if known(item, least[place], greatest[place]) is None]
            self._variables.work.spend(1 + len(open_))
            layers.append(dict.fromkeys(reduced(after) for item in open_ for after in (item, item - weight)))
        truth = {True: self._manager.true, False: self._manager.false}
        made: dict[int, Any] = {}
        for place in range(len(ordered), -1, -1):
            below, made = made, {}
            for item in layers[place]:
                outcome = known(item, least[place], greatest[place])
                if outcome is None:
                    name, weight = ordered[place]
                    high, low = below[reduced(item - weight)], below[reduced(item)]
                    made[item] = self._manager.ite(self._manager.var(name), high, low)
                else:
                    made[item] = truth[outcome]
        return self._variables.work.count(made[left])

    # Cases

    def collected(self, cases: Iterable[tuple[Any, Form]]) -> Cases:
        """Cases with equal forms put together, what is impossible or beyond 32 bits left out.

        Raises:
            NotLinearError: There are too many.
        """
        found: dict[Form, Any] = {}
        for where, form in cases:
            low, high = form.bounds()
            if low < MINIMUM_INTEGER * form.divisor or high > MAXIMUM_INTEGER * form.divisor:
                where = where & self.between(form, MINIMUM_INTEGER, MAXIMUM_INTEGER)
            if where != self._manager.false:
                found[form] = found[form] | where if form in found else where
                if len(found) > MAXIMUM_CASES:
                    raise NotLinearError
        return tuple((self._variables.work.count(where), form) for form, where in found.items())

    def joined(self, a: Cases, b: Cases, function: Callable[[Form, Form], Iterable[tuple[Any, Form]]]) -> Cases:
        """Return the result of a function on the forms of two integers, case by case."""
        if len(a) * len(b) > MAXIMUM_CASES:
            raise NotLinearError
        return self.collected(
            (first & second & where, form)
            for first, one in a
            for second, other in b
            for where, form in function(one, other)
        )

    def lesser(self, one: Form, other: Form) -> list[tuple[Any, Form]]:
        """The lesser of two forms."""
        is_first = self.compared("<=", one, other)
        return [(is_first, one), (~is_first, other)]

    def greater(self, one: Form, other: Form) -> list[tuple[Any, Form]]:
        """The greater of two forms."""
        is_first = self.compared(">=", one, other)
        return [(is_first, one), (~is_first, other)]

    def product(self, one: Form, other: Form) -> list[tuple[Any, Form]]:
        """The product of two forms, one of them a constant."""
        if other.weights:
            one, other = other, one
        if other.weights or other.constant % other.divisor:
            raise NotLinearError
        return [(self._manager.true, one.times(other.constant // other.divisor))]

    def quotient(self, one: Form, other: Form) -> list[tuple[Any, Form]]:
        """The quotient by a constant, towards zero."""
        by = self._constant(other)
        return [(where, one.plus(Form((), -rest)).divided(by)) for where, rest in self._remainders(one, by)]

    def remainder(self, one: Form, other: Form) -> list[tuple[Any, Form]]:
        """The remainder by a constant, with the sign of what is divided."""
        return [(where, Form((), rest)) for where, rest in self._remainders(one, self._constant(other))]

    @staticmethod
    def _constant(form: Form) -> int:
        if form.weights or form.constant % form.divisor:
            raise NotLinearError
        return form.constant // form.divisor

    def _remainders(self, form: Form, by: int) -> list[tuple[Any, int]]:
        """Return the predicate of each remainder, with the remainder; division by 0 leaves none."""
        if abs(by) > MAXIMUM_CASES:
            raise NotLinearError
        negative = self.compared("<", form, Form((), 0))
        found = []
        for rest in range(abs(by)):
            found.append((~negative & self.congruent(form, rest, abs(by)), rest))
            # Below zero a remainder is negative, and 0 stands for both.
            found.append((negative & self.congruent(form, -rest, abs(by)), -rest))
        return found
