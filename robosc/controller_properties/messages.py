"""Data that the events of one middleware message can carry together.

Several communications may read one message: then they receive data from the same fields. Enum rules are
read as conditions over *terms*. A term is a field that is compared with constants, or a more difficult expression,
which may have any value. Values that no comparison distinguishes are represented by one of them, so that all choices
can be enumerated. The result contains every possible combination, and may contain impossible ones: terms that are
written differently are taken to be independent, although they may read the same fields.
"""

import math
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise, product
from math import prod

import msgspec

from robosc.automata.compile import Carried, Path
from robosc.automata.inputs import valuations
from robosc.automata.structure import InputVariable, System
from robosc.expressions import (
    ArrayType,
    Binary,
    BooleanType,
    Conditional,
    Constant,
    DoubleType,
    EnumType,
    Expression,
    IntegerType,
    ObjectType,
    Received,
    StringType,
    Type,
    Unary,
    Value,
    domain,
    leaves,
)
from robosc.expressions.evaluate import evaluate
from robosc.model.structure import Communication, EnumDefinition, EventKind, Model
from robosc.model.typed import constant_value

MAXIMUM_CHOICES = 20_000
"""Maximum number of combinations of terms' values; beyond it the data of events counts as independent."""

MAXIMUM_CASES = 256
"""Cases of a message's data beyond which searches on sets of states take the data of its events as independent."""


class PossibleData(msgspec.Struct, frozen=True):
    """Data that an event can carry.

    Attributes:
        data: The data.
        is_unknown: True if an enum has its default because a rule is unknown; under the setting `on_unknown: keep` the
            event then does not happen.
        may_be_left_out: True if `is_unknown` is possible.
    """

    data: Carried
    is_unknown: bool
    may_be_left_out: bool


Choice = tuple[tuple[PossibleData, ...], ...]
"""Data that each event of a batch can carry, for one combination of values of the shared terms."""


def choices_together(model: Model, system: System, batch: Sequence[Communication]) -> tuple[Choice, ...] | None:
    """The data that the events of one message can carry together, or None where every combination counts as possible.

    Args:
        model: The robot.
        system: Its automata.
        batch: The outgoing messages on one identifier, in source order.
    """
    terms = _Terms()
    is_object = any(_has_field(model, item.response, "data") for item in batch)
    events = [_Event(model, system, item, terms, ("data",) if is_object else ()) for item in batch]
    users = [key for event in events for key in event.terms]
    shared = [key for key in dict.fromkeys(users) if users.count(key) > 1]
    if not shared or terms.combinations(shared) > MAXIMUM_CHOICES:
        return None
    if any(event.free_choices * terms.combinations(event.terms) > MAXIMUM_CHOICES for event in events):
        return None
    options = [event.options(terms, shared) for event in events]
    found: dict[Choice, None] = {}
    for values in product(*(terms.values(key) for key in shared)):
        known = dict(zip(shared, values, strict=True))
        choice = tuple(
            by_values[tuple(known[key] for key in shared if key in event.terms)]
            for event, by_values in zip(events, options, strict=True)
        )
        found[choice] = None
    return tuple(found)


def _has_field(model: Model, type_: Type | None, name: str) -> bool:
    source = model.enum(type_.name).source if isinstance(type_, EnumType) else type_
    return isinstance(source, ObjectType) and any(item.name == name for item in model.object(source.name).properties)


class _Terms:
    """Terms that conditions use, with the values that the conditions distinguish."""

    def __init__(self) -> None:
        self._kinds: dict[Hashable, Type | None] = {}
        self._points: dict[Hashable, set[float | str]] = {}
        self._may_be_unknown: set[Hashable] = set()
        self._values: dict[Hashable, tuple[Value | None, ...]] = {}

    def add(self, key: Hashable, type_: Type | None, points: Iterable[float | str], *, may_be_unknown: bool) -> None:
        """Add a term and the constants that it is compared with; a term without a basic type counts as a boolean."""
        self._kinds[key] = type_
        self._points.setdefault(key, set()).update(points)
        if may_be_unknown:
            self._may_be_unknown.add(key)

    def combinations(self, keys: Iterable[Hashable]) -> int:
        """Return the number of choices of values that some terms have."""
        return prod(len(self.values(key)) for key in keys)

    def values(self, key: Hashable) -> tuple[Value | None, ...]:
        """One value of each class that the conditions distinguish; call it only when all conditions are known."""
        if key not in self._values:
            unknown = (None,) if key in self._may_be_unknown else ()
            self._values[key] = (*self._known(key), *unknown)
        return self._values[key]

    def _known(self, key: Hashable) -> Sequence[Value]:
        points = self._points[key]
        match self._kinds[key]:
            case IntegerType():
                ends = {end for point in points for end in (math.floor(float(point)), math.ceil(float(point)))}
                return sorted({end + step for end in ends for step in (-1, 0, 1)}) or [0]
            case DoubleType():
                numbers = sorted(float(point) for point in points)
                between = [(low + high) / 2 for low, high in pairwise(numbers)]
                return sorted({-math.inf, *numbers, *between, math.inf})
            case StringType():
                texts = sorted(str(point) for point in points)
                return [*texts, "".join(texts) + "x"]
            case EnumType(values=values):
                return values
            case _:
                return [False, True]


