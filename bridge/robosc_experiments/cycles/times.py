"""Times of cycles, those of the paper, and the sensor input of a controller while they are measured."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

CYCLES = 1000
RUNS = 3
LIMIT_S = 120.0

FAR_M, NEAR_M = 3.0, 0.2
BEAMS = 360
_ASIDE_M = 0.3
_TURNS = 50
"""Number of inputs before an obstacle appears or goes."""

Samples = Mapping[str, Sequence[float]]
"""Seconds of each `cycle`, and with a middleware of each `publish` alone."""

PAPER: Mapping[tuple[str, bool], tuple[float, float, float, float]] = {
    ("line", True): (34, 11, 160, 25),
    ("maze", True): (40, 9, 660, 40),
    ("line", False): (5, 0, 73, 5),
    ("maze", False): (2, 0, 139, 7),
}
"""Table I: mean, minimum, maximum and standard deviation in microseconds, by scenario and whether with middleware."""

OTHER: Mapping[str, tuple[str, Any, str]] = {
    "line": ("/line/correction", 0.1, "line_correction(&r, ++now_us, 0.1)"),
    "maze": ("/rotate_done", None, "rotate_done(&r, ++now_us)"),
}
"""Input beside scans: its topic, its data, and the same in C."""


@dataclass(frozen=True, slots=True)
class CycleTimes:
    """Times of cycles.

    Attributes:
        experiment: `maze` or `line`.
        what: Description of what was measured, in words.
        has_middleware: True if messages went out.
        microseconds: Mean, minimum, maximum and standard deviation; None: not measured.
        count: Number of cycles.
        why: Reason why it was not measured.
        median_us: Median, in microseconds: the time of a machine that has nothing else to do; others' work makes the
            mean and the maximum.
        publish_us: Median of the time that the middleware takes of it, in microseconds, measured alone; None: there
            is none.
    """

    experiment: str
    what: str
    has_middleware: bool
    microseconds: tuple[float, float, float, float] | None
    count: int = 0
    why: str = ""
    median_us: float = 0.0
    publish_us: float | None = None

    @property
    def paper(self) -> tuple[float, float, float, float]:
        """The paper's figures of the same."""
        return PAPER[self.experiment, self.has_middleware]


def cycle_times(experiment: str, what: str, found: Samples | str, *, has_middleware: bool) -> CycleTimes:
    """Return the figures of what was found, or the reason why nothing was found."""
    if isinstance(found, str):
        return CycleTimes(experiment, what, has_middleware, None, why=found)
    us = [sample * 1e6 for sample in found["cycle"]]
    figures = (statistics.fmean(us), min(us), max(us), statistics.pstdev(us))
    publish_us = statistics.median(found["publish"]) * 1e6 if "publish" in found else None
    return CycleTimes(
        experiment, what, has_middleware, figures, len(us), median_us=statistics.median(us), publish_us=publish_us
    )


def feed(experiment: str, number: int) -> tuple[str, Any]:
    """Return the next input: every other time a scan, whose obstacle comes and goes."""
    if number % 2 == 0:
        identifier, data, _ = OTHER[experiment]
        return identifier, data
    return "/scan", SimpleNamespace(ranges=[(FAR_M, NEAR_M)[number // _TURNS % 2]] * BEAMS)


def clear_scan() -> list[float]:
    """A scan in a corridor that is free ahead, in metres: either robot drives on."""
    walls = (*range(60, 121), *range(240, 301))
    return [_ASIDE_M if beam in walls else FAR_M for beam in range(BEAMS)]
