"""Basic types against the fields of middleware types."""

from pathlib import Path

import pytest

from robosc.language import load_bundle
from robosc.language.interfaces import find_interfaces
from robosc.model import check
from robosc.model.interfaces import fields_of

BATTERY = """# A battery
uint8 UNKNOWN=0
uint8 FULL = 1   # a constant
std_msgs/Header header
float32 voltage  # in volts
float32[] cell_voltage
string<=5 name "a=b"
"""


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (BATTERY, (("header", "voltage", "cell_voltage", "name"),)),
        ("", ((),)),
        ("bool data\n", (("data",),)),
        ("bool start\n---\nbool success\nstring message", (("start",), ("success", "message"))),
        ("int32 order # = no\r\n---\r\n---\r\nint32[] partial\r\n", (("order",), (), ("partial",))),
    ],
)
def test_fields(text: str, parts: tuple[tuple[str, ...], ...]) -> None:
    assert fields_of(text) == parts


@pytest.fixture
def share(tmp_path: Path) -> Path:
    folder = tmp_path / "ros"
    for name, text in {
        "sensor_msgs/msg/Battery.msg": BATTERY,
        "std_msgs/msg/Bool.msg": "bool data",
        "robot_msgs/msg/Speed.msg": "float64 speed",
        "robot_msgs/srv/Go.srv": "float64 x\nfloat64 y\n---\nbool done",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def codes(share: Path, tmp_path: Path, uses: str, communication: str) -> list[str]:
    model = tmp_path / "robot.rscd"
    model.write_text(
        f"robot R {{ interface i use {uses} datatype object O {{ }} component C {{ {communication} links i }} }}",
        encoding="utf-8",
    )
    return [item.code for item in check(load_bundle(model, (), (share,))).diagnostics]


@pytest.mark.parametrize(
    ("uses", "communication", "expected"),
    [
        ("Battery from sensor_msgs", "outgoing message m with type: double", ["ambiguous-field"]),
        ("Battery from sensor_msgs", "outgoing message m with type: none", []),
        ("Battery from sensor_msgs", "outgoing message m with type: O", []),
        ("Bool from std_msgs", "outgoing message m with type: boolean", []),
        ("Speed from robot_msgs", "incoming message m with type: double", []),
        ("Unheard from robot_msgs", "incoming message m with type: double", []),
        ("Go from robot_msgs", "service m with request: double, response: boolean", ["ambiguous-field"]),
        ("Go from robot_msgs", "service m with request: O, response: boolean", []),
        ("Go from robot_msgs", "incoming message m with type: double", []),
    ],
)
def test_ambiguous_fields(share: Path, tmp_path: Path, uses: str, communication: str, expected: list[str]) -> None:
    assert codes(share, tmp_path, uses, communication) == expected


def test_only_what_a_model_names_is_read(share: Path) -> None:
    (share / "secret.msg").write_text("bool data")
    texts = [
        "robot R { interface a use Bool from std_msgs interface b use ^Speed from ^robot_msgs interface c use ../.. }"
    ]
    assert [file.name for file in find_interfaces(texts, (share,))] == [
        "robot_msgs/msg/Speed.msg",
        "std_msgs/msg/Bool.msg",
    ]
    assert find_interfaces(["interface", "interface a use", "// interface a use Bool from std_msgs"], (share,)) == ()
