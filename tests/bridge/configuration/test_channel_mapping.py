import pytest

from robosc.language import load_bundle
from robosc.model.check import check
from robosc.model.structure import Model
from robosc_bridge import driver_registry
from robosc_bridge.configuration import ChannelMapping, ConfigurationError, map_channels, parse, unsuitable_because
from robosc_bridge.configuration import channels as kinds
from support.models import EXAMPLES, bundle_of

HEAD = "robot: burger\ndrive: {driver: opencr, port: /dev/ttyACM0}\nscanner: {driver: lds02, port: /dev/ttyUSB0}\n"
MAZE = """channels:
  /scan: {channel: scanner}
  /rotate_left: {channel: rotate, unit: degrees, direction: left}
  /rotate_right: {channel: rotate, unit: degrees, direction: right}
  /rotate_done: {channel: rotated}
  /cmd_vel: {channel: drive}
"""


def model_of(text: str) -> Model:
    checked = check(bundle_of(text))
    assert checked.model is not None, checked.diagnostics
    return checked.model


def example(name: str) -> Model:
    model = check(load_bundle(EXAMPLES / f"{name}.rscd")).model
    assert model is not None
    return model


def mapped(model: Model, text: str, head: str = HEAD) -> ChannelMapping:
    loaded = parse((head + text).encode(), "c.yaml")
    return map_channels(model, loaded.configuration, loaded.document)


def errors_of(model: Model, text: str, head: str = HEAD) -> list[str]:
    with pytest.raises(ConfigurationError) as caught:
        mapped(model, text, head)
    return str(caught.value).splitlines()


MESSAGES = """robot R {{
    interface any use Any from any_interfaces
    datatype object Vector {{ x: double y: double z: double }}
    datatype object Twist {{ linear: Vector angular: Vector }}
    datatype object Stamped {{ twist: Twist }}
    datatype object Scan {{ ranges: array(double) }}
    datatype object Echoes {{ ranges: array(integer) }}
    datatype object Flat {{ ranges: double }}
    datatype object Flags {{ data: boolean }}
    datatype object Number {{ data: double }}
    datatype object Whole {{ data: integer }}
    datatype object Lidar {{ ranges: array(double) echoes: array(double) range_max: double }}
    datatype object Battery {{ voltage: double percentage: double }}
    datatype object Point {{ x: double y: double theta: double }}
    datatype object Position {{ position: Vector }}
    datatype object Pose {{ pose: Position }}
    datatype object Odometry {{ pose: Pose }}
    datatype object Outcome {{ success: boolean }}
    datatype enum Near from double to {{ value < 1.0 -> near default -> far }}
    datatype enum Ahead from Scan to {{ value.ranges[0] > 0.4 -> clear default -> blocked }}
    datatype enum Pressed from boolean to {{ value -> pressed default -> released }}
    component C {{
        {declaration}
        behaviour {{ initial marked state s {{ {use} }} }}
    }}
    {provide}
}}"""


def with_message(kind: str, type_: str, provide: str = "") -> Model:
    declaration = f'{kind} message m with identifier: "/m", type: {type_} links any'
    use = "on request to m" if kind == "incoming" else ""
    return model_of(MESSAGES.format(declaration=declaration, use=use, provide=provide))


def test_the_maze_solver_is_tied() -> None:
    mapping = mapped(example("maze_solver/maze_solver"), MAZE)
    assert mapping.channels["rotate_right"] == kinds.RotateChannel(unit="degrees", direction="right")
    assert [item.name for item, _ in mapping.mapped_to(kinds.ScannerChannel)] == [
        "scan_front",
        "scan_right",
        "scan_back_right",
    ]
    assert list(mapping.channels) == [item.name for item in mapping.communications]


def test_all_that_is_missing_is_one_error() -> None:
    assert errors_of(example("maze_solver/maze_solver"), "channels:\n  /cmd_vel: {channel: drive}\n") == [
        f"c.yaml:4: channels: {text} is not mapped to a channel"
        for text in (
            "outgoing message 'scan_front' ('/scan')",
            "outgoing message 'scan_right' ('/scan')",
            "outgoing message 'scan_back_right' ('/scan')",
            "incoming message 'rotate_left' ('/rotate_left')",
            "incoming message 'rotate_right' ('/rotate_right')",
            "outgoing message 'rotate_done' ('/rotate_done')",
        )
    ]


