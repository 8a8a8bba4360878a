"""Time of whole processes by engine, in seconds of the processor: families of systems, and models of CIF.

Usage: run.py engines [DIR]

With a folder of CIF models these are measured instead of the families. A process that takes longer than the limit is
marked, and so is all that would be compared with it.
"""

import os
import resource
import statistics
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from cif import models_in
from figures import text_table

LIMIT_S = 120.0
RUNS = 3
SIZES = (30, 100)

ENGINES = {
    "cudd with kernel": ("cudd", "1"),
    "oxidd": ("oxidd", "1"),
    "cudd without kernel": ("cudd", "0"),
}
"""For each column its engine, and what `ROBOSC_KERNEL` is."""

HEADER = ("model", *(f"{name}, s" for name in ENGINES), "oxidd / cudd with kernel", "of synthesis alone")


def measured(name: str, size: int, engine: str) -> None:
    """Synthesize a family's system, or a model whose name is a path and which has no size; print the seconds of it."""
    from robosc.cif import check_cif, load_cif
    from robosc.synthesis import synthesize
    from support.seeded_families import SEEDED_FAMILIES

    made = SEEDED_FAMILIES[name](size, 1) if size else check_cif(load_cif(Path(name))).system
    if made is None:
        raise SystemExit(f"{name} has errors: robosc check lists them")
    begin = os.times()
    synthesize(made, engine=engine)
    end = os.times()
    print(end.user + end.system - begin.user - begin.system)


def _seconds(name: str, size: int, column: str) -> tuple[float, float] | None:
    """Medians of several processes: of the whole, and of synthesis alone; None if they take too long."""
    engine, kernel = ENGINES[column]
    wholes, parts = [], []
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            done = subprocess.run(
                [sys.executable, __file__, name, str(size), engine],
                capture_output=True,
                text=True,
                check=True,
                timeout=LIMIT_S,
                cwd=Path(__file__).parent,
                env={**os.environ, "ROBOSC_KERNEL": kernel},
            )
        except subprocess.TimeoutExpired:
            return None
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        wholes.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        parts.append(float(done.stdout))
    return statistics.median(wholes), statistics.median(parts)


def table(arguments: Sequence[str] = ()) -> str:
    """One line a family and size, or one a model of a folder, and geometric means of the ratios.

    Raises:
        SystemExit: The argument is no folder of models.
    """
    models: list[tuple[str, str, int]] = []
    if arguments:
        folder = Path(arguments[0])
        paths = models_in(folder) if folder.is_dir() else []
        if len(arguments) > 1 or not paths:
            raise SystemExit("usage: run.py engines [DIR], where DIR is a folder of CIF models")
        models = [(str(path.relative_to(folder)), str(path.resolve()), 0) for path in paths]
    else:
        from support.seeded_families import SEEDED_FAMILIES

        models = [(f"{name}, {size}", name, size) for name in SEEDED_FAMILIES for size in SIZES]
    rows: list[list[str]] = []
    ratios: tuple[list[float], list[float]] = ([], [])
    for label, name, size in models:
        found = {column: _seconds(name, size, column) for column in ENGINES}
        cells = [f"{item[0]:.2f}" if item else f"> {LIMIT_S:.0f}" for item in found.values()]
        one, other = found["oxidd"], found["cudd with kernel"]
        if one and other:
            for kept, mine, theirs in zip(ratios, one, other, strict=True):
                kept.append(mine / theirs)
                cells.append(f"{kept[-1]:.2f}")
        rows.append([label, *cells, *[""] * (len(HEADER) - 1 - len(cells))])
    means = [f"{statistics.geometric_mean(items):.2f}" for items in ratios]
    rows.append(["geometric mean", *[""] * len(ENGINES), *means])
    return text_table(f"whole processes by engine, medians of {RUNS}", HEADER, rows)


if __name__ == "__main__":
    measured(sys.argv[1], int(sys.argv[2]), sys.argv[3])
