"""States and variables of the model's components as named values.

MAVLink gives a value a name of at most 10 bytes. If `Component` or `Component.variable` is longer, the name is its
first six bytes, a tilde and three characters made from the whole name: so it does not depend on the rest of the model,
except in the rare case that two names give the same short one.
"""

import math
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from robosc.expressions import BooleanType, DoubleType, EnumType, IntegerType, Type
from robosc.model.structure import Model
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.states import State
from robosc_bridge.ground_station.telemetry import Make

NAME_BYTES = 10
MOST_VALUES = 500
"""Maximum number of values; the others of a model with more are not reported."""

SUPERVISOR_STATE, BLOCKED = "sup_state", "blocked"
"""The daemon's state as its place in `State`; how many requests were held back so far."""

_HEAD = 6
_TAIL = 3
_DIGITS = "0123456789abcdefghijklmnopqrstuvwxyz"
_LEAST, _MOST = -(2**31), 2**31 - 1
_LARGEST_SINGLE = 3.4e38

type Number = int | float


@dataclass(frozen=True)
class NamedValue:
    """Source of a named value.

    Attributes:
        name: Name as it is sent; at most `NAME_BYTES` ASCII characters.
        meaning: `Component` for its state, `Component.variable`.
        component: Name of the component in the snapshot.
        variable: Variable of the component; None: its state.
        words: Words whose index is sent: states, or values of an enum; empty: the value is a number or truth value.
        is_float: True if NAMED_VALUE_FLOAT sends it, else NAMED_VALUE_INT.
    """

    name: str
    meaning: str
    component: str
    variable: str | None
    words: tuple[str, ...]
    is_float: bool = False

    def number(self, components: Mapping[str, Mapping[str, Any]]) -> Number | None:
        """Return the present value; None: there is none, or it cannot be reported."""
        component = components.get(self.component)
        if component is None:
            return None
        value = component["state"] if self.variable is None else component["variables"].get(self.variable)
        if self.words:
            return self.words.index(value) if value in self.words else None
        if isinstance(value, bool):
            return int(value)
        if self.is_float:
            return _single(float(value)) if isinstance(value, int | float) else None
        return value if isinstance(value, int) and _LEAST <= value <= _MOST else None


def _single(value: float) -> float:
    """Within what MAVLink's numbers hold."""
    return math.copysign(math.inf, value) if abs(value) > _LARGEST_SINGLE else value


def named_values(model: Model) -> tuple[NamedValue, ...]:
    """Return all named values of a model, in its order."""
    taken = {SUPERVISOR_STATE, BLOCKED}
    found: list[NamedValue] = []
    for meaning, component, variable, words, is_float in _published(model):
        if len(found) == MOST_VALUES:
            break
        name = _short(meaning, taken)
        taken.add(name)
        found.append(NamedValue(name, meaning, component, variable, words, is_float))
    return tuple(found)


def _published(model: Model) -> Iterator[tuple[str, str, str | None, tuple[str, ...], bool]]:
    for component in model.components:
        behaviour = component.behaviour
        if behaviour is None:
            continue
        yield component.name, component.name, None, tuple(state.name for state in behaviour.states), False
        for variable in behaviour.variables:
            meaning = f"{component.name}.{variable.name}"
            if _is_published(variable.type):
                words = variable.type.values if isinstance(variable.type, EnumType) else ()
                yield meaning, component.name, variable.name, words, isinstance(variable.type, DoubleType)


def _is_published(type_: Type) -> bool:
    return isinstance(type_, BooleanType | IntegerType | DoubleType | EnumType)


def _short(meaning: str, taken: set[str]) -> str:
    if len(meaning) <= NAME_BYTES and meaning not in taken:
        return meaning
    number = zlib.crc32(meaning.encode())
    while True:
        tail = "".join(_DIGITS[number // 36**place % 36] for place in range(_TAIL))
        name = f"{meaning[:_HEAD]}~{tail}"
        if name not in taken:
            return name
        number += 1


def supervisor_state(snapshot: Snapshot) -> int:
    """Return the value of `SUPERVISOR_STATE`."""
    return list(State).index(snapshot.state)


def named_value(name: str, number: Number, boot_ms: int) -> Make:
    """Return a named value as a message."""
    data = name.encode("ascii")
    if isinstance(number, float):
        return lambda codec: codec.named_value_float_encode(boot_ms, data, number)
    return lambda codec: codec.named_value_int_encode(boot_ms, data, number)