def test_what_the_model_does_not_have_is_reported() -> None:
    (line,) = errors_of(example("maze_solver/maze_solver"), MAZE + "  /scann: {channel: scanner}\n")
    assert line == "c.yaml:10: channels[\"/scann\"]: the model has no such communication; did you mean '/scan'?"


def test_without_a_file_there_are_no_lines() -> None:
    loaded = parse(HEAD.encode(), "c.yaml")
    with pytest.raises(ConfigurationError, match=r"^configuration: channels: outgoing message 'scan_front'"):
        map_channels(example("maze_solver/maze_solver"), loaded.configuration)


def test_names_of_communications_may_stand_for_their_identifiers() -> None:
    model = with_message("incoming", "Twist")
    assert mapped(model, "channels: {m: {channel: drive}}").channels == {"m": kinds.DriveChannel()}


def test_a_second_tie_is_reported() -> None:
    model = with_message("incoming", "Twist")
    (line,) = errors_of(model, "channels:\n  /m: {channel: drive}\n  m: {channel: log}\n")
    assert line == "c.yaml:6: channels.m: incoming message 'm' ('/m') is mapped here again, but '/m' maps it already"


def test_messages_on_one_identifier_need_one_channel() -> None:
    text = MAZE.replace("  /scan: {channel: scanner}\n", "").replace(
        "channels:\n",
        "channels:\n  scan_front: {channel: scanner}\n  scan_right: {channel: none}\n  scan_back_right: "
        "{channel: scanner}\n",
    )
    (line,) = errors_of(example("maze_solver/maze_solver"), text)
    assert line == (
        "c.yaml:4: channels: 'scan_front' and 'scan_right' share the identifier '/scan' and need one channel"
    )


@pytest.mark.parametrize(
    ("direction", "type_", "channel", "reason"),
    [
        ("incoming", "Twist", "drive", None),
        ("incoming", "Stamped", "drive", None),
        ("incoming", "Vector", "drive", "has no field 'x'; there is linear, angular"),
        ("incoming", "double", "drive", "the data is {linear: "),
        ("incoming", "none", "drive", "not nothing"),
        ("incoming", "none", "stop", None),
        ("incoming", "Twist", "stop", None),
        ("incoming", "integer", "rotate", None),
        ("incoming", "double", "rotate", None),
        ("incoming", "Whole", "rotate", None),
        ("incoming", "string", "rotate", "the data is number, not string"),
        ("incoming", "Near", "rotate", "the data is number, not Near"),
        ("incoming", "none", "rotate", "the data is number, not nothing"),
        ("incoming", "Scan", "scanner", "the channel is for an outgoing message"),
        ("incoming", "Scan", "log", None),
        ("incoming", "Scan", "grpc", None),
        ("incoming", "Scan", "none", None),
        ("outgoing", "Scan", "scanner", None),
        ("outgoing", "Ahead", "scanner", None),
        ("outgoing", "none", "scanner", None),
        ("outgoing", "Lidar", "scanner", "has no field 'echoes'; there is ranges, angle_min"),
        ("outgoing", "Echoes", "scanner", "'ranges[]' is number, not integer"),
        ("outgoing", "Flat", "scanner", "'ranges' is array of number, not double"),
        ("outgoing", "Twist", "drive", "the channel is for an incoming message"),
        ("outgoing", "Odometry", "odometry", None),
        ("outgoing", "Pose", "odometry", "has no field 'pose.position'; there is pose"),
        ("outgoing", "Point", "odometry", "has no field 'x'; there is pose, twist"),
        ("outgoing", "Battery", "battery", None),
        ("outgoing", "boolean", "bumper", None),
        ("outgoing", "Pressed", "bumper", None),
        ("outgoing", "Flags", "bumper", None),
        ("outgoing", "integer", "bumper", "the data is boolean, not integer"),
        ("outgoing", "none", "bumper", None),
        ("outgoing", "double", "line", None),
        ("outgoing", "Near", "line", None),
        ("outgoing", "Number", "line", None),
        ("outgoing", "Whole", "line", "the data is number, not {data}"),
        ("outgoing", "integer", "line", "the data is number, not integer"),
        ("outgoing", "string", "fault", None),
        ("outgoing", "double", "line_lost", "the data is nothing, not double"),
        ("outgoing", "none", "rotated", None),
        ("outgoing", "none", "log", "the channel is for an incoming message"),
        ("outgoing", "Scan", "grpc", None),
        ("outgoing", "Scan", "none", None),
    ],
)
def test_data_and_direction_must_fit(direction: str, type_: str, channel: str, reason: str | None) -> None:
    model, text = with_message(direction, type_), f"channels:\n  /m: {{channel: {channel}}}\n"
    if reason is None:
        assert mapped(model, text).channels.keys() == {"m"}
        return
    (first, *_) = errors_of(model, text)
    assert first.startswith(
        f"c.yaml:5: channels[\"/m\"]: {direction} message 'm' ('/m') cannot be mapped to '{channel}'"
    )
    assert reason in first


