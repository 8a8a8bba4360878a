"""Time from the text of an example robot with goals to its supervisor and its strategy, in parts, of the processor."""

import itertools
import json
import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).parents[1]))

from figures import text_table

ROOT = Path(__file__).parents[2]

ROBOTS = ("courier", "1 x 50", "2 x 50", "3 x 10", "3 x 25", "3 x 50")
"""Example robots, and robots with so many detours of so many visits."""

RUNS = 3
"""Runs of a robot, each in a process of its own; the fastest one counts."""

HEADER = ("robot", "states", "check, s", "supervisor, s", "winning, s", "strategy and findings, s", "all, verified, s")


def measured(robot: str) -> dict[str, float]:
    """Figures of one robot, in this process."""
    from robosc.certification import make_supervisor
    from robosc.certification.pipeline import SynthesisProblem, prepare
    from robosc.language import load_bundle
    from robosc.model.structure import Deployment
    from robosc.strategies import gr1, synthesize_strategy
    from robosc.synthesis import synthesize
    from support.long_detours import robot_with_detours
    from support.models import bundle_of

    detours, _, visits = robot.partition(" x ")
    if visits:
        bundle = bundle_of(robot_with_detours(int(detours), int(visits)))
    else:
        bundle = load_bundle(ROOT / "examples" / robot / f"{robot}.rscd")
    times_s = [time.process_time()]
    problem = prepare(bundle, Deployment.CONTROLLER)
    assert isinstance(problem, SynthesisProblem)
    times_s.append(time.process_time())
    found = synthesize(problem.system.automata)
    times_s.append(time.process_time())
    # The first solution is the one with all goals and all assumptions; the others are for findings.
    solved_s: list[float] = []
    solve = gr1.solve

    def timed(*arguments: object, **named: object) -> object:
        begin_s = time.process_time()
        solution = solve(*arguments, **named)  # type: ignore[arg-type]
        solved_s.append(time.process_time() - begin_s)
        return solution

    with patch("robosc.strategies.synthesize.solve", timed):
        assert synthesize_strategy(problem.system, found.added).strategy is not None
    times_s.append(time.process_time())
    made = make_supervisor(bundle)
    assert made.supervisor is not None
    times_s.append(time.process_time())
    check_s, supervisor_s, strategy_s, all_s = (after_s - before_s for before_s, after_s in itertools.pairwise(times_s))
    return {
        "states": found.statistics.states,
        "check": check_s,
        "supervisor": supervisor_s,
        "winning": solved_s[0],
        "strategy": strategy_s,
        "all": all_s,
    }


def table() -> str:
    """One line a robot."""
    rows = []
    for robot in ROBOTS:
        runs = [
            json.loads(
                subprocess.run(
                    [sys.executable, __file__, robot],
                    capture_output=True,
                    text=True,
                    check=True,
                    cwd=Path(__file__).parent,
                ).stdout
            )
            for _ in range(RUNS)
        ]
        best = min(runs, key=lambda run: run["all"])
        rows.append([robot, f"{best['states']:,}", *(f"{best[key]:.2f}" for key in list(best)[1:])])
    return text_table("strategies: from the text of a robot with goals", HEADER, rows)


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1])))
