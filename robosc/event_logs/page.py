"""Sequences of events as pages that can be zoomed, with plotly; nothing in them is fetched from a network."""

import html

import plotly.graph_objects as go

from robosc.event_logs.drawing import CONTROLLABLE, UNCONTROLLABLE
from robosc.event_logs.sequence import EventSequence

_PLACES = 20_000
"""A zoomed page shows more than a picture."""

_SVG_MARKS = 10_000
"""Marks up to which a browser draws them as shapes; more are painted by the graphics card."""

_ROW_PIXELS = 26
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
    figure = go.Figure()
    scatter = go.Scatter if shown.drawn <= _SVG_MARKS else go.Scattergl
    for is_controllable in (True, False):
        rows = [(place, row) for place, row in enumerate(shown.rows) if row.is_controllable is is_controllable]
        if rows:
            figure.add_trace(
                scatter(
                    x=[time_s for _, row in rows for time_s in row.times_s],
                    y=[place for place, row in rows for _ in row.times_s],
                    # Names come from a file, and plotly takes some tags in texts for its own.
                    text=[f"{_escaped(row.event)} (line {line})" for _, row in rows for line in row.lines],
                    hovertemplate="%{text}<br>%{x:.3f} s<extra></extra>",
                    mode="markers",
                    name="controllable" if is_controllable else "uncontrollable",
                    marker={
                        "symbol": "triangle-up" if is_controllable else "circle",
                        "size": 10 if is_controllable else 8,
                        "color": CONTROLLABLE if is_controllable else UNCONTROLLABLE,
                        "line": {"width": 0.5, "color": "white"},
                    },
                )
            )
    figure.update_layout(
        title={"text": _escaped(title)},
        template="plotly_white",
        height=_FRAME_PIXELS + _ROW_PIXELS * len(shown.rows),
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
    figure.update_xaxes(title=f"time since the begin of the log (s){notes}", automargin=True)
    figure.update_yaxes(
        tickvals=list(range(len(shown.rows))),
        ticktext=[_escaped(row.label) for row in shown.rows],
        range=[len(shown.rows) - 0.4, -0.6],
        automargin=True,
    )
    text = figure.to_html(
        full_html=True,
        include_plotlyjs=True,
        include_mathjax=False,
        div_id="sequence",
        config={"displaylogo": False, "responsive": True, "scrollZoom": True},
    )
    return str(text).encode("utf-8"), shown
