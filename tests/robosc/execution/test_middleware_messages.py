"""Messages of any class: their fields, and whether all numbers in them are numbers."""

import array
import decimal
import fractions
import json
import math
from collections import deque
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest

from robosc.execution.runtime.event_log import open_event_log, plain
from robosc.execution.runtime.middleware_messages import MAXIMUM_PARTS, fields_of, is_finite


class Slotted:
    __slots__ = ("__weakref__", "x", "y")

    def __init__(self, x: Any) -> None:
        self.x = x


class Below(Slotted):
    __slots__ = "z"

    def __init__(self, x: Any, z: Any) -> None:
        super().__init__(x)
        self.z = z


class Pair(NamedTuple):
    x: Any
    y: Any


class Ros:
    __slots__ = ("_check_fields", "_x")

    def __init__(self, x: Any) -> None:
        self._x = x

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {"x": "double"}

    x = property(lambda self: self._x)


class Trap:
    def __getattribute__(self, name: str) -> Any:
        raise RuntimeError(name)


class Bottomless:
    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {"x": "Bottomless"}

    x = property(lambda self: Bottomless())


SHAPES: list[Any] = [
    lambda n: n,
    lambda n: [0.0, n],
    lambda n: {"a": {"b": (1, {"c": n})}},
    lambda n: {n} | {1.0},
    lambda n: deque([n]),
    lambda n: array.array("d", [1.0, n]),
    lambda n: array.array("f", [1.0, n]),
    lambda n: memoryview(array.array("d", [1.0, n])),
    lambda n: SimpleNamespace(a=SimpleNamespace(b=n)),
    lambda n: Slotted(n),
    lambda n: Below(1.0, n),
    lambda n: Below(n, 1.0),
    lambda n: Pair(1.0, n),
    lambda n: Ros(n),
    lambda n: [Ros(1.0), Ros(Ros(n))],
    lambda n: decimal.Decimal(n),
]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_nan_or_an_infinity_is_found_wherever_it_is(shape: Any) -> None:
    assert is_finite(shape(0.5))
    for number in (math.nan, math.inf, -math.inf):
        assert not is_finite(shape(number))


def test_what_has_no_numbers_is_finite() -> None:
    for message in (None, True, 10**400, "nan", b"nan", [], {}, object(), fractions.Fraction(1, 3)):
        assert is_finite(message)
    assert is_finite(array.array("B", bytes(MAXIMUM_PARTS * 2)))


def test_what_cannot_be_looked_through_is_not_finite(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not is_finite(Trap())
    assert not is_finite([Trap()])
    monkeypatch.setattr("robosc.execution.runtime.middleware_messages.MAXIMUM_PARTS", 1000)
    assert is_finite([0.5] * 999)
    assert not is_finite([0.5] * 1000)
    assert not is_finite(Bottomless())


def test_a_message_that_contains_itself_is_looked_through_once() -> None:
    message: list[Any] = [1.0]
    message += [message, message]
    assert is_finite(message)
    message.append(math.nan)
    assert not is_finite(message)


def test_the_fields_of_a_message() -> None:
    assert fields_of(Ros(1)) == {"x": 1}
    assert fields_of(Below(1, 2)) == {"z": 2, "x": 1}
    assert fields_of(SimpleNamespace(a=1)) == {"a": 1}
    assert fields_of(object()) == {}
    assert fields_of(Trap()) == {}


def test_the_log_shows_a_message_by_its_fields() -> None:
    assert plain([Ros(SimpleNamespace(a=math.nan))]) == [{"x": {"a": "nan"}}]
    assert plain(Bottomless()) is not None


def test_a_message_that_cannot_be_written_is_lost_and_counted(tmp_path: Path) -> None:
    log = open_event_log(str(tmp_path), "robot", 0.0)
    log.write({"kind": "event", "data": Trap()})
    log.write({"kind": "event", "data": Ros(1)})
    log.close()
    (file,) = tmp_path.iterdir()
    entries = [json.loads(line) for line in file.read_text().splitlines()]
    assert entries[0] == {"kind": "event", "data": {"x": 1}}
    assert (entries[1]["kind"], entries[1]["count"]) == ("dropped", 1)
