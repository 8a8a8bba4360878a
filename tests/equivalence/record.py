"""Records the runs of the example robots anew, after a change that is meant to change what they do.

Usage: python tests/equivalence/record.py
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.equivalence.recorded import FOLDER, recorded_text
from support.equivalence.worlds import WORLDS, live


def main() -> int:
    """Write every file."""
    FOLDER.mkdir(exist_ok=True)
    for robot in WORLDS:
        text = recorded_text(*live(robot))
        (FOLDER / f"{robot}.jsonl").write_text(text, encoding="utf-8")
        sys.stdout.write(f"{robot}: {len(text.splitlines())} lines\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
