"""Definitions of ROS 1 that come with RoboSC, against the classes that an installed ROS 1 has."""

import json
import subprocess
from pathlib import Path

import pytest

from robosc.interfaces import DISTRIBUTIONS, Field
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces

PYTHON = Path("/usr/bin/python3")
PRINT_FIELDS = """
import importlib, json, sys
found = {}
for name in json.load(sys.stdin):
    package, kind, type_ = name.split("/")
    try:
        item = getattr(importlib.import_module(package + "." + kind), type_)
    except ImportError:
        continue
    items = [item] if kind == "msg" else [item._request_class, item._response_class]
    found[name] = [dict(zip(item.__slots__, item._slot_types)) for item in items]
json.dump(found, sys.stdout)
"""


def in_python(field: Field, package: str) -> str:
    """The type of a field as classes of ROS 1 name it."""
    length = "" if field.array is None else f"[{field.array.length or ''}]"
    is_header = field.type == f"{package}/Header"
    return ("std_msgs/Header" if is_header else field.type) + length


def test_the_classes_of_an_installed_ros_1_have_the_fields_that_the_definitions_say() -> None:
    noetic = next(item for item in DISTRIBUTIONS if item.version == 1)
    # ROS 1 has messages alone for an action.
    names = [name for name in noetic.definitions if "/action/" not in name]
    result = subprocess.run(
        [PYTHON, "-c", PRINT_FIELDS],
        input=json.dumps(names), capture_output=True, text=True, timeout=60, check=False, env={},
    )  # fmt: skip
    classes = json.loads(result.stdout or "{}")
    if not classes:
        pytest.skip("no ROS 1 is installed")
    catalogue = Catalogue(noetic, FoundInterfaces({}))
    for name, expected in classes.items():
        package, kind, type_ = name.split("/")
        parts = catalogue.definition(kind, package, type_) or ()
        assert [{item.name: in_python(item, package) for item in part.fields.values()} for part in parts] == expected
    assert len(classes) > 100
