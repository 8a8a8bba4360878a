"""Models of the published language mean what they meant when they were recorded (see `support.corpus`)."""

import json

import pytest

from support.corpus import (
    CORPUS,
    cases,
    differences,
    outcome,
    recorded,
    recording_path,
    stimuli_of,
    written,
)

_SHOWN = 25


@pytest.mark.parametrize("case", cases())
def test_model_means_what_was_recorded(case: str) -> None:
    was = recorded(case)
    found = differences(was, outcome(case, stimuli_of(was)))
    if found:
        more = [f"... and {len(found) - _SHOWN} more"] if len(found) > _SHOWN else []
        pytest.fail("\n  ".join([f"tests/corpus/{case}.rscd no longer means the same:", *found[:_SHOWN], *more]))


def test_every_recording_has_its_model() -> None:
    recordings = {str(path.relative_to(CORPUS).with_suffix("")) for path in CORPUS.rglob("*.json")}
    assert recordings == set(cases())


def test_recordings_are_written_as_they_are_recorded() -> None:
    """A recording that was edited by hand would make later differences hard to read."""
    for case in cases():
        assert recording_path(case).read_text(encoding="utf-8") == written(recorded(case)), case


def test_the_corpus_covers_what_it_is_for() -> None:
    recordings = [recorded(case) for case in cases()]
    text = json.dumps(recordings)
    assert sum("run" in item for item in recordings) >= 40
    assert {item["controller"]["supervisor"] for item in recordings if "controller" in item} == {"exists", "none"}
    for word in ("error ", "warning ", "note ", "controllable", "unknown", "release", "cancel"):
        assert word in text, word


def test_differences_say_what_and_where() -> None:
    run: list[dict[str, list[str]]] = [{"log": []}]
    was = {"findings": ["a", "b"], "controller": {"states": 3, "initial": {"A": True}}, "run": run}
    now = {"findings": ["b", "c"], "controller": {"states": 4, "initial": {"A": 1}}, "run": [*run, {"log": ["x"]}]}
    assert differences(was, was) == []
    assert differences(was, now) == [
        "findings: no longer a",
        "findings: only now c",
        "controller states: was 3, is 4",
        "controller initial A: was true, is 1",
        'run [1]: was nothing, is {"log": ["x"]}',
    ]
