"""Sequences of events as pages that can be zoomed, with plotly; nothing in them is fetched from a network."""

import html
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from robosc.event_logs.drawing import BLOCKED, CONTROLLABLE, STATES, UNCONTROLLABLE
from robosc.event_logs.sequence import EventSequence

_PLACES = 20_000
"""A zoomed page shows more than a picture."""

_SVG_MARKS = 10_000
"""Marks up to which a browser draws them as shapes; more are painted by the graphics card."""

_ROW_PIXELS = 26
_CURVE_PIXELS = 110
_GAP_PIXELS = 14
_FRAME_PIXELS = 190


def _escaped(text: str) -> str:
    """A text, none of which plotly takes for a tag; it shows entities of quotation marks as they stand."""
    return html.escape(text, quote=False)


def page(sequence: EventSequence, title: str) -> tuple[bytes, EventSequence]:
    """Return a page, and the part of the sequence that it shows.

    Args:
        sequence: Sequence to draw.
        title: Text above it.
    """
    shown = sequence.thinned(_PLACES)
    rows = len(shown.bands) + len(shown.rows) + len(shown.blocked)
    heights = [_FRAME_PIXELS + _ROW_PIXELS * rows, *[_CURVE_PIXELS] * len(shown.curves)]
    figure = make_subplots(
        rows=len(heights), cols=1, shared_xaxes=True, row_heights=heights, vertical_spacing=_GAP_PIXELS / sum(heights)
    )
    _add_bands(figure, shown)
    _add_events(figure, shown)
    for number, curve in enumerate(shown.curves, 2):
        line = {"shape": "hv", "color": UNCONTROLLABLE, "width": 1.5}
        figure.add_trace(
            go.Scatter(
                x=curve.times_s, y=curve.values, mode="lines", line=line, showlegend=False, name=_escaped(curve.name),
                hovertemplate="%{y:.6g}<br>%{x:.3f} s<extra></extra>",
            ),
            row=number,
            col=1,
        )  # fmt: skip
        figure.update_yaxes(
            title={"text": _escaped(curve.name), "font": {"size": 11}}, automargin=True, row=number, col=1
        )
    figure.update_layout(
        title={"text": _escaped(title)},
        template="plotly_white",
        height=sum(heights),
        barmode="overlay",
        # A state whose name does not fit is reported when it is pointed at.
        uniformtext={"minsize": 10, "mode": "hide"},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "x": 0},
        shapes=[
            {
                "type": "line", "x0": item.time_s, "x1": item.time_s, "y0": 0, "y1": 1, "yref": "paper",
                "line": {"color": "#555555", "width": 1, "dash": "dot"},
                "label": {"text": _escaped(item.text), "textangle": 0, "font": {"size": 9}, "yanchor": "top"},
            }
            for item in shown.interruptions
        ],
    )  # fmt: skip
    notes = "".join(f"<br>{_escaped(note)}" for note in shown.notes)
    figure.update_xaxes(title=f"{shown.axis}{notes}", automargin=True, row=len(heights), col=1)
    labels = [band.name for band in shown.bands] + [row.label for row in (*shown.rows, *shown.blocked)]
    figure.update_yaxes(
        tickvals=list(range(rows)),
        ticktext=[_escaped(label) for label in labels],
        range=[rows - 0.4, -0.6],
        automargin=True,
        row=1,
        col=1,
    )
    text = figure.to_html(
        full_html=True,
        include_plotlyjs=True,
        include_mathjax=False,
        div_id="sequence",
        config={"displaylogo": False, "responsive": True, "scrollZoom": True},
    )
    return str(text).encode("utf-8"), shown


def _add_bands(figure: Any, shown: EventSequence) -> None:
    for place, band in enumerate(shown.bands):
        colors = {text: STATES[number % len(STATES)] for number, text in enumerate(band.texts)}
        figure.add_trace(
            go.Bar(
                orientation="h",
                base=[span.begin_s for span in band.spans],
                x=[span.end_s - span.begin_s for span in band.spans],
                y=[place] * len(band.spans),
                width=0.8,
                text=[_escaped(span.text) for span in band.spans],
                textposition="inside",
                insidetextanchor="middle",
                textangle=0,
                textfont={"color": "black"},
                marker={"color": [colors[span.text] for span in band.spans], "line": {"width": 0.5, "color": "white"}},
                customdata=[span.end_s for span in band.spans],
                hovertemplate=f"{_escaped(band.name)}: %{{text}}<br>%{{base:.3f}} s to %{{customdata:.3f}} s"
                "<extra></extra>",
                showlegend=False,
            ),
            row=1,
            col=1,
        )


def _add_events(figure: Any, shown: EventSequence) -> None:
    first, last = len(shown.bands), len(shown.bands) + len(shown.rows)
    rows = list(enumerate(shown.rows, first))
    groups = (
        ("controllable", "triangle-up", 10, CONTROLLABLE, [each for each in rows if each[1].is_controllable]),
        ("uncontrollable", "circle", 8, UNCONTROLLABLE, [each for each in rows if not each[1].is_controllable]),
        ("blocked", "x-thin", 8, BLOCKED, list(enumerate(shown.blocked, last))),
    )
    scatter = go.Scatter if shown.drawn <= _SVG_MARKS else go.Scattergl
    for name, symbol, size, color, members in groups:
        if members:
            figure.add_trace(
                scatter(
                    x=[time_s for _, row in members for time_s in row.times_s],
                    y=[place for place, row in members for _ in row.times_s],
                    # Names come from a file, and plotly takes some tags in texts for its own.
                    text=[f"{_escaped(row.event)} (line {line})" for _, row in members for line in row.lines],
                    hovertemplate="%{text}<br>%{x:.3f} s<extra></extra>",
                    mode="markers",
                    name=name,
                    marker={
                        "symbol": symbol,
                        "size": size,
                        "color": color,
                        "line": {"width": 0.5, "color": "white"}
                        if name != "blocked"
                        else {"width": 1.5, "color": color},
                    },
                ),
                row=1,
                col=1,
            )