@pytest.mark.parametrize(
    ("provide", "parts"),
    [
        ("", []),
        ("provide m with { linear: { x: 0.1 }, angular: { z: 0.2 } }", []),
        ("provide m with { linear: { x: 0.1, y: 0.0 }, angular: { x: 0.0 } }", []),
        ("provide m with { linear: { y: 0.1 } }", ["linear.y"]),
        ("provide m with { linear: { z: 1.0 - 1.0 }, angular: { x: 2.0, y: -1.0 } }", ["angular.x", "angular.y"]),
    ],
)
def test_velocities_that_the_wheels_cannot_do_are_reported(provide: str, parts: list[str]) -> None:
    model = with_message("incoming", "Twist", provide)
    reasons = unsuitable_because(model, model.communications[0], kinds.DriveChannel)
    assert [reason.split("'")[1] for reason in reasons if not reason.startswith("the model gives 'linear.z'")] == parts
    assert all("does not use; it uses angular.z, linear.x" in reason for reason in reasons)


CALLS = """robot R {{
    datatype object Angle {{ angle: double }}
    datatype object Other {{ width: double }}
    datatype object Outcome {{ success: boolean }}
    datatype object Left {{ remaining: double }}
    interface any use Any from any_interfaces
    component C {{
        {declaration} links any
        behaviour {{ initial marked state s {{ on request to m }} }}
    }}
}}"""


@pytest.mark.parametrize(
    ("declaration", "channel", "reason"),
    [
        ("service m with request: Angle, response: Outcome", "rotate", None),
        ("service m with request: Angle, response: none", "rotate", None),
        ("service m with request: none, response: Outcome", "stop", None),
        ("service m with request: none, response: Outcome", "rotate", "request: the data is number, not nothing"),
        ("service m with request: Other, response: Outcome", "rotate", "request: the data is number, not {width}"),
        ("service m with request: Angle, response: Left", "rotate", "response: has no field 'remaining'"),
        ("service m with request: Angle, response: Left", "grpc", None),
        ("service m with request: Angle, response: Left", "drive", "the channel is for an incoming message"),
        (
            "service m with request: Angle, response: Left",
            "none",
            "the channel is for an incoming message or an outgoing",
        ),
        ("action m with request: Angle, response: Outcome, feedback: Left", "rotate", None),
        (
            "action m with request: Angle, response: Outcome, feedback: Angle",
            "rotate",
            "feedback: has no field 'angle'",
        ),
        (
            "action m with request: none, response: none, feedback: none",
            "stop",
            "the channel is for an incoming message or a s",
        ),
    ],
)
def test_services_and_actions_are_tied_to_skills(declaration: str, channel: str, reason: str | None) -> None:
    model, text = model_of(CALLS.format(declaration=declaration)), f"channels: {{m: {{channel: {channel}}}}}"
    if reason is None:
        mapped(model, text)
    else:
        (line,) = errors_of(model, text)
        assert reason in line


def test_a_robot_of_ones_own_is_not_for_the_drives_of_a_turtlebot3() -> None:
    model = with_message("outgoing", "none")
    own = "robot: {wheel_separation_m: 0.3, linear_m_s: 0.8, angular_rad_s: 1.5}\n"
    head = f"{own}drive: {{driver: opencr, port: /dev/ttyUSB1}}\n"
    (line,) = errors_of(model, "channels: {/m: {channel: none}}", head)
    problem = "the drive 'opencr' belongs to a TurtleBot3; 'robot' must be one of burger, waffle, waffle_pi"
    assert line == f"c.yaml:1: robot: {problem}"
    for driver in ("dynamixel", "mavlink-rover", "of_a_plug_in"):
        head = f"{own}drive: {{driver: {driver}, port: /dev/ttyUSB1}}\n"
        assert mapped(model, "channels: {/m: {channel: none}}", head).channels.keys() == {"m"}


