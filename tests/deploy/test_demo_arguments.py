"""Wrong use of the demonstration is told at once, before anything is started."""

import subprocess
import sys
from pathlib import Path

import pytest

DEMO = Path(__file__).parents[2] / "deploy" / "demo"


@pytest.mark.parametrize("name", ["demo.py", "line_follower.py"])
def test_a_model_that_is_not_there_is_one_clear_error(name: str, tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, str(DEMO / name), "--model", "no.rscd"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.splitlines()[-1] == f"{name}: error: there is no file no.rscd"


def test_a_scene_that_is_not_there_is_one_clear_error(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, str(DEMO / "demo.py"), "--scene", "no-maze", "--output", str(tmp_path / "out")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr.startswith("demo: there is no scene and no file 'no-maze'; there are ")


def test_a_speed_that_cannot_be_is_one_clear_error(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, str(DEMO / "demo.py"), "--speed", "1000", "--output", str(tmp_path / "out")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == 1
    assert result.stderr == "demo: the speed must be from 0.5 to 25, and is 1000\n"


def test_a_seed_that_cannot_be_is_one_clear_error(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, str(DEMO / "demo.py"), "--seed", "-1", "--output", str(tmp_path / "out")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1] == (
        "demo.py: error: argument --seed: a whole number from 0 to 2147483647 is needed, not '-1'"
    )
