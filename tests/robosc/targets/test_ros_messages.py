"""Data into and out of real ROS messages (the types alone: no node is started)."""

import math
from typing import Any

import pytest

from robosc.execution.runtime.protocol import DataDoesNotFit
from robosc.targets.ros.runtime.messages import (
    Sender,
    SetupError,
    basic_field,
    check_shape,
    converter,
    headers_of,
    load_message,
    received_field,
)

pytestmark = pytest.mark.ros2
pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

VECTOR = {"x": "double", "y": "double", "z": "double"}
TWIST = {"linear": VECTOR, "angular": VECTOR}


def message(package: str, name: str) -> Any:
    return load_message(package, name)


def test_a_missing_type_says_what_to_do() -> None:
    with pytest.raises(SetupError, match="message type no_such_msgs/msg/X is not installed; build no_such_msgs"):
        load_message("no_such_msgs", "X")
    with pytest.raises(SetupError, match="std_msgs/msg/NoSuchType"):
        load_message("std_msgs", "NoSuchType")


def test_a_basic_type_stands_for_data_or_the_only_field() -> None:
    assert basic_field(message("std_msgs", "Int16")) == "data"
    assert basic_field(message("std_msgs", "Float32MultiArray")) == "data"
    with pytest.raises(SetupError, match="sensor_msgs/msg/Range has the fields header, radiation_type"):
        basic_field(message("sensor_msgs", "Range"))
    with pytest.raises(SetupError, match="std_msgs/msg/Empty has no field"):
        basic_field(message("std_msgs", "Empty"))


@pytest.mark.parametrize(
    ("package", "name", "shape"),
    [
        ("geometry_msgs", "Twist", TWIST),
        ("sensor_msgs", "LaserScan", {"ranges": ["double"], "header": {"stamp": {"sec": "integer"}}}),
        ("sensor_msgs", "Imu", {"orientation_covariance": ["double"]}),
        ("sensor_msgs", "BatteryState", {"present": "boolean", "location": "string", "power_supply_status": "integer"}),
        ("nav_msgs", "Path", {"poses": [{"pose": {"position": VECTOR}}]}),
        ("std_msgs", "String", "string"),
        ("std_msgs", "Empty", None),
        ("geometry_msgs", "Twist", None),
    ],
)
def test_shapes_that_fit(package: str, name: str, shape: Any) -> None:
    check_shape(message(package, name), shape, "message m")


@pytest.mark.parametrize(
    ("package", "name", "shape", "problem"),
    [
        ("geometry_msgs", "Twist", {"liniar": VECTOR}, "has no field 'liniar'; it has linear, angular"),
        (
            "geometry_msgs",
            "Twist",
            {"linear": {"w": "double"}},
            "Twist has no field 'linear.w'|has no field 'linear.w'",
        ),
        (
            "geometry_msgs",
            "Twist",
            {"linear": "double"},
            "field 'linear' .* geometry_msgs/Vector3, in the model it is double",
        ),
        (
            "geometry_msgs",
            "Twist",
            {"linear": {"x": {"y": "double"}}},
            "'linear.x' .* is double, in the model it is an object",
        ),
        ("geometry_msgs", "Twist", {"linear": {"x": "integer"}}, "'linear.x' .* is double, in the model it is integer"),
        ("sensor_msgs", "LaserScan", {"ranges": "double"}, "'ranges' .* sequence<float>, in the model it is double"),
        ("sensor_msgs", "LaserScan", {"ranges": ["integer"]}, "'ranges' .* is float, in the model it is integer"),
        ("sensor_msgs", "LaserScan", {"angle_min": ["double"]}, "'angle_min' .* is float, in the model it is an array"),
        ("std_msgs", "Int16", "double", "'data' .* is int16, in the model it is double"),
        ("std_msgs", "Bool", "integer", "'data' .* is boolean, in the model it is integer"),
        ("std_msgs", "String", "boolean", "'data' .* is string, in the model it is boolean"),
        ("std_msgs", "Byte", "integer", "'data' .* is octet, in the model it is integer"),
    ],
)
def test_shapes_that_do_not_fit(package: str, name: str, shape: Any, problem: str) -> None:
    with pytest.raises(SetupError, match=f"^message m: .*({problem})"):
        check_shape(message(package, name), shape, "message m")


