"""The packages of the targets ros1-cpp and ros2-cpp as texts: what they hold, and what is refused."""

import re
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from support.models import bundle_of
from support.node_logs import entries_of
from support.rclcpp_nodes import compiled, compiled_once, hostile, missing, run, sent


def supervisor_of(body: str) -> Supervisor:
    made = make_supervisor(bundle_of(body))
    assert made.supervisor is not None, made.reason
    return made.supervisor


MISFIT = """
robot Misfit {
    datatype object Wrong { x: string w: double }
    interface i use Vector3 from geometry_msgs
    component C {
        outgoing message m with identifier: "/m", type: Wrong links i
        behaviour { variable w: double on response from m do w := value.w initial marked state s { } }
    }
}
"""


@pytest.mark.skipif(missing("geometry_msgs") is not None, reason=str(missing("geometry_msgs")))
def test_the_compiler_names_a_field_that_does_not_fit(tmp_path: Path) -> None:
    with pytest.raises(AssertionError) as raised:
        compiled(supervisor_of(MISFIT), tmp_path)
    message = str(raised.value)
    assert "in the model it is a string, in the message it is not" in message
    assert re.search(r"has no member named .w.", message)


@pytest.mark.skipif(missing("geometry_msgs") is not None, reason=str(missing("geometry_msgs")))
def test_names_and_texts_of_a_hostile_model_stay_names_and_texts(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    program = compiled_once(hostile(), tmp_path_factory)
    lines = ["message /c nothing", "message /d 1", "message /c */ \" ' \\ ??/ %d </name>", "message /d 0", "signal 15"]
    done = run(program, lines, "every:=event", "period:=3600", f"log_folder:={tmp_path / 'log'}")
    assert (done.returncode, done.stderr) == (0, "")
    published = {name: data for word, name, data in sent(done.stdout) if word == "publish"}
    assert '"; import os; */ %s ??/ \\ é' in published["/a"].replace('\\"', '"').replace("\\\\", "\\")
    assert "x: -0.50000" in published["/b"]
    entries = entries_of(tmp_path / "log")
    variables = [entry["state"]["namespace"]["variables"] for entry in entries if entry["kind"] == "event"]
    assert variables[0] == {"class": "auto", "robot_t": 0, "this": '"; system("x"); // \\ \' ??/\n%s é'}
    assert {item["class"] for item in variables} == {"auto", "break"}
    assert variables[-1]["robot_t"] == 7
