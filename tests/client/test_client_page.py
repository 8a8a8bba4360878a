"""The page about the client says what is so: its example in Python runs against a real server."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from support.models import EXAMPLES
from support.service import served
from support.waiting import PATIENCE_S

PAGE = (Path(__file__).parents[2] / "docs" / "client.md").read_text()
_ADDRESS = '"localhost:50051"'
_LAST = "\n\nimport asyncio\n\nasyncio.run(main())\n"


def test_the_example_runs(tmp_path: Path) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert example.count(_ADDRESS) == 2
    shutil.copy(EXAMPLES / "line_follower" / "line_follower.rscd", tmp_path / "robot.rscd")
    with served() as address:
        program = example.replace(_ADDRESS, repr(address)) + _LAST
        command = [sys.executable, "-c", program]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^supervisor  \d+$", done.stdout, re.MULTILINE)
    assert re.search(r"^succeeded ", done.stdout, re.MULTILINE)
    assert done.stdout.endswith("\nno findings\n")