@pytest.mark.parametrize(
    ("field_type", "good", "bad"),
    [
        ("int8", (-128, 127, 0), (-129, 128)),
        ("int16", (-32768, 32767), (-32769, 32768, 70000)),
        ("int32", (-(2**31), 2**31 - 1), (2**31,)),
        ("int64", (-(2**63), 2**63 - 1), (2**63,)),
        ("uint8", (0, 255), (-1, 256)),
        ("uint16", (0, 65535), (-1, 65536)),
        ("uint32", (0, 2**32 - 1), (-1, 2**32)),
        ("uint64", (0, 2**64 - 1), (-1, 2**64)),
    ],
)
def test_integers_must_fit(field_type: str, good: tuple[int, ...], bad: tuple[int, ...]) -> None:
    convert = converter(field_type, "integer")
    for value in good:
        assert convert(value) == value
    for misfit in (*bad, 1.5, "1", None, True):
        with pytest.raises(DataDoesNotFit):
            convert(misfit)


def test_numbers_must_be_finite_and_fit() -> None:
    single, double = converter("float", "double"), converter("double", "double")
    for convert in (single, double):
        assert convert(1) == 1.0
        assert type(convert(1)) is float
        for value in (math.nan, math.inf, -math.inf, None, "1", True):
            with pytest.raises(DataDoesNotFit):
                convert(value)
    assert double(1e300) == 1e300
    assert single(3.4028234663852886e38) == 3.4028234663852886e38
    for value in (1e300, -1e39, 3.5e38):
        with pytest.raises(DataDoesNotFit):
            single(value)


def test_strings_must_fit_their_bound() -> None:
    assert converter("string", "string")("é" * 100) == "é" * 100
    bounded = converter("string<4>", "string")
    assert bounded("éé") == "éé"
    for value in ("ééé", 5, None):
        with pytest.raises(DataDoesNotFit):
            bounded(value)


def test_a_sender_fills_one_message_again_and_again() -> None:
    sender = Sender(message("geometry_msgs", "Twist"), TWIST, (("angular", "z"), ("linear", "x")), "message move")
    first = sender.message
    sender.fill({"linear": {"x": 1}, "angular": {"z": 0.5}})
    assert (first.linear.x, first.angular.z, sender.is_default) == (1.0, 0.5, False)
    sender.fill({"linear": {"x": 2.0}})
    assert (first.linear.x, first.angular.z, sender.is_default) == (2.0, 0.0, False)
    sender.fill(None)
    assert (first.linear.x, first.angular.z, sender.is_default) == (0.0, 0.0, True)
    assert first == type(first)()
    sender.fill({"linear": {"x": 0.0}, "angular": {}})
    assert sender.is_default
    assert sender.message is first


def test_a_sender_says_which_property_does_not_fit() -> None:
    sender = Sender(message("geometry_msgs", "Twist"), TWIST, (("linear", "x"),), "message move")
    with pytest.raises(DataDoesNotFit, match=r"^linear\.x: nan does not fit"):
        sender.fill({"linear": {"x": math.nan}})
    number = Sender(message("std_msgs", "Int16"), "integer", ((),), "message turn")
    with pytest.raises(DataDoesNotFit, match=r"^data: 70000 is outside -32768\.\.32767$"):
        number.fill(70000)
    number.fill(90)
    assert number.message.data == 90
    assert not number.is_default


def test_a_default_other_than_zero_comes_back() -> None:
    quaternion = Sender(message("geometry_msgs", "Quaternion"), {"w": "double"}, (("w",),), "message q")
    quaternion.fill({"w": 0.0})
    assert not quaternion.is_default
    quaternion.fill({})
    assert quaternion.message.w == 1.0
    assert quaternion.is_default


def test_the_field_that_holds_a_received_datum() -> None:
    scan = message("sensor_msgs", "LaserScan")
    assert received_field(message("std_msgs", "Float32"), "double", "message m") == "data"
    assert received_field(scan, {"ranges": ["double"]}, "message m") is None
    assert received_field(message("std_msgs", "Empty"), None, "message m") is None
    with pytest.raises(SetupError, match="a basic type can stand for none of them"):
        received_field(scan, "double", "message m")


def test_the_headers_of_a_request_are_its_own_or_those_of_its_fields() -> None:
    goal = message("geometry_msgs", "PoseStamped")()
    assert headers_of(goal, "action a") == [goal.header]
    services = pytest.importorskip("nav_msgs.srv", reason="nav_msgs is not installed")
    plan = services.GetPlan.Request()
    (first, second) = headers_of(plan, "action a")
    assert first is plan.start.header
    assert second is plan.goal.header
    with pytest.raises(SetupError, match="action a: it is stamped, but neither geometry_msgs/msg/Twist nor a field"):
        headers_of(message("geometry_msgs", "Twist")(), "action a")
