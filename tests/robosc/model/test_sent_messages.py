"""Headers that nothing stamps, and values that do not fit into their fields; what generated nodes send is the twin."""

import pytest

from robosc.certification import make_supervisor
from robosc.execution.runtime.protocol import DataDoesNotFit
from robosc.interfaces import parse_definition
from robosc.model.sent_messages import _misfit
from robosc.model.structure import Deployment
from robosc.targets.ros.runtime.messages import converter
from support.models import bundle_of, checked, marked_place

STAMPED = """robot R {{
    interface i use TwistStamped from geometry_msgs
    datatype object Header {{ frame_id: string }}
    datatype object Vector {{ x: double }}
    datatype object Twist {{ linear: Vector }}
    datatype object Command {{ header: Header twist: Twist }}
    component C {{ incoming message §go with type: Command{} links i }}
    {}
}}"""


@pytest.mark.parametrize(
    ("option", "provide", "code"),
    [
        ("", "", "not-stamped"),
        (', stamped: "base"', "", None),
        ("", "provide go with { twist: { linear: { x: 1.0 } } }", "not-stamped"),
        ("", 'provide go with { header: { frame_id: "base" } }', None),
        (', stamped: "base"', "provide go with { twist: { linear: { x: 1.0 } } }", None),
    ],
)
def test_headers_that_nothing_stamps(option: str, provide: str, code: str | None) -> None:
    text, line, column = marked_place(STAMPED.format(option, provide))
    found = checked(text).diagnostics
    places = [(item.code, item.location.line, item.location.column) for item in found if item.location]
    assert places == ([(code, line, column)] if code else [])


def assert_empty_frame(marked: str) -> None:
    """Check that the only finding is an empty frame at the marked place."""
    text, line, column = marked_place(marked)
    (found,) = checked(text).diagnostics
    assert found.code == "empty-frame"
    assert found.location is not None
    assert (found.location.line, found.location.column) == (line, column)


@pytest.mark.parametrize(
    ("option", "provide"),
    [
        (', §stamped: ""', ""),
        ("", '§provide go with { header: { frame_id: "" } }'),
        (
            "",
            'provide go with { header: { frame_id: "a" } } if true §provide go with { twist: { linear: { x: 1.0 } } }',
        ),
    ],
)
def test_empty_frames(option: str, provide: str) -> None:
    assert_empty_frame(STAMPED.replace("§go", "go").format(option, provide))


def test_an_empty_frame_of_an_unknown_package() -> None:
    assert_empty_frame("""robot R {
        interface travel use Travel from a_package_of_nobody
        datatype object Header { frame_id: string }
        datatype object Goal { header: Header }
        component C { action go with request: Goal, response: none, feedback: none links travel }
        provide go with { header: { frame_id: "map" } } if true
        §provide go with { header: { frame_id: "" } }
    }""")


def test_a_layer_passes_headers_on() -> None:
    text = STAMPED.replace("§", "").format("", "")
    for deployment, codes in ((Deployment.CONTROLLER, {"not-stamped"}), (Deployment.LAYER, set())):
        found = make_supervisor(bundle_of(text), deployment=deployment).diagnostics
        assert {item.code for item in found} & {"not-stamped", "empty-frame"} == codes


@pytest.mark.parametrize(
    ("type_", "package", "communication", "codes"),
    [
        ("MoveBase", "move_base_msgs", "action go with request: none, response: none, feedback: none", ["not-stamped"]),
        (
            "MoveBase",
            "move_base_msgs",
            'action go with request: none, response: none, feedback: none, stamped: "map"',
            [],
        ),
        ("Twist", "geometry_msgs", "incoming message go with type: none", []),
        ("Path", "nav_msgs", "incoming message go with type: none", ["not-stamped"]),
        ("LaserScan", "sensor_msgs", "outgoing message go with type: none", []),
        ("GetPlan", "nav_msgs", "service go with request: none, response: none", []),
    ],
)
def test_the_headers_of_each_kind(type_: str, package: str, communication: str, codes: list[str]) -> None:
    text = f"robot R {{ interface i use {type_} from {package} component C {{ {communication} links i }} }}"
    assert [item.code for item in checked(text).diagnostics] == codes


@pytest.mark.parametrize(
    ("uses", "value", "is_found"),
    [
        ("UInt8 from std_msgs", "255", False),
        ("UInt8 from std_msgs", "256", True),
        ("UInt8 from std_msgs", "-1", True),
        ("Int8 from std_msgs", "-128", False),
        ("Int8 from std_msgs", "-129", True),
        ("Byte from std_msgs", "255", False),
        ("Int64 from std_msgs", "2147483647", False),
    ],
)
def test_integers_that_do_not_fit(uses: str, value: str, is_found: bool) -> None:
    text = (
        f"robot R {{ interface i use {uses} component C {{ incoming message go with type: integer links i }} "
        f"provide go with {value} }}"
    )
    found = [item.code for item in checked(text).diagnostics if item.code != "not-in-ros2-python"]
    assert found == ["value-outside-field"] * is_found


def test_what_is_inside_an_object_and_what_has_no_link_is_looked_at_too() -> None:
    inside = (
        "robot R { interface i use RegionOfInterest from sensor_msgs datatype object O { width: integer } "
        "component C { incoming message go with type: O links i } provide go with { width: -1 } }"
    )
    bare = "robot R { component C { incoming message go with type: integer } provide go with 40000 }"
    for text in (inside, bare):
        (found,) = checked(text).diagnostics
        assert found.code == "value-outside-field"
    assert found.message.startswith("40000 does not fit into the field 'data' of std_msgs/Int16, int16, from -32768")


_IN_PYTHON = {"float32": "float", "float64": "double", "bool": "boolean", "char": "uint8"}


@pytest.mark.parametrize(
    "definition",
    [
        *(f"{sign}int{bits} x" for sign in ("", "u") for bits in (8, 16, 32, 64)),
        *("char x", "float32 x", "float64 x", "string x", "string<=3 x", "bool x"),
    ],
)
def test_what_does_not_fit_is_what_nodes_refuse_to_send(definition: str) -> None:
    """The twin: conversion of generated nodes, on values at every limit."""
    (part,) = parse_definition(definition, "p")
    field = part.fields["x"]
    values: dict[str, list[bool | int | float | str]] = {
        "integer": [sign * (2**bits + change) for sign in (1, -1) for bits in (0, 7, 8, 15, 16, 31) for change in (-1, 0, 1)],
        "double": [0.0, 1.5, 3.4e38, -3.4e38, 3.5e38, -3.5e38, 1e300],
        "string": ["", "abc", "abcd", "äß", "🤖"],
        "boolean": [True, False],
    }  # fmt: skip
    kind = {"s": "string", "f": "double", "b": "boolean"}.get(field.type[0], "integer")
    in_ros = f"string<{field.bound}>" if field.bound else _IN_PYTHON.get(field.type, field.type)
    convert = converter(in_ros, kind)
    for value in values[kind]:
        try:
            convert(value)
            fits = True
        except DataDoesNotFit:
            fits = False
        assert (_misfit(field, value) == "") is fits, (field, value)
