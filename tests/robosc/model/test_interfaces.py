"""Communications against the definitions of their middleware types; what generated nodes do at their start is the twin."""

import importlib
import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.errors import Severity
from robosc.interfaces import DISTRIBUTIONS, Field, Part
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces
from robosc.language import load_bundle
from robosc.language.interfaces import find_interfaces, interface_folders, sourced_distribution
from robosc.model import message_fields
from robosc.model.check import check
from robosc.model.interfaces import headers_of as known_headers
from robosc.model.message_fields import Fault
from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile
from robosc.targets.ros.package import ROS2_ERRORS
from robosc.targets.ros.runtime.messages import SetupError, check_shape, headers_of
from robosc.targets.ros.topics import shapes_of
from support.models import checked, marked_place

BATTERY = """# A battery
uint8 FULL = 1   # a constant
std_msgs/Header header
float32 voltage  # in volts
Cell[] cells
string<=5 name "a=b"
"""


@pytest.fixture
def share(tmp_path: Path) -> Path:
    folder = tmp_path / "ros"
    for name, text in {
        "power_msgs/msg/Battery.msg": BATTERY,
        "power_msgs/msg/Cell.msg": "float32 voltage\nother_msgs/Place place",
        "power_msgs/msg/Own.idl": "",
        "power_msgs/msg/Broken.msg": "]",
        "std_msgs/msg/Bool.msg": "bool data",
        "robot_msgs/msg/Speed.msg": "float64 speed",
        "robot_msgs/srv/Go.srv": "float64 x\nfloat64 y\n---\nbool done",
        "robot_msgs/action/Walk.action": "float64 x\n---\nbool done\n---\nint32 steps",
        "old_msgs/msg/Status.msg": "Header header\nbool on\nduration since",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


OBJECTS = """
    datatype object O { }
    datatype object Battery { voltage: double name: string }
    datatype object Cells { cells: array(Battery) }
    datatype object Placed { cells: array(Cell) }
    datatype object Cell { voltage: double place: O }
    datatype object Status { ^on: boolean since: Since }
    datatype object Since { secs: integer }
    datatype object Header { seq: integer }
    datatype enum Level from double to { value > 1.0 -> high default -> low }
"""


def found_in(share: Path, tmp_path: Path, uses: str, communication: str) -> list[str]:
    model = tmp_path / "here" / "robot.rscd"
    model.parent.mkdir(exist_ok=True)
    model.write_text(
        f"robot R {{ interface i use {uses} {OBJECTS} component C {{ {communication} links i }} }}", encoding="utf-8"
    )
    return [f"{item.code}: {item.message}" for item in check(load_bundle(model, (), (share,))).diagnostics]


@pytest.mark.parametrize(
    ("uses", "communication", "expected"),
    [
        ("Battery from power_msgs", "outgoing message m with type: double", ["ambiguous-field"]),
        ("Battery from power_msgs", "outgoing message m with type: Level", ["ambiguous-field"]),
        ("Battery from power_msgs", "outgoing message m with type: none", []),
        ("Battery from power_msgs", "outgoing message m with type: O", []),
        ("Battery from power_msgs", "outgoing message m with type: Battery", []),
        ("Battery from power_msgs", "outgoing message m with type: Cells", ["needless-property"]),
        ("Battery from power_msgs", "outgoing message m with type: Placed", ["definition-not-found"]),
        ("Batery from power_msgs", "outgoing message m with type: Battery", ["unknown-ros-type"]),
        ("Battery from power_msgs", "service m with request: none, response: none", ["unknown-ros-type"]),
        ("Own from power_msgs", "outgoing message m with type: Battery", ["definition-not-found"]),
        ("Broken from power_msgs", "outgoing message m with type: Battery", ["definition-not-found"]),
        ("Battery from no_msgs", "outgoing message m with type: Battery", ["definition-not-found"]),
        ("Bool from std_msgs", "outgoing message m with type: boolean", []),
        ("Bool from std_msgs", "outgoing message m with type: double", ["field-type-mismatch"]),
        ("Bool from std_msgs", "outgoing message m with type: integer", ["cpp-only", "ros1-only"]),
        ("Speed from robot_msgs", "incoming message m with type: double", []),
        ("Speed from robot_msgs", "outgoing message m with type: Level", []),
        ("Speed from robot_msgs", "outgoing message m with type: Status", ["needless-property", "needless-property"]),
        ("Go from robot_msgs", "service m with request: double, response: boolean", ["ambiguous-field"]),
        ("Go from robot_msgs", "service m with request: O, response: boolean", []),
        ("Go from robot_msgs", "service m with request: O, response: string", ["field-type-mismatch"]),
        ("Go from robot_msgs", "incoming message m with type: double", ["unknown-ros-type"]),
        ("Walk from robot_msgs", "action m with request: double, response: boolean, feedback: integer", []),
        (
            "Walk from robot_msgs",
            "action m with request: double, response: none, feedback: double",
            ["field-type-mismatch"],
        ),
        ("WalkGoal from robot_msgs", "outgoing message m with type: double", ["definition-not-found"]),
        ("Status from old_msgs", "outgoing message m with type: Status", []),
        ("Status from old_msgs", "outgoing message m with type: Battery", ["needless-property", "needless-property"]),
        ("MoveBase from move_base_msgs", "action m with request: O, response: none, feedback: none", ["not-stamped"]),
        (
            "MoveBaseAction from move_base_msgs",
            "action m with request: O, response: none, feedback: none",
            ["not-stamped"],
        ),
        ("Header from std_msgs", "outgoing message m with type: Header", ["ros1-only"]),
        ("Twist from geometry_msgs", 'incoming message m with type: none, stamped: "b"', ["no-header"]),
        ("TwistStamped from geometry_msgs", 'incoming message m with type: none, stamped: "b"', []),
    ],
)
def test_what_is_found(share: Path, tmp_path: Path, uses: str, communication: str, expected: list[str]) -> None:
    found = found_in(share, tmp_path, uses, communication)
    assert [item.partition(":")[0] for item in found] == expected, found


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


def test_what_definitions_are_made_of_is_read_and_of_a_package_that_lacks_a_type_its_names(share: Path) -> None:
    texts = ["robot R { interface a use Battery from power_msgs interface b use Gone from robot_msgs }"]
    found = find_interfaces(texts, (share,))
    assert [file.name for file in found] == [
        "power_msgs/msg/Battery.msg",
        "power_msgs/msg/Cell.msg",
        "robot_msgs/types.txt",
    ]
    assert found[-1].text == "action/Walk\nmsg/Speed\nsrv/Go\n"


@pytest.mark.parametrize("place", ["model.rscd", "models/model.rscd", "robot/models/model.rscd"])
def test_packages_of_the_workspace_are_found_and_given_folders_win(share: Path, tmp_path: Path, place: str) -> None:
    model = share / place
    model.parent.mkdir(parents=True, exist_ok=True)
    model.write_text("robot R { interface a use Speed from robot_msgs }")
    (found,) = load_bundle(model).interfaces
    assert found == SourceFile("robot_msgs/msg/Speed.msg", "float64 speed")
    package = tmp_path / "given" / "robot_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "msg" / "Speed.msg").write_text("float32 other")
    installed = tmp_path / "install" / "robot_msgs" / "share"
    installed.mkdir(parents=True)
    (installed / "robot_msgs").symlink_to(package)
    for folder in (package, package.parent, tmp_path / "install"):
        (found,) = load_bundle(model, (), (folder,)).interfaces
        assert found.text == "float32 other"


def test_where_nothing_was_looked_for_nothing_is_missed(share: Path) -> None:
    text = "robot R { interface a use Battery from no_msgs component C { outgoing message m with type: none links a } }"
    assert [item.code for item in check(Bundle(SourceFile("r", text))).diagnostics] == []
    (found,) = check(Bundle(SourceFile("r", text), searched=(".",))).diagnostics
    assert found.message == "not checked against no_msgs (its definitions were not found)"
    assert found.severity is Severity.NOTE


MODEL = """robot R {{
    interface i use {} from {}
    datatype object O {{ {} }}
    datatype object P {{ {} }}
    component C {{ outgoing message m with type: O links i }}
}}"""


@pytest.mark.parametrize(
    ("type_", "properties", "inner", "message", "fix"),
    [
        (
            "§BateryState from sensor_msgs", "", "",
            "sensor_msgs of ROS 2 Jazzy has no message 'BateryState'; did you mean 'BatteryState'?",
            "Write 'BatteryState'.",
        ),
        (
            "§SetBool from std_srvs", "", "",
            "std_srvs of ROS 2 Jazzy has no message 'SetBool'; it is a service",
            "Link it to a service, or use a type that is a message.",
        ),
        (
            "BatteryState from sensor_msgs", "§percentag: double", "",
            "sensor_msgs/BatteryState of ROS 2 Jazzy has no field 'percentag', and nothing reads or fills it; did you mean 'percentage'?",
            "Write 'percentage'.",
        ),
        (
            "BatteryState from sensor_msgs", "percentage: §integer(0..100)", "",
            "the field 'percentage' of sensor_msgs/BatteryState of ROS 2 Jazzy is float32, not integer(0..100)",
            "Write 'double'.",
        ),
        (
            "LaserScan from sensor_msgs", "ranges: §double", "",
            "the field 'ranges' of sensor_msgs/LaserScan of ROS 2 Jazzy is float32[], not double",
            "Write 'array(double)'.",
        ),
        (
            "LaserScan from sensor_msgs", "ranges: §array(integer)", "",
            "the field 'ranges' of sensor_msgs/LaserScan of ROS 2 Jazzy is float32[], not array(integer)",
            "Write 'array(double)'.",
        ),
        (
            "Twist from geometry_msgs", "linear: §double", "",
            "the field 'linear' of geometry_msgs/Twist of ROS 2 Jazzy is geometry_msgs/Vector3, not double",
            "Make an object type with the fields of geometry_msgs/Vector3 that are meant, such as x, y, z.",
        ),
        (
            "Twist from geometry_msgs", "linear: P", "§speed: double",
            "geometry_msgs/Vector3 of ROS 2 Jazzy has no field 'speed', and nothing reads or fills it; it has x, y, z",
            "Remove the property, or give it the name of a field.",
        ),
        (
            "BatteryState from sensor_msgs", "§POWER_SUPPLY_STATUS_FULL: integer", "",
            "sensor_msgs/BatteryState of ROS 2 Jazzy has no field 'POWER_SUPPLY_STATUS_FULL', and nothing reads or fills it; it is a constant, 4",
            "Remove the property, and write the value instead.",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_where_it_is(type_: str, properties: str, inner: str, message: str, fix: str) -> None:
    name, _, package = type_.partition(" from ")
    marked = MODEL.format(name, package, properties, inner)
    text, line, column = marked_place(marked)
    (found,) = checked(text).diagnostics
    assert (found.message, found.fix) == (message, fix)
    assert found.location is not None
    assert (found.location.line, found.location.column) == (line, column)
    assert found.severity is Severity.WARNING


@pytest.mark.parametrize(
    ("type_", "properties", "expected"),
    [
        # A byte of ROS 2 is an object of one byte in Python, in all else a number.
        ("DiagnosticStatus from diagnostic_msgs", "level: integer", ("not-in-ros2-python", Severity.WARNING)),
        ("BatteryState from sensor_msgs", "power_supply_status: boolean", ("cpp-only", Severity.WARNING)),
        ("CameraInfo from sensor_msgs", "K: array(double)", ("ros1-only", Severity.NOTE)),
        ("CameraInfo from sensor_msgs", "k: array(double)", ("ros2-only", Severity.NOTE)),
        ("VelocityStamped from geometry_msgs", "body_frame_id: string", ("ros2-only", Severity.NOTE)),
        ("Float64 from std_msgs", "data: double", None),
        ("BatteryState from sensor_msgs", "temperature: double", None),
    ],
)
def test_what_only_some_nodes_can_do(type_: str, properties: str, expected: tuple[str, Severity] | None) -> None:
    name, _, package = type_.partition(" from ")
    found = checked(MODEL.format(name, package, properties, "")).diagnostics
    assert [(item.code, item.severity) for item in found] == ([] if expected is None else [expected]), found


@pytest.mark.parametrize(
    ("local", "properties", "codes"),
    [
        # The one of ROS 1 is as it ever was.
        ("float32 charge", "percentage: double", ["ros1-only"]),
        ("float32 charge", "percentages: double", ["needless-property"]),
        ("builtin_interfaces/Time stamp\nfloat32 charge", "percentage: double", ["ros1-only"]),
        ("float32 charge", "charge: double", []),
        ("float32 percentage", "percentage: double", []),
        ("float32 secret", "secret: double", ["ros2-only"]),
        ("Header header\nfloat32 secret", "secret: double", ["ros1-only"]),
    ],
)
def test_a_local_definition_wins_over_the_one_that_comes_with_robosc(
    local: str, properties: str, codes: list[str]
) -> None:
    text = MODEL.format("BatteryState", "sensor_msgs", properties, "")
    files = (SourceFile("sensor_msgs/msg/BatteryState.msg", local),)
    found = check(Bundle(SourceFile("model.rscd", text), interfaces=files)).diagnostics
    assert [item.code for item in found] == codes, found


# Distributions.

POSE_2D = ("Pose2D from geometry_msgs", "theta: double")
WAYPOINT = ("WaypointStatus from nav2_msgs", "error_msg: string")
TRACKED = ("TrackingFeedback from nav2_msgs", "speed: double")


def of_distribution(uses: tuple[str, str], distribution: str, *files: SourceFile) -> list[tuple[str, Severity, str]]:
    name, _, package = uses[0].partition(" from ")
    text = MODEL.format(name, package, uses[1], "")
    bundle = Bundle(SourceFile("model.rscd", text), interfaces=files, distribution=distribution)
    return [(item.code, item.severity, item.message) for item in check(bundle).diagnostics]


@pytest.mark.parametrize(
    ("uses", "distribution", "expected"),
    [
        (POSE_2D, "jazzy", None),
        (
            POSE_2D,
            "lyrical",
            "geometry_msgs of ROS 2 Lyrical has no message 'Pose2D'; it fits ROS 2 Humble, Jazzy and Kilted",
        ),
        (
            WAYPOINT,
            "jazzy",
            "nav2_msgs of ROS 2 Jazzy has no message 'WaypointStatus'; it fits ROS 2 Kilted and Lyrical",
        ),
        (WAYPOINT, "kilted", None),
        (TRACKED, "lyrical", None),
        (TRACKED, "kilted", "nav2_msgs of ROS 2 Kilted has no message 'TrackingFeedback'; it fits ROS 2 Lyrical"),
    ],
)
def test_what_the_chosen_distribution_lacks_is_a_warning_with_its_name(
    uses: tuple[str, str], distribution: str, expected: str | None
) -> None:
    found = of_distribution(uses, distribution)
    assert [item for item in found if item[0] not in ("ros2-only", "ros1-only")] == (
        [] if expected is None else [("unknown-ros-type", Severity.WARNING, expected)]
    )


FIELD = """robot R {
    interface navigate use NavigateToPose from nav2_msgs
    datatype object Done { error_code: integer }
    datatype object Far { position_tracking_error: double }
    component C {
        action go with request: none, response: RESPONSE, feedback: FEEDBACK, stamped: "map" links navigate
        behaviour {
            variable code: integer(0..9999)
            variable offset: double
            initial marked state idle { on request to go goto busy }
            state busy {
                UPDATE goto idle
                on error from go goto idle
                on cancel to go goto idle
            }
        }
    }
}"""
RESULT = FIELD.replace("RESPONSE", "Done").replace("FEEDBACK", "none")
RESULT = RESULT.replace("UPDATE", "on response from go do code := value.error_code")
PROGRESS = FIELD.replace("RESPONSE", "none").replace("FEEDBACK", "Far")
PROGRESS = PROGRESS.replace("UPDATE", "on feedback from go do offset := value.position_tracking_error")


@pytest.mark.parametrize(
    ("text", "lacking", "named"),
    [
        (RESULT, ["humble"], "it fits ROS 2 Jazzy, Kilted and Lyrical"),
        (PROGRESS, ["humble", "jazzy", "kilted"], "it fits ROS 2 Lyrical"),
    ],
)
def test_a_field_that_came_is_reported_with_the_distributions_that_have_it(
    text: str, lacking: list[str], named: str
) -> None:
    for distribution in ("humble", "jazzy", "kilted", "lyrical"):
        bundle = Bundle(SourceFile("model.rscd", text), distribution=distribution)
        found = [item for item in check(bundle).diagnostics if item.code == "unknown-field"]
        if distribution in lacking:
            (item,) = found
            assert f"nav2_msgs/NavigateToPose of ROS 2 {distribution.capitalize()} has no field" in item.message
            assert item.message.endswith(f"; {named}")
            assert item.severity is Severity.WARNING
            assert "--distribution" in item.fix
        else:
            assert found == []


def test_where_none_is_chosen_what_jazzy_lacks_is_noted() -> None:
    message = "nav2_msgs of ROS 2 Jazzy has no message 'WaypointStatus'; it fits ROS 2 Kilted and Lyrical"
    assert of_distribution(WAYPOINT, "") == [("other-distribution", Severity.NOTE, message)]
    assert of_distribution(POSE_2D, "") == []


def test_nothing_of_other_distributions_helps_where_none_fits() -> None:
    found = of_distribution(("Pose2D from geometry_msgs", "thita: double"), "jazzy")
    assert [item[0] for item in found] == ["needless-property"]
    ((code, _, message),) = of_distribution(("Pose2 from geometry_msgs", "x: double"), "lyrical")
    assert (code, message) == (
        "unknown-ros-type",
        "geometry_msgs of ROS 2 Lyrical has no message 'Pose2'; did you mean 'Pose'?",
    )


def test_what_is_installed_is_of_the_chosen_distribution() -> None:
    file = SourceFile("geometry_msgs/msg/Pose2D.msg", "float64 other\nbuiltin_interfaces/Time stamp")
    assert of_distribution(("Pose2D from geometry_msgs", "other: double"), "lyrical", file)[1:] == []


def test_folders_of_another_distribution_are_not_searched(share: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prefixes = share.parent / "jazzy", share.parent / "workspace"
    for prefix, package in zip(prefixes, ("std_msgs", "robot_msgs"), strict=True):
        (prefix / "share" / package).mkdir(parents=True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", ":".join(map(str, prefixes)))
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    jazzy, workspace = (prefix / "share" for prefix in prefixes)
    assert interface_folders("jazzy")[:2] == (jazzy, workspace)
    assert interface_folders("lyrical")[0] == workspace
    assert jazzy not in interface_folders("lyrical")
    assert sourced_distribution() == "jazzy"
    monkeypatch.setenv("ROS_DISTRO", "rolling")
    assert sourced_distribution() == ""


# The twin: what a Python node of ROS 2 does with the classes of the installed ROS.

_WORDS = {"boolean": "boolean", "integer": "integer", "double": "double", "string": "string"}


def shapes(part: Part, catalogue: Catalogue, dice: random.Random, depth: int = 0) -> Any:
    """A shape of data, mostly one that fits a message."""
    if depth == 0 and dice.random() < 0.2:
        return dice.choice([*_WORDS, None])
    names = list(part.fields)
    chosen = dice.sample(names, min(len(names), dice.randint(0, 3)))
    found = {name: shape_of(part.fields[name], catalogue, dice, depth) for name in chosen}
    if dice.random() < 0.05:
        found[dice.choice(["nothing", *(f"{name}s" for name in names)])] = "double"
    return found


def shape_of(field: Field, catalogue: Catalogue, dice: random.Random, depth: int) -> Any:
    if dice.random() < 0.1 or depth > 3:
        return dice.choice([*_WORDS, {}, ["double"], [{}], None])
    if field.is_message:
        part = catalogue.message(field.type)
        assert part is not None
        shape = shapes(part, catalogue, dice, depth + 1)
    elif field.type in ("string", "wstring"):
        shape = "string"
    else:
        is_float, is_bool = field.type.startswith("float"), field.type == "bool"
        shape = "double" if is_float else "boolean" if is_bool else "integer"
    return [shape] if field.array is not None else shape


def declared(shape: Any, objects: list[str]) -> str:
    """The type in the model that has a shape; its objects are added to a list."""
    if isinstance(shape, dict):
        properties = " ".join(f"^{name}: {declared(inner, objects)}" for name, inner in shape.items())
        objects.append(f"datatype object O{len(objects)} {{ {properties} }}")
        return f"O{len(objects) - 1}"
    return f"array({declared(shape[0], objects)})" if isinstance(shape, list) else shape or "none"


def installed_messages() -> Iterator[tuple[str, str]]:
    for folder in interface_folders():
        if (folder / "ament_index").is_dir():
            for file in sorted(folder.glob("*/msg/*.msg")):
                yield file.parent.parent.name, file.stem


def can_start(message_class: Any, shape: Any) -> bool:
    """Return True if a generated node would start with a shape."""
    try:
        check_shape(message_class, shape, "message m")
    except SetupError:
        return False
    return True


def test_python_nodes_of_ros_2_refuse_at_their_start_what_the_check_finds() -> None:
    """Every message of the installed ROS 2, with random shapes, against `check_shape` and the classes of ROS."""
    dice = random.Random(7)
    messages = list(installed_messages())
    if not messages:
        pytest.skip("no ROS 2 is installed")
    counts, counts_without = Counter[bool](), Counter[bool]()
    for package, type_ in messages:
        message_class = getattr(importlib.import_module(f"{package}.msg"), type_)
        uses = f"interface i use {type_} from {package}"
        files = find_interfaces([uses], interface_folders())
        catalogue = Catalogue(DISTRIBUTIONS[0], FoundInterfaces({file.name: file.text for file in files}))
        definition = catalogue.definition("msg", package, type_)
        assert definition is not None
        for _ in range(6):
            shape = shapes(definition[0], catalogue, dice)
            starts = can_start(message_class, shape)
            objects: list[str] = []
            written = declared(shape, objects)
            text = (
                f"robot R {{ {uses} {' '.join(objects)} "
                f"component C {{ outgoing message m with type: {written} links i }} }}"
            )
            made = check(Bundle(SourceFile("r", text), interfaces=files))
            found = made.diagnostics
            if made.model is not None and any(item.code == "needless-property" for item in found):
                # The node has no part of what nothing needs.
                rest = shapes_of(made.model, made.model.communications[0], Deployment.CONTROLLER)["m.response"]
                starts = can_start(message_class, rest)
                counts_without[starts] += 1
            refused = any(item.severity is Severity.ERROR or item.code in ROS2_ERRORS for item in found)
            assert refused is not starts, (package, type_, shape, found)
            counts[starts] += 1
    assert min(counts[True], counts[False]) > 100, counts
    assert counts_without[True] > 30, counts_without


def test_headers_that_nodes_stamp_are_those_that_the_check_knows() -> None:
    messages = list(installed_messages())
    if not messages:
        pytest.skip("no ROS 2 is installed")
    for package, type_ in messages:
        message = getattr(importlib.import_module(f"{package}.msg"), type_)()
        files = find_interfaces([f"interface i use {type_} from {package}"], interface_folders())
        catalogue = Catalogue(DISTRIBUTIONS[0], FoundInterfaces({file.name: file.text for file in files}))
        definition = catalogue.definition("msg", package, type_)
        assert definition is not None
        try:
            count = len(headers_of(message, "goal"))
        except SetupError:
            count = 0
        assert len(known_headers(definition[0], catalogue, is_action=True)) == count


def test_a_type_is_compared_with_a_message_once_however_often_it_crosses(monkeypatch: pytest.MonkeyPatch) -> None:
    count = 0
    original = message_fields._unknown_field

    def counted(*arguments: Any) -> Fault:
        nonlocal count
        count += 1
        return original(*arguments)

    monkeypatch.setattr(message_fields, "_unknown_field", counted)
    number = 20
    properties = " ".join(f"nothing{index}: double" for index in range(number))
    messages = " ".join(f"outgoing message m{index} with type: O links i" for index in range(number))
    text = (
        f"robot R {{ interface i use BatteryState from sensor_msgs datatype object O {{ {properties} }} "
        f"component C {{ {messages} }} }}"
    )
    assert len(checked(text).diagnostics) == number
    assert count == number * len(DISTRIBUTIONS) * len(message_fields.Language)


def test_of_very_many_faults_the_first_are_reported() -> None:
    properties = " ".join(f"nothing{index}: double" for index in range(message_fields.MAXIMUM_FAULTS + 5))
    text = MODEL.format("BatteryState", "sensor_msgs", properties, "")
    assert len(checked(text).diagnostics) == message_fields.MAXIMUM_FAULTS
