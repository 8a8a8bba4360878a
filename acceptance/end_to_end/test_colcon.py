"""Built with real colcon: interfaces, helper nodes and a generated package, which then drive the navigation robot."""

import json
import math
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from support.colcon import ROOT, Workspace, locked
from support.example_robots import Stage, generated_package, stage
from support.kinematic_robot import KinematicRobot, Thing, World
from support.models import EXAMPLES
from support.ros2 import RosProcess

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

# The first run makes an environment, which takes a minute or more.
pytestmark = [pytest.mark.ros2, pytest.mark.timeout(2000)]

GOAL = (2.0, 0.5)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """The workspace as the README says: the example packages and the generated one below src."""
    own = tmp_path_factory.getbasetemp()
    # All workers of a run share one, which the first one builds.
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    folder, built = shared / "colcon_workspace", shared / "colcon_workspace.built"
    made = Workspace(folder)
    with locked(shared / "colcon_workspace.lock"):
        if not built.exists():
            for package in ("robosc_example_interfaces", "robosc_examples"):
                shutil.copytree(EXAMPLES / package, folder / "src" / package, dirs_exist_ok=True)
            generated_package("navigation", folder / "src" / "navigation_controller")
            # The project that it lies in has other settings, which are none of the packages'.
            (folder / "pyproject.toml").write_text('[tool.pytest.ini_options]\naddopts = ["--no-such-option"]\n')
            made.colcon("build")
            built.touch()
    return made


class Navigation:
    """The test's side of the navigation robot."""

    def __init__(self, workspace: Workspace, at: Stage, folder: Path) -> None:
        from std_msgs.msg import String

        self._workspace = workspace
        self.at = at
        self._log_folder = folder / "events"
        self.robot = at.robot = KinematicRobot(at.peer, World())
        self._states = at.peer.receive(String, "/state")
        self.driver = self._run(
            "robosc_examples", "drive_to_pose", "speed_limit:=1.0", "turn_limit:=2.0", "patience:=0.5"
        )
        self._run("robosc_examples", "calibrator", "duration:=0.4")
        self._run("robosc_examples", "person_detector")
        self.controller = self._run(
            "navigation_controller",
            "start_navigation",
            "period:=0.05",
            "publish_state:=true",
            f"log_folder:={self._log_folder}",
        )

    def _run(self, package: str, executable: str, *parameters: str) -> RosProcess:
        given = [word for item in parameters for word in ("-p", item)]
        command = self._workspace.command(package, executable, ["--ros-args", *given])
        return self.at.run(command, [], program="/bin/bash")

    def component(self, name: str) -> Any:
        """State and variables of a component, as the controller reports them."""
        return json.loads(self._states[-1].data)["current"][name] if self._states else {"state": "", "variables": {}}

    def until_driving(self) -> None:
        self.at.until(
            lambda: self.component("Navigator")["state"] == "driving" and self.robot.speed > 0.0,
            "the robot to drive",
            self.controller,
        )

    def log(self) -> str:
        """The controller's event log so far."""
        (log,) = self._log_folder.iterdir()
        return log.read_text()

    def events(self) -> list[str]:
        """The events in the controller's log, once it has ended."""
        assert self.controller.wait() == 0, self.controller.stderr
        entries = [json.loads(line) for line in self.log().splitlines()]
        assert not [entry for entry in entries if entry["kind"] in ("fault", "unknown")]
        return [entry["event"] for entry in entries if "event" in entry]


@pytest.fixture
def navigation(workspace: Workspace, tmp_path: Path) -> Iterator[Navigation]:
    with stage(tmp_path) as at:
        yield Navigation(workspace, at, tmp_path)


def test_the_robot_navigates_to_its_goal_and_stops_for_a_person(navigation: Navigation) -> None:
    at, robot = navigation.at, navigation.robot
    navigation.until_driving()
    assert navigation.component("Localisation") == {"state": "known", "variables": {"calibrated": "true"}}
    at.until(
        lambda: 0.0 < float(navigation.component("Navigator")["variables"]["remaining"]) < 1.7,
        "feedback that the goal comes nearer",
        navigation.controller,
    )

    robot.world.obstacles.append(Thing(robot.x + 1.0, robot.y, 0.2))
    at.until(lambda: robot.speed == 0.0, "the robot to stop for a person", navigation.controller)
    at.until(lambda: navigation.component("Navigator")["state"] == "ready", "the goal to be cancelled")
    x = robot.x
    at.go_on(0.5)
    assert (robot.speed, robot.x) == (0.0, x)

    robot.world.obstacles.clear()
    navigation.until_driving()
    at.until(
        lambda: math.dist((robot.x, robot.y), GOAL) < 0.06 and robot.speed == 0.0, "the goal", navigation.controller
    )
    at.until(lambda: robot.turn == 0.0 and abs(robot.yaw) < 0.06, "the goal's direction", navigation.controller)
    # The state is published after each decision, and the next goal is asked for with the first one after the result.
    at.until(lambda: "navigate.response" in navigation.log(), "the result", navigation.controller)
    at.end()
    events = navigation.events()
    expected = ["calibrate.request", "calibrate.response", "navigate.request", "navigate.feedback", "navigate.cancel"]
    for event in (*expected, "navigate.request", "navigate.feedback", "navigate.response"):
        assert event in events
        events = events[events.index(event) + 1 :]


def test_without_odometry_goals_fail_until_somebody_presses_the_button(navigation: Navigation) -> None:
    from std_msgs.msg import Empty

    at, robot = navigation.at, navigation.robot
    navigation.until_driving()
    robot.has_odometry = False
    at.until(lambda: robot.speed == 0.0, "the robot to stop without odometry", navigation.controller)
    # The first goal is aborted, the others are rejected.
    at.until(lambda: navigation.component("Navigator")["state"] == "given_up", "the robot to give up")
    robot.has_odometry = True
    at.go_on(0.3)
    assert robot.speed == 0.0
    at.peer.publish(Empty(), "/button")
    navigation.until_driving()
    at.end()
    events = navigation.events()
    assert events.count("navigate.error") >= 3


def test_a_stopped_driver_leaves_the_robot_at_rest(navigation: Navigation) -> None:
    navigation.until_driving()
    navigation.driver.signal(signal.SIGTERM)
    navigation.at.until(
        lambda: navigation.robot.speed == 0.0 and not navigation.driver.is_running, "a zero and the end"
    )
    assert navigation.driver.wait() == 0


def test_a_recorded_run_is_the_same_as_that_of_the_reference(workspace: Workspace, tmp_path: Path) -> None:
    """The suite of `tests/equivalence`, for the one example whose interfaces must be built first."""
    command = workspace.python(str(ROOT / "tests" / "equivalence" / "compare_navigation.py"), str(tmp_path / "run"))
    done = subprocess.run(["/bin/bash", *command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    steps, calls, goals, cancels = map(int, re.findall(r"\d+", done.stdout))
    assert steps > 50
    assert min(calls, goals, cancels) > 0


def test_colcon_test_passes(workspace: Workspace) -> None:
    workspace.colcon("test", "--packages-select", "navigation_controller", "--return-code-on-test-failure")
    # No index has the linters of copyright and XML.
    assert "7 tests, 0 errors, 0 failures, 2 skipped" in workspace.colcon("test-result", "--verbose")
