"""Conditions and symbols in CIF, which knows no unknown value."""

from dataclasses import dataclass

from robosc.targets.cif.text import FALSE, TRUE, Text, all_of, any_of, equivalent, implied, negated
from robosc.targets.code.predicates import Logic


@dataclass(frozen=True, slots=True)
class Symbol:
    """A value of an enum, and where it is known."""

    value: Text
    known: Text = TRUE


def _equal(operator: str, left: Text, right: Text) -> Text:
    same = equivalent(left, right)
    return same if operator == "=" else negated(same)


LOGIC = Logic(TRUE, FALSE, all_of, any_of, negated, implied, _equal)
