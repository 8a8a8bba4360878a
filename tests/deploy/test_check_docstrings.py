"""The rule for the first words of docstrings and comments."""

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "deploy" / "check_docstrings.py"

GOOD = '''"""Jobs."""

LIMIT = 3  # Jobs of all callers.
"""Number of jobs. What waits beyond it is refused."""


class Job:
    """Job of a caller.

    Attributes:
        name: Name of the job: whatever its caller likes.
        is_over: True if nothing follows.
    """

    text = "Whether this is a docstring"

    def is_busy(self):
        """Return True if it runs, whether or not its caller is there.

        Whether it was tried before does not count.
        """
        # The state of a job is known here,
        # whether it runs or not.
        return "# Whether it runs"
'''


def checked(folder: Path, text: str) -> tuple[int, list[str]]:
    (folder / "part").mkdir(exist_ok=True)
    (folder / "part" / "jobs.py").write_text(text)
    done = subprocess.run([sys.executable, PROGRAM, "part"], cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout.splitlines()


def test_what_names_its_thing_first_passes(tmp_path: Path) -> None:
    assert checked(tmp_path, GOOD) == (0, [])


@pytest.mark.parametrize(
    ("plain", "riddle", "line", "word"),
    [
        ('"""Jobs."""', '"""What jobs are."""', 1, "What"),
        ("Number of jobs", "How many jobs", 4, "How"),
        ("Job of a caller", "Who waits", 8, "Who"),
        ("Number of jobs", "Of jobs", 4, "Of"),
        ("Number of jobs", "There are jobs", 4, "There"),
        ("Job of a caller", "It waits", 8, "It"),
        ("Return True if", "Nothing if", 18, "Nothing"),
        ("name: Name of the job", "name: What it is called", 11, "What"),
        ("is_over: True if", "is_over: Whether", 12, "Whether"),
        ("Return True if", "Whether", 18, "Whether"),
        ("Jobs of all callers", "Of all callers", 3, "Of"),
        ("The state of a job", "What a job does", 22, "What"),
    ],
)
def test_an_opening_without_subject_is_found_in_its_line(
    plain: str, riddle: str, line: int, word: str, tmp_path: Path
) -> None:
    status, findings = checked(tmp_path, GOOD.replace(plain, riddle))
    assert status == 1
    assert [entry.startswith(f"part/jobs.py:{line}: begins with '{word}':") for entry in findings] == [True]


def test_a_folder_that_is_not_there_is_wrong_use(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, PROGRAM, "parts"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "parts is not a folder\n")
