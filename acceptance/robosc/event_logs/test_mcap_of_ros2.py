"""Messages of a converted log, read by the message classes of an installed ROS 2."""

import importlib
import json
import math
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from robosc.event_logs import convert_log

# The parser of definitions in ROS 2 still loads a module that Python is to lose.
pytestmark = [pytest.mark.ros2, pytest.mark.filterwarnings("ignore:module 'sre:DeprecationWarning")]

BEGIN_S = 1767225600.25


def test_ros_2_reads_what_was_written(tmp_path: Path) -> None:
    from rclpy.serialization import deserialize_message

    log, motion = tmp_path / "run.jsonl", tmp_path / "motion.jsonl"
    state = {"Arm": {"state": "up", "variables": {"n": -3, "x": 0.5, "flag": True, "front": "wäll"}}}
    entries = [
        {"time": BEGIN_S, "kind": "event", "event": "go.request", "controllable": True, "data": {"v": 1},
         "state": state},
        {"time": BEGIN_S + 1, "kind": "blocked", "identifier": "/cmd_vel", "why": "forbidden"},
    ]  # fmt: skip
    log.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")
    sample = {
        "time": BEGIN_S, "world_s": 0.0, "x_m": 1.0, "y_m": 2.0, "heading_rad": math.pi, "linear_m_s": 0.1,
        "angular_rad_s": 0.2, "collisions": 0,
    }  # fmt: skip
    motion.write_text(json.dumps(sample) + "\n", encoding="utf-8")
    found: dict[str, Any] = {}
    with convert_log(log, tmp_path / "run.mcap").path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert schema is not None
            package, _, name = schema.name.split("/")
            try:
                type_ = getattr(importlib.import_module(f"{package}.msg"), name)
            except ModuleNotFoundError:
                assert package == "tf2_msgs"  # No index of packages has it.
                continue
            found[channel.topic] = deserialize_message(message.data, type_)
    (status,) = found["/robosc/events"].status
    assert (status.level, status.name, status.message) == (b"\x00", "go.request", "controllable")
    assert [(pair.key, pair.value) for pair in status.values] == [("v", "1")]
    assert found["/robosc/events"].header.stamp.nanosec == 250_000_000
    assert found["/robosc/blocked"].status[0].level == b"\x01"
    assert (found["/robosc/log"].level, found["/robosc/log"].msg) == (30, "blocked: /cmd_vel, forbidden")
    values = {topic.rpartition("/")[2]: item.data for topic, item in found.items() if "/Arm" in topic}
    assert values == {"Arm": "up", "n": -3, "x": 0.5, "flag": True, "front": "wäll"}
    pose = found["/robosc/pose"].pose
    assert (pose.position.x, pose.position.y, pose.orientation.z) == (1.0, 2.0, 1.0)
    assert found["/robosc/velocity"].twist.angular.z == 0.2
    assert len(found["/robosc/path"].poses) == 1
