"""Semantics 3.9: the event log."""

import io
import json
import math
import threading
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.execution.runtime.event_log import JsonLinesLog, MemoryLog, NullLog, json_line, open_event_log
from support.execution import bench

ROBOT = """
robot Robot {
  interface twist use Twist from geometry_msgs
  datatype object Vector { x: double }
  datatype object Twist { linear: Vector }
  component Sensor {
    outgoing message scan with type: double
    behaviour {
      variable distance: double
      variable safe: boolean = true
      on response from scan do distance := value
      initial marked state near { transition if distance > 1.0 goto far }
      marked state far { }
    }
  }
  component Wheels { incoming message move with identifier: "/cmd_vel", type: Twist links twist }
  requirement move needs Sensor.far
  provide move with { linear: { x: 0.5 } }
}
""".replace("transition if distance > 1.0 goto far", "on response from scan do distance := value goto far")


def test_every_event_is_logged_with_all_that_belongs_to_it() -> None:
    b = bench(ROBOT)
    b.clock.advance(2.5)
    b.receive("scan", 4.0)
    b.tick()
    first, second = b.log.entries
    assert first == {
        "time": 1_000_002.5,
        "kind": "event",
        "event": "scan.response",
        "controllable": False,
        "data": {"value": 4.0},
        "state": {"Sensor": {"state": "far", "variables": {"distance": 4.0, "safe": True}}},
        "decision_us": 0.0,
    }
    assert second["event"] == "move.request"
    assert second["controllable"] is True
    assert second["data"] == {"linear": {"x": 0.5}}


def test_the_decision_time_counts_from_when_something_came() -> None:
    b = bench(ROBOT)
    read = b.system.read

    def slow(event: str, data: Any) -> Any:
        b.clock.advance(0.002)
        return read(event, data)

    b.system.read = slow  # type: ignore[method-assign]
    b.receive("scan", 4.0)
    assert b.log.entries[0]["decision_us"] == pytest.approx(2000.0)


def test_lines_are_written_and_the_file_is_closed(tmp_path: Path) -> None:
    log = open_event_log(str(tmp_path / "deep" / "er"), "robot", 0.0)
    for number in range(1000):
        log.write({"n": number})
    log.close()
    log.close()
    files = list((tmp_path / "deep" / "er").iterdir())
    assert [file.name for file in files] == ["robot-19700101-000000.jsonl"]
    assert [json.loads(line)["n"] for line in files[0].read_text().splitlines()] == list(range(1000))
    log.write({"n": -1})
    assert log.dropped == 1


def test_two_logs_of_one_second_get_two_files(tmp_path: Path) -> None:
    for _ in range(3):
        open_event_log(str(tmp_path), "robot", 0.0).close()
    assert len(list(tmp_path.iterdir())) == 3


class StuckStream(io.StringIO):
    """A disk that hangs until it is let go."""

    def __init__(self) -> None:
        super().__init__()
        self.is_free = threading.Event()
        self.is_busy = threading.Event()
        self.text = ""

    def write(self, text: str) -> int:
        self.is_busy.set()
        assert self.is_free.wait(10)
        self.text += text
        return len(text)


def test_a_disk_that_hangs_stops_nobody_and_what_is_lost_is_counted() -> None:
    stream = StuckStream()
    log = JsonLinesLog(stream, limit=10)
    log.write({"n": 0})
    assert stream.is_busy.wait(10)
    for number in range(1, 26):
        log.write({"n": number})
    assert log.dropped == 15
    stream.is_free.set()
    log.close()
    lines = [json.loads(line) for line in stream.text.splitlines()]
    assert [line["n"] for line in lines[:-1]] == list(range(11))
    assert (lines[-1]["kind"], lines[-1]["count"]) == ("dropped", 15)


class FullStream(io.StringIO):
    """A disk that is full for a while, after half a line."""

    def __init__(self) -> None:
        super().__init__()
        self.text = ""
        self.is_full = False

    def write(self, text: str) -> int:
        if self.is_full:
            self.text += text[:5]
            self.is_full = False
            raise OSError("no space left on device")
        self.text += text
        if '"n":1' in text:
            self.is_full = True
        return len(text)


def test_a_disk_that_is_full_loses_lines_but_no_other_line() -> None:
    stream = FullStream()
    log = JsonLinesLog(stream)
    for number in range(4):
        log.write({"n": number})
    log.close()
    assert log.dropped == 1
    kept = [line for line in stream.text.splitlines() if line.endswith("}")]
    assert [json.loads(line).get("n") for line in kept] == [0, 1, 3, None]


def strictly(line: str) -> Any:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(line, parse_constant=refuse)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (math.nan, "nan"),
        (-math.inf, "-inf"),
        ([1.0, math.inf], [1.0, "inf"]),
        ({"a": {"b": math.nan}}, {"a": {"b": "nan"}}),
        pytest.param(10**5000, hex(10**5000), id="a very long integer"),
        (object(), "object"),
        (b"\x00", "bytes"),
        ("line\nbreak\ud800", "line\nbreak\ud800"),
        ({1: 2}, {"1": 2}),
    ],
)
def test_whatever_the_values_are_a_line_is_valid_json(value: Any, expected: Any) -> None:
    line = json_line({"data": value})
    assert line.count("\n") == 1
    line.encode("utf-8")
    assert strictly(line) == {"data": expected}


def test_a_value_that_contains_itself_is_cut() -> None:
    value: list[Any] = []
    value.append(value)
    strictly(json_line({"data": value}))


@given(
    st.recursive(
        st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.binary()),
        lambda inner: st.one_of(st.lists(inner), st.dictionaries(st.text(), inner)),
        max_leaves=8,
    )
)
def test_any_data_makes_a_valid_line(value: Any) -> None:
    strictly(json_line({"data": value}))


def test_an_executor_with_a_file_leaves_readable_lines(tmp_path: Path) -> None:
    log = open_event_log(str(tmp_path), "robot", 0.0)
    b = bench(ROBOT)
    b.executor._recorder._log = log
    b.receive("scan", math.nan)
    b.receive("scan", 2.0)
    b.tick()
    b.executor.stop("done")
    log.close()
    kinds = [strictly(line)["kind"] for line in next(tmp_path.iterdir()).read_text().splitlines()]
    assert kinds == ["event", "unknown", "event", "event", "stop"]


def test_the_other_logs() -> None:
    memory = MemoryLog()
    memory.write({"a": 1})
    memory.close()
    assert memory.entries == [{"a": 1}]
    null = NullLog()
    null.write({"a": 1})
    null.close()
    assert (null.is_active, null.dropped) == (False, 0)
