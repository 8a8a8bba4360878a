"""The typed state of the generated ROS 2 node in C++ is that of the node in Python, period by period."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.supervisor import Supervisor
from robosc.targets import StateMessage
from robosc.targets.code.naming import package_name
from robosc.targets.registry import GenerateOptions
from support.equivalence.python_targets import observe
from support.equivalence.random_scenarios import ticking_scenario
from support.equivalence.rclcpp_target import SteppedSurroundings
from support.equivalence.scenario import Scenario
from support.execution import supervisor_of
from support.generated import example_supervisor
from support.models import model_of
from support.rclcpp_nodes import SANITIZERS, compiled, compiled_once, courier, hostile, missing, run, sent
from support.typed_state import states_in_python

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
PACKAGES = ("geometry_msgs", "sensor_msgs", "std_srvs", "test_msgs")
pytestmark = pytest.mark.skipif(missing(*PACKAGES) is not None, reason=str(missing(*PACKAGES)))

LAMP = """
robot Lamp {
    component Light {
        incoming message blink with identifier: "blink", type: none
        behaviour { initial marked state lit { on request to blink } }
    }
}
"""


def states_in_cpp(supervisor: Supervisor, scenario: Scenario, program: Path, folder: Path) -> list[dict[str, object]]:
    """Return the typed states that the node publishes in a run, one for each period, without headers."""
    node = SteppedSurroundings(supervisor, program, folder, package_name(supervisor, GenerateOptions(), "controller"))
    node.start(scenario, folder / "events")
    try:
        states = [node.first_state()]
        issued = 0
        for number, (action, seen) in enumerate(zip(scenario.actions, observe(supervisor, scenario)[1:], strict=True)):
            if action.do == "message":
                node.send(action.subject, action.data)
            elif action.do != "tick":
                node.answer(action)
            elif number > 0:
                states.append(node.next_state())
            issued += len(seen.issued)
            node.wait_for_issued(issued)
        node.stop()
    finally:
        node.close()
    stamps = [state.pop("header")["stamp"] for state in states]
    seconds = [stamp["sec"] + stamp["nanosec"] / 1e9 for stamp in stamps]
    assert seconds == [seconds[0] + 0.125 * number for number in range(len(states))]
    return states


@pytest.mark.parametrize(
    ("make", "options"),
    [
        (lambda: example_supervisor("line_follower/line_follower"), ()),
        (lambda: example_supervisor("maze_solver/maze_solver"), ()),
        (lambda: example_supervisor("object_finder/object_finder"), ()),
        (courier, SANITIZERS),
        (hostile, ()),
    ],
    ids=["line_follower", "maze_solver", "object_finder", "courier", "hostile"],
)
def test_the_state_of_each_period(
    make: Callable[[], Supervisor],
    options: tuple[str, ...],
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    supervisor = make()
    program = compiled_once(supervisor, tmp_path_factory, *options)
    seen = set()
    for seed in range(3):
        folder = tmp_path / str(seed)
        folder.mkdir()
        scenario = ticking_scenario(supervisor, seed, 300)
        expected = states_in_python(supervisor, scenario, folder / "python", monkeypatch)
        assert states_in_cpp(supervisor, scenario, program, folder) == expected
        assert any(state["transitions"] for state in expected)
        seen |= {state["status"] for state in expected} | {bool(state["reasons"]) for state in expected}
    assert seen >= {"waiting", "running", True, False}


def test_without_the_message_all_but_json_is_one_clear_error(tmp_path: Path) -> None:
    program = compiled(supervisor_of(model_of(LAMP)), tmp_path / "package", state_message=StateMessage.JSON)
    done = run(program, ["signal 15"], "state_message:=both")
    assert done.returncode == 2
    assert done.stderr == (
        "lamp_controller: parameter 'state_message' must be json: this package was generated without --state-message "
        "typed\n"
    )
    lines = ["wait publish /state", "signal 15"]
    done = run(program, lines, "publish_state:=true", "state_message:=json", "period:=0.001")
    assert done.returncode == 0, done.stderr
    assert {name for _, name, _ in sent(done.stdout)} <= {"/state", "/blink"}


def test_both_forms_at_once(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    program = compiled_once(example_supervisor("maze_solver/maze_solver"), tmp_path_factory)
    node = "/robot1/maze_solver_controller/state"
    done = run(
        program, [f"wait publish {node}", "signal 15"], "publish_state:=true", "state_message:=both", "period:=0.001",
        "topic_prefix:=/fleet", namespace="/robot1",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    names = [name for _, name, _ in sent(done.stdout) if name.endswith("state")]
    assert names[:2] == [node, "/fleet/state"]
