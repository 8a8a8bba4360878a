"""Layouts of Foxglove for converted logs: panels that show the topics of one log.

Foxglove imports the file as a layout (`Import from file`): it has the panels by name, and their places in the window.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from robosc.event_logs.messages import BLOCKED, EVENTS, LOG, PATH, POSE, ROBOT, TF, VELOCITY, WORLD

_MOST_LINES = 12
"""Most lines of one plot that a reader can tell apart."""

_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#F0E442")
_NUMBERS = ("std_msgs/msg/Bool", "std_msgs/msg/Int64", "std_msgs/msg/Float64")


def layout_of(topics: Mapping[str, str]) -> dict[str, Any]:
    """Return the layout for a converted log.

    Args:
        topics: Type of each topic of the log, as in `Converted`.
    """
    texts = [topic for topic, type_ in topics.items() if type_ == "std_msgs/msg/String"]
    states = [topic for topic in texts if topic.startswith("/robosc/state/")]
    others = [topic for topic in texts if topic not in states]
    numbers = [topic for topic, type_ in topics.items() if type_ in _NUMBERS]
    paths = [*(f"{topic}.data" for topic in states + others), f"{EVENTS}.status[0].name"]
    panels: dict[str, Any] = {
        "StateTransitions!states": {"isSynced": True, "paths": [_path(path) for path in paths]},
        "RosOut!log": {"searchTerms": [], "minLogLevel": 1, "topicToRender": LOG},
        "RawMessages!events": {
            "topicPath": EVENTS, "diffEnabled": False, "diffMethod": "custom", "diffTopicPath": "",
            "showFullMessageForDiff": False,
        },
    }  # fmt: skip
    left: Any = "StateTransitions!states"
    right: Any = _split("column", 60, "RosOut!log", "RawMessages!events")
    if BLOCKED in topics:
        panels["Table!blocked"] = {"topicPath": f"{BLOCKED}.status[:]"}
        right = _split("column", 70, right, "Table!blocked")
    lines = [f"{topic}.data" for topic in numbers[:_MOST_LINES]]
    if VELOCITY in topics:
        lines += [f"{VELOCITY}.twist.linear.x", f"{VELOCITY}.twist.angular.z"]
    if lines:
        panels["Plot!variables"] = _plot(lines)
        left = _split("column", 60, left, "Plot!variables")
    if POSE in topics:
        panels["3D!motion"] = {
            "followTf": WORLD,
            "followMode": "follow-none",
            "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": True, "frameId": WORLD,
                                "size": 10, "divisions": 10, "lineWidth": 1, "color": "#248eff66", "order": 1}},
            "cameraState": {"perspective": False, "distance": 8, "phi": 0, "thetaOffset": 0, "targetOffset": [0, 0, 0],
                            "target": [0, 0, 0], "targetOrientation": [0, 0, 0, 1], "fovy": 45, "near": 0.01,
                            "far": 5000},
            "transforms": {f"frame:{ROBOT}": {"visible": True}},
            "topics": {POSE: {"visible": True}, PATH: {"visible": True}, TF: {"visible": True}},
            "scene": {"enableStats": False},
        }  # fmt: skip
        right = _split("column", 45, "3D!motion", right)
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split("row", 60, left, right),
    }


def _path(value: str, **more: Any) -> dict[str, Any]:
    label = value.removeprefix("/robosc/").removesuffix(".data").removesuffix(".status[0].name")
    return {"value": value, "label": label, "enabled": True, "timestampMethod": "receiveTime", **more}


def _plot(values: Sequence[str]) -> dict[str, Any]:
    paths = [_path(value, color=_COLORS[number % len(_COLORS)]) for number, value in enumerate(values)]
    return {
        "paths": paths, "xAxisVal": "timestamp", "isSynced": True, "showLegend": True, "legendDisplay": "floating",
        "showPlotValuesInLegend": True, "showXAxisLabels": True, "showYAxisLabels": True, "sidebarDimension": 240,
    }  # fmt: skip


def _split(direction: str, percentage: int, first: Any, second: Any) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percentage}