class _Reading(msgspec.Struct):
    """A datum that is computed from terms.

    Attributes:
        path: Path of the datum in the event's data.
        slots: Key of each term that it reads, with the range to which a received integer is clamped.
        rules: Conditions over `Received((n,))`, the n-th slot, each with the value of the datum then.
        default: Value if no rule is true; None if it is the first slot itself.
    """

    path: Path
    slots: list[tuple[Hashable, IntegerType | None]] = msgspec.field(default_factory=list)
    rules: list[tuple[Expression, str]] = msgspec.field(default_factory=list)
    default: str | None = None

    def value(self, known: Mapping[Hashable, Value | None]) -> tuple[Value | None, bool]:
        """The datum, and whether a rule before it was unknown."""
        read = [_clamped(known[key], range_) for key, range_ in self.slots]
        if self.default is None:
            return read[0], False
        was_unknown = False
        for condition, value in self.rules:
            holds = evaluate(condition, _nothing, _nothing, lambda path: read[path[0]])  # type: ignore[index]
            if holds is True:
                return value, False
            was_unknown = was_unknown or holds is None
        return self.default, was_unknown


def _nothing(*names: str) -> str:
    raise KeyError(names)


def _clamped(value: Value | None, range_: IntegerType | None) -> Value | None:
    if range_ is None or value is None:
        return value
    low = -math.inf if range_.low is None else range_.low
    high = math.inf if range_.high is None else range_.high
    return int(min(max(float(value), low), high))


