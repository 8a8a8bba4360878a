"""Tests of the common parts of the generated packages of a controller for ROS 1 and ROS 2."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from robosc.errors import UnsupportedModelError
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.interpreter.description import describe
from robosc.targets import GenerateOptions, generate, write_files
from robosc.targets.ros.runtime.parameters import ParameterError, declarations, validate
from support.execution import unsupervised
from support.generated import example_supervisor, imported, require_sound_python
from support.goal_porter import porter_supervisor
from support.own_tests import PYTEST, own_tests

yaml = pytest.importorskip("yaml", reason="PyYAML, a part of ROS 2, is not installed")

FOLLOWER = "line_follower/line_follower"
EXAMPLES = [FOLLOWER, "maze_solver/maze_solver", "navigation/navigation"]
BOTH = pytest.mark.parametrize("target", ["ros1", "ros2"])
WITH_COMMANDS = pytest.mark.parametrize(
    ("target", "command"), [("ros1", PYTEST), ("ros1", ("test/run_tests.py",)), ("ros2", PYTEST)]
)


def refusal(target: str, body: str) -> str:
    """Return the message with which a target refuses a robot: one line."""
    with pytest.raises(UnsupportedModelError) as raised:
        generate(unsupervised(f"robot Robot {{ {body} }}"), target)
    message = str(raised.value)
    assert message.startswith(f"target {target}: ")
    assert "\n" not in message
    return message


@BOTH
@pytest.mark.parametrize("name", EXAMPLES)
def test_python_files_run_on_3_8_and_name_nothing_undefined(target: str, name: str, tmp_path: Path) -> None:
    write_files(generate(example_supervisor(name), target), tmp_path)
    require_sound_python(tmp_path)


@WITH_COMMANDS
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_packages_own_tests_pass_without_ros(
    target: str, command: tuple[str, ...], name: str, tmp_path: Path
) -> None:
    write_files(generate(example_supervisor(name), target), tmp_path)
    result = own_tests(tmp_path, command)
    assert result.returncode == 0, result.stdout
    if target == "ros2":
        assert "3 passed" in result.stdout


@WITH_COMMANDS
def test_the_packages_own_tests_can_fail(target: str, command: tuple[str, ...], tmp_path: Path) -> None:
    write_files(generate(example_supervisor(FOLLOWER), target), tmp_path)
    supervisor = tmp_path / "line_follower_controller" / "supervisor.py"
    text = supervisor.read_text()
    begin = text.index("def allow_move_request")
    supervisor.write_text(text[:begin] + text[begin:].replace("== 'safe'", "== 'unsafe'", 1))
    assert own_tests(tmp_path, command).returncode == 1


@BOTH
def test_a_package_may_be_called_as_one_likes(target: str) -> None:
    files = generate(unsupervised("robot Robot { }"), target, GenerateOptions(package="my_robot"))
    assert ElementTree.fromstring(files["package.xml"]).findtext("name") == "my_robot"
    assert "my_robot/node.py" in files


# Refused models.


@BOTH
@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (
            'component C { outgoing message m with identifier: "/a b", type: none }',
            "the identifier '/a b' of 'm' is no ROS name",
        ),
        ('component C { outgoing message m with identifier: "/1", type: none }', "identifier '/1' of 'm'"),
        ('component C { outgoing message m with identifier: "/a/", type: none }', "identifier '/a/' of 'm'"),
        ('component C { outgoing message m with identifier: "/a//b", type: none }', "identifier '/a//b' of 'm'"),
        ('component C { outgoing message m with identifier: "{x}", type: none }', "identifier '{x}' of 'm'"),
        ('component C { outgoing message m with identifier: "/' + "x" * 220 + '", type: none }', "no ROS name"),
        (
            'component C { outgoing message m with identifier: "/t", type: none'
            '              outgoing message n with identifier: "/t", type: double }',
            "the topic /t has two types: std_msgs/Empty for 'm' and std_msgs/Float32 for 'n'",
        ),
        (
            "interface i use Twist from geometry_msgs component C {"
            '  outgoing message m with identifier: "/t", type: none'
            '  incoming message n with identifier: "/t", type: none links i }',
            "the topic /t has two types: std_msgs/Empty for 'm' and geometry_msgs/Twist for 'n'",
        ),
        (
            "interface i use twist from geometry_msgs component C { outgoing message m with type: none links i }",
            "twist from geometry_msgs, linked by 'm', is not a name of a ROS type",
        ),
        (
            "interface i use Twist from Geometry_Msgs component C { outgoing message m with type: none links i }",
            "Twist from Geometry_Msgs, linked by 'm', is not a name",
        ),
        (
            "datatype enum E from double to { value > 1.0 -> a default -> b }"
            "component C { incoming message m with type: E }",
            "'m' sends the enum E, which is made from received data",
        ),
        (
            "interface s use S from x_srvs interface t use T from x_srvs component C {"
            '  service a with identifier: "/s", request: none, response: none links s'
            '  service b with identifier: "/s", request: none, response: none links t }',
            "the service /s has two types: x_srvs/S for 'a' and x_srvs/T for 'b'",
        ),
        (
            "interface i use Go from x_msgs component C {"
            '  action a with identifier: "/a b", request: none, response: none, feedback: none links i }',
            "the identifier '/a b' of 'a' is no ROS name",
        ),
        (
            "datatype enum E from double to { value > 1.0 -> a default -> b } datatype object O { e: E }"
            "interface i use Go from x_msgs component C {"
            "  action go with request: O, response: none, feedback: none links i }",
            "'go' sends the enum E, which is made from received data",
        ),
        (
            'component C { outgoing message m with identifier: "/diagnostics", type: string }',
            "the topic /diagnostics is of the type std_msgs/String, but every generated node publishes",
        ),
        (
            "interface i use X from robot_controller component C {"
            "  service s with request: none, response: none links i }",
            "the generated package would be called robot_controller, like a package whose types it uses",
        ),
        (
            "interface i use X from robot_controller component C { outgoing message m with type: none links i }",
            "the generated package would be called robot_controller, like a package whose types it uses",
        ),
        ('component C { outgoing message m with identifier: "{{ 1 }}", type: none }', "identifier '{{ 1 }}' of 'm'"),
        (
            'component C { outgoing message m with identifier: "$(env HOME)", type: none }',
            "the identifier '$(env HOME)' of 'm' is no ROS name",
        ),
    ],
)
def test_what_it_cannot_do_is_refused_with_its_name(target: str, body: str, problem: str) -> None:
    assert problem in refusal(target, body)


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (
            'component C { outgoing message m with identifier: "_x", type: none }',
            "the identifier '_x' is not a name in ROS 1: it begins with an underscore",
        ),
        (
            "interface i use Trigger from std_srvs component C {"
            '  service s with identifier: "_s", request: none, response: none links i }',
            "the identifier '_s' is not a name in ROS 1",
        ),
    ],
)
def test_names_without_a_meaning_in_ros_1_are_refused(body: str, problem: str) -> None:
    assert problem in refusal("ros1", body)


# Hostile texts.

HOSTILE = r"""
robot None {
    datatype object class { x: double }
    datatype enum continue from string to { value = "{{ 1 }} --> `|` \" ' \\ </name>" -> break default -> global }
    interface i use Vector3 from geometry_msgs
    component def {
        incoming message lambda with identifier: "/a", type: string
        incoming message raise with identifier: "/b", type: class links i
        outgoing message yield with identifier: "/c", type: continue
        behaviour {
            variable y: continue = break
            on response from yield do y := value
            variable x: string = "\" ' \\ ${x} $(env HOME) {{ x }} {% raw %} </name> <!-- --> \u0022 é"
            initial marked state in { on request to lambda on request to raise }
        }
    }
    requirement lambda needs def.y = break
    provide lambda with "'''\"; import os \\ {{ 1 }} {% if %} é"
}
""".replace("state in", "state s")


@BOTH
def test_texts_of_the_model_stay_texts(target: str, tmp_path: Path) -> None:
    files = generate(unsupervised(HOSTILE), target)
    write_files(files, tmp_path / "package")
    require_sound_python(tmp_path / "package", "F,E9,B,PLE")
    for path, text in files.items():
        if path.endswith((".xml", ".launch")):
            ElementTree.fromstring(text)
    yaml.safe_load(files["config/parameters.yaml"])
    with imported(files, tmp_path, "none_controller.supervisor") as module:
        system = module.Supervisor()
        interpreted = InterpretedSystem(unsupervised(HOSTILE))
        assert system.provide("lambda") == interpreted.provide("lambda")
        assert system.enabled("lambda.request")
        assert system.state() == interpreted.state()
    result = own_tests(tmp_path / "package")
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("target", ["ros1", "ros1-cpp", "ros2", "ros2-cpp"])
def test_a_node_with_goals_has_a_time_for_assumptions(target: str) -> None:
    for supervisor, expected in ((porter_supervisor(), 30.0), (example_supervisor(FOLLOWER), None)):
        files = generate(supervisor, target)
        given = yaml.safe_load(files["config/parameters.yaml"])
        values = given["/**"]["ros__parameters"] if "/**" in given else given
        assert values.get("assumption_timeout") == expected
        assert ("`assumption_timeout`" in files["README.md"]) is (expected is not None)


@BOTH
def test_the_files_of_a_node_with_goals_are_sound(target: str, tmp_path: Path) -> None:
    write_files(generate(porter_supervisor(), target), tmp_path)
    require_sound_python(tmp_path)


def test_the_time_for_assumptions_is_a_setting_of_the_executor() -> None:
    given = {item.name: item.default for item in declarations((), policy="strategy")}
    description = describe(porter_supervisor())
    assert validate({**given, "assumption_timeout": 2.5}, description).settings.assumption_timeout_s == 2.5
    with pytest.raises(ParameterError, match=r"parameter 'assumption_timeout' is -1\.0; it must be a number"):
        validate({**given, "assumption_timeout": -1.0}, description)
