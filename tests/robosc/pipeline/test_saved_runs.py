"""Runs that are kept: event logs that the replay of logs accepts, tests that pass and can fail, files of events."""

import io
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import robosc
from robosc.event_logs import check_log, read_log
from robosc.model.structure import Deployment
from robosc.pipeline.event_scripts import ScriptError, parse_event, read_script
from robosc.pipeline.received_data import NO_DATA
from robosc.pipeline.saved_runs import ModelOfTest, pytest_module
from support.effort import seeds
from support.models import EXAMPLES
from support.random_supervisors import random_supervisor

MODEL = """robot R {
    datatype enum Way from double to { value > 0.5 -> free  default -> blocked }
    datatype object Scan { front: Way  class: integer(0..3)  far: double  rest: array(Way) }
    interface range use Range from sensor_msgs
    component Sensor {
        outgoing message scan with identifier: "/scan", type: Scan links range
        behaviour {
            variable front: Way = blocked
            variable back: Way = blocked
            variable far: double
            variable number: integer(0..3)
            on response from scan do
                front := value.front, number := value.class, back := value.rest[1], far := value.far
            initial marked state sensing { }
        }
    }
    component Base { incoming message move with identifier: "/move", type: integer }
    requirement move needs Sensor.front = free
    provide move with Sensor.number + 1
}"""


@pytest.fixture
def run(tmp_path: Path) -> robosc.Run:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "robot.rscd").write_text(MODEL, encoding="utf-8")
    made = robosc.synthesize(tmp_path / "models" / "robot.rscd").supervisor
    assert made is not None
    run = robosc.simulate(made)
    run.step("scan.response", {"front": 0.7, "class": 1, "rest": [None, "free"], "far": math.inf})
    run.step("move.request")
    run.step("scan.response", {"front": math.nan, "class": 9, "far": math.nan})
    run.step("scan.response", {"front": math.nan, "class": 0})
    return run


def passes(file: Path, supervisor: Any = None) -> bool:
    """Return True if a saved test passes; with a supervisor instead of the file that it would load."""
    names: dict[str, Any] = {"__file__": str(file), "supervisor_given": supervisor}
    text = file.read_text(encoding="utf-8")
    if supervisor is not None:
        text = text.replace("    supervisor = MODEL\n", "    supervisor = supervisor_given\n")
    exec(compile(text, file.name, "exec"), names)
    try:
        names["test_run"]()
    except AssertionError as error:
        assert "after event" in str(error)
        return False
    return True


def test_a_saved_test_passes_and_can_fail(run: robosc.Run, tmp_path: Path) -> None:
    model = ModelOfTest(tmp_path / "models" / "robot.rscd")
    file = run.save(tmp_path / "test_run.py", model)
    text = file.read_text(encoding="utf-8")
    assert "MODEL = FOLDER / 'models/robot.rscd'" in text
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(file)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    for old, new in (("'Sensor.number': 1}", "'Sensor.number': 2}"), ("('move.request',)", "()"), ("math.inf", "1.0")):
        assert old in text
        file.write_text(text.replace(old, new, 1), encoding="utf-8")
        assert not passes(file), old


def test_a_saved_test_may_load_the_file_of_a_supervisor(run: robosc.Run, tmp_path: Path) -> None:
    run.supervisor.write(tmp_path / "it's.rsup")
    assert passes(run.save(tmp_path / "test_run.py", ModelOfTest(tmp_path / "it's.rsup")))


def test_a_saved_test_names_deployment_and_folders(run: robosc.Run, tmp_path: Path) -> None:
    model = ModelOfTest(tmp_path / "m.rscd", Deployment.LAYER, (tmp_path / "lib 'x'",), (tmp_path / "share",))
    text = pytest_module(run, model, tmp_path / "t.py")
    assert "deployment=robosc.Deployment.LAYER" in text
    assert "library_paths=[FOLDER / \"lib 'x'\"], interface_paths=[FOLDER / 'share']" in text
    compile(text, "t.py", "exec")


def test_a_saved_log_is_read_checked_and_happens_again(run: robosc.Run, tmp_path: Path) -> None:
    file = run.save(tmp_path / "run.jsonl")
    log = read_log(file)
    assert [entry.event for entry in log.events] == [step.event for step in run.history]
    assert [entry.time_s for entry in log.events] == [1.0, 2.0, 3.0, 4.0]
    assert check_log(log, run.supervisor).violations == ()
    again = robosc.simulate(run.supervisor)
    for item in script(file.read_text(encoding="utf-8"), run):
        again.step(item.event, *(() if item.data is NO_DATA else (item.data,)))
    assert [str(step) for step in again] == [str(step) for step in run]


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(12))
def test_a_random_run_is_saved_and_happens_again(seed: int, tmp_path: Path) -> None:
    run = robosc.simulate(random_supervisor(seed))
    run.walk(15, seed)
    assert passes(run.save(tmp_path / "t.py", ModelOfTest(tmp_path / "r.rsup")), run.supervisor)


