"""Random constants: the front end gives them the values, or refuses them, as its twin does."""

from random import Random

import pytest

from robosc.cif.parser import parse
from robosc.cif.scopes import Entity, Scopes
from robosc.cif.typing import Typing
from robosc.model.findings import Findings
from robosc.source import SourceFile
from support.cif_constants_twin import RefusedError, constants
from support.effort import examples
from support.random_cif_constants import random_constants


def read(text: str) -> dict[str, object] | None:
    """The values of all constants of a text; None if one of them has an error."""
    findings = Findings()
    scopes = Scopes((parse(SourceFile("m.cif", text)),), findings)
    typing = Typing(scopes)
    found = {}
    for name, entity in scopes.root.entries.items():
        assert isinstance(entity, Entity)
        found[name] = typing.entity(entity).value
    assert {item.code for item in findings.diagnostics} <= {"cif-type"}, text
    return None if findings.has_errors else found


def expected(text: str) -> dict[str, object] | None:
    """The same, by the twin."""
    try:
        return constants(text)
    except RefusedError:
        return None


@pytest.mark.random
def test_constants_are_those_of_the_twin() -> None:
    count = examples(400)
    accepted = 0
    for seed in range(count):
        text = random_constants(Random(seed))
        found = read(text)
        assert repr_of(found) == repr_of(expected(text)), text
        accepted += found is not None
    assert count / 4 < accepted < count * 3 / 4


def repr_of(values: dict[str, object] | None) -> object:
    """Values such that 1, 1.0 and True differ."""
    return None if values is None else {name: _told_apart(value) for name, value in values.items()}


def _told_apart(value: object) -> object:
    if isinstance(value, tuple):
        return tuple(map(_told_apart, value))
    if isinstance(value, frozenset):
        return frozenset(map(_told_apart, value))
    return type(value).__name__, value
