import itertools
import json
from pathlib import Path
from typing import get_args

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.language import load_bundle
from robosc.model.check import check
from robosc.model.structure import Model
from robosc_bridge.assembly import safety_limits
from robosc_bridge.configuration import Configuration, ConfigurationError, init, map_channels, parse
from robosc_bridge.configuration import template as template_module
from robosc_bridge.configuration.document import parse_document
from robosc_bridge.configuration.structure import TurtleBot
from robosc_bridge.configuration.template import UDEV_RULES, DriveDriver, ScannerDriver, quoted
from support.models import EXAMPLES, bundle_of

COMBINATIONS = list(
    itertools.product(*map(get_args, (TurtleBot, template_module.DriveDriver, template_module.ScannerDriver)))
)
# Facts that an engineer has to give: nothing on a robot shows them.
OPEN = {
    "line_follower": set[str](),
    "line_follower_layer": set[str](),
    "maze_solver": set[str](),
    "narrow_maze": set[str](),
    "courier": {"/door/open", "/door/close", "/door/opened", "/tray/unlock", "/tray/lock", "/tray/closed", "/order"},
    "ball_pusher": {"/ball", "/goal", "/scored", "/kick_off", "/push", "/pushed", "circle"},
    "navigation": {"/calibrate", "/person/distance", "/navigate_to_pose"},
    "object_finder": {"/camera/detection", "/search", "/announce"},
    "person_follower": {"/person"},
}


def model_of(text: str) -> Model:
    model = check(bundle_of(text)).model
    assert model is not None
    return model


def example(name: str) -> Model:
    (path,) = EXAMPLES.glob(f"*/{name}.rscd")
    model = check(load_bundle(path)).model
    assert model is not None
    return model


def test_every_example_is_covered() -> None:
    assert {path.stem for path in EXAMPLES.glob("*/*.rscd")} == set(OPEN)


@pytest.mark.parametrize("name", [name for name, missing in OPEN.items() if not missing])
@pytest.mark.parametrize(("robot", "drive", "scanner"), COMBINATIONS)
def test_what_is_plain_is_tied(
    name: str, robot: TurtleBot, drive: template_module.DriveDriver, scanner: template_module.ScannerDriver
) -> None:
    model = example(name)
    loaded = parse(init(robot, drive, scanner, model).encode(), "c.yaml")
    found = loaded.configuration
    assert (found.robot, found.drive.driver) == (robot, drive)
    assert found.scanner is not None
    assert found.scanner.driver == scanner
    assert map_channels(model, found, loaded.document).channels.keys() == {item.name for item in model.communications}


@pytest.mark.parametrize("name", OPEN)
def test_what_is_not_plain_is_listed_when_it_is_loaded(name: str) -> None:
    text = init("burger", "opencr", "lds02", example(name))
    open_keys = set[str]()
    try:
        parse(text.encode(), "c.yaml")
    except ConfigurationError as error:
        open_keys = {str(item.path[1]) for item in error.problems}
        assert all(item.message.startswith("is not filled in; it must be {channel: ") for item in error.problems)
        lines = text.splitlines()
        for item in error.problems:
            assert item.line is not None
            assert "To be filled in" in lines[item.line - 2]
            assert lines[item.line - 1] == f"  {json.dumps(item.path[1])}:"
    assert open_keys == OPEN[name]
    assert text.count("To be filled in") == len(open_keys)


def test_filled_in_it_can_be_tied() -> None:
    model = example("navigation")
    text = init("waffle_pi", "opencr", "lds03", model)
    lines = [
        f"{line} {{channel: grpc}}" if before.startswith("  # To be filled in") else line
        for before, line in itertools.pairwise(["", *text.splitlines()])
    ]
    loaded = parse("\n".join(lines).encode(), "c.yaml")
    mapping = map_channels(model, loaded.configuration, loaded.document)
    assert {type(channel).__name__ for channel in mapping.channels.values()} == {"GrpcChannel", "ButtonChannel"}


def test_a_drive_without_buttons_has_none_tied() -> None:
    text = init("burger", "dynamixel", "lds02", example("person_follower"))
    with pytest.raises(ConfigurationError) as caught:
        parse(text.encode(), "c.yaml")
    assert {item.path[1] for item in caught.value.problems} == {"/person", "/button"}


def test_every_setting_has_its_default() -> None:
    bare = "robot: burger\ndrive: {driver: opencr, port: /dev/ttyACM0}\nscanner: {driver: lds03, port: /dev/ttyUSB0}\n"
    default = parse(bare.encode(), "c.yaml").configuration
    found = parse(init("burger", "opencr", "lds03", example("maze_solver")).encode(), "c.yaml").configuration
    assert msgspec.structs.replace(found, channels={}) == default
    assert safety_limits(found) == safety_limits(default)
    assert safety_limits(found).scan_timeout_s == 0.3


