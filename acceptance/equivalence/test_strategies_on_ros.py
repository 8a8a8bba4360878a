"""Generated nodes of every kind of ROS follow a strategy as the reference executor does: nothing else is published."""

import importlib.util
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from support import rclcpp_nodes, ros1, ros1_cpp
from support.equivalence.node_target import NodeTarget
from support.equivalence.python_targets import observe, reference
from support.equivalence.rclcpp_target import rclcpp_target
from support.equivalence.ros1_target import ros1_cpp_target, ros1_target
from support.equivalence.ros2_target import Ros2Surroundings, ros2_target
from support.equivalence.scenario import Action, Scenario
from support.equivalence.strategic import ERRANDS, porter_run
from support.equivalence.targets import compare
from support.equivalence.worlds import live_by_messages
from support.generated import example_supervisor
from support.goal_porter import porter_supervisor
from support.process import Process
from support.ros2 import RosProcess, environment, own_domain

Factory = pytest.TempPathFactory
Made = Callable[[Supervisor, Path, Factory], NodeTarget]
CHOICES = "it must be one of fair, priority, random, strategy"
Ended = Callable[[Supervisor, str, Path, Factory], tuple[int, str]]
"""Exit status and errors of a node with a policy."""

TOPICS = ("/door/open", "/door/close", "/enter", "/leave")
PERIODS = 6
"""Number of periods that is enough for all that can follow a message."""

HAS_ROS2 = importlib.util.find_spec("rclpy") is not None
ON_ROS2 = (pytest.mark.ros2, pytest.mark.skipif(not HAS_ROS2, reason="ROS 2 (rclpy) is not installed"))
IN_CPP = pytest.mark.skipif(rclcpp_nodes.missing() is not None, reason=str(rclcpp_nodes.missing()))
ON_ROS1 = (pytest.mark.ros1, pytest.mark.skipif(ros1.missing() is not None, reason=str(ros1.missing())))
ON_ROSCPP = (pytest.mark.ros1, pytest.mark.skipif(ros1_cpp.missing() is not None, reason=str(ros1_cpp.missing())))


def package_of(supervisor: Supervisor, target: str, folder: Path) -> str:
    """Write a generated package of Python, and return its name."""
    files = generate(supervisor, target)
    write_files(files, folder)
    return next(path.partition("/")[0] for path in files if path.endswith("/node.py"))


def ended_on_ros2(supervisor: Supervisor, policy: str, folder: Path, factory: Factory) -> tuple[int, str]:
    name = package_of(supervisor, "ros2", folder / "package")
    command = ["-m", f"{name}.node", "--ros-args", "-p", f"policy:={policy}"]
    with (
        own_domain() as domain,
        RosProcess(command, environment(domain, folder), folder / "run", [folder / "package"]) as node,
    ):
        return node.wait(), node.stderr


def ended_in_cpp(supervisor: Supervisor, policy: str, folder: Path, factory: Factory) -> tuple[int, str]:
    done = rclcpp_nodes.run(rclcpp_nodes.compiled_once(supervisor, factory), ["signal 15"], f"policy:={policy}")
    return done.returncode, done.stderr


def ended_on_ros1(supervisor: Supervisor, policy: str, folder: Path, factory: Factory) -> tuple[int, str]:
    name = package_of(supervisor, "ros1", folder / "package")
    with (
        ros1.Master(folder) as master,
        ros1.start_node(master, folder / "run", folder / "package", f"{name}.node", [f"_policy:={policy}"]) as node,
    ):
        return node.wait(), node.stderr


def ended_on_roscpp(supervisor: Supervisor, policy: str, folder: Path, factory: Factory) -> tuple[int, str]:
    command = ros1_cpp.node_command(ros1_cpp.built_once(supervisor, factory), f"policy:={policy}")
    with ros1_cpp.Master(folder) as master, Process(command, master.variables, folder / "node") as node:
        return node.wait(), node.stderr


