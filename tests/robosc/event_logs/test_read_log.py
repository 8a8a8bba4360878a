"""Reading event logs: what executors write, what is torn, and what is no log."""

import json
import os
from pathlib import Path
from typing import Any

import pytest

from robosc.event_logs import LogError, read_log, reading
from robosc.execution.runtime.event_log import open_event_log

STATE = {"A": {"state": "idle", "variables": {"n": 1, "x": 0.5}}}


def event(time_s: float = 1.0, name: str = "go.request", **more: Any) -> dict[str, Any]:
    return {"time": time_s, "kind": "event", "event": name, "controllable": True, "data": None, "state": STATE, **more}


def written(folder: Path, *lines: str | dict[str, Any], end: str = "\n") -> Path:
    file = folder / "log.jsonl"
    file.write_text(
        "\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines) + end, encoding="utf-8"
    )
    return file


def test_what_an_event_log_writes_is_read(tmp_path: Path) -> None:
    log = open_event_log(str(tmp_path), "robot", 0.0)
    log.write(event(10.0, decision_us=3.5))
    log.write({"time": 11.0, "kind": "blocked", "identifier": "/cmd_vel", "why": "not allowed now"})
    log.write({"time": 12.0, "kind": "unexpected", "event": "done.response", "data": None})
    log.close()
    (file,) = tmp_path.iterdir()
    run = read_log(file)
    assert [(entry.line, entry.time_s, entry.kind, entry.event) for entry in run.entries] == [
        (1, 10.0, "event", "go.request"), (2, 11.0, "blocked", ""), (3, 12.0, "unexpected", "done.response"),
    ]  # fmt: skip
    assert (run.dropped, run.torn_line, run.notes(), run.begin_s) == (0, None, (), 10.0)
    assert [entry.event for entry in run.events] == ["go.request"]
    first, second, _ = run.entries
    assert (first.is_controllable, first.data, first.state, first.document["decision_us"]) == (True, None, STATE, 3.5)
    assert (second.text("why"), second.text("what"), second.state) == ("not allowed now", "", {})


def test_an_empty_log_is_one(tmp_path: Path) -> None:
    assert read_log(written(tmp_path, end="")).entries == ()


def test_components_that_do_not_change_are_kept_once_but_never_mixed_up(tmp_path: Path) -> None:
    states = [{"A": {"state": "s", "variables": {"v": value}}} for value in (1, 1, 1.0, True)]
    run = read_log(written(tmp_path, *(event(state=state) for state in states)))
    assert run.entries[0].state["A"] is run.entries[1].state["A"]
    assert [repr(entry.state["A"]["variables"]["v"]) for entry in run.entries] == ["1", "1", "1.0", "True"]


def test_a_last_line_that_is_cut_off_is_left_out_and_reported(tmp_path: Path) -> None:
    run = read_log(written(tmp_path, event(), '{"time":2.0,"kind":"ev', end=""))
    assert (len(run.entries), run.torn_line) == (1, 2)
    assert run.notes() == ("line 2, the last one, is cut off and was left out",)
    assert read_log(written(tmp_path, event(), event(), end="")).torn_line is None


def test_lines_that_were_torn_by_a_full_disk_are_those_that_the_log_counts(tmp_path: Path) -> None:
    lines = (event(), '{"time":2.0,"ki', "", event(), {"time": 3.0, "kind": "dropped", "count": 2})
    run = read_log(written(tmp_path, *lines))
    assert (len(run.events), run.dropped) == (2, 2)
    assert run.notes() == ("the log lacks 2 entries that its writer lost",)
    with pytest.raises(LogError, match="line 2: no JSON"):
        read_log(written(tmp_path, *lines[:4]))


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("[1, 2]", "no JSON object"),
        ("hello", "no JSON"),
        ('{"time": NaN, "kind": "x"}', "no JSON"),
        ("[" * 100_000, "nested too deeply"),
        ({"kind": "event"}, "its 'time' is not a number of seconds"),
        ({"time": 1e308, "kind": "x"}, "its 'time' is not a number of seconds"),
        ({"time": -2e12, "kind": "x"}, "its 'time' is not a number of seconds"),
        ({"time": 1.0, "kind": "x\x01"}, "it has no 'kind'"),
        (event(name="go\ud800"), "its 'event' is not an event's name"),
        (event(name="go\x1b[31m"), "its 'event' is not an event's name"),
        ({"time": 1.0, "kind": "fault", "what": "it \x00 broke"}, "its 'what' is not a text that can be shown"),
        ({"time": 1.0, "kind": "fault", "what": "\udfff"}, "its 'what' is not a text that can be shown"),
        (event(True), "its 'time' is not a number of seconds"),
        ('{"time": 1e999, "kind": "x"}', "its 'time' is not a number of seconds"),
        ('{"time": 1' + "0" * 400 + ', "kind": "x"}', "its 'time' is not a number of seconds"),
        ({"time": 1.0}, "it has no 'kind'"),
        (event(name=""), "its 'event' is not an event's name"),
        (event(name="x" * 601), "its 'event' is not an event's name"),
        (event(name=3), "its 'event' is not an event's name"),  # type: ignore[arg-type]
        (event(controllable="yes"), "its 'controllable' is neither true nor false"),
        (event(state=None), "it has no 'state'"),
        (event(state={"A": None}), "the state of 'A' is not a state with variables"),
        (event(state={"A": {"state": 1, "variables": {}}}), "the state of 'A' is not a state with variables"),
        (event(state={"A": {"state": "s"}}), "the state of 'A' is not a state with variables"),
        ({"time": 1.0, "kind": "dropped", "count": -1}, "its 'count' is not a number of entries"),
        ('{"time": 1.0, "kind": "x", "n": ' + "9" * 5000 + "}", "no JSON"),
    ],
)  # fmt: skip
def test_what_is_no_entry_is_reported_with_its_line(line: Any, problem: str, tmp_path: Path) -> None:
    file = written(tmp_path, event(), line, event())
    with pytest.raises(LogError) as caught:
        read_log(file)
    assert str(caught.value).startswith(f"{file}, line 2: {problem}")
    assert len(str(caught.value)) < 500


def test_a_file_of_another_kind_is_no_log(tmp_path: Path) -> None:
    file = tmp_path / "robot.rscd"
    file.write_text("robot R { }", encoding="utf-8")
    with pytest.raises(LogError, match="line 1: no entry of an event log"):
        read_log(file)
    file.write_bytes(b"\xff\xfe{")
    with pytest.raises(LogError, match="line 1: no entry of an event log"):
        read_log(file)


def test_sizes_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LogError, match="line 2: longer than"):
        read_log(written(tmp_path, event(), event(data="x" * reading.MAXIMUM_LINE_BYTES)))
    monkeypatch.setattr(reading, "MAXIMUM_ENTRIES", 3)
    with pytest.raises(LogError, match="line 4: a log of more than 3 lines is not read"):
        read_log(written(tmp_path, *[event()] * 4))
    monkeypatch.setattr(reading, "MAXIMUM_BYTES", 100)
    with pytest.raises(LogError, match="a log of more than 100 is not read"):
        read_log(written(tmp_path, event()))


def test_what_never_ends_is_not_read(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for place in (pipe, Path("/dev/zero")):
        with pytest.raises(LogError, match="is not a plain file"):
            read_log(place)
    with pytest.raises(OSError, match="directory"):
        read_log(tmp_path)
