"""Builds and checks limits: the bounds into which numbers of requests are moved."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations, product
from math import prod

from robosc.errors import RelatedPlace
from robosc.expressions import (
    DoubleType,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    StateTest,
    Type,
    Value,
    VariableRead,
    domain,
    is_finite,
    leaves,
    type_text,
)
from robosc.expressions.evaluate import evaluate
from robosc.language import syntax
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.structure import Behaviour, Bound, Communication, Limit
from robosc.model.typed import constant_value
from robosc.model.types import Types
from robosc.model.units import unique
from robosc.source import Location

_MAXIMUM_COMBINATIONS = 10_000
"""Combinations of states and values that are tried to find out whether two conditions can hold together."""

_State = Mapping[tuple[str, str | None], Value]

_NUMBERS = (DoubleType, IntegerType)


class LimitBuilder:
    """Builder of limits.

    Args:
        checker: Checker that resolves expressions of the robot.
        types: All types.
        findings: Findings to which faults are reported.
    """

    def __init__(self, checker: ExpressionChecker, types: Types, findings: Findings) -> None:
        self._checker = checker
        self._types = types
        self._findings = findings

    def build(self, tree: syntax.Limit, communications: Mapping[str, Communication]) -> Limit | None:
        """A limit of the model, or None where it is broken."""
        name = tree.communication
        condition = None if tree.condition is None else self._checker.condition(tree.condition)
        request = self._findings.request_of(
            name,
            communications,
            "limit-on-outgoing",
            "a component sends it, and nothing can move its numbers",
            "Limit an incoming message, a service or an action.",
        )
        if request is None:
            return None
        bounds = self._bounds(tree.range, request, name, ())
        if bounds is None or (tree.condition is not None and condition is None):
            return None
        return Limit(name.text, bounds, condition)

    def _bounds(
        self, tree: syntax.ObjectRange | syntax.Range, wanted: Type, name: syntax.Name, path: tuple[str, ...]
    ) -> tuple[Bound, ...] | None:
        """The bounds of the numbers at a path and below it, or None where one is broken."""
        if isinstance(tree, syntax.ObjectRange):
            return self._object(tree, wanted, path)
        if not isinstance(wanted, _NUMBERS):
            self._mismatch(name, wanted, tree.location)
            return None
        low, high = (self._end(end, wanted) for end in (tree.low, tree.high))
        if low is None or high is None:
            return None
        if low > high:
            self._findings.error(
                "empty-limit",
                f"no number is in {low}..{high}",
                tree.location,
                f"Write the lower bound first: '{self._written(tree.high, high)}..{self._written(tree.low, low)}'.",
            )
            return None
        if isinstance(wanted, IntegerType) and not _can_be_within(wanted, low, high):
            self._findings.error(
                "empty-limit",
                f"no number of {type_text(wanted)} is in {low}..{high}",
                tree.location,
                "Let the bounds have a number in common with the type.",
            )
            return None
        return (Bound(path, low, high),)

    def _written(self, tree: syntax.Expression, value: float) -> str:
        """Return an end as it is written, where that is one name or number, else its value."""
        return tree.root.text if isinstance(tree, syntax.Access) and tree.root and not tree.steps else f"{value}"

    def _object(self, tree: syntax.ObjectRange, wanted: Type, path: tuple[str, ...]) -> tuple[Bound, ...] | None:
        if not isinstance(wanted, ObjectType):
            self._findings.error(
                "type-mismatch",
                f"ranges of properties cannot stand for {type_text(wanted)}",
                tree.location,
                "Write a plain range, such as '0..1'." if isinstance(wanted, _NUMBERS) else "Remove the limit.",
            )
            return None
        unique([name for name, _ in tree.properties], "duplicate-property", "property", self._findings)
        found: list[Bound] = []
        is_sound = True
        for name, part in tree.properties:
            type_ = self._types.property_type(wanted, name.text)
            if type_ is None:
                known = self._types.property_names(wanted)
                self._findings.unknown(f"property of '{wanted.name}'", name.text, name.location, known)
                is_sound = False
                continue
            self._findings.bindings.bind(name, self._types.property_places.get((wanted.name, name.text)))
            bounds = self._bounds(part, type_, name, (*path, name.text))
            found += bounds or ()
            is_sound = is_sound and bounds is not None
        return tuple(found) if is_sound else None

    def _mismatch(self, name: syntax.Name, found: Type, place: Location) -> None:
        if isinstance(found, ObjectType):
            fix = "Write '{ property: low..high }' for its numbers."
        else:
            fix = "Remove it: only a number can be moved into bounds."
        words = "no data" if isinstance(found, NoneType) else type_text(found)
        self._findings.error("type-mismatch", f"'{name.text}' is {words}, and bounds need a number", place, fix)

    def _end(self, tree: syntax.Expression, wanted: Type) -> int | float | None:
        """The value of an end of a range, or None after reporting what is wrong."""
        is_double = isinstance(wanted, DoubleType)
        typed = self._checker.fitting(tree, DoubleType() if is_double else IntegerType())
        if typed is None:
            return None
        value = constant_value(typed.expression)
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._findings.error(
                "not-constant",
                "a bound is a number that is known in advance",
                tree.location,
                "Compute it from numbers and constants, without dividing by zero or leaving 32 bits.",
            )
            return None
        return float(value) if is_double else value


def _can_be_within(type_: IntegerType, low: float, high: float) -> bool:
    """Return True if a type has a number from low to high."""
    return (type_.low is None or type_.low <= high) and (type_.high is None or low <= type_.high)


def check_together(
    limits: Sequence[Limit], places: Sequence[Location], behaviours: Mapping[str, Behaviour], findings: Findings
) -> None:
    """Report limits on one number that can apply together and have no number in common."""
    for (first, before), (second, place) in combinations(zip(limits, places, strict=True), 2):
        if first.communication != second.communication:
            continue
        for one, other in product(first.bounds, second.bounds):
            if one.path != other.path or max(one.low, other.low) <= min(one.high, other.high):
                continue
            name = ".".join((first.communication, *one.path))
            message = f"no number is in {one.low}..{one.high} and {other.low}..{other.high}"
            related = RelatedPlace("the other limit is here", before)
            conditions = [item.condition for item in (first, second) if item.condition is not None]
            if len(set(conditions)) < 2 and len(conditions) != 1:
                fix = "Let the two have a number in common, or remove one of them."
                findings.error("empty-limit", f"{message}: '{name}' has none", place, fix, related)
            elif can_hold_together(conditions, behaviours):
                fix = "Let the two have a number in common, or let their conditions exclude each other."
                words = f"{message}: while both apply, '{first.communication}' is never sent"
                findings.warning("contradictory-limits", words, place, fix, related)


def can_hold_together(conditions: Sequence[Expression], behaviours: Mapping[str, Behaviour]) -> bool:
    """Return False if no combination of states and values, reachable or not, lets all conditions be other than false.

    Where there are too many to try, they count as possible.
    """
    places = dict.fromkeys(_places(conditions))
    domains = [_domain(component, variable, behaviours) for component, variable in places]
    if any(item is None for item in domains):
        return True
    values = [item for item in domains if item is not None]
    if prod(map(len, values)) > _MAXIMUM_COMBINATIONS:
        return True
    return any(_are_possible(conditions, dict(zip(places, chosen, strict=True))) for chosen in product(*values))


def _are_possible(conditions: Iterable[Expression], state: _State) -> bool:
    def location(component: str) -> str:
        return str(state[component, None])

    def variable(component: str, name: str) -> Value:
        return state[component, name]

    return all(evaluate(condition, variable, location) is not False for condition in conditions)


def _places(conditions: Iterable[Expression]) -> Iterator[tuple[str, str | None]]:
    for condition in conditions:
        for leaf in leaves(condition):
            if isinstance(leaf, VariableRead):
                yield leaf.component, leaf.variable
            elif isinstance(leaf, StateTest):
                yield leaf.component, None


def _domain(component: str, variable: str | None, behaviours: Mapping[str, Behaviour]) -> Sequence[Value] | None:
    """All states of a component or values of a variable; None where there are too many to try."""
    behaviour = behaviours[component]
    if variable is None:
        return [state.name for state in behaviour.states]
    type_ = next(item.type for item in behaviour.variables if item.name == variable)
    if not is_finite(type_) or (isinstance(type_, IntegerType) and _size(type_) > _MAXIMUM_COMBINATIONS):
        return None
    return domain(type_)


def _size(type_: IntegerType) -> int:
    return (type_.high or 0) - (type_.low or 0) + 1
