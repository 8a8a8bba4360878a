"""Layouts of Foxglove: each panel is placed once, and shows topics and fields that the log has."""

import re
from typing import Any

import pytest

from robosc.event_logs.foxglove import layout_of
from robosc.event_logs.messages import definition_text
from robosc.interfaces import parse_definition
from robosc.interfaces.distributions import JAZZY

SMALL = {"/robosc/events": "diagnostic_msgs/msg/DiagnosticArray", "/robosc/log": "rcl_interfaces/msg/Log"}
STATES = SMALL | {
    "/robosc/state/Arm": "std_msgs/msg/String",
    "/robosc/variables/Arm/front": "std_msgs/msg/String",
    "/robosc/variables/Arm/n": "std_msgs/msg/Int64",
    "/robosc/blocked": "diagnostic_msgs/msg/DiagnosticArray",
}
MOTION = STATES | {
    "/robosc/pose": "geometry_msgs/msg/PoseStamped",
    "/robosc/velocity": "geometry_msgs/msg/TwistStamped",
    "/robosc/path": "nav_msgs/msg/Path",
    "/tf": "tf2_msgs/msg/TFMessage",
}
MANY = SMALL | {f"/robosc/variables/Arm/n{number}": "std_msgs/msg/Float64" for number in range(50)}


def placed(part: Any) -> list[str]:
    """The panels of a part of the window."""
    if isinstance(part, str):
        return [part]
    assert part["direction"] in ("row", "column")
    assert 0 < part["splitPercentage"] < 100
    return [*placed(part["first"]), *placed(part["second"])]


def shown(panels: dict[str, Any]) -> list[str]:
    """Paths of messages in panels."""
    found = []
    for name, panel in panels.items():
        found += [path["value"] for path in panel.get("paths", ())]
        found += [panel[key] for key in ("topicPath", "topicToRender") if key in panel]
        found += list(panel["topics"]) if name.startswith("3D!") else []
    return found


def check_path(path: str, topics: dict[str, str]) -> None:
    """Each name of a path is a field of the message that the names before lead to."""
    topic, *names = path.split(".")
    type_ = topics[topic]
    for name in names:
        package = type_.partition("/")[0]
        (part,) = parse_definition(JAZZY.definitions[type_], package)
        field = part.fields[re.sub(r"\[.*\]", "", name)]
        assert (field.array is not None) == ("[" in name)
        type_ = field.type.replace("/", "/msg/")
    assert definition_text(topics[topic])


@pytest.mark.parametrize("topics", [SMALL, STATES, MOTION, MANY], ids=["small", "states", "motion", "many"])
def test_panels_are_placed_once_and_show_what_there_is(topics: dict[str, str]) -> None:
    layout = layout_of(topics)
    assert sorted(placed(layout["layout"])) == sorted(layout["configById"])
    paths = shown(layout["configById"])
    for path in paths:
        check_path(path, topics)
    assert "/robosc/events.status[0].name" in paths


def test_the_kinds_of_panels_follow_the_topics() -> None:
    def kinds(topics: dict[str, str]) -> set[str]:
        return {name.partition("!")[0] for name in layout_of(topics)["configById"]}

    assert kinds(SMALL) == {"StateTransitions", "RosOut", "RawMessages"}
    assert kinds(STATES) == {"StateTransitions", "RosOut", "RawMessages", "Table", "Plot"}
    assert kinds(MOTION) == {"StateTransitions", "RosOut", "RawMessages", "Table", "Plot", "3D"}


def test_a_plot_has_as_many_lines_as_can_be_told_apart() -> None:
    assert len(layout_of(MANY)["configById"]["Plot!variables"]["paths"]) == 12
