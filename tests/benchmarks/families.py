"""Time of synthesis on families of systems in many orders of their declarations, in seconds of the processor.

Usage: run.py families [DIR]

Every size of a family is declared in `ORDERS` orders. With a folder of CIF models these are shuffled instead.
A synthesis that takes longer than the limit is counted with the limit, and marked. Each line goes to standard error as
soon as it is measured.
"""

import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from cif import models_in
from figures import text_table

LIMIT_S = 60.0
ORDERS = 20
SIZES = (30, 100, 300)

HEADER = ("family, about so many parts", "median, s", "worst, s", "worst / median", "grows as")


def measured(name: str, size: int) -> list[float]:
    """Seconds of each order; a name that is a path is a model's, and has no size."""
    from robosc.cif import check_cif, load_cif
    from robosc.errors import SynthesisCancelled
    from robosc.synthesis import synthesize
    from support.families import token_ring
    from support.seeded_families import SEEDED_FAMILIES, shuffled

    made = SEEDED_FAMILIES[name](size, 1) if size else check_cif(load_cif(Path(name))).system
    if made is None:
        raise SystemExit(f"{name} has errors: robosc check lists them")
    synthesize(token_ring(2))  # The first use imports modules, outside the measurement.
    found = []
    for order in range(ORDERS):
        system = shuffled(made, order)
        begin_s = time.process_time()

        def is_late(begin_s: float = begin_s) -> bool:
            return time.process_time() - begin_s > LIMIT_S

        try:
            synthesize(system, should_stop=is_late)
            found.append(time.process_time() - begin_s)
        except SynthesisCancelled:
            found.append(LIMIT_S)
            if len(found) > 1 and found[-2] == LIMIT_S:
                break
    return found


def _row(name: str, size: int, before: tuple[int, float] | None, label: str) -> tuple[list[str], float]:
    """A line of the table, and its median; `before` is the size and the median of the line before."""
    done = subprocess.run(
        [sys.executable, __file__, name, str(size)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parent,
    )
    times = json.loads(done.stdout)
    median, worst = statistics.median(times), max(times)
    growth = f"n^{math.log(median / before[1]) / math.log(size / before[0]):.1f}" if before else ""
    mark = "> " if worst >= LIMIT_S else ""
    row = [label, f"{median:.3f}", f"{mark}{worst:.3f}", f"{worst / median:.1f}", growth]
    # The whole table takes an hour.
    sys.stderr.write("  ".join(row) + "\n")
    return row, median


def table(arguments: Sequence[str] = ()) -> str:
    """One line a family and size, or one a model of a folder.

    Raises:
        SystemExit: The argument is no folder of models.
    """
    rows = []
    if arguments:
        folder = Path(arguments[0])
        models = models_in(folder) if folder.is_dir() else []
        if len(arguments) > 1 or not models:
            raise SystemExit("usage: run.py families [DIR], where DIR is a folder of CIF models")
        rows = [_row(str(path.resolve()), 0, None, str(path.relative_to(folder)))[0] for path in models]
    else:
        from support.seeded_families import SEEDED_FAMILIES

        for name in SEEDED_FAMILIES:
            before: tuple[int, float] | None = None
            for size in SIZES:
                row, median = _row(name, size, before, f"{name}, {size}")
                rows.append(row)
                before = size, median
                if median >= LIMIT_S:
                    break
    return text_table(f"synthesis in {ORDERS} orders of declarations", HEADER, rows)


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]))))
