"""Sequences of events as pictures, with matplotlib."""

import io
from collections.abc import Mapping, Sequence

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.offsetbox import AnnotationBbox, HPacker, TextArea, VPacker
from matplotlib.ticker import MaxNLocator

from robosc.event_logs.bands import Band, Span
from robosc.event_logs.drawing import BLOCKED, CONTROLLABLE, STATES, UNCONTROLLABLE
from robosc.event_logs.sequence import EventSequence

_WIDTH_INCHES = 11.0
_ROW_INCHES = 0.26
_CURVE_INCHES = 0.75
_FRAME_INCHES = 1.3
_STATE_POINTS = 7.5
_SMALL_POINTS = 6.0
_CHARACTER_INCHES = 0.064
"""Width of a letter of that size, and a little more."""

_LONGEST = 40
_MOST_BESIDE = 6
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
    rows = len(sequence.bands) + len(sequence.rows) + len(sequence.blocked)
    heights = [_ROW_INCHES * rows + 0.2, *[_CURVE_INCHES] * len(sequence.curves)]
    figure = Figure(
        figsize=(_WIDTH_INCHES, _FRAME_INCHES - 0.2 + sum(heights) + 0.18 * len(sequence.notes)),
        layout="constrained",
        facecolor="white",
    )
    top, *below = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    _draw_rows(top, sequence)
    for axes, curve in zip(below, sequence.curves, strict=True):
        axes.plot(curve.times_s, curve.values, drawstyle="steps-post", color=UNCONTROLLABLE, linewidth=1.0)
        axes.set_ylabel(_short(curve.name), rotation=0, ha="right", va="center", parse_math=False)
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.margins(y=0.15)
        axes.grid(axis="y", color="#dddddd", linewidth=0.6)
    for axes in (top, *below):
        for item in sequence.interruptions:
            axes.axvline(item.time_s, color="#555555", linewidth=0.8, linestyle="--" if "restart" in item.text else ":")
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    margin = (sequence.end_s - sequence.begin_s) * 0.01 or 0.5
    top.set_xlim(sequence.begin_s - margin, sequence.end_s + margin)
    (below or [top])[-1].set_xlabel("\n".join([sequence.axis, *sequence.notes]), parse_math=False)
    top.set_title(title, loc="left", parse_math=False)
    figure.legend(handles=_legend(sequence), loc="outside upper right", ncols=4, frameon=False)
    _name_states(figure, top, sequence)
    return figure


def _draw_rows(axes: Axes, sequence: EventSequence) -> None:
    """Draw bands, events and blocked requests, from top to bottom."""
    for place, band in enumerate(sequence.bands):
        colors = _colors(band)
        axes.broken_barh(
            [(span.begin_s, span.end_s - span.begin_s) for span in band.spans],
            (place - 0.4, 0.8),
            facecolors=[colors[span.text] for span in band.spans],
            edgecolors="white",
            linewidth=0.4,
        )
    events = len(sequence.bands)
    for place, row in enumerate((*sequence.rows, *sequence.blocked), events):
        is_blocked = place >= events + len(sequence.rows)
        marker, size = ("x", 5.0) if is_blocked else ("^", 5.5) if row.is_controllable else ("o", 4.5)
        color = BLOCKED if is_blocked else CONTROLLABLE if row.is_controllable else UNCONTROLLABLE
        axes.plot(
            row.times_s,
            [place] * len(row.times_s),
            linestyle="none",
            marker=marker,
            markersize=size,
            markeredgewidth=1.2 if is_blocked else 0.3,
            markeredgecolor=color if is_blocked else "white",
            color=color,
        )
    if events and sequence.rows:
        axes.axhline(events - 0.5, color="#aaaaaa", linewidth=0.6)
    labels = [_short(band.name) for band in sequence.bands]
    labels += [row.label for row in (*sequence.rows, *sequence.blocked)]
    axes.set_yticks(range(len(labels)))
    # Names come from a file: dollar signs in them are no formula.
    axes.set_yticklabels(labels, parse_math=False)
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.grid(axis="y", color="#dddddd", linewidth=0.6)


def _name_states(figure: Figure, axes: Axes, sequence: EventSequence) -> None:
    """Write each state's name into its spans that are wide enough, or right of the band if none is."""
    written: list[Artist] = []
    # Names on the right make the axes narrower: the width of a second is known only after the layout.
    for _ in range(2):
        figure.draw_without_rendering()
        per_s = axes.get_window_extent().width / figure.dpi / (axes.get_xlim()[1] - axes.get_xlim()[0])
        while written:
            written.pop().remove()
        for place, band in enumerate(sequence.bands):
            wide = [
                span
                for span in band.spans
                if (span.end_s - span.begin_s) * per_s > _CHARACTER_INCHES * len(_short(span.text)) + 0.06
            ]
            written += [_name(axes, place, span) for span in wide]
            missing = [text for text in band.texts if text not in {span.text for span in wide}]
            if missing:
                written.append(_beside(axes, place, missing, _colors(band)))


def _name(axes: Axes, place: int, span: Span) -> Artist:
    return axes.text(
        (span.begin_s + span.end_s) / 2, place, _short(span.text), ha="center", va="center_baseline",
        fontsize=_STATE_POINTS, parse_math=False, clip_on=True,
    )  # fmt: skip


def _beside(axes: Axes, place: int, texts: Sequence[str], colors: Mapping[str, str]) -> Artist:
    """The names of states in their colours, right of a band, in two lines if there are many."""
    shown = [(_short(text), colors[text]) for text in texts[:_MOST_BESIDE]]
    if len(texts) > _MOST_BESIDE:
        shown.append((f"and {len(texts) - _MOST_BESIDE} more", "white"))
    points = _STATE_POINTS if len(shown) <= 2 else _SMALL_POINTS
    areas: list[Artist] = [
        TextArea(
            text,
            textprops={
                "fontsize": points,
                "parse_math": False,
                "bbox": {"facecolor": color, "edgecolor": "none", "pad": 0.8},
            },
        )
        for text, color in shown
    ]
    half = len(areas) if len(areas) <= 2 else -(-len(areas) // 2)
    lines: list[Artist] = [HPacker(children=part, pad=0, sep=5) for part in (areas[:half], areas[half:]) if part]
    box = AnnotationBbox(
        VPacker(children=lines, pad=0, sep=2.5), (1.006, place), xycoords=axes.get_yaxis_transform(),
        box_alignment=(0, 0.5), frameon=False, pad=0.0, annotation_clip=False,
    )  # fmt: skip
    return axes.add_artist(box)


def _colors(band: Band) -> dict[str, str]:
    return {text: STATES[number % len(STATES)] for number, text in enumerate(band.texts)}


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def _legend(sequence: EventSequence) -> list[Line2D]:
    kinds = {row.is_controllable for row in sequence.rows}
    handles = []
    if True in kinds:
        handles.append(Line2D([], [], linestyle="none", marker="^", color=CONTROLLABLE, label="controllable"))
    if False in kinds:
        handles.append(Line2D([], [], linestyle="none", marker="o", color=UNCONTROLLABLE, label="uncontrollable"))
    if sequence.blocked:
        handles.append(Line2D([], [], linestyle="none", marker="x", color=BLOCKED, label="blocked"))
    if sequence.interruptions:
        handles.append(Line2D([], [], color="#555555", linestyle=":", label="fault, stop, its end, restart (dashed)"))
    return handles
