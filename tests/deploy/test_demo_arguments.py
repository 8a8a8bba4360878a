"""Wrong use of the demonstration is reported at once, before anything is started."""

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


@pytest.mark.parametrize(
    ("option", "value", "status", "message"),
    [
        ("--scene", "no-maze", 1, "demo: there is no scene and no file 'no-maze'; there are "),
        ("--speed", "1000", 1, "demo: the speed must be from 0.5 to 25, and is 1000"),
        ("--seed", "-1", 2, "demo.py: error: argument --seed: a whole number from 0 to 2147483647 is needed, not '-1'"),
    ],
)
def test_what_cannot_be_is_one_clear_error(option: str, value: str, status: int, message: str, tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, str(DEMO / "demo.py"), option, value, "--output", str(tmp_path / "out")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == status
    assert result.stderr.splitlines()[-1].startswith(message)
    # A speed is looked at only when the scene has been read, which is printed.
    assert option == "--speed" or result.stdout == ""
