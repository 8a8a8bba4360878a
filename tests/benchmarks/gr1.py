"""Time and memory of winning positions of reactive problems: our solver beside omega's, on families of growing size.

Each measurement is a process of its own with a limit of time; larger sizes of a family are left out for a solver that
has passed it. Times are of the processor. omega is measured as it comes, where CUDD changes the order of variables
when it thinks fit, and in a manager like ours, whose order stays as the family gives it.
"""

import json
import re
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from figures import text_table

LIMIT_S = 60.0

SIZES = {"arbiter": (*range(2, 15), 20, 30), "lift": (*range(2, 15), 20, 30), "bus": range(2, 7)}

OURS, THEIRS, THEIRS_IN_ORDER = "robosc", "omega", "omega, our order"

HEADER = ("family, size", "solver", "build, s", "solve, s", "solve: times ours", "memory, MB")


def measured(family: str, size: int, solver: str) -> dict[str, float]:
    """Figures of one game in this process; memory is what the process has grown by at most, after all imports."""
    from robosc.synthesis.engines import make_manager
    from support import omega_peer
    from support.reactive import game_of, is_realizable, solution_of
    from support.reactive_families import FAMILIES

    problem = FAMILIES[family](size)
    before_kib = _peak_kib()
    begin = time.process_time()
    manager = None if solver == THEIRS else make_manager("cudd")
    if manager is not None:
        problem.declare(manager)
    if solver == OURS:
        game = game_of(problem, manager)
        built = time.process_time()
        winning = solution_of(game).winning
    else:
        opponent = omega_peer.automaton_of(problem, manager)
        built = time.process_time()
        winning = omega_peer.winning_positions(opponent)
    end = time.process_time()
    after_kib = _peak_kib()
    is_won = is_realizable(game, winning) if solver == OURS else omega_peer.is_realizable(opponent, winning)
    if not is_won:
        raise AssertionError(f"{solver} finds no system for {family}, {size}")
    return {"build_s": built - begin, "solve_s": end - built, "memory_kib": after_kib - before_kib}


def _peak_kib() -> int:
    """Most memory that this process has had, in KiB; `getrusage` counts what it was copied from, too."""
    found = re.search(r"^VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text("ascii"), re.MULTILINE)
    assert found
    return int(found[1])


def _figures(family: str, size: int, solver: str) -> dict[str, float] | None:
    """The figures of a process of its own, or None if it took longer than the limit."""
    command = [sys.executable, __file__, family, str(size), solver]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=True, cwd=Path(__file__).parent, timeout=LIMIT_S
        )
    except subprocess.TimeoutExpired:
        return None
    found: dict[str, float] = json.loads(done.stdout)
    return found


def table() -> str:
    """One line a size and solver."""
    rows = []
    for family, sizes in SIZES.items():
        solvers = [OURS, THEIRS, THEIRS_IN_ORDER]
        for size in sizes:
            ours = 0.0
            for solver in tuple(solvers):
                found = _figures(family, size, solver)
                name = f"{family}, {size}"
                if found is None:
                    solvers.remove(solver)
                    rows.append([name, solver, "", f"> {LIMIT_S:.0f}", "", ""])
                    continue
                if solver == OURS:
                    ours = found["solve_s"]
                times = f"{found['solve_s'] / ours:.1f}" if ours else ""
                memory = f"{found['memory_kib'] / 1024:.1f}"
                rows.append([name, solver, f"{found['build_s']:.3f}", f"{found['solve_s']:.3f}", times, memory])
    return text_table("reactive games: our solver and omega's, times of the processor", HEADER, rows)


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]), sys.argv[3])))
