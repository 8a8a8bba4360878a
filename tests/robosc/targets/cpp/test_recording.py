"""The recorded run in the test of a C++ package: it follows the model, and is the same each time."""

import re

import pytest

from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.code.c.unit import make_unit
from robosc.targets.cpp.recording import STEPS, Recording, record
from support.generated import example_supervisor
from support.rclcpp_nodes import courier


def recorded(supervisor: Supervisor) -> Recording:
    return record(supervisor, make_unit(supervisor, "robot_supervisor").layout)


@pytest.mark.parametrize("name", ["maze_solver/maze_solver", "navigation/navigation"])
def test_a_run_follows_the_supervisor(name: str) -> None:
    supervisor = example_supervisor(name)
    run = recorded(supervisor)
    assert recorded(example_supervisor(name)) == run
    assert len(run.steps) == STEPS + 1
    happened = [event.strip('"') for _, events, _ in run.steps for event in events]
    assert len(set(happened)) > 3
    # A request that is issued first of a step was allowed before it.
    allowed: tuple[str, ...] | None = None
    first_requests = 0
    for _, events, allowed_after in run.steps:
        if events and events[0].endswith('.request"') and allowed is not None:
            assert events[0] in allowed
            first_requests += 1
        allowed = allowed_after
    assert any(event.endswith(".request") for event in happened)


def test_servers_answer_in_every_way() -> None:
    run = recorded(courier())
    statements = " ".join(line for lines, _, _ in run.steps for line in lines)
    assert set(re.findall(r"supervisor_(call_failed|goal_accepted|goal_ended)", statements)) >= {"call_failed"}
    assert "run.last(" in statements
    assert "run.end(" in statements
    assert "message.nested_field.float32_value = " in statements


def test_the_package_declares_its_test() -> None:
    files = generate(example_supervisor("maze_solver/maze_solver"), "ros2-cpp")
    assert "ament_add_gtest(test_recorded_run test/test_recorded_run.cpp" in files["CMakeLists.txt"]
    assert "<test_depend>ament_cmake_gtest</test_depend>" in files["package.xml"]
    linters = re.findall(r"<test_depend>ament_cmake_(\w+)</test_depend>", files["package.xml"])
    assert linters == ["copyright", "flake8", "gtest", "lint_cmake", "pep257", "xmllint"]
    assert "ament_lint_auto_find_test_dependencies()" in files["CMakeLists.txt"]
    # The longest line that its linter takes.
    assert max(map(len, files["launch/controller.launch.py"].splitlines())) <= 99
    assert "colcon test" in files["README.md"]
    assert 'SCOPED_TRACE("step 40");' in files["test/test_recorded_run.cpp"]
