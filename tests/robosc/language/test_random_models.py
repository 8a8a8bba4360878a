"""Random models without errors, and the same models damaged."""

import json
import re
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import Severity
from robosc.language import parse
from robosc.model.check import check
from robosc.source import Bundle, SourceFile
from support.effort import examples
from support.models import EXAMPLE_NAMES, EXAMPLES
from support.mutate import mutated
from support.random_models import models, random_bundle, relaid

TEXTS = [(EXAMPLES / f"{name}.rscd").read_text(encoding="utf-8") for name in EXAMPLE_NAMES]
"""Texts of the examples."""


@settings(max_examples=examples(60))
@given(models())
def test_models_of_the_whole_language_have_no_errors(bundle: Bundle) -> None:
    assert [item for item in check(bundle).diagnostics if item.severity is Severity.ERROR] == []


@settings(max_examples=examples(40))
@given(models(part_b=False))
def test_models_of_part_a_have_no_errors(bundle: Bundle) -> None:
    assert [item for item in check(bundle).diagnostics if item.severity is Severity.ERROR] == []


@settings(max_examples=examples(40))
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_blanks_and_comments_mean_nothing(seed: int, goals: bool) -> None:
    text = random_bundle(seed, goals=goals).main.text
    other = relaid(text, Random(seed + 1))
    trees = [re.sub(r"Location\([^()]*\)", "", repr(parse(SourceFile("m", item)).tree)) for item in (text, other)]
    assert trees[0] == trees[1] != "None"


def assert_well_reported(bundle: Bundle) -> None:
    """Check for any text: it is checked, and every finding is one that a user can work with."""
    parsed, checked = parse(bundle.main), check(bundle)
    assert (parsed.tree is None) == bool(parsed.diagnostics)
    assert all(item.severity is Severity.ERROR for item in parsed.diagnostics)
    assert checked.model is None or not checked.has_errors
    places = [item.location for item in checked.diagnostics]
    assert places == sorted(place for place in places if place)
    for item in checked.diagnostics:
        file = bundle.file(item.location.file) if item.location else None
        assert file is not None
        assert item.location is not None
        lines = file.text.split("\n")
        assert 1 <= item.location.line <= len(lines)
        assert 1 <= item.location.column <= len(lines[item.location.line - 1]) + 1
        assert re.fullmatch(r"[a-z][a-z0-9-]*", item.code)
        assert item.message
        assert item.fix.endswith((".", "?"))
        assert json.loads(json.dumps(item.to_json()))["line"] == item.location.line
        assert item.render(bundle)


@settings(max_examples=examples(60))
@given(st.sampled_from(TEXTS), st.integers(0, 2**32 - 1))
def test_damaged_examples(text: str, seed: int) -> None:
    damaged = mutated(text, TEXTS, Random(seed))
    assert_well_reported(Bundle(SourceFile("model.rscd", damaged)))


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32 - 1))
def test_damaged_random_models(seed: int) -> None:
    bundle, dice = random_bundle(seed, goals=seed % 2 == 0), Random(seed)
    files = [SourceFile(file.name, mutated(file.text, TEXTS, dice)) for file in bundle.files]
    assert_well_reported(Bundle(files[0], tuple(files[1:])))
