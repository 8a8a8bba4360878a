"""Six generated packages in one workspace, built and tested with real colcon: the table of it is printed.

It is also left in out/colcon.md.
"""

import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

from robosc.model.structure import Deployment
from robosc.targets import GenerateOptions, StateMessage, generate, write_files
from support.colcon import ROOT, Workspace
from support.colcon_table import rows, table
from support.generated import example_supervisor
from support.models import EXAMPLES
from support.rclcpp_packages import LINK_VARIABLES, write_stand_ins

# The first run makes an environment, which takes a minute or more.
pytestmark = pytest.mark.timeout(3000)

TABLE = ROOT / "out" / "colcon.md"
INTERFACES = "robosc_example_interfaces"
"""Package of the examples that one of the six needs, written by hand."""


class Package(NamedTuple):
    """A package to generate.

    Attributes:
        kind: Its kind, in words.
        robot: Example robot, as in `example_supervisor`.
        target: Target that writes it.
        options: Options of the target.
        deployment: Deployment of the supervisor.
    """

    kind: str
    robot: str
    target: str
    options: GenerateOptions = GenerateOptions()
    deployment: Deployment = Deployment.CONTROLLER


PACKAGES = {
    "robosc_msgs": Package("messages of the state", "maze_solver/maze_solver", "ros2-msgs"),
    "maze_solver_controller": Package("Python controller", "maze_solver/maze_solver", "ros2"),
    "line_follower_layer": Package(
        "Python supervision layer",
        "line_follower/line_follower_layer",
        "ros2",
        GenerateOptions(package="line_follower_layer"),
        Deployment.LAYER,
    ),
    "person_follower_controller": Package(
        "Python controller, typed state",
        "person_follower/person_follower",
        "ros2",
        GenerateOptions(publish_state=True, state_message=StateMessage.TYPED),
    ),
    "navigation_controller": Package("Python controller, services and actions", "navigation/navigation", "ros2"),
    "line_follower_controller": Package(
        "C++ component, on a stand-in for rclcpp", "line_follower/line_follower", "ros2-cpp"
    ),
}
HAS_TESTS = [name for name, package in PACKAGES.items() if package.target != "ros2-msgs"]


def test_six_packages_are_built_and_pass_their_tests(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    workspace = Workspace(tmp_path / "workspace", LINK_VARIABLES)
    source = workspace.folder / "src"
    for name, package in PACKAGES.items():
        supervisor = example_supervisor(package.robot, package.deployment)
        write_files(generate(supervisor, package.target, package.options), source / name)
    shutil.copytree(EXAMPLES / INTERFACES, source / INTERFACES)
    write_stand_ins(source / "stand_in")
    # One after another, so that each has the computer for itself and its time means something.
    built = workspace.colcon("build", "--executor", "sequential")
    workspace.colcon("test", "--executor", "sequential", "--packages-select", *PACKAGES)
    tested = workspace.run("test-result", "--all")
    kinds = {name: package.kind for name, package in PACKAGES.items()}
    found = rows(workspace.folder, kinds, built, tested.stdout)
    TABLE.parent.mkdir(exist_ok=True)
    TABLE.write_text(table(found), encoding="utf-8")
    with capsys.disabled():
        print(f"\n{table(found)}")
    details = workspace.run("test-result", "--verbose").stdout
    assert tested.returncode == 0, table(found) + details
    for row in found:
        assert row.build_s > 0.0
        assert row.counts.errors == row.counts.failures == row.lint_findings == 0, details
        assert row.package not in HAS_TESTS or row.counts.tests - row.lint_tests >= 3, table(found)
