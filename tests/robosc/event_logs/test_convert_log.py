"""Event logs as MCAP files: read back, they hold what the log and the record of motion hold."""

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from robosc.event_logs import ConversionUnavailableError, LogError, MotionOfLogError, convert_log, read_log
from robosc.event_logs.messages import MAXIMUM_TOPICS, definition_text

BEGIN_S = 1767225600.0


def event(time_s: float, name: str, state: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"time": BEGIN_S + time_s, "kind": "event", "event": name, "controllable": name.endswith("request"),
            "state": state, **more}  # fmt: skip


def arm(state: str, **variables: Any) -> dict[str, Any]:
    return {"Arm": {"state": state, "variables": variables}}


def written(folder: Path, *entries: dict[str, Any]) -> Path:
    path = folder / "run.jsonl"
    path.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")
    return path


def sample(time_s: float, x_m: float, heading_rad: float = 0.0) -> dict[str, Any]:
    return {"time": BEGIN_S + time_s, "world_s": 10 * time_s, "x_m": x_m, "y_m": 0.5, "heading_rad": heading_rad,
            "linear_m_s": 0.1, "angular_rad_s": -0.2, "collisions": 0}  # fmt: skip


def messages(path: Path) -> Iterator[tuple[str, str, int, Any]]:
    """Topic, type, time and content of each message, by the time of the log."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        for schema, channel, message, content in reader.iter_decoded_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            yield channel.topic, schema.name, message.log_time, content


def on(path: Path, topic: str) -> list[Any]:
    return [content for each, _, _, content in messages(path) if each == topic]


def test_events_have_their_data_and_the_time_of_the_log(tmp_path: Path) -> None:
    log = written(
        tmp_path,
        event(0.25, "scan.response", arm("up"), data={"value": "wall", "ranges": [1.5, "nan"]}, decision_us=12.5),
        event(1.0, "go.request", arm("up")),
    )
    found = convert_log(log, tmp_path / "run.mcap")
    assert (found.entries, found.has_motion, found.notes) == (2, False, ())
    first, second = on(found.path, "/robosc/events")
    (status,) = first.status
    assert (first.header.stamp.sec, first.header.stamp.nanosec) == (1767225600, 250_000_000)
    assert (status.level, status.name, status.message, status.hardware_id) == (
        0, "scan.response", "uncontrollable", "run.jsonl",
    )  # fmt: skip
    assert [(pair.key, pair.value) for pair in status.values] == [
        ("value", "wall"), ("ranges", '[1.5, "nan"]'), ("decision_us", "12.5"),
    ]  # fmt: skip
    assert [(item.name, item.message, item.values) for item in second.status] == [("go.request", "controllable", [])]
    times = [time_ns for topic, _, time_ns, _ in messages(found.path) if topic == "/robosc/events"]
    assert times == [1767225600_250_000_000, 1767225601_000_000_000]


def test_every_entry_stands_in_the_log_topic_in_words(tmp_path: Path) -> None:
    def entry(kind: str, **more: Any) -> dict[str, Any]:
        return {"time": BEGIN_S, "kind": kind, **more}

    log = written(
        tmp_path,
        event(0.0, "go.request", arm("up"), data={"speed": 0.5}),
        entry("blocked", identifier="/cmd_vel", why="forbidden"),
        entry("unknown", event="scan.response", unknown=["Arm.a", "Arm.b"]),
        entry("fault", what="it broke"),
        entry("release", identifier="/cmd_vel"),
        entry("dropped", count=3),
        entry("reached", aim="goal 1", count=2, what="always eventually Arm.up"),
        entry("approach", aim=None, what="all are met"),
        entry("owed", assumption="assumption 1", owed_s=30.0, what="Arm.up leads to Arm.down"),
        entry("met", assumption="assumption 1", owed_s=31.5, what="Arm.up leads to Arm.down"),
    )
    found = convert_log(log, tmp_path / "run.mcap")
    read_back = [(item.level, item.name, item.msg, item.function, item.line) for item in on(found.path, "/robosc/log")]
    assert read_back == [
        (20, "go.request", "go.request: speed = 0.5", "event", 1),
        (30, "blocked", "blocked: /cmd_vel, forbidden", "blocked", 2),
        (30, "scan.response", "unknown scan.response: Arm.a, Arm.b", "unknown", 3),
        (40, "fault", "fault: it broke", "fault", 4),
        (20, "release", "release: /cmd_vel", "release", 5),
        (30, "dropped", "dropped: 3", "dropped", 6),
        (20, "reached", "reached: goal 1, always eventually Arm.up, 2", "reached", 7),
        (20, "approach", "approach: all are met", "approach", 8),
        (30, "owed", "owed: assumption 1, Arm.up leads to Arm.down", "owed", 9),
        (20, "met", "met: assumption 1, Arm.up leads to Arm.down", "met", 10),
    ]
    ((blocked,),) = (item.status for item in on(found.path, "/robosc/blocked"))
    assert (blocked.level, blocked.name, blocked.message) == (1, "/cmd_vel", "forbidden")
    assert found.notes == ("the log lacks 3 entries that its writer lost",)


def test_states_and_variables_are_written_when_they_change(tmp_path: Path) -> None:
    log = written(
        tmp_path,
        event(0.0, "a", arm("up", n=1, x=1, flag=True, front="wall", pose={"x": 0.5, "unset": None})),
        event(1.0, "b", arm("up", n=1, x="nan", flag=False, front="wall", pose={"x": 0.5})),
        event(2.0, "c", arm("down", n=2, x=2.5, flag=False, front="nan", pose={"x": 1.5})),
    )
    found = convert_log(log, tmp_path / "run.mcap")
    assert [item.data for item in on(found.path, "/robosc/state/Arm")] == ["up", "down"]
    name = "/robosc/variables/Arm/"
    assert {topic: type_ for topic, type_ in found.topics.items() if topic.startswith(name)} == {
        name + "n": "std_msgs/msg/Int64",
        name + "x": "std_msgs/msg/Float64",
        name + "flag": "std_msgs/msg/Bool",
        name + "front": "std_msgs/msg/String",
        name + "pose/x": "std_msgs/msg/Float64",
    }
    assert [item.data for item in on(found.path, name + "n")] == [1, 2]
    assert [item.data for item in on(found.path, name + "flag")] == [True, False]
    assert [item.data for item in on(found.path, name + "front")] == ["wall", "nan"]
    assert [item.data for item in on(found.path, name + "pose/x")] == [0.5, 1.5]
    first, nan, last = (item.data for item in on(found.path, name + "x"))
    assert (first, math.isnan(nan), last) == (1.0, True, 2.5)


@pytest.mark.parametrize("seed", range(5))
def test_the_last_messages_by_any_time_are_the_state_of_the_log(tmp_path: Path, seed: int) -> None:
    """The twin: each state of the log as a whole, beside the changes in the messages."""
    import random

    chance = random.Random(seed)
    entries, state = [], {name: {"state": "s0", "variables": {"v": 0}} for name in "ABC"}
    for number in range(200):
        name = chance.choice("ABC")
        state = {**state, name: {"state": f"s{chance.randrange(3)}", "variables": {"v": chance.randrange(3)}}}
        entries.append(event(number * 0.01, "e", state))
    found = convert_log(written(tmp_path, *entries), tmp_path / "run.mcap")
    last: dict[str, Any] = {}
    by_time: dict[int, dict[str, Any]] = {}
    for topic, _, time_ns, content in messages(found.path):
        if topic.startswith(("/robosc/state/", "/robosc/variables/")):
            last[topic] = content.data
        by_time[time_ns] = dict(last)
    for entry in read_log(tmp_path / "run.jsonl").entries:
        read_back = by_time[round(entry.time_s * 1e6) * 1000]
        for name, part in entry.state.items():
            assert read_back[f"/robosc/state/{name}"] == part["state"]
            assert read_back[f"/robosc/variables/{name}/v"] == part["variables"]["v"]


def test_names_that_ros_refuses_are_changed_and_stay_different(tmp_path: Path) -> None:
    parts: dict[str, Any] = {name: {"state": name, "variables": {}} for name in ("a b", "a-b", "4wd", "")}
    found = convert_log(written(tmp_path, event(0.0, "e", parts)), tmp_path / "run.mcap")
    states = {topic: content.data for topic, _, _, content in messages(found.path) if "/state/" in topic}
    assert states == {
        "/robosc/state/a_b": "a b", "/robosc/state/a_b_2": "a-b", "/robosc/state/_4wd": "4wd", "/robosc/state/_": "",
    }  # fmt: skip


def test_the_motion_beside_the_log_is_taken(tmp_path: Path) -> None:
    log = written(tmp_path, event(0.0, "a", arm("up")), event(1.0, "b", arm("up")))
    hit = {"time": BEGIN_S + 0.6, "world_s": 6.0, "happening": "collision", "x_m": 1.0, "y_m": 0.5, "name": "box"}
    lines = [sample(0.0, 0.0), sample(0.5, 1.0, math.pi), hit]
    (tmp_path / "motion.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    found = convert_log(log, tmp_path / "run.mcap")
    assert found.has_motion
    first, second = on(found.path, "/robosc/pose")
    assert (first.header.frame_id, second.header.stamp.nanosec) == ("map", 500_000_000)
    turn = second.pose.orientation
    assert (second.pose.position.x, second.pose.position.y) == (1.0, 0.5)
    assert (turn.x, turn.y, turn.z) == (0.0, 0.0, 1.0)
    assert turn.w == pytest.approx(0.0)
    assert [item.twist.angular.z for item in on(found.path, "/robosc/velocity")] == [-0.2, -0.2]
    (path,) = on(found.path, "/robosc/path")
    assert [pose.pose.position.x for pose in path.poses] == [0.0, 1.0]
    (transform,) = on(found.path, "/tf")[1].transforms
    assert (transform.header.frame_id, transform.child_frame_id, transform.transform.translation.x) == (
        "map", "base_link", 1.0,
    )  # fmt: skip
    assert [item.msg for item in on(found.path, "/robosc/log") if item.function == "motion"] == [
        "collision box at x = 1 m, y = 0.5 m"
    ]


def test_a_motion_of_another_time_is_refused_if_it_was_asked_for(tmp_path: Path) -> None:
    log = written(tmp_path, event(0.0, "a", arm("up")))
    other = tmp_path / "motion.jsonl"
    other.write_text(json.dumps(sample(60.0, 0.0)) + "\n", encoding="utf-8")
    assert not convert_log(log, tmp_path / "run.mcap").has_motion
    with pytest.raises(MotionOfLogError, match=r"is of another time than .*run.jsonl: it begins \+60.0 s"):
        convert_log(log, tmp_path / "run.mcap", motion=other)
    with pytest.raises(MotionOfLogError, match="there is no such file"):
        convert_log(log, tmp_path / "run.mcap", motion=tmp_path / "none.jsonl")


def test_the_path_of_a_long_way_is_thinned_and_keeps_its_end(tmp_path: Path) -> None:
    log = written(tmp_path, event(0.0, "a", arm("up")))
    lines = [sample(number * 0.05, float(number)) for number in range(5000)]
    (tmp_path / "motion.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    (path,) = on(convert_log(log, tmp_path / "run.mcap").path, "/robosc/path")
    assert len(path.poses) <= 2001
    assert [path.poses[place].pose.position.x for place in (0, -1)] == [0.0, 4999.0]


def test_the_same_log_gives_the_same_file(tmp_path: Path) -> None:
    log = written(tmp_path, event(0.0, "a", arm("up", n=1)), event(1.0, "b", arm("down", n=2)))
    one, two = (convert_log(log, tmp_path / name).path.read_bytes() for name in ("1.mcap", "2.mcap"))
    assert one == two


def test_a_log_without_entries_is_noted(tmp_path: Path) -> None:
    found = convert_log(written(tmp_path), tmp_path / "run.mcap")
    assert (found.entries, found.notes) == (0, ("the log has no entries",))


def test_what_no_message_can_hold_is_refused_before_a_file_is_there(tmp_path: Path) -> None:
    target = tmp_path / "run.mcap"
    with pytest.raises(LogError, match=r"run.jsonl, line 2: its 'time' is before 1970 or after 2038"):
        convert_log(written(tmp_path, event(0.0, "a", {}), event(1e9, "a", {})), target)
    many = {f"v{number}": number for number in range(MAXIMUM_TOPICS)}
    with pytest.raises(LogError, match=f"line 1: more than {MAXIMUM_TOPICS} components and variables"):
        convert_log(written(tmp_path, event(0.0, "a", arm("up", **many))), target)
    with pytest.raises(LogError, match="line 2: it has no 'kind'"):
        convert_log(written(tmp_path, event(0.0, "a", {}), {"time": BEGIN_S}), target)
    assert not target.exists()


def test_a_file_that_cannot_be_written_whole_is_not_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mcap_ros2.writer import Writer

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Writer, "finish", full)
    with pytest.raises(OSError, match="No space left"):
        convert_log(written(tmp_path, event(0.0, "a", {})), tmp_path / "run.mcap")
    assert not (tmp_path / "run.mcap").exists()


def test_without_the_extra_it_is_said_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap_ros2", None)
    monkeypatch.delitem(sys.modules, "mcap_ros2.writer", raising=False)
    with pytest.raises(ConversionUnavailableError, match=r"pip install 'robosc\[mcap\]'"):
        convert_log(written(tmp_path, event(0.0, "a", {})), tmp_path / "run.mcap")


def test_a_definition_has_all_that_it_holds_once() -> None:
    text = definition_text("nav_msgs/msg/Path")
    parts = [line.removeprefix("MSG: ") for line in text.splitlines() if line.startswith("MSG: ")]
    assert parts == [
        "geometry_msgs/PoseStamped", "std_msgs/Header", "geometry_msgs/Pose", "builtin_interfaces/Time",
        "geometry_msgs/Point", "geometry_msgs/Quaternion",
    ]  # fmt: skip
