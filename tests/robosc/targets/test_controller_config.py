"""`controller-config.json`: what it may say, what is refused, and what becomes of it."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from robosc.cli.main import main
from robosc.model.structure import Deployment
from robosc.targets.controller_config import (
    CONFIG_FILE,
    MAXIMUM_BYTES,
    ControllerConfig,
    ControllerConfigError,
    read_controller_config,
)
from robosc.targets.registry import PackageMetadata, StateMessage, SupervisedController

MODEL = """\
robot Blinker {
    component Lamp {
        incoming message blink with identifier: "/blink", type: none
        outgoing message blinked with identifier: "/blinked", type: none
        behaviour { initial marked state lit { } }
    }
}
"""


def written(folder: Path, content: Any) -> Path:
    text = content if isinstance(content, str) else json.dumps(content)
    (folder / CONFIG_FILE).write_text(text, encoding="utf-8")
    return folder


def test_no_file_stands_for_the_defaults(tmp_path: Path) -> None:
    assert read_controller_config(tmp_path) == ControllerConfig()


def test_everything_that_it_may_say(tmp_path: Path) -> None:
    written(
        tmp_path,
        {
            "publishStateInformation": True,
            "writeEventsToLog": True,
            "outputLocations": {"ROS1": "catkin_ws/src/x", "ros2": "ws"},
            "supervisedController": {"package": "turtlebot3_example", "launchFile": "drive.launch.py"},
            "maintainer": "Jane Doe <jane@example.org>",
            "license": "Apache-2.0",
            "version": "1.2.3",
            "copyright": "2024-2026 Jane Doe",
            "stateMessage": "both",
        },
    )
    config = read_controller_config(tmp_path)
    assert config.warnings == ()
    assert config.locations == {"ros1": tmp_path / "catkin_ws/src/x", "ros2": tmp_path / "ws"}
    options = config.options("name")
    assert (options.package, options.publish_state, options.log_events) == ("name", True, True)
    assert options.supervised == SupervisedController("turtlebot3_example", launch_file="drive.launch.py")
    assert options.metadata == PackageMetadata(
        "Jane Doe", "jane@example.org", "Apache-2.0", "1.2.3", "2024-2026 Jane Doe"
    )
    assert options.state_message is StateMessage.BOTH


def test_what_the_original_writes(tmp_path: Path) -> None:
    run = {"packageName": "controller", "namespace": "controller", "executable": "interface", "name": "controller"}
    written(
        tmp_path,
        {
            "publishStateInformation": True,
            "output": {
                "ros1ControllerNodeLocation": "./catkin_ws/",
                "ros2ControllerNodeLocation": "./controller/",
                "ros2SupervisorNodeLocation": "./supervisor",
            },
            "supervisor": {"controller": {"run": run}},
        },
    )
    config = read_controller_config(tmp_path)
    assert config.warnings == ()
    controller, layer = Deployment.CONTROLLER, Deployment.LAYER
    assert {config.location(name, controller) for name in ("ros2", "ros2-cpp")} == {tmp_path / "controller"}
    assert {config.location(name, controller) for name in ("ros1", "ros1-cpp")} == {tmp_path / "catkin_ws"}
    assert config.location("ros2", layer) == tmp_path / "supervisor"
    assert config.location("ros1", layer) is None
    assert config.location("c99", controller) is None
    assert config.supervised == SupervisedController(
        "controller", "interface", namespace="controller", name="controller"
    )


def test_a_launch_file_as_the_original_names_it(tmp_path: Path) -> None:
    launch = {"packageName": "turtlebot3_example", "file": "drive.launch.py"}
    written(tmp_path, {"output": None, "supervisor": {"controller": {"launch": launch, "run": None}}})
    config = read_controller_config(tmp_path)
    assert config.warnings == ()
    assert config.supervised == SupervisedController("turtlebot3_example", launch_file="drive.launch.py")


def test_our_own_names_go_before_those_of_the_original(tmp_path: Path) -> None:
    written(
        tmp_path,
        {
            "outputLocations": {"ros2": "ours"},
            "output": {"ros2ControllerNodeLocation": "theirs"},
            "supervisedController": {"package": "ours", "executable": "x"},
            "supervisor": {"controller": {"run": {"packageName": "theirs", "executable": "x"}}},
        },
    )
    config = read_controller_config(tmp_path)
    assert config.location("ros2", Deployment.CONTROLLER) == tmp_path / "ours"
    assert config.location("ros2-cpp", Deployment.CONTROLLER) == tmp_path / "theirs"
    assert config.supervised is not None
    assert config.supervised.package == "ours"


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("{", "no JSON"),
        ("[" * 30_000, "nested too deeply"),
        ('"\ud800"'.encode("utf-16", "surrogatepass").decode("latin-1"), "no JSON"),
        ([], "must hold an object"),
        ('{"publishStateInformation": true, "publishStateInformation": false}', "stands twice"),
        ({"publishStateInformation": 1}, "'publishStateInformation' must be true or false"),
        ({"writeEventsToLog": "yes"}, "'writeEventsToLog' must be true or false"),
        ({"outputLocations": "out"}, "'outputLocations' must be an object"),
        ({"outputLocations": {"ros2": "/etc"}}, "'outputLocations.ros2' must be the relative path"),
        ({"outputLocations": {"ros2": "../x"}}, "'outputLocations.ros2' must be the relative path"),
        ({"outputLocations": {"ros2": "a\\..\\b"}}, "'outputLocations.ros2' must be the relative path"),
        ({"outputLocations": {"ros2": ""}}, "'outputLocations.ros2' must be the relative path"),
        ({"outputLocations": {"ros2": "a", "ROS2": "b"}}, "each once"),
        ({"outputLocations": {"../x": "a"}}, "names are those of targets"),
        ({"supervisedController": "x"}, "'supervisedController' must be an object"),
        ({"supervisedController": {"executable": "x"}}, "'package' must be the name of a package"),
        ({"supervisedController": {"package": "p; rm", "executable": "x"}}, "'package' must be the name of a package"),
        ({"supervisedController": {"package": "p"}}, "either an executable or a launch file"),
        ({"supervisedController": {"package": "p", "executable": "x", "launchFile": "y"}}, "either an executable"),
        ({"supervisedController": {"package": "p", "executable": "../x"}}, "without a path"),
        ({"supervisedController": {"package": "p", "executable": 3}}, "an object of texts"),
        ({"output": "x"}, "'output' must be an object with ros1ControllerNodeLocation"),
        (
            {"output": {"ros2ControllerNodeLocation": "/x"}},
            "'output.ros2ControllerNodeLocation' must be the relative path",
        ),
        ({"output": {"ros2ControllerNodeLocation": "../x"}}, "must be the relative path"),
        ({"supervisor": []}, "'supervisor' must be an object with controller"),
        ({"supervisor": {"controller": 3}}, "'supervisor.controller' must be an object with run, launch"),
        ({"supervisor": {"controller": {"run": {}, "launch": {}}}}, "with either run or launch"),
        ({"supervisor": {"controller": {"run": {}}}}, "'supervisor.controller.run': 'package' must be the name"),
        ({"supervisor": {"controller": {"run": {"packageName": "p", "executable": 3}}}}, "an object of texts"),
        (
            {"supervisor": {"controller": {"run": {"packageName": "p", "executable": "x", "namespace": "a//b"}}}},
            "'namespace' must be a name of ROS",
        ),
        (
            {"supervisor": {"controller": {"run": {"packageName": "p", "executable": "x", "name": "a b"}}}},
            "'name' must be the name of a node",
        ),
        ({"supervisor": {"controller": {"launch": {"packageName": "p"}}}}, "either an executable or a launch file"),
        ({"stateMessage": "xml"}, "'stateMessage' must be one of json, typed, both"),
        ({"stateMessage": ["json"]}, "'stateMessage' must be one of json, typed, both"),
        ({"maintainer": 3}, "'maintainer' must be a text"),
        ({"maintainer": "Jane"}, "'maintainer': the maintainer must be written as 'Jane Doe <jane@example.org>'"),
        (
            {"maintainer": "Jane <jane>"},
            "'maintainer': the maintainer's e-mail address 'jane' is not an e-mail address",
        ),
        ({"license": " "}, "'license': the licence must be one line"),
        ({"license": "a\nb"}, "'license': the licence must be one line"),
        ({"version": "1.0"}, "'version': the version of the package must be three numbers, such as 1.0.0"),
        ({"version": "01.0.0"}, "three numbers"),
        ({"copyright": "Jane Doe"}, "'copyright': the copyright must be years and a name, such as '2026 Jane Doe'"),
        ({"copyright": "2026"}, "years and a name"),
        ({"copyright": "2026 a\nb"}, "'copyright': the copyright must be one line"),
        (" " * (MAXIMUM_BYTES + 1), "more than"),
    ],
)
def test_what_is_wrong_is_reported_with_its_place(tmp_path: Path, content: Any, problem: str) -> None:
    with pytest.raises(ControllerConfigError) as raised:
        read_controller_config(written(tmp_path, content))
    assert problem in str(raised.value)
    assert CONFIG_FILE in str(raised.value)
    assert "\n" not in str(raised.value)


def test_what_is_not_known_is_a_warning(tmp_path: Path) -> None:
    written(
        tmp_path,
        {
            "publishStateInformations": True,
            "supervisedController": {"package": "p", "executable": "x", "a": 1},
            "output": {"ros2ControllerNodeLocations": "x"},
        },
    )
    config = read_controller_config(tmp_path)
    assert not config.publish_state
    assert len(config.warnings) == 3
    assert "did you mean 'ros2ControllerNodeLocation'?" in config.warnings[1]
    assert not config.nodes
    assert "did you mean 'publishStateInformation'?" in config.warnings[0]
    assert "'supervisedController.a' is not known" in config.warnings[2]


_PLAIN = st.none() | st.booleans() | st.integers(-2, 2) | st.sampled_from(["", "a", "a/b", "..", "/a", "ros2", "a\nb"])
_NAMES = st.sampled_from(
    "ros2 ROS2 c99 .. package executable launchFile ros2ControllerNodeLocation controller run launch x".split()
)
_JSON = _PLAIN | st.lists(_PLAIN, max_size=2) | st.dictionaries(_NAMES, _PLAIN, max_size=3)
_KEYS = st.sampled_from(
    "publishStateInformation writeEventsToLog outputLocations supervisedController output supervisor x".split()
)


@given(st.dictionaries(_KEYS, _JSON))
def test_any_document_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, document: dict[str, Any]) -> None:
    folder = tmp_path_factory.mktemp("config")
    try:
        config = read_controller_config(written(folder, document))
    except ControllerConfigError:
        return
    for place in (*config.locations.values(), *config.nodes.values()):
        assert place.resolve().is_relative_to(folder.resolve())


class TestCommand:
    """`robosc generate` beside such a file."""

    @pytest.fixture
    def model(self, tmp_path: Path) -> Path:
        path = tmp_path / "blinker.rscd"
        path.write_text(MODEL)
        return path

    def test_it_chooses_the_folder_and_the_node_s_parameters(
        self, model: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        written(
            model.parent,
            {"publishStateInformation": True, "writeEventsToLog": True, "outputLocations": {"ros2": "ws/src/b"}},
        )
        assert main(["generate", str(model), "--target", "ros2"]) == 0
        file = model.parent / "ws/src/b/config/parameters.yaml"
        assert str(file) in capsys.readouterr().out
        parameters = yaml.safe_load(file.read_text())["/**"]["ros__parameters"]
        assert parameters["publish_state"] is True
        assert parameters["log_folder"] == "event_log"

    def test_a_layer_goes_where_the_original_puts_it_and_starts_its_controller(self, model: Path) -> None:
        run = {"packageName": "controller", "namespace": "c", "executable": "interface", "name": "follower"}
        written(
            model.parent,
            {
                "output": {"ros2ControllerNodeLocation": "controller", "ros2SupervisorNodeLocation": "supervisor"},
                "supervisor": {"controller": {"run": run}},
            },
        )
        assert main(["generate", str(model), "--target", "ros2", "--deployment", "layer"]) == 0
        assert not (model.parent / "controller").exists()
        text = (model.parent / "supervisor/launch/layer.launch.py").read_text()
        compile(text, "layer.launch.py", "exec")
        assert "name='follower'," in text
        assert "namespace=[namespace, '/c']," in text
        written(model.parent, {"supervisor": {"controller": {"run": run}}})
        chosen = ["--deployment", "layer", "-o", str(model.parent / "ros1")]
        assert main(["generate", str(model), "--target", "ros1", *chosen]) == 0
        text = (model.parent / "ros1/launch/layer.launch").read_text()
        assert 'name="controller_name" default="follower"' in text
        assert 'name="$(arg controller_name)" ns="c" output' in text

    def test_a_controller_in_another_namespace_has_no_relative_names(
        self, model: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        model.write_text(MODEL.replace('"/blink"', '"blink"'))
        run = {"packageName": "controller", "namespace": "c", "executable": "interface"}
        written(
            model.parent, {"output": {"ros2SupervisorNodeLocation": "s"}, "supervisor": {"controller": {"run": run}}}
        )
        assert main(["generate", str(model), "--target", "ros2", "--deployment", "layer"]) == 1
        assert "the name blink is relative; write '/blink' in the model" in capsys.readouterr().err

    def test_what_is_given_on_the_command_line_has_the_last_word(self, model: Path, tmp_path: Path) -> None:
        written(model.parent, {"outputLocations": {"python": "there"}})
        chosen = ["--package", "blinks", "-o", str(tmp_path / "here")]
        assert main(["generate", str(model), "--target", "python", *chosen]) == 0
        assert (tmp_path / "here/blinks.py").is_file()
        assert not (tmp_path / "there").exists()

    def test_a_flag_goes_before_what_the_file_says_of_the_package(self, model: Path, tmp_path: Path) -> None:
        written(
            tmp_path,
            {"maintainer": "Ann <ann@example.org>", "license": "MIT", "version": "1.0.0", "copyright": "2024 Ann"},
        )
        chosen = [
            "--maintainer",
            "Bo <bo@example.org>",
            "--package-version",
            "2.0.0",
            "--copyright",
            "2025 Bo",
            "--state-message",
            "typed",
            "-o",
            str(tmp_path / "here"),
        ]
        assert main(["generate", str(model), "--target", "ros2", *chosen]) == 0
        text = (tmp_path / "here/package.xml").read_text()
        assert '<maintainer email="bo@example.org">Bo</maintainer>' in text
        assert "<license>MIT</license>" in text
        assert "<version>2.0.0</version>" in text
        assert (tmp_path / "here/setup.py").read_text().startswith("# Copyright 2025 Bo\n")
        assert "<exec_depend>robosc_msgs</exec_depend>" in text

    def test_a_node_in_cpp_is_built_with_the_message_of_its_state(self, model: Path, tmp_path: Path) -> None:
        written(tmp_path, {"stateMessage": "typed"})
        assert main(["generate", str(model), "--target", "ros2-cpp", "-o", str(tmp_path / "here")]) == 0
        assert "<depend>robosc_msgs</depend>" in (tmp_path / "here/package.xml").read_text()

    @pytest.mark.parametrize(
        ("target", "chosen", "is_reported"),
        [
            ("ros2", (), True),
            ("all", (), True),
            ("ros2", ("--maintainer", "Bo <bo@example.org>"), False),
            ("ros2-msgs", (), False),
            ("python", (), False),
        ],
    )
    def test_a_placeholder_for_the_maintainer_is_reported(
        self, model: Path, capsys: pytest.CaptureFixture[str], target: str, chosen: tuple[str, ...], is_reported: bool
    ) -> None:
        folder = str(model.parent / "here")
        assert main(["generate", str(model), "--target", target, "-o", folder, *chosen]) == 0
        assert ("note: package.xml has a placeholder for its maintainer" in capsys.readouterr().err) is is_reported
        assert main(["generate", str(model), "--target", target, "-o", folder, "--json", *chosen]) == 0
        assert capsys.readouterr().err == ""

    def test_a_maintainer_without_an_address_is_wrong_use(
        self, model: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main(["generate", str(model), "--target", "ros2", "-o", "x", "--maintainer", "Bo"]) == 2
        assert "must be written as 'Jane Doe <jane@example.org>'" in capsys.readouterr().err

    @pytest.mark.parametrize(
        ("target", "option", "value"),
        [
            ("c99", "--license", "MIT"),
            ("python", "--package-version", "1.0.0"),
            ("python", "--copyright", "2026 Bo"),
            ("cif", "--maintainer", "Bo <bo@example.org>"),
            ("ros1", "--state-message", "typed"),
            ("ros1-cpp", "--state-message", "both"),
        ],
    )
    def test_an_option_for_other_targets_is_wrong_use(
        self, model: Path, capsys: pytest.CaptureFixture[str], target: str, option: str, value: str
    ) -> None:
        assert main(["generate", str(model), "--target", target, "-o", "x", option, value]) == 2
        error = capsys.readouterr().err
        assert option in error
        assert "leave it out" in error

    def test_without_any_folder_it_says_where_one_can_be_given(
        self, model: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main(["generate", str(model), "--target", "python"]) == 2
        error = capsys.readouterr().err
        assert "-o DIR, or outputLocations.python of controller-config.json" in error

    def test_a_wrong_file_is_one_error(self, model: Path, capsys: pytest.CaptureFixture[str]) -> None:
        written(model.parent, {"writeEventsToLog": 1})
        assert main(["generate", str(model), "--target", "python", "-o", str(model.parent / "out")]) == 2
        assert capsys.readouterr().err.count("\n") == 1

    def test_what_is_not_known_is_reported(self, model: Path, capsys: pytest.CaptureFixture[str]) -> None:
        written(model.parent, {"nonsense": 1})
        assert main(["generate", str(model), "--target", "python", "-o", str(model.parent / "out")]) == 0
        assert "warning: " in capsys.readouterr().err
