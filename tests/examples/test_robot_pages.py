"""Tests that the pages and launch files of the example robots are correct."""

import re
import shlex
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from robosc.cli.main import make_parser
from robosc.language import load_bundle
from robosc.model.check import check
from support.launch_stub import Recorded, launch_actions
from support.models import EXAMPLES

ROBOTS = sorted({path.parent.name for path in EXAMPLES.glob("*/*.rscd")})
HELPERS = EXAMPLES / "robosc_examples"
ROOT = EXAMPLES.parent

# Topics of the robot itself.
OWN = {"/cmd_vel", "/scan", "/odom", "/image", "/bumper"}


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The programs that setup.py installs."""
    stub = ModuleType("setuptools")
    asked: dict[str, dict[str, list[str]]] = {}
    stub.setup = lambda **given: asked.update(given)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "setuptools", stub)
    monkeypatch.chdir(HELPERS)
    exec((HELPERS / "setup.py").read_text(), {"__name__": "__main__"})
    for place in asked["data_files"]:
        assert all(Path(file).is_file() for file in place[1])
    return [script.partition(" = ")[0] for script in asked["entry_points"]["console_scripts"]]


def page(robot: str) -> str:
    return (EXAMPLES / robot / "README.md").read_text(encoding="utf-8")


def commands(text: str) -> list[str]:
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    texts = [block.replace("\\\n", " ") for language, block in blocks if not language]
    return [line.rstrip(" &") for block in texts for line in block.splitlines()]


def identifiers(robot: str) -> set[str]:
    """The topics, services and actions of a robot's model."""
    checked = check(load_bundle(EXAMPLES / robot / f"{robot}.rscd"))
    assert checked.model is not None
    return {item.identifier for item in checked.model.communications}


def test_every_robot_has_a_page_a_launch_file_and_a_place_in_the_list() -> None:
    folders = {path.parent.name for path in EXAMPLES.glob("*/*.rscd")}
    assert set(ROBOTS) == folders
    assert {path.name.partition(".")[0] for path in (HELPERS / "launch").glob("*.*")} == folders
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    assert all(f"({robot}/README.md)" in text for robot in ROBOTS)


def test_every_node_is_installed_and_on_the_page(nodes: list[str]) -> None:
    text = (HELPERS / "README.md").read_text(encoding="utf-8")
    files = [path.stem for path in (HELPERS / "robosc_examples").glob("*.py") if "__main__" in path.read_text()]
    assert sorted(files) == nodes
    assert re.findall(r"^\| `(\w+)`", text, re.MULTILINE) != []
    assert sorted(re.findall(r"^\| `(\w+)`", text, re.MULTILINE)) == nodes


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_diagram_shows_every_topic_of_the_model(robot: str) -> None:
    diagram = page(robot).partition("```mermaid\n")[2].partition("```")[0]
    shown = set(re.findall(r"/[\w/]+", diagram))
    assert identifiers(robot) <= shown
    # And what is beyond it belongs to the nodes or to the robot.
    assert shown - identifiers(robot) <= OWN | {"/announcement"}


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_launch_file_starts_nodes_that_speak_of_the_model(robot: str, nodes: list[str], tmp_path: Path) -> None:
    found = launch_actions(HELPERS / "launch" / f"{robot}.launch.py", tmp_path)
    declared = {item.positional[0] for item in found.get("DeclareLaunchArgument", [])}
    used = set()
    for node in found["Node"]:
        named = SimpleNamespace(**{"parameters": [], "remappings": [], **node.named})
        if named.package == f"{robot}_controller":
            assert named.executable == "controller"
            assert named.parameters[0] == str(tmp_path / "config" / "parameters.yaml")
        else:
            assert (named.package, named.executable in nodes) == ("robosc_examples", True)
            assert named.executable in page(robot)
        for _, target in named.remappings:
            assert isinstance(target, Recorded) or target in identifiers(robot)
        settings = [value for item in named.parameters if isinstance(item, dict) for value in item.values()]
        used |= {item.positional[0] for item in [*settings, *(to for _, to in named.remappings)] if not _is_plain(item)}
    assert declared == used


def _is_plain(value: object) -> bool:
    return isinstance(value, str | int | float)


@pytest.mark.parametrize("robot", [*ROBOTS, "robosc_examples", "."])
def test_the_commands_are_understood(robot: str, nodes: list[str]) -> None:
    found = 0
    for command in commands(page(robot)):
        generate = re.search(r"(?:^|/)robosc (generate .*)", command)
        if generate:
            parsed = make_parser().parse_args(shlex.split(generate[1]))
            assert (ROOT / parsed.model).is_file()
            found += 1
        for module in re.findall(r"-m robosc_examples\.([\w.]+)", command):
            # Those for ROS 1 are in a package of their own, and need rospy to be imported.
            assert module in nodes or module.startswith("ros1.")
            assert (HELPERS / "robosc_examples" / f"{module.replace('.', '/')}.py").is_file()
            found += 1
        for node in re.findall(r"ros2 run robosc_examples (\w+)", command):
            assert node in nodes
        for file in re.findall(r"ros2 launch robosc_examples (\S+)", command):
            assert (HELPERS / "launch" / file).is_file()
        for copied in re.findall(r"cp -r (.*) \S+", command):
            assert all((ROOT / folder / "package.xml").is_file() for folder in copied.split())
    assert found > 0


@pytest.mark.parametrize("robot", [*ROBOTS, "robosc_examples", "."])
def test_the_links_lead_somewhere(robot: str) -> None:
    for target in re.findall(r"\]\(([^)#]+)", page(robot)):
        assert (EXAMPLES / robot / target).exists(), target