@pytest.mark.parametrize(("drive", "board"), [("opencr", "opencr"), ("dynamixel", "u2d2")])
def test_ports_have_their_names_by_the_udev_rules(drive: DriveDriver, board: str) -> None:
    rules = (Path(__file__).parents[3] / "deploy" / "udev" / UDEV_RULES).read_text(encoding="utf-8")
    for scanner in get_args(ScannerDriver):
        text = init("burger", drive, scanner, example("maze_solver"), has_udev_names=True)
        found = parse_document(text.encode(), "c.yaml").value
        assert isinstance(found, dict)
        for section, name in (("drive", f"robosc-{board}"), ("scanner", "robosc-lds")):
            assert found[section]["port"] == f"/dev/{name}"
            assert f'SYMLINK+="{name}"' in rules
        assert text.count("# Its name by the udev rules") == 2


@pytest.mark.parametrize("port", ["/tmp/base", "udpout:127.0.0.1:1", "/dev/a b", "/dev/x: # y", "/dev/\u00e4\n"])
def test_ports_that_are_given_stand_there(port: str) -> None:
    text = init("burger", "opencr", "lds02", example("maze_solver"), drive_port=port, scanner_port=port)
    found = parse_document(text.encode(), "c.yaml").value
    assert isinstance(found, dict)
    assert (found["drive"]["port"], found["scanner"]["port"]) == (port, port)


def test_every_setting_is_written_with_what_it_means() -> None:
    text = init("burger", "opencr", "lds02", example("maze_solver"))
    written = parse_document(text.encode(), "c.yaml").value
    assert isinstance(written, dict)
    assert written.keys() == set(Configuration.__struct_fields__)
    assert max(map(len, text.splitlines())) <= 120
    words = {
        "# Highest yaw rate, in rad/s.",
        "# Execution of the supervisor.",
        "# Rotator.rotate_done: outgoing message",
    }
    assert words <= {line.strip() for line in text.splitlines()}


@pytest.mark.parametrize(
    ("identifier", "declaration", "expected"),
    [
        ("/robot_1/cmd_vel", "incoming message m with {}, type: Twist links any", "{channel: drive}"),
        ("cmd_vel", "incoming message m with {}, type: Twist links any", "{channel: drive}"),
        ("/cmd_vel", "incoming message m with {}, type: double", None),
        ("/velocity", "incoming message m with {}, type: Twist links any", None),
        ("/rotate", "incoming message m with {}, type: double", "{channel: rotate, unit: radians, direction: left}"),
        (
            "/rotate_right",
            "incoming message m with {}, type: integer(0..360)",
            "{channel: rotate, unit: degrees, direction: right}",
        ),
        (
            "/rotate",
            "action m with {}, request: Angle, response: none, feedback: none links any",
            "{channel: rotate, unit: radians, direction: left}",
        ),
        ("/rotate_failed", "outgoing message m with {}, type: none", "{channel: rotated, outcome: failed}"),
        ("/button", "outgoing message m with {}, type: boolean", "{channel: button, name: button_1, on: change}"),
        ("/button_2", "outgoing message m with {}, type: none", "{channel: button, name: button_2, on: press}"),
        ("/battery_state", "outgoing message m with {}, type: Battery links any", "{channel: battery, unit: share}"),
        ("/odom", "outgoing message m with {}, type: Twist links any", None),
        ("/imu", "outgoing message m with {}, type: Imu links any", "{channel: imu}"),
        ("/stop", "outgoing message m with {}, type: none", None),
        ("/x/emergency_stop/stop", "outgoing message m with {}, type: none", "{channel: emergency_stop, event: stop}"),
        ("/line/lost", "outgoing message m with {}, type: none", "{channel: line_lost}"),
        ("/scan", "outgoing message m with {}, type: none", "{channel: scanner}"),
    ],
)
def test_what_is_plain(identifier: str, declaration: str, expected: str | None) -> None:
    use = "" if declaration.startswith("outgoing") else "on request to m"
    model = model_of(
        f"""robot R {{
    interface any use Any from any_interfaces
    datatype object Vector {{ x: double y: double z: double }}
    datatype object Twist {{ linear: Vector angular: Vector }}
    datatype object Angle {{ angle: double }}
    datatype object Battery {{ voltage: double }}
    datatype object Imu {{ angular_velocity: Vector }}
    component C {{
        {declaration.format(f'identifier: "{identifier}"')}
        behaviour {{ initial marked state s {{ {use} }} }}
    }}
}}"""
    )
    text = init("burger", "opencr", "lds02", model)
    line = text.splitlines()[-1]
    assert line == f'  "{identifier}":' + (f" {expected}" if expected else "")


def test_a_model_that_says_nothing_has_nothing_to_tie() -> None:
    model = model_of("robot R { component C { behaviour { initial marked state s { } } } }")
    loaded = parse(init("burger", "opencr", "lds02", model).encode(), "c.yaml")
    assert map_channels(model, loaded.configuration).channels == {}


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=10))
def test_any_identifier_is_written_on_one_line_and_read_again(text: str) -> None:
    written = f"{quoted(text)}: 1"
    assert written.isprintable()
    assert parse_document(written.encode(), "c.yaml").value == {text: 1}
