"""Definitions of interfaces, with the classes that ROS makes of them as their opponent."""

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.interfaces import (
    DISTRIBUTIONS,
    INTERFACE_KINDS,
    Array,
    Field,
    MalformedDefinitionError,
    Part,
    parse_definition,
    ros_version_of,
)
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces
from robosc.language.interfaces import interface_folders

BATTERY = """# A battery
uint8 UNKNOWN=0
uint8 FULL = 1   # a constant
string MOTTO=# is no comment
std_msgs/Header header
float32 voltage  # in volts
float32[] cell_voltage
string<=5 name "a=b"
Cell[<=4] cells
int8[3] three [1, 2, 3]
"""


def names(part: Part) -> list[str]:
    return list(part.fields)


def test_a_message() -> None:
    (part,) = parse_definition(BATTERY, "power_msgs")
    assert part.constants == {"UNKNOWN": "0", "FULL": "1", "MOTTO": "# is no comment"}
    assert part.fields == {
        "header": Field("header", "std_msgs/Header"),
        "voltage": Field("voltage", "float32"),
        "cell_voltage": Field("cell_voltage", "float32", None, Array()),
        "name": Field("name", "string", 5),
        "cells": Field("cells", "power_msgs/Cell", None, Array(4, is_bounded=True)),
        "three": Field("three", "int8", None, Array(3)),
    }
    texts = [field.type_text for field in part.fields.values()]
    assert texts == ["std_msgs/Header", "float32", "float32[]", "string<=5", "power_msgs/Cell[<=4]", "int8[3]"]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", [[]]),
        ("bool data\n", [["data"]]),
        ("bool start\n---\nbool success\nstring message", [["start"], ["success", "message"]]),
        ("int32 order # = no\r\n---\r\n---\r\nint32[] partial\r\n", [["order"], [], ["partial"]]),
        ("\ttime\tstamp\n  duration   d", [["stamp", "d"]]),
    ],
)
def test_parts(text: str, parts: list[list[str]]) -> None:
    assert list(map(names, parse_definition(text, "p"))) == parts


@pytest.mark.parametrize(
    "text", ["bool", "bool 1x", "a/b/c d", "bool[x] b", "bool[<=] b", "string<=x s", "=== a", "{}"]
)
def test_what_is_no_definition(text: str) -> None:
    with pytest.raises(MalformedDefinitionError):
        parse_definition(text, "p")


@pytest.mark.parametrize(
    ("text", "version"),
    [
        ("float64 x", None),
        ("std_msgs/Header header", None),
        ("Header header", 1),
        ("time stamp", 1),
        ("builtin_interfaces/Time stamp", 2),
        ("string<=3 s", 2),
        ("int8[<=3] s", 2),
        ("int8[3] s", None),
    ],
)
def test_the_version_of_ros_that_a_text_shows(text: str, version: int | None) -> None:
    assert ros_version_of(parse_definition(text, "p"), "p") == version


def installed() -> Iterator[tuple[str, str, str, Path]]:
    """Package, kind, type and file of each definition of the installed ROS 2."""
    for folder in interface_folders():
        if (folder / "ament_index").is_dir():
            for kind in INTERFACE_KINDS:
                for file in sorted(folder.glob(f"*/{kind}/*.{kind}")):
                    yield file.parent.parent.name, kind, file.stem, file


def classes(package: str, kind: str, type_: str) -> list[Any]:
    """The classes of an interface's parts."""
    found = getattr(pytest.importorskip(f"{package}.{kind}", reason="no ROS 2 is installed"), type_)
    names = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}[kind]
    return [getattr(found, name) for name in names] or [found]


_PYTHON_NAMES = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double"}


def in_python(field: Field) -> str:
    """The type of a field as classes of ROS 2 name it."""
    text = _PYTHON_NAMES.get(field.type, field.type)
    text = text if field.bound is None else f"{text}<{field.bound}>"
    if field.array is None:
        return text
    if field.array.length is not None and not field.array.is_bounded:
        return f"{text}[{field.array.length}]"
    return f"sequence<{text}>" if field.array.length is None else f"sequence<{text}, {field.array.length}>"


def is_constant(value: Any, text: str) -> bool:
    """Return True if the value of a constant in Python is what its definition says."""
    match value:
        case bool():
            return text == str(value).lower()
        case bytes():
            return value == bytes([int(text)])
        case str():
            return value == text.strip("'\"")
        case _:
            return bool(value == float(text))


def test_every_installed_definition_is_read_as_ros_reads_it() -> None:
    """Slow and obvious: the classes that ROS generated from the same files."""
    count = 0
    for package, kind, type_, file in installed():
        parts = parse_definition(file.read_text(encoding="utf-8"), package)
        expected = [dict(item.get_fields_and_field_types()) for item in classes(package, kind, type_)]
        assert [{name: in_python(field) for name, field in part.fields.items()} for part in parts] == expected, file
        for part, item in zip(parts, classes(package, kind, type_), strict=True):
            for name, value in part.constants.items():
                assert is_constant(getattr(item, name), value), (file, name)
        count += 1
    if not count:
        pytest.skip("no ROS 2 is installed")
    assert count > 150


