"""Time, size and memory of synthesis on families of systems of growing size: both engines, and in modules.

Each size runs in a process of its own with a limit of time; what does not end in it is marked so, and larger sizes
of that family are left out for that engine.
"""

import json
import resource
import subprocess
import sys
import time
from math import log
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from figures import text_table

LIMIT_S = 60.0

SIZES: dict[str, tuple[int, ...]] = {
    "dining philosophers": (5, 10, 20, 50, 100, 200),
    "transfer line": (1, 2, 4, 8, 12),
    "token ring": (5, 20, 60, 200),
    "cat and mouse, 1 pair": (1, 3, 5),
    "cat and mouse, 2 pairs": (1, 2, 3, 4),
    "counter": (100, 1_000, 10_000),
    "random robot": (5, 20, 40, 60),
}

IN_MODULES = "in modules"

MODULAR_SIZES: dict[str, tuple[int, ...]] = {
    "machines in a row": (10, 50, 100, 200, 500, 1000),
    "assembly tree": (15, 63, 127, 255, 511, 1023),
    "inspection tree": (15, 63, 127, 255, 511, 1023),
}

HEADER = ("family, size", "engine", "states", "rounds", "peak nodes", "adds to", "time, s", "grows as", "memory, MB")


def measured(family: str, size: int, engine: str) -> dict[str, object]:
    """Figures of one synthesis, in this process; the system is built before the clock starts."""
    from robosc.errors import SynthesisCancelled
    from robosc.modular.synthesize import synthesize_modular
    from robosc.synthesis import synthesize
    from support.families import FAMILIES

    system = FAMILIES[family](size)
    synthesize(FAMILIES["token ring"](2))  # The first use imports modules, outside the measurement.
    begin = time.perf_counter()

    def is_late() -> bool:
        return time.perf_counter() - begin > LIMIT_S

    try:
        if engine == IN_MODULES:
            whole = synthesize_modular(system, should_stop=is_late)
            figures, added = [item.result.statistics for item in whole.modules], whole.added
        else:
            found = synthesize(system, engine=engine, should_stop=is_late)
            figures, added = [found.statistics], found.added
    except SynthesisCancelled:
        return {}
    return {
        "seconds": time.perf_counter() - begin,
        "states": str(figures[0].states) if len(figures) == 1 else f"{len(figures)} modules",
        "rounds": max(item.iterations for item in figures),
        "peak_nodes": max(item.peak_nodes for item in figures),
        "added": len(added),
        "memory_kib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }


def _row(family: str, size: int, engine: str, before: tuple[int, float] | None) -> tuple[list[str], float] | None:
    """One line of the table and its time, or None where the limit has passed.

    Args:
        family: Name of the family.
        size: Its size.
        engine: Engine of the synthesis.
        before: The size and time of the line before: the exponent of the growth since then is printed.
    """
    done = subprocess.run(
        [sys.executable, __file__, family, str(size), engine],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parent,
    )
    found = json.loads(done.stdout)
    if not found:
        return None
    states = found["states"]
    if states.isdecimal() and len(states) >= 10:
        states = f"{float(states):.2e}"
    figures = (states, f"{found['rounds']}", f"{found['peak_nodes']:,}", f"{found['added']}")
    seconds, memory = found["seconds"], f"{found['memory_kib'] / 1024:.0f}"
    growth = f"n^{log(seconds / before[1]) / log(size / before[0]):.1f}" if before else ""
    return [f"{family}, {size}", engine, *figures, f"{seconds:.3f}", growth, memory], seconds


def table() -> str:
    """One line a size and engine."""
    rows = []
    for family, sizes in (*SIZES.items(), *MODULAR_SIZES.items()):
        engines = ["cudd", IN_MODULES if family in MODULAR_SIZES else "autoref"]
        last: dict[str, tuple[int, float]] = {}
        for size in sizes:
            for engine in tuple(engines):
                measured_row = _row(family, size, engine, last.get(engine))
                if measured_row is None:
                    engines.remove(engine)
                    rows.append([f"{family}, {size}", engine, *[""] * 4, f"> {LIMIT_S:.0f}", "", ""])
                    continue
                row, seconds = measured_row
                last[engine] = (size, seconds)
                rows.append(row)
    return text_table("synthesis: families of growing size, whole process's memory", HEADER, rows)


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]), sys.argv[3])))
