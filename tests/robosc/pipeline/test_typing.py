"""Wrong use of the Python API is an error of types."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
USES = "tests/robosc/pipeline/typed_uses.py"


def test_mypy_finds_every_wrong_use_and_no_other(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path), "--follow-imports", "silent", USES]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert (ROOT / USES).read_text().count("# type: ignore[") > 20
