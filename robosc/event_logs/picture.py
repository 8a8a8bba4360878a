"""Sequences of events as pictures, with matplotlib."""

import io

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from robosc.event_logs.drawing import CONTROLLABLE, UNCONTROLLABLE
from robosc.event_logs.sequence import EventSequence

_WIDTH_INCHES = 11.0
_ROW_INCHES = 0.26
_FRAME_INCHES = 1.3
_DPI = 130
_PLACES = 600
"""Marks that stand side by side along the time axis without covering each other entirely."""


def picture(sequence: EventSequence, title: str, format_: str) -> tuple[bytes, EventSequence]:
    """Return a picture, and the part of the sequence that it shows.

    Args:
        sequence: Sequence to draw.
        title: Text above it.
        format_: `png` or `svg`.
    """
    shown = sequence.thinned(_PLACES)
    # The same bytes for the same log: no date, no random names, fonts that matplotlib brings along.
    with mpl.rc_context({"svg.hashsalt": "robosc", "font.family": "DejaVu Sans", "font.size": 9, "text.usetex": False}):
        figure = _figure(shown, title)
        content = io.BytesIO()
        metadata = {"Date": None, "Creator": "RoboSC"} if format_ == "svg" else {"Software": "RoboSC"}
        figure.savefig(content, format=format_, dpi=_DPI, metadata=metadata)
    return content.getvalue(), shown


def _figure(sequence: EventSequence, title: str) -> Figure:
    height = _FRAME_INCHES + _ROW_INCHES * len(sequence.rows) + 0.18 * len(sequence.notes)
    figure = Figure(figsize=(_WIDTH_INCHES, height), layout="constrained", facecolor="white")
    axes = figure.add_subplot()
    for place, row in enumerate(sequence.rows):
        axes.plot(
            row.times_s,
            [place] * len(row.times_s),
            linestyle="none",
            marker="^" if row.is_controllable else "o",
            markersize=5.5 if row.is_controllable else 4.5,
            markeredgewidth=0.3,
            markeredgecolor="white",
            color=CONTROLLABLE if row.is_controllable else UNCONTROLLABLE,
        )
    for item in sequence.interruptions:
        axes.axvline(item.time_s, color="#555555", linewidth=0.8, linestyle="--" if "restart" in item.text else ":")
    axes.set_yticks(range(len(sequence.rows)))
    # Names come from a file: dollar signs in them are no formula.
    axes.set_yticklabels([row.label for row in sequence.rows], parse_math=False)
    axes.set_ylim(len(sequence.rows) - 0.4, -0.6)
    margin = (sequence.end_s - sequence.begin_s) * 0.01 or 0.5
    axes.set_xlim(sequence.begin_s - margin, sequence.end_s + margin)
    axes.grid(axis="y", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("\n".join(["time since the begin of the log (s)", *sequence.notes]), parse_math=False)
    axes.set_title(title, loc="left", parse_math=False)
    figure.legend(handles=_legend(sequence), loc="outside upper right", ncols=3, frameon=False)
    return figure


def _legend(sequence: EventSequence) -> list[Line2D]:
    kinds = {row.is_controllable for row in sequence.rows}
    handles = []
    if True in kinds:
        handles.append(Line2D([], [], linestyle="none", marker="^", color=CONTROLLABLE, label="controllable"))
    if False in kinds:
        handles.append(Line2D([], [], linestyle="none", marker="o", color=UNCONTROLLABLE, label="uncontrollable"))
    if sequence.interruptions:
        handles.append(Line2D([], [], color="#555555", linestyle=":", label="fault, stop, its end, restart (dashed)"))
    return handles