def test_the_definitions_that_come_with_robosc_are_those_of_the_installed_jazzy() -> None:
    jazzy = DISTRIBUTIONS[0]
    for package, kind, type_, file in installed():
        if any(name.startswith(f"{package}/") for name in jazzy.definitions):
            parts = parse_definition(file.read_text(encoding="utf-8"), package)
            assert parse_definition(jazzy.definitions[f"{package}/{kind}/{type_}"], package) == parts


@pytest.mark.parametrize("distribution", DISTRIBUTIONS, ids=lambda item: item.title)
def test_what_a_distribution_has_is_whole(distribution: Any) -> None:
    catalogue = Catalogue(distribution, FoundInterfaces({}))
    assert len(distribution.definitions) > 150
    for name in distribution.definitions:
        package, kind, type_ = name.split("/")
        parts = catalogue.definition(kind, package, type_)
        assert parts is not None
        assert len(parts) == {"msg": 1, "srv": 2, "action": 3}[kind]
        for field in (field for part in parts for field in part.fields.values() if field.is_message):
            assert catalogue.message(field.type) is not None, (name, field)


def test_distributions_differ_where_they_are_known_to() -> None:
    jazzy, *_, humble, noetic = (Catalogue(item, FoundInterfaces({})) for item in DISTRIBUTIONS)
    for catalogue, has in ((jazzy, True), (humble, False), (noetic, False)):
        assert catalogue.has("msg", "geometry_msgs", "VelocityStamped") is has
    fields = [catalogue.definition("msg", "sensor_msgs", "CameraInfo")[0].fields for catalogue in (jazzy, noetic)]  # type: ignore[index]
    assert ["k" in fields[0], "K" in fields[0], "k" in fields[1], "K" in fields[1]] == [True, False, False, True]
    for catalogue, names in ((jazzy, ["stamp", "frame_id"]), (noetic, ["seq", "stamp", "frame_id"])):
        header = catalogue.message("std_msgs/Header")
        assert header is not None
        assert list(header.fields) == names
    assert noetic.message("time") != jazzy.message("time")
    assert noetic.definition("action", "move_base_msgs", "MoveBaseAction") is not None
    assert not jazzy.knows("move_base_msgs")
    assert importlib.import_module("robosc.interfaces").DISTRIBUTIONS[0].title == "ROS 2 Jazzy"


def test_nav2_differs_where_it_is_known_to() -> None:
    jazzy, kilted, lyrical, humble, noetic = (Catalogue(item, FoundInterfaces({})) for item in DISTRIBUTIONS)

    def parts(catalogue: Catalogue, type_: str) -> list[Part]:
        found = catalogue.definition("action", "nav2_msgs", type_)
        assert found is not None
        return list(found)

    # Humble says nothing about a failure but that there is one.
    assert list(parts(humble, "NavigateToPose")[1].fields) == ["result"]
    for catalogue in (jazzy, kilted, lyrical):
        result = parts(catalogue, "NavigateToPose")[1]
        assert list(result.fields) == ["error_code", "error_msg"]
        assert ("GOAL_REJECTED" in result.constants) is (catalogue is lyrical)
    codes = {
        catalogue.distribution.title: parts(catalogue, "NavigateToPose")[1].constants for catalogue in (jazzy, kilted)
    }
    assert "TIMEOUT" not in codes["ROS 2 Jazzy"]
    assert codes["ROS 2 Kilted"]["TIMEOUT"] == "9003"
    poses = {
        catalogue.distribution.title: parts(catalogue, "NavigateThroughPoses")[0].fields["poses"].type_text
        for catalogue in (humble, jazzy, kilted, lyrical)
    }
    assert poses == {
        "ROS 2 Humble": "geometry_msgs/PoseStamped[]",
        "ROS 2 Jazzy": "geometry_msgs/PoseStamped[]",
        "ROS 2 Kilted": "nav_msgs/Goals",
        "ROS 2 Lyrical": "nav_msgs/Goals",
    }
    for type_, having in {
        "MissedWaypoint": (jazzy,),
        "WaypointStatus": (kilted, lyrical),
        "TrackingFeedback": (lyrical,),
    }.items():
        assert [item for item in (jazzy, kilted, lyrical, humble) if item.has("msg", "nav2_msgs", type_)] == [
            *having
        ], type_
    assert list(parts(lyrical, "FollowPath")[2].fields) == ["tracking_feedback"]
    assert list(parts(jazzy, "FollowPath")[2].fields) == ["distance_to_goal", "speed"]
    assert not noetic.knows("nav2_msgs")
    for catalogue in (jazzy, kilted, lyrical, humble):
        assert catalogue.has("action", "opennav_docking_msgs", "DockRobot")
        assert catalogue.has("action", "nav2_msgs", "DockRobot") is (catalogue is not humble)
    for catalogue in (jazzy, kilted, lyrical, humble, noetic):
        for type_ in ("FollowJointTrajectory", "GripperCommand", "PointHead"):
            assert catalogue.has("action", "control_msgs", type_), (catalogue.distribution, type_)
        assert catalogue.has("msg", "geographic_msgs", "GeoPoseStamped")