@pytest.mark.parametrize("name", ["run.txt", "run", "run.py"])
def test_another_name_is_refused(run: robosc.Run, tmp_path: Path, name: str) -> None:
    with pytest.raises(robosc.FileAccessError, match=r"the name of a saved run ends in \.jsonl"):
        run.save(tmp_path / name)
    assert not (tmp_path / name).exists()


def script(text: str | bytes, run: robosc.Run) -> Any:
    content = text.encode() if isinstance(text, str) else text
    return read_script(io.BytesIO(content), "events", run.supervisor.model)


@pytest.mark.parametrize(
    ("line", "event", "data"),
    [
        ("move.request", "move.request", NO_DATA),
        ("  level.response\t3 ", "level.response", 3),
        ("level.response null", "level.response", None),
        ("level.response -2.5e3", "level.response", -2500.0),
        ("level.response free", "level.response", "free"),
        ("level.response truth", "level.response", "truth"),
        ('level.response "two words"', "level.response", "two words"),
        ('scan.response {"front": 0.7, "rest": [1, 2]}', "scan.response", {"front": 0.7, "rest": [1, 2]}),
        ('scan.response front=free rest=[1, "x"]  n=true', "scan.response",
         {"front": "free", "rest": [1, "x"], "n": True}),
        ('scan.response a={"b": {"c": 1}} d="e=f"', "scan.response", {"a": {"b": {"c": 1}}, "d": "e=f"}),
        ("scan.response a=1e9999", "scan.response", {"a": math.inf}),
    ],
)  # fmt: skip
def test_lines_of_events(line: str, event: str, data: object) -> None:
    assert parse_event(line) == (event, data)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("move.request\nscan.response 1 2", "events:2: what follows scan.response is neither JSON nor name=value: 1 2"),
        ("scan.response {", "events:1: this is no JSON: {"),
        ("# x\n\nscan.response a=1 2", "events:3: name=value is expected at: 2"),
        ("scan.response a=1 a=2", "events:1: 'a' is given twice"),
        ("scan.response a=", "events:1: there is no value after: a="),
        ("scan.response a=[1", "events:1: this is no JSON: [1"),
        (b"move\xff", "events: no text in UTF-8 (invalid start byte at byte 4)"),
        ('{"kind": "event"}', "events, line 1: its 'time' is not a number of seconds"),
        ('{"time": 1, "kind": "event", "event": "x.y", "state": {}}', "events:1: x.y is not an event of R"),
        ('{"time": 1, "kind": "event", "event": "scan.response", "data": {"value.front": 3}, "state": {}}',
         "events:1: scan.response carries no value.front of the declared type"),
        (b"x" * (1 << 24) + b"y", "events: more than 16777216 bytes"),
    ],
)  # fmt: skip
def test_what_is_no_event_is_reported_with_its_line(run: robosc.Run, text: str | bytes, message: str) -> None:
    with pytest.raises(ScriptError) as caught:
        script(text, run)
    assert message in str(caught.value)


def test_messages_as_they_came_are_read_from_logs_too(run: robosc.Run) -> None:
    # Nodes in C++ log the message, with fields that the model does not know.
    text = (
        '{"time": 1, "kind": "restart", "what": "x"}\n'
        '{"time": 1, "kind": "event", "event": "scan.response", "state": {}, '
        '"data": {"header": {"stamp": 3}, "front": 0.9, "class": 2, "far": "nan", "rest": [0.1, 0.9]}}\n'
        '{"time": 2, "kind": "release", "identifier": "/move"}'
    )
    first, second = script(text, run)
    assert (first.event, second.event) == ("", "scan.response")
    assert second.data["front"] == "free"
    assert (second.data["class"], second.data["rest"]) == (2, [None, "free"])
    assert math.isnan(second.data["far"])


def test_the_log_of_an_example_happens_again(tmp_path: Path) -> None:
    made = robosc.synthesize(EXAMPLES / "navigation" / "navigation.rscd").supervisor
    assert made is not None
    run = robosc.simulate(made)
    run.walk(200, 7)
    again = robosc.simulate(made)
    for item in script(run.save(tmp_path / "run.jsonl").read_text(encoding="utf-8"), run):
        again.step(item.event, *(() if item.data is NO_DATA else (item.data,)))
    assert [str(step) for step in again] == [str(step) for step in run]
