"""Conditions and symbols in CIF, which knows no unknown value: strong Kleene logic in two predicates."""

from collections.abc import Sequence
from dataclasses import dataclass

from robosc.targets.cif.text import TRUE, Text, all_of, any_of, equivalent, implied, negated


@dataclass(frozen=True, slots=True)
class Predicate:
    """A condition.

    Attributes:
        true: Text that holds where the condition is true.
        false: Text that holds where the condition is false; None if that is wherever it is not true.
    """

    true: Text
    false: Text | None = None

    @property
    def is_false(self) -> Text:
        """Text that holds where it is false."""
        return negated(self.true) if self.false is None else self.false

    @property
    def known(self) -> Text:
        """Text that holds where it is known."""
        return TRUE if self.false is None else any_of([self.true, self.false])


@dataclass(frozen=True, slots=True)
class Symbol:
    """A value of an enum, and where it is known."""

    value: Text
    known: Text = TRUE


def connected(operator: str, parts: Sequence[Predicate]) -> Predicate:
    """A conjunction or disjunction."""
    join, opposite = (all_of, any_of) if operator == "and" else (any_of, all_of)
    true = join(item.true for item in parts)
    if all(item.false is None for item in parts):
        return Predicate(true)
    return Predicate(true, opposite(item.is_false for item in parts))


def implication(left: Predicate, right: Predicate) -> Predicate:
    """`left => right`."""
    if left.false is None and right.false is None:
        return Predicate(implied(left.true, right.true))
    return Predicate(any_of([left.is_false, right.true]), all_of([left.true, right.is_false]))


def same_truth(left: Predicate, right: Predicate) -> Predicate:
    """Return the condition that two conditions are equal."""
    if left.false is None and right.false is None:
        return Predicate(equivalent(left.true, right.true))
    pairs = (left.true, right.true), (left.is_false, right.is_false)
    crossed = (left.true, right.is_false), (left.is_false, right.true)
    return Predicate(any_of(map(all_of, pairs)), any_of(map(all_of, crossed)))


def opposite(predicate: Predicate) -> Predicate:
    """Its negation."""
    return Predicate(negated(predicate.true)) if predicate.false is None else Predicate(predicate.false, predicate.true)
