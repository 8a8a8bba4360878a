"""Differences between two checked models, in the words of models."""

from collections.abc import Iterator
from typing import Any, get_args

import msgspec

from robosc.errors import UnsupportedModelError
from robosc.expressions import Expression, Type, type_text
from robosc.expressions.text import expression_text
from robosc.model.structure import Interface, Model, Transition

MAXIMUM_DIFFERENCES = 20
"""Differences that are reported: where there are more, the models have little in common."""

_MAXIMUM_TEXT = 120

_WORDS = {
    "assumptions": "assumption",
    "behaviour": "",
    "communications": "communication",
    "components": "component",
    "detours": "detour",
    "enums": "enum",
    "goals": "goal",
    "interface": "middleware type",
    "invariants": "invariant",
    "is_allowed": "'allow'",
    "is_initial": "initial",
    "is_marked": "marked",
    "is_never": "'never'",
    "is_synthesis": "part in synthesis",
    "missions": "mission",
    "objects": "object",
    "preferences": "preference",
    "properties": "property",
    "provides": "provide statement",
    "requirements": "requirement",
    "rules": "rule",
    "states": "state",
    "transitions": "transition",
    "updates": "update",
    "variables": "variable",
    "visits": "visit",
}
"""Names of the fields of the structure in a model."""

_ENCODER = msgspec.json.Encoder(order="sorted")
_EXPRESSIONS = get_args(Expression)
_TYPES = get_args(Type)


def model_differences(stored: Model, model: Model) -> tuple[str, ...]:
    """Return the differences of a supervisor's model from a model; none if they are the same to the last bit.

    Args:
        stored: The supervisor's.
        model: The one it should be.

    Raises:
        UnsupportedModelError: A model is nested more deeply than any supervisor file could be.
    """
    found: list[str] = []
    try:
        for difference in _differences("", stored, model):
            if len(found) == MAXIMUM_DIFFERENCES:
                return (*found, "and more")
            found.append(difference)
    except RecursionError:
        raise UnsupportedModelError("an expression is nested more deeply than a supervisor file can have it") from None
    return tuple(found)


def _differences(place: str, stored: Any, model: Any) -> Iterator[str]:
    # The number 1, in writing, is neither 1.0 nor true.
    if _ENCODER.encode(stored) == _ENCODER.encode(model):
        return
    if isinstance(stored, tuple) and isinstance(model, tuple):
        yield from _in_rows(place, stored, model)
    elif isinstance(stored, msgspec.Struct) and type(stored) is type(model) and not _is_leaf(stored):
        for name in stored.__struct_fields__:
            word = _WORDS.get(name, name.replace("_", " "))
            inner = ": ".join(part for part in (place, word) if part)
            yield from _differences(inner, getattr(stored, name), getattr(model, name))
    else:
        yield f"{place}: {_text(stored)} in the supervisor, {_text(model)} in the model"


def _is_leaf(value: Any) -> bool:
    """Return True if a value is reported as a whole."""
    return isinstance(value, (*_EXPRESSIONS, *_TYPES, Interface))


def _in_rows(place: str, stored: tuple[Any, ...], model: tuple[Any, ...]) -> Iterator[str]:
    """Differences between rows: of things with names by these, of others by their numbers."""
    names = [_names(row) for row in (stored, model)]
    if names[0] is None or names[1] is None or len(set(names[0])) < len(stored) or len(set(names[1])) < len(model):
        for number, (mine, theirs) in enumerate(zip(stored, model, strict=False), start=1):
            yield from _differences(f"{place} {number}{_hint(mine)}", mine, theirs)
        for number, item in enumerate(stored[len(model) :], start=len(model) + 1):
            yield f"{place} {number}{_hint(item)}: in the supervisor only"
        for number, item in enumerate(model[len(stored) :], start=len(stored) + 1):
            yield f"{place} {number}{_hint(item)}: in the model only"
        return
    mine, theirs = dict(zip(names[0], stored, strict=True)), dict(zip(names[1], model, strict=True))
    for name, item in mine.items():
        if name in theirs:
            yield from _differences(f"{place} {name}", item, theirs[name])
        else:
            yield f"{place} {name}: in the supervisor only"
    yield from (f"{place} {name}: in the model only" for name in theirs if name not in mine)
    if [name for name in mine if name in theirs] != [name for name in theirs if name in mine]:
        yield f"{place}: in another order"


def _names(row: tuple[Any, ...]) -> list[str] | None:
    """The names of a row's things, or None if they have none."""
    if all(isinstance(item, msgspec.Struct) and hasattr(item, "name") for item in row):
        return [item.name for item in row]
    return None


def _hint(item: Any) -> str:
    return f" (on {item.event})" if isinstance(item, Transition) else ""


def _text(value: Any) -> str:
    if value is None:
        text = "nothing"
    elif isinstance(value, bool):
        text = "yes" if value else "no"
    elif isinstance(value, str):
        text = f"'{value}'"
    elif isinstance(value, _EXPRESSIONS):
        text = expression_text(value)
    elif isinstance(value, _TYPES):
        text = type_text(value)
    elif isinstance(value, Interface):
        text = f"{value.package}/{value.type}"
    else:
        text = _ENCODER.encode(value).decode()
    return text if len(text) <= _MAXIMUM_TEXT else text[: _MAXIMUM_TEXT - 3] + "..."
