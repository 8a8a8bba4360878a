"""Cycles that publish a Twist through real middleware, and publish() alone beside it."""

import statistics

from execution.robots import EXPERIMENTS, SMALL, WITH, supervisor
from figures import micro
from robosc_experiments.cycles.driving import measured_driving
from robosc_experiments.cycles.times import CYCLES, RUNS

_AIM = "34"


def rows() -> list[list[str]]:
    """Rows of the table: each robot on each middleware; one line says so where a middleware is missing."""
    found: list[list[str]] = []
    for kind in ("rclpy", "rospy", "roscpp"):
        for name in SMALL:
            label = f"{name}, {'generated C' if kind == 'roscpp' else 'generated Python'}, {kind}"
            samples = measured_driving(kind, EXPERIMENTS[name], supervisor(name), RUNS, CYCLES)
            if isinstance(samples, str):
                found.append([f"{label}: not measured, {samples}", *[""] * 7])
                continue
            aim = _AIM if kind == "rclpy" else ""
            found.append([f"{label}: cycle with publish", *micro(samples["cycle"]), WITH[name], aim])
            found.append([f"{label}: publish alone", *micro(samples["publish"]), "", ""])
            own = statistics.fmean(samples["cycle"]) - statistics.fmean(samples["publish"])
            found.append([f"{label}: difference of the means", f"{own * 1e6:.2f}", "", "", "", "", "", ""])
    return found
