"""`make test` runs tests in two phases: which words each is given, and what both come to."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("run.sh")

PYTEST = """\
#!/bin/sh
echo "$@" >> "$TOLD"
case "$*" in
  *"-m not real_time"*) exit "$FIRST" ;;
  *) exit "$SECOND" ;;
esac
"""
"""Instead of an interpreter: notes what it is given, and ends as it is told."""


def run(folder: Path, first: int, second: int, *words: str) -> tuple[int, list[str]]:
    """Exit status, and what pytest was given each time."""
    stand_in, told = folder / "python", folder / "told"
    stand_in.write_text(PYTEST)
    stand_in.chmod(0o755)
    told.write_text("")
    variables = {
        **os.environ,
        "PYTHON": str(stand_in),
        "WORKERS": "3",
        "TOLD": str(told),
        "FIRST": str(first),
        "SECOND": str(second),
    }
    ended = subprocess.run(["sh", str(SCRIPT), *words], env=variables, capture_output=True, text=True, timeout=30)
    return ended.returncode, told.read_text().splitlines()


@pytest.mark.parametrize(
    ("first", "second", "status"),
    [
        (0, 0, 0),
        (0, 1, 1),
        (1, 0, 1),
        (1, 1, 1),
        (3, 1, 3),
        (0, 3, 3),
        # Nothing was chosen in one of them, or in both.
        (0, 5, 0),
        (5, 0, 0),
        (5, 1, 1),
        (1, 5, 1),
        (5, 5, 5),
    ],
)
def test_both_phases_run_and_a_failure_in_either_counts(first: int, second: int, status: int, tmp_path: Path) -> None:
    found, told = run(tmp_path, first, second, "tests/a", "-k", "b")
    assert found == status
    assert told == [
        "-m pytest -n 3 --dist loadscope --durations 20 -r fEs -m not real_time tests/a -k b",
        "-m pytest -m real_time --durations 20 -r fEs tests/a -k b",
    ]


def test_after_an_interrupt_there_is_no_second_phase(tmp_path: Path) -> None:
    assert run(tmp_path, 2, 0) == (2, ["-m pytest -n 3 --dist loadscope --durations 20 -r fEs -m not real_time"])


@pytest.mark.parametrize("words", [("-m", "ros2"), ("tests/a", "-mros2")])
def test_who_chooses_by_markers_gets_one_phase(words: tuple[str, ...], tmp_path: Path) -> None:
    given = ["-m pytest -n 3 --dist loadscope --durations 20 -r fEs " + " ".join(words)]
    assert run(tmp_path, 0, 1, *words) == (1, given)


def test_what_lives_by_the_clock_is_marked() -> None:
    """Whole files, and single tests that carry the marker themselves; and folders may have none."""
    whole, some, folder = (
        "tests/bridge/daemon/test_run.py",
        "tests/bridge/devices/test_dynamixel_bus.py",
        "tests/api",
    )
    # Words that somebody gives every pytest would change what is printed.
    plain = {name: value for name, value in os.environ.items() if name != "PYTEST_ADDOPTS"}
    others = {f"tests/api/{file.name}" for file in SCRIPT.with_name("api").glob("test_*.py")}
    for marked, files in (("real_time", {whole, some}), ("not real_time", {some, *others})):
        command = ["-m", "pytest", "-p", "no:cacheprovider", "--collect-only", "-q", "-m", marked, whole, some, folder]
        ended = subprocess.run(
            [sys.executable, *command], cwd=SCRIPT.parents[1], env=plain, capture_output=True, text=True, timeout=120
        )
        assert {line.partition("::")[0] for line in ended.stdout.splitlines() if "::" in line} == files
