"""Constant indices against the lengths of received arrays; an array of that length is the twin."""

import pytest

from robosc.model.check import check
from robosc.source import Bundle, SourceFile
from support.models import checked, marked_place

ROBOT = """robot R {{
    interface i use PoseWithCovariance from geometry_msgs
    interface s use LaserScan from sensor_msgs
    datatype object Estimate {{ covariance: array(double) }}
    datatype object Scan {{ ranges: array(double) }}
    datatype enum Known from Estimate to {{ {rule} -> known default -> lost }}
    component C {{
        outgoing message known with type: Known links i
        outgoing message estimate with type: Estimate links i
        outgoing message scan with type: Scan links s
        behaviour {{
            variable a: double
            on response from estimate do a := {update}
            on response from scan do a := value.ranges[9999]
            initial marked state only {{ }}
        }}
    }}
}}"""
SOUND = {"rule": "value.covariance[0] < 0.1", "update": "value.covariance[35]"}


@pytest.mark.parametrize(
    ("place", "text", "is_found"),
    [
        ("rule", "value.covariance[35] < 1.0", False),
        ("rule", "value.covariance§[36] < 1.0", True),
        ("rule", "1.0 + abs(value.covariance§[40]) < 1.0 or true", True),
        ("rule", "min(value.covariance[30..35]) < 1.0", False),
        ("rule", "min(value.covariance§[30..36]) < 1.0", True),
        ("rule", "all(x in value.covariance§[36..2]: x > 0.0)", True),
        ("update", "if value.covariance[0] > 1.0 then 1.0 else value.covariance§[99]", True),
        ("update", "value.covariance[7]", False),
    ],
)
def test_indices_beyond_a_fixed_length(place: str, text: str, is_found: bool) -> None:
    marked = ROBOT.format(**{**SOUND, place: text})
    line = column = 0
    if is_found:
        marked, line, column = marked_place(marked)
    found = checked(marked).diagnostics
    places = [(item.code, item.location.line, item.location.column) for item in found if item.location]
    assert places == [("index-outside-array", line, column)] * is_found


@pytest.mark.parametrize("length", ["", "3", "<=3"])
@pytest.mark.parametrize("index", [0, 2, 3, 4])
def test_each_way_to_say_a_length(length: str, index: int) -> None:
    files = (
        SourceFile("p/msg/Outer.msg", "Inner[] inner"),
        SourceFile("p/msg/Inner.msg", f"float64[{length}] items"),
    )
    text = f"""robot R {{
        interface i use Outer from p
        datatype object Inner {{ items: array(double) }}
        datatype object Outer {{ inner: array(Inner) }}
        component C {{
            outgoing message m with type: Outer links i
            behaviour {{
                variable a: double
                on response from m do a := value.inner[7].items[{index}]
                initial marked state only {{ }}
            }}
        }}
    }}"""
    found = check(Bundle(SourceFile("r", text), interfaces=files)).diagnostics
    # The twin: the longest array that such a field can hold.
    longest = list(range(int(length.strip("<=")) if length else 10_000))
    is_there = bool(longest[index : index + 1])
    assert [item.code for item in found] == [] if is_there else ["index-outside-array"]


def test_conditions_of_incoming_messages_are_looked_at_too() -> None:
    text = """robot R {
        interface i use Twist from own_msgs
        interface p use PoseWithCovariance from geometry_msgs
        datatype object Estimate { covariance: array(double) }
        component C { incoming message m with type: Estimate, when: value.covariance[36] > 0.0 links p }
    }"""
    assert [item.code for item in checked(text).diagnostics] == ["index-outside-array"]
