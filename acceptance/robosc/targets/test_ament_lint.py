import os
import subprocess
from pathlib import Path

import pytest

from robosc.targets import write_files
from support.ament_lint import PACKAGES
from support.colcon import colcon_program

# A Python with ROS 2 hands these variables down to programs that have their own.
HANDED_DOWN = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PYTHONPATH")


def linted(linter: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """The outcome of a linter of ROS in a folder."""
    program = colcon_program().parent / "bin" / linter
    environment = {name: value for name, value in os.environ.items() if name not in HANDED_DOWN}
    return subprocess.run([program], cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.ros2
@pytest.mark.parametrize("linter", ["ament_flake8", "ament_pep257"])
@pytest.mark.parametrize("name", PACKAGES)
def test_a_linter_finds_nothing_in_a_generated_package(linter: str, name: str, tmp_path: Path) -> None:
    write_files(PACKAGES[name](), tmp_path)
    done = linted(linter, tmp_path)
    # A package of messages has no Python.
    assert done.returncode == 0 or "0 files checked" in done.stdout, done.stdout + done.stderr


@pytest.mark.ros2
@pytest.mark.parametrize("linter", ["ament_flake8", "ament_pep257"])
def test_a_linter_finds_what_is_wrong(linter: str, tmp_path: Path) -> None:
    (tmp_path / "wrong.py").write_text('def wrong():\n    """The wrong one"""\n' + "    return " + "1 + " * 40 + "1\n")
    assert linted(linter, tmp_path).returncode != 0
