"""Time and size of synthesis on a folder of CIF models, beside a table of another tool's figures if there is one.

Usage: run.py cif DIR [--against FILE]

FILE has a table in Markdown with a line a model: its name first, then columns called `controlled states, exact`,
`synthesis s` and `whole process s`, as far as they are known. Models that others import are parts and not measured.
"""

import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from figures import text_table

LIMIT_S = 600.0
RUNS = 5

PHASES = {
    "encoding": "building",
    "coreachability": "fixed point",
    "controllability": "fixed point",
    "fixed point": "fixed point",
    "reachability": "reachability",
}
"""Column of the time that passes until synthesis reports one of its phases; the rest makes conditions."""

TIMES = ("reading", "building", "fixed point", "reachability", "conditions")

HEADER = ("model", "states", *(f"{name}, s" for name in TIMES), "process, s", "peak nodes", "memory, MB")
RATIOS = ("as reported", "fixed point", "process")

_IMPORT = re.compile(r'^\s*import\s+"([^"]+)"', re.MULTILINE)


def measured(path: Path) -> dict[str, object]:
    """Figures of one model, in this process: seconds of each part of the work, and what came of it."""
    from robosc.cif import check_cif, load_cif
    from robosc.synthesis import SynthesisProgress, synthesize

    seconds = dict.fromkeys(TIMES, 0.0)
    last = time.perf_counter()

    def passed(column: str) -> None:
        nonlocal last
        now = time.perf_counter()
        seconds[column] += now - last
        last = now

    def note(progress: SynthesisProgress) -> None:
        passed(PHASES[progress.phase])

    system = check_cif(load_cif(path)).system
    passed("reading")
    if system is None:
        raise SystemExit(f"{path} has errors: robosc check lists them")
    found = synthesize(system, on_progress=note)
    passed("conditions")
    return {
        **seconds,
        "states": str(found.statistics.states),
        "peak nodes": found.statistics.peak_nodes,
        "memory": _peak_kib(),
    }


def _peak_kib() -> int:
    """Most memory that this process had; `getrusage` would count the one that started it, too."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1])


def models_in(folder: Path) -> list[Path]:
    """The models of a folder, without what others import."""
    found = sorted(folder.rglob("*.cif"))
    parts = {(path.parent / name).resolve() for path in found for name in _IMPORT.findall(path.read_text("utf-8"))}
    return [path for path in found if path.resolve() not in parts]


def figures_of_another(text: str) -> dict[str, dict[str, str]]:
    """The lines of the first table of a Markdown text by each word of their first column."""
    lines = [line.strip().strip("|").split("|") for line in text.splitlines() if line.strip().startswith("|")]
    cells = [[cell.strip() for cell in line] for line in lines]
    if not cells:
        return {}
    header, *rows = cells
    found: dict[str, dict[str, str]] = {}
    for row in rows:
        for word in re.findall(r"[\w-]+(?=\.cif)|\w+", row[0]):
            found.setdefault(word, dict(zip(header, row, strict=False)))
    return found


def _number(text: str) -> float | None:
    try:
        return float(text.replace(",", ""))
    except ValueError:
        return None


def _in_process(path: Path) -> dict[str, object] | None:
    """Figures of one model in a process of its own; None if it takes longer than it may."""
    try:
        done = subprocess.run(
            [sys.executable, __file__, str(path)], capture_output=True, text=True, check=True, timeout=LIMIT_S
        )
    except subprocess.TimeoutExpired:
        return None
    return dict(json.loads(done.stdout))


def _process_seconds(path: Path, environment: dict[str, str]) -> float:
    """Median of the whole process's time, from the file to readable conditions."""
    robosc = shutil.which("robosc", path=str(Path(sys.executable).parent))
    assert robosc is not None, "install the project first"
    runs = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        subprocess.run([robosc, "synth", str(path)], env=environment, stdout=subprocess.DEVNULL, check=False)
        runs.append(time.perf_counter() - begin)
    return statistics.median(runs)


def table(arguments: Sequence[str]) -> str:
    """One line a model, and geometric means of the ratios to another tool's figures.

    Raises:
        SystemExit: The arguments are none.
    """
    folder, against = _arguments(arguments)
    others = figures_of_another(against.read_text("utf-8")) if against else {}
    rows: list[list[str]] = []
    ratios: tuple[list[float], list[float]] = ([], [])
    with tempfile.TemporaryDirectory() as cache:
        # Compiled modules are part of a warm cache, whatever the caller's environment says.
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": cache}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for path in models_in(folder):
            found = _in_process(path)
            name = str(path.relative_to(folder))
            if found is None:
                rows.append([name, f"> {LIMIT_S:.0f} s", *[""] * (len(HEADER) - 2 + (len(RATIOS) if others else 0))])
                continue
            seconds = [float(str(found[column])) for column in TIMES]
            process = _process_seconds(path, environment)
            states = int(str(found["states"]))
            text = f"{states:,}" if states < 10**12 else f"{float(states):.4e}"
            size = [f"{found['peak nodes']:,}", f"{float(str(found['memory'])) / 1024:.0f}"]
            row = [name, text, *(f"{figure:.3f}" for figure in (*seconds, process)), *size]
            if others:
                row += _compared(others.get(path.stem, {}), states, seconds[2] + seconds[3], process, ratios)
            rows.append(row)
    if others:
        means = [f"{statistics.geometric_mean(items):.2f}" if items else "" for items in ratios]
        rows.append(["geometric mean", *[""] * (len(HEADER) - 1), "", *means])
    header = (*HEADER, *(f"{name}, ratio" if name != RATIOS[0] else name for name in RATIOS)) if others else HEADER
    return text_table("synthesis of CIF models; the fixed point's ratio is with reachability", header, rows)


def _compared(
    other: dict[str, str], states: int, fixed_point: float, process: float, ratios: tuple[list[float], list[float]]
) -> list[str]:
    """Cells: whether the states are those of the other tool, and the ratios of times, which are also kept."""
    known = _number(other.get("controlled states, exact", ""))
    cells = ["" if known is None else "yes" if abs(states - known) <= 1e-4 * known else "NO"]
    for seconds, column, kept in zip((fixed_point, process), ("synthesis s", "whole process s"), ratios, strict=True):
        figure = _number(other.get(column, ""))
        if figure:
            kept.append(seconds / figure)
        cells.append(f"{seconds / figure:.2f}" if figure else "")
    return cells


def _arguments(arguments: Sequence[str]) -> tuple[Path, Path | None]:
    found: tuple[Path, Path | None]
    match arguments:
        case [folder]:
            found = Path(folder), None
        case [folder, "--against", file] | ["--against", file, folder]:
            found = Path(folder), Path(file)
        case _:
            raise SystemExit("usage: run.py cif DIR [--against FILE]")
    if not found[0].is_dir() or (found[1] is not None and not found[1].is_file()):
        raise SystemExit(f"there is no {found[0] if not found[0].is_dir() else found[1]}")
    if not models_in(found[0]):
        raise SystemExit(f"{found[0]} has no .cif file")
    return found


if __name__ == "__main__":
    print(json.dumps(measured(Path(sys.argv[1]))))
