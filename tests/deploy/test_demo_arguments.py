"""Wrong use of the demonstration is told at once, before anything is started."""

import subprocess
import sys
from pathlib import Path

DEMO = Path(__file__).parents[2] / "deploy" / "demo" / "demo.py"


def test_a_model_that_is_not_there_is_one_clear_error(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, str(DEMO), "--model", "no.rscd"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.splitlines()[-1] == "demo.py: error: there is no file no.rscd"
