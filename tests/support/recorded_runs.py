"""Recorded runs of scenarios: logs and motions as real ones leave them, of the reference executor."""

import json
from pathlib import Path

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.event_log import json_line
from robosc.supervisor import encode
from robosc_experiments.scenario import Outcome
from robosc_simulated.scene import load_scene
from support.execution import Bench
from support.generated import example_supervisor


def recorded(folder: Path, faults: tuple[str, ...] = ()) -> Outcome:
    """Record a maze solver that has turned and driven, as its processes would have left it.

    Args:
        folder: Folder for the record; made anew.
        faults: Faults of its motion.
    """
    folder.mkdir(parents=True, exist_ok=True)
    supervisor = example_supervisor("maze_solver/maze_solver")
    (folder / "maze.rsup").write_bytes(encode(supervisor))
    bench = Bench(InterpretedSystem(supervisor))
    bench.receive("/scan", {"ranges": [0.2] * 360})
    bench.tick(2)
    bench.receive("/rotate_done")
    bench.receive("/scan", {"ranges": [3.0] * 360})
    bench.tick(2)
    (folder / "log.jsonl").write_text("".join(map(json_line, bench.log.entries)), encoding="utf-8")
    samples = [
        {
            "time": 1e6 + number / 20, "world_s": number / 20, "x_m": number / 100, "y_m": 0.0, "heading_rad": 0.0,
            "linear_m_s": 0.2, "angular_rad_s": 0.0, "collisions": 0,
        }
        for number in range(20)
    ]  # fmt: skip
    (folder / "motion.jsonl").write_text("".join(json.dumps(item) + "\n" for item in samples), encoding="utf-8")
    return Outcome(
        name="maze",
        connection="serial",
        folder=folder,
        event_log=folder / "log.jsonl",
        motion=folder / "motion.jsonl",
        supervisor=folder / "maze.rsup",
        scene=load_scene("maze-rooms"),
        faults=faults,
        figures={"world_s": 0.95, "way_m": 0.19},
    )