class _Event:
    """One event of a batch: the data that it can carry, as a function of terms."""

    def __init__(self, model: Model, system: System, item: Communication, terms: _Terms, root: Path) -> None:
        self._model = model
        self._all = terms
        declared = item.response
        source = model.enum(declared.name).source if isinstance(declared, EnumType) else declared
        # A basic type stands for one field of the message.
        self._base: Path = () if isinstance(source, ObjectType) else root
        # Not linked, it is received as a ROS integer of 16 bits; linked, it may be one that is wider than ours.
        self._is_narrow = item.interface is None and isinstance(source, IntegerType)
        self._message: Hashable = item.interface or (type(source), getattr(source, "name", None))
        inputs = [one for one in system.inputs if one.event == item.event(EventKind.RESPONSE)]
        self._free: list[InputVariable] = []
        self._readings: list[_Reading] = []
        self._is_input = {one.path for one in inputs}
        for one in inputs:
            # A field with too many values would make too many combinations to enumerate.
            if one.may_be_unknown or len(domain(one.type)) > MAXIMUM_CHOICES:
                self._free.append(one)
            else:
                self._readings.append(self._reading(one.path, one.type))
        if isinstance(declared, EnumType) and () not in self._is_input:
            self._readings.append(self._reading((), declared))
        self._may_be_left_out = not isinstance(declared, EnumType) and _has_enum(model, declared)
        self.free_choices = prod(len(domain(one.type)) + one.may_be_unknown for one in self._free)
        self.terms = tuple(dict.fromkeys(key for reading in self._readings for key, _ in reading.slots))

    def options(
        self, terms: _Terms, shared: Sequence[Hashable]
    ) -> dict[tuple[Value | None, ...], tuple[PossibleData, ...]]:
        """The data for each choice of values of the shared terms that it reads."""
        free = [tuple(data.items()) for data in valuations(self._free)]
        found: dict[tuple[Value | None, ...], dict[PossibleData, None]] = {}
        for values in product(*(terms.values(key) for key in self.terms)):
            known = dict(zip(self.terms, values, strict=True))
            data: list[tuple[Path, Value | None]] = []
            is_unknown = False
            for reading in self._readings:
                value, was_unknown = reading.value(known)
                is_unknown = is_unknown or was_unknown
                if reading.path in self._is_input:
                    data.append((reading.path, value))
            options = found.setdefault(tuple(known[key] for key in shared if key in known), {})
            may_be_left_out = is_unknown or self._may_be_left_out
            options.update((PossibleData((*data, *more), is_unknown, may_be_left_out), None) for more in free)
        return {values: tuple(options) for values, options in found.items()}

    def _reading(self, path: Path, type_: Type) -> _Reading:
        reading = _Reading(path)
        match type_:
            case EnumType(name=name):
                definition = self._model.enum(name)
                reading.default = definition.default
                rules = ((self._abstract(rule.condition, reading, definition), rule.value) for rule in definition.rules)
                reading.rules.extend(rules)
            case IntegerType(low=int(low), high=int(high)):
                self._field(reading, path, type_, range(low, high + 1))
            case _:
                self._field(reading, path, type_, ())
        return reading

    def _field(self, reading: _Reading, path: Path, type_: Type, points: Iterable[float | str]) -> Expression:
        """A term that is a field of the message, as the reading's next slot."""
        is_element = any(isinstance(step, int) for step in path)
        kind = type_.name if isinstance(type_, EnumType) else type(type_)
        key = (self._message, (*self._base, *path), kind)
        # A received double may be no number, and a received integer too large for 32 bits; in a range it is clamped.
        is_wide = isinstance(type_, IntegerType) and not self._is_narrow and (type_.low is None or type_.high is None)
        may_be_unknown = is_element or is_wide or isinstance(type_, DoubleType)
        ends: list[float | str] = []
        if isinstance(type_, IntegerType):
            ends = [end for end in (type_.low, type_.high) if end is not None]
        self._all.add(key, type_, (*points, *ends), may_be_unknown=may_be_unknown)
        return _slot(reading, key, type_ if isinstance(type_, IntegerType) else None)

    # Conditions

    def _abstract(self, condition: Expression, reading: _Reading, enum: EnumDefinition) -> Expression:
        """A condition over the slots of a reading."""
        match condition:
            case Constant():
                return condition
            case Unary(operator="not" | "holds" as operator, operand=operand):
                return Unary(operator, self._abstract(operand, reading, enum))
            case Binary(operator="and" | "or" | "implies" as operator, left=left, right=right):
                return Binary(operator, self._abstract(left, reading, enum), self._abstract(right, reading, enum))
            case Conditional(condition=asked, then=then, otherwise=otherwise):
                return Conditional(*(self._abstract(part, reading, enum) for part in (asked, then, otherwise)))
            case Binary(operator="=" | "!=" | "<" | "<=" | ">" | ">=" as operator, left=left, right=right):
                for term, other, is_first in ((left, right, True), (right, left, False)):
                    constant = constant_value(other)
                    if constant is not None:
                        compared = self._term(term, constant, reading, enum)
                        sides = (compared, Constant(constant)) if is_first else (Constant(constant), compared)
                        return Binary(operator, *sides)
            case Received(path=path) if isinstance(self._type_at(enum.source, path), BooleanType):
                return self._field(reading, (*reading.path, *path), BooleanType(), ())
        return self._opaque(condition, None, (), reading, enum)

    def _term(self, term: Expression, constant: Value, reading: _Reading, enum: EnumDefinition) -> Expression:
        """Return the expression for a term that is compared with a constant."""
        points = () if isinstance(constant, bool) else (constant,)
        if isinstance(term, Received):
            type_ = self._type_at(enum.source, term.path)
            if isinstance(type_, BooleanType | IntegerType | DoubleType | StringType | EnumType):
                return self._field(reading, (*reading.path, *term.path), type_, points)
        match constant:
            case bool():
                return self._opaque(term, None, (), reading, enum)
            case str():
                # A text, or the name of an enum's value: all that matters is whether it is this one.
                return self._opaque(term, StringType(), points, reading, enum)
            case _:
                return self._opaque(term, DoubleType(), points, reading, enum)

    def _opaque(
        self,
        term: Expression,
        type_: Type | None,
        points: Iterable[float | str],
        reading: _Reading,
        enum: EnumDefinition,
    ) -> Expression:
        """An opaque term: equal expressions over fields of the same types have one value."""
        read = [leaf for leaf in leaves(term) if isinstance(leaf, Received)]
        types = tuple(self._type_at(enum.source, leaf.path) for leaf in read)
        key = (self._message, self._base, reading.path, term, types, type(type_))
        self._all.add(key, type_, points, may_be_unknown=True)
        return _slot(reading, key, None)

    def _type_at(self, declared: Type, path: Path) -> Type | None:
        found: Type | None = declared
        for step in path:
            match found:
                case ArrayType(element=element):
                    found = element
                case ObjectType(name=name):
                    properties = {item.name: item.type for item in self._model.object(name).properties}
                    found = properties.get(str(step))
                case _:
                    return None
        return found


def _slot(reading: _Reading, key: Hashable, range_: IntegerType | None) -> Expression:
    slot = (key, range_)
    if slot not in reading.slots:
        reading.slots.append(slot)
    return Received((reading.slots.index(slot),))


def _has_enum(model: Model, declared: Type | None) -> bool:
    """Return True if a part of data is an enum."""
    return any(isinstance(type_, EnumType) for type_ in _parts(model, declared, set()))


def _parts(model: Model, declared: Type | None, seen: set[str]) -> Iterator[Type]:
    match declared:
        case ArrayType(element=element):
            yield from _parts(model, element, seen)
        case ObjectType(name=name) if name not in seen:
            seen.add(name)
            for item in model.object(name).properties:
                yield from _parts(model, item.type, seen)
        case ObjectType() | None:
            pass
        case _:
            yield declared
