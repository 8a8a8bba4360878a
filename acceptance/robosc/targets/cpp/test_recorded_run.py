"""The tests of generated rclcpp packages, compiled with a stand-in for GoogleTest: they pass, and can fail."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from robosc.targets import generate, write_files
from support.generated import example_supervisor
from support.rclcpp_nodes import RECORDED_RUN, compiled_test, courier

pytestmark = pytest.mark.skipif(
    shutil.which("gcc") is None or shutil.which("g++") is None, reason="gcc or g++ is not installed"
)

EXAMPLES = ["maze_solver/maze_solver", "navigation/navigation", "line_follower/line_follower"]


def outcome(program: Path) -> tuple[int, str]:
    done = subprocess.run([program], capture_output=True, text=True, timeout=60.0, check=False)
    return done.returncode, done.stdout


@pytest.mark.parametrize("name", [*EXAMPLES, "courier"])
def test_the_supervisor_does_what_was_recorded(name: str, tmp_path: Path) -> None:
    supervisor = courier() if name == "courier" else example_supervisor(name)
    status, output = outcome(compiled_test(supervisor, tmp_path / "package"))
    assert (status, output.splitlines()) == (
        0,
        ["Supervisor.DoesWhatItDidWhenTheRunWasRecorded", "Supervisor.BeginsAnewAfterAStop"],
    )


def test_another_supervisor_is_noticed(tmp_path: Path) -> None:
    write_files(generate(courier(), "ros2-cpp"), tmp_path / "package")
    source = tmp_path / "package" / RECORDED_RUN
    text = source.read_text(encoding="utf-8")
    found = re.search(r'Names\{"(\w+)\.response", "\w+\.request"\}', text)
    assert found is not None
    source.write_text(text.replace(found[0], f'Names{{"{found[1]}.response"}}', 1), encoding="utf-8")
    status, output = outcome(compiled_test(courier(), tmp_path / "package"))
    assert status == 1
    assert output.count("failed at step ") == 1