@pytest.fixture(
    params=[
        pytest.param((lambda robot, folder, _: ros2_target(robot, folder), ended_on_ros2), id="ros2", marks=ON_ROS2),
        pytest.param(
            (
                lambda robot, folder, factory: rclcpp_target(robot, rclcpp_nodes.compiled_once(robot, factory), folder),
                ended_in_cpp,
            ),
            id="ros2-cpp",
            marks=IN_CPP,
        ),
        pytest.param((lambda robot, folder, _: ros1_target(robot, folder), ended_on_ros1), id="ros1", marks=ON_ROS1),
        pytest.param(
            (
                lambda robot, folder, factory: ros1_cpp_target(robot, ros1_cpp.built_once(robot, factory), folder),
                ended_on_roscpp,
            ),
            id="ros1-cpp",
            marks=ON_ROSCPP,
        ),
    ]
)
def kind(request: pytest.FixtureRequest) -> tuple[Made, Ended]:
    """A kind of node: how one is made that the suite compares, and how one ends that gets a wrong policy."""
    made, ended = request.param
    return made, ended


def test_the_reference_does_the_errands() -> None:
    start, *seen = observe(porter_supervisor(), porter_run())
    assert not start.issued
    done = [" ".join(name for _, name, _ in item.issued) for item in seen]
    assert done[: len(ERRANDS)] == [request for _, request in ERRANDS]
    # By chance, each of the others is met as well.
    assert {"open", "enter", "leave", "close", ""} <= set(done[len(ERRANDS) :])


@pytest.mark.parametrize("policy", [None, "strategy", "fair"])
def test_the_porter(policy: str | None, kind: tuple[Made, Ended], tmp_path: Path, tmp_path_factory: Factory) -> None:
    scenario = porter_run(policy)
    seen = observe(porter_supervisor(), scenario)
    # Under another policy the door is opened though nobody calls.
    assert any(item.issued for item in seen[:4]) is (policy == "fair")
    compare(kind[0](porter_supervisor(), tmp_path, tmp_path_factory), scenario, seen)


def test_a_courier_with_missions(kind: tuple[Made, Ended], tmp_path: Path, tmp_path_factory: Factory) -> None:
    supervisor = example_supervisor("courier/courier")
    scenario = live_by_messages("courier")
    seen = observe(supervisor, scenario)
    made = Counter(line["aim"] for item in seen for line in item.log if line["kind"] == "reached")
    assert made.keys() == {aim.name for aim in supervisor.executable.obligations.aims}
    assert made["visit 1 of detour 1 of mission rounds"] == 3
    compare(kind[0](supervisor, tmp_path, tmp_path_factory), scenario, seen)


def test_wrong_policies_are_refused(kind: tuple[Made, Ended], tmp_path: Path, tmp_path_factory: Factory) -> None:
    status, errors = kind[1](porter_supervisor(), "strategic", tmp_path / "porter", tmp_path_factory)
    assert status == 2
    assert f"parameter 'policy' is 'strategic'; {CHOICES}" in errors.splitlines()[-1]
    # A robot without goals has no strategy.
    status, errors = kind[1](
        example_supervisor("line_follower/line_follower"), "strategy", tmp_path / "follower", tmp_path_factory
    )
    assert status == 2
    assert "parameter 'policy' is 'strategy'" in errors.splitlines()[-1]


@pytest.mark.ros2
@pytest.mark.skipif(not HAS_ROS2, reason="ROS 2 (rclpy) is not installed")
def test_a_porter_that_decides_by_its_own_timer(tmp_path: Path) -> None:
    """After each message several periods pass: all that is to be requested then is, and nothing more."""
    scenario = Scenario((), {"period_s": 0.02})
    target = reference(porter_supervisor())
    target.start(scenario)
    surroundings = Ros2Surroundings(porter_supervisor(), tmp_path)
    node = NodeTarget("ros2", porter_supervisor().model, surroundings, tmp_path / "events")
    surroundings.start(scenario, tmp_path / "events")
    published: Counter[str] = Counter()
    try:
        # The node decides before the first message comes, too; as long as none does, one decision is like another.
        for topic in (None, *(topic for topic, _ in ERRANDS)):
            seen = [] if topic is None else [target.do(Action("message", topic))]
            seen += [target.do(Action("tick")) for _ in range(PERIODS)]
            published.update(f"/{name}" for item in seen for _, name, _ in item.issued)
            if topic is not None:
                surroundings.send(topic, None)
            expected = [entry for item in seen for entry in item.log]
            found = node.next_entries(len(expected))
            for _ in range(PERIODS):
                surroundings.wait_for_tick()
            assert [*found, *node.next_entries(0)] == expected, topic
        received = Counter(topic for _, topic, _ in node.issued)
        assert received == {topic: published[topic.removeprefix("/door")] for topic in TOPICS}
    finally:
        surroundings.close()