def test_devices_that_are_not_there_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver_registry, "_registered", {})
    model = with_message("outgoing", "none")
    head = "robot: burger\ndrive: {driver: dynamixel, port: /dev/ttyUSB1}\n"

    def problem(channel: str, rest: str = "") -> str:
        (line,) = errors_of(model, f"channels: {{/m: {channel}}}\n{rest}", head)
        return line.partition("]")[2] or line

    assert problem("{channel: scanner}") == ": there is no scanner: the section 'scanner' is missing"
    assert problem("{channel: fault, device: scanner}") == ": there is no scanner: the section 'scanner' is missing"
    assert problem("{channel: imu}") == ": the drive 'dynamixel' has no inertial sensor"
    assert problem("{channel: bumper}") == ": the drive 'dynamixel' has no bumpers"
    assert problem("{channel: button, name: x}") == ".name: the drive 'dynamixel' has no button 'x'; there is none"
    line = problem("{channel: none}", "skills: {emergency_stop: {stop_buttons: [button_1]}}")
    assert line == (
        "c.yaml:4: skills.emergency_stop.stop_buttons: the drive 'dynamixel' has no button 'button_1'; there is none"
    )
    (line,) = errors_of(model, "channels: {/m: {channel: button, name: buton_1}}")
    assert line.endswith("the drive 'opencr' has no button 'buton_1'; did you mean 'button_1'?")
    # Declarations of a plug-in count, and without any, all may be there.
    driver_registry.register(
        driver_registry.Driver(
            driver_registry.Kind.DRIVE_BASE, "cart", "a cart", object, driver_registry.DriverFeatures(("button_7",))
        )
    )
    cart = head.replace("dynamixel", "cart")
    assert mapped(model, "channels: {/m: {channel: button, name: button_7}}", cart).channels.keys() == {"m"}
    for channel in ("{channel: button, name: button_1}", "{channel: bumper}", "{channel: imu}"):
        (line,) = errors_of(model, f"channels: {{/m: {channel}}}", cart)
        assert "the drive 'cart' " in line
    plug_in = head.replace("dynamixel", "of_a_plug_in")
    for channel in ("{channel: button, name: any}", "{channel: bumper}", "{channel: imu}"):
        assert mapped(model, f"channels: {{/m: {channel}}}", plug_in).channels.keys() == {"m"}


def test_settings_name_what_the_model_has() -> None:
    execution = """execution:
  policy: priority
  priority: [move, mve, scan_front]
  max_age_s:
    /scan: 1
    /cmd_vel: 1
  release_identifiers: [/cmd_vel, /scan]
"""
    assert errors_of(example("maze_solver/maze_solver"), execution + MAZE) == [
        "c.yaml:6: execution.priority[1]: 'mve' is not a request of the model; did you mean 'move'?",
        "c.yaml:6: execution.priority[2]: 'scan_front' is not a request of the model; there is move, rotate_left, "
        "rotate_right",
        'c.yaml:9: execution.max_age_s["/cmd_vel"]: the model receives no message with this identifier; '
        "there is /rotate_done, /scan",
        "c.yaml:10: execution.release_identifiers[1]: the model sends nothing on '/scan'; there is /cmd_vel, "
        "/rotate_left, /rotate_right",
    ]


def test_the_executor_releases_what_drives() -> None:
    model, text = with_message("incoming", "Twist"), "channels: {/m: {channel: drive}}\n"
    loaded = parse((HEAD + text).encode(), "c.yaml")
    mapping = map_channels(model, loaded.configuration)
    settings = mapping.settings(loaded.configuration.execution)
    assert settings.release_identifiers == ("/m",)
    assert settings.period_s == 0.02
    chosen = parse((HEAD + text + "execution: {release_identifiers: [], seed: 5}\n").encode(), "c.yaml")
    settings = mapping.settings(chosen.configuration.execution)
    assert (settings.release_identifiers, settings.seed) == ((), 5)
