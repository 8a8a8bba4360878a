"""Sequences of events as pictures and pages, as in the paper's Figures 14 and 15.

Time goes to the right; each row stands for one event. Orange triangles are controllable events, blue dots are
uncontrollable ones. The colours are those that M. Okabe and K. Ito propose for colour-blind readers ("Color Universal
Design", 2008), and the shapes distinguish the two kinds without any colour.
"""

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robosc.errors import RoboscError
from robosc.event_logs.bands import PlotError, on_robots_clock
from robosc.event_logs.entries import LoggedRun
from robosc.event_logs.sequence import sequence_of
from robosc.motion_record import Motion

CONTROLLABLE = "#D55E00"
UNCONTROLLABLE = "#0072B2"
BLOCKED = "#000000"

STATES = ("#BFDDF0", "#F6D9A8", "#BFE3D2", "#EBCFE0", "#D9D9D9", "#F5F0B0", "#C9C3E6", "#F2C4B3")
"""Colours of states by their number in a band, light enough for a black text; more states begin anew."""

SUFFIXES = (".png", ".svg", ".html")
"""Kinds of plots that can be drawn, by the suffix of the file's name."""


class PlottingUnavailableError(RoboscError, LookupError):
    """A package that draws is not installed."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Content of a plot.

    Attributes:
        path: Its file.
        events: Number of events in the time window.
        marks: Number of marks that were drawn for them.
        rows: Names of the events that have a row, from top to bottom.
        begin_s: Begin of the time axis, in seconds since the begin of the log.
        end_s: End of the time axis.
        notes: Remarks on what is not shown, in sentences.
        bands: Names of the components and variables that are shown as bands, from top to bottom.
        curves: Names of the variables that are shown as curves.
        blocked: Number of requests that were held back.
    """

    path: Path
    events: int
    marks: int
    rows: tuple[str, ...]
    begin_s: float
    end_s: float
    notes: tuple[str, ...]
    bands: tuple[str, ...] = ()
    curves: tuple[str, ...] = ()
    blocked: int = 0


def draw_sequence(
    run: LoggedRun,
    path: str | Path,
    *,
    begin_s: float | None = None,
    end_s: float | None = None,
    events: Sequence[str] = (),
    only_changes: bool = False,
    title: str = "",
    has_bands: bool = True,
    variables: Sequence[str] = (),
    motion: Motion | None = None,
) -> Drawn:
    """Draw a log. The same log gives the same file.

    Args:
        run: The log.
        path: Output file: `.png` and `.svg` are pictures, `.html` a page that can be zoomed and needs no network.
        begin_s: Begin of the time window, in seconds since the begin of the log; None: the first event.
        end_s: Its end; None: the last event.
        events: Names, or patterns such as `*.request`, of the events to show; empty: all.
        only_changes: True if events are left out that carry what they carried before and leave the state as it was.
        title: Text above it.
        has_bands: True if a band shows the states of each component.
        variables: Names, or patterns such as `Arm.*`, of the variables to show, numbers as curves, all else as bands.
        motion: Record of the robot's motion, by whose time everything is drawn; None: by the time of the log.

    Raises:
        PlotError: There is nothing to show, or no such kind of file.
        PlottingUnavailableError: The extra `robosc[plot]` is not installed.
        OSError: The file cannot be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise PlotError(f"{target}: plots are {', '.join(SUFFIXES)} files")
    sequence = sequence_of(
        run if motion is None else on_robots_clock(run, motion),
        begin_s,
        end_s,
        events,
        only_changes=only_changes,
        has_bands=has_bands,
        variables=variables,
        is_robots_time=motion is not None,
    )
    if suffix == ".html":
        content, drawn = _drawer("page", "plotly").page(sequence, title)
    else:
        content, drawn = _drawer("picture", "matplotlib").picture(sequence, title, suffix[1:])
    target.write_bytes(content)
    return Drawn(
        path=target,
        events=drawn.count,
        marks=drawn.drawn,
        rows=tuple(row.event for row in drawn.rows),
        begin_s=drawn.begin_s,
        end_s=drawn.end_s,
        notes=drawn.notes,
        bands=tuple(band.name for band in drawn.bands),
        curves=tuple(curve.name for curve in drawn.curves),
        blocked=sum(len(row.times_s) for row in sequence.blocked),
    )


def _drawer(module: str, package: str) -> Any:
    """Return a module of this package that draws with another package, loaded on use.

    Raises:
        PlottingUnavailableError: The other package is not installed.
    """
    try:
        return importlib.import_module(f"robosc.event_logs.{module}")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != package:
            raise
        raise PlottingUnavailableError(f"this plot needs {package}: pip install 'robosc[plot]'") from error
