"""Plots of event logs: what they show, that they are the same for the same log, and that they stay small."""

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from robosc.event_logs import Drawn, LogEntry, LoggedRun, PlotError, draw_sequence
from robosc.event_logs.sequence import MAXIMUM_ROWS, sequence_of

SVG = "{http://www.w3.org/2000/svg}"


def run_of(*events: tuple[float, str], **more: int) -> LoggedRun:
    """A log of events; requests are controllable; faults and restarts are what is called so."""
    entries = []
    for line, (time_s, name) in enumerate(events, 1):
        kind = name if name in ("fault", "restart") else "event"
        entries.append(
            LogEntry(line, 1000.0 + time_s, kind, name if kind == "event" else "", name.endswith("request"), {})
        )
    return LoggedRun(tuple(entries), **more)


SHORT = run_of(
    (0.0, "scan.response"), (0.5, "move.request"), (1.0, "scan.response"), (1.5, "fault"), (2.0, "halt.request"),
    (3.0, "scan.response"),
)  # fmt: skip


def test_a_row_is_an_event_by_its_first_occurrence() -> None:
    sequence = sequence_of(SHORT)
    assert [(row.event, row.is_controllable, row.times_s, row.lines) for row in sequence.rows] == [
        ("scan.response", False, (0.0, 1.0, 3.0), (1, 3, 6)),
        ("move.request", True, (0.5,), (2,)),
        ("halt.request", True, (2.0,), (5,)),
    ]
    assert [(item.time_s, item.text) for item in sequence.interruptions] == [(1.5, "fault")]
    assert (sequence.begin_s, sequence.end_s, sequence.count, sequence.notes) == (0.0, 3.0, 5, ())


def test_time_window_and_events_are_chosen() -> None:
    sequence = sequence_of(SHORT, begin_s=0.5, end_s=2.5, events=("*.request", "nothing*", "scan.response")[:1])
    assert [row.event for row in sequence.rows] == ["move.request", "halt.request"]
    assert (sequence.begin_s, sequence.end_s) == (0.5, 2.5)
    assert [row.event for row in sequence_of(SHORT, events=("move.request",)).rows] == ["move.request"]


def test_a_fault_after_the_last_event_is_drawn() -> None:
    entries = [
        LogEntry(1, 9.0, "restart", "", False, {"what": ""}),
        LogEntry(2, 10.0, "event", "go.request", True, {"state": {}}),
        LogEntry(3, 10.5, "fault", "", False, {"what": "it broke"}),
    ]
    found = sequence_of(LoggedRun(tuple(entries)))
    assert (found.begin_s, found.end_s) == (0.0, 1.5)
    assert [(item.time_s, item.text) for item in found.interruptions] == [(0.0, "restart"), (1.5, "fault: it broke")]
    assert [item.text for item in sequence_of(LoggedRun(tuple(entries)), end_s=1.2).interruptions] == ["restart"]


def test_what_says_nothing_new_can_be_left_out() -> None:
    given = [
        ("a", 1, "x"),
        ("a", 1, "x"),
        ("a", 2, "x"),
        ("b", None, "x"),
        ("b", None, "y"),
        ("a", 2, "y"),
        ("a", 2, "x"),
    ]
    run = LoggedRun(
        tuple(
            LogEntry(line, float(line), "event", name, False, {"data": data, "state": {"A": {"state": state}}})
            for line, (name, data, state) in enumerate(given, 1)
        )
    )
    sequence = sequence_of(run, only_changes=True)
    assert {row.event: row.lines for row in sequence.rows} == {"a": (1, 3, 7), "b": (4, 5)}
    assert sequence.notes == ("events that repeat what was known already are left out",)


@pytest.mark.parametrize(
    ("chosen", "problem"),
    [
        ({"begin_s": 2.0, "end_s": 2.0}, "the time window from 2 s to 2 s is empty"),
        ({"begin_s": 4.0}, "no event in the time window; the last one is at 3.000 s"),
        ({"events": ("move",)}, "no event of the log is called 'move'; there are scan.response, move.request"),
    ],
)
def test_nothing_to_show_is_reported(chosen: dict[str, object], problem: str, tmp_path: Path) -> None:
    with pytest.raises(PlotError) as caught:
        draw_sequence(SHORT, tmp_path / "plot.png", **chosen)  # type: ignore[arg-type]
    assert str(caught.value).startswith(problem)
    with pytest.raises(PlotError, match="the log contains no events"):
        sequence_of(run_of((0.0, "fault")))
    with pytest.raises(PlotError, match=r"plots are \.png, \.svg, \.html files"):
        draw_sequence(SHORT, tmp_path / "plot.gif")
    assert list(tmp_path.iterdir()) == []


def test_marks_that_would_cover_one_of_the_same_event_are_left_out_and_reported() -> None:
    run = run_of(*((number * 0.001, "scan.response") for number in range(10_001)), (10.0, "move.request"))
    sequence = sequence_of(run).thinned(100)
    scan, move = sequence.rows
    assert (len(scan.times_s), len(move.times_s)) == (100, 1)
    assert scan.times_s[:2] == pytest.approx((0.0, 0.1))
    assert sequence.notes == ("of 10002 events 9901 are not drawn: they stand where a mark of the same event is",)
    assert (sequence.count, sequence.drawn) == (10_002, 101)


def test_of_too_many_events_the_most_frequent_are_shown() -> None:
    events = [(float(number), f"e{number % 100}.response") for number in range(150)]
    sequence = sequence_of(run_of(*events))
    assert len(sequence.rows) == MAXIMUM_ROWS
    assert {f"e{number}.response" for number in range(50)} <= {row.event for row in sequence.rows}
    assert sequence.notes == ("of 100 different events the 80 most frequent are shown",)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".html"])
def test_the_same_log_gives_the_same_file(suffix: str, tmp_path: Path) -> None:
    drawn = [draw_sequence(SHORT, tmp_path / f"{name}{suffix}", title="A run") for name in "ab"]
    first, second = (item.path.read_bytes() for item in drawn)
    assert first == second
    assert drawn[0] == Drawn(
        tmp_path / f"a{suffix}", 5, 5, ("scan.response", "move.request", "halt.request"), 0.0, 3.0, ()
    )
    assert first.startswith({".png": b"\x89PNG", ".svg": b"<?xml", ".html": b"<!doctype html>"}[suffix])


def test_an_svg_tells_events_apart_by_colour_and_shape(tmp_path: Path) -> None:
    draw_sequence(SHORT, tmp_path / "plot.svg")
    root = ElementTree.parse(tmp_path / "plot.svg").getroot()
    used = [
        (item.get("style") or "", item.get("{http://www.w3.org/1999/xlink}href")) for item in root.iter(f"{SVG}use")
    ]
    orange = {shape for style, shape in used if "#d55e00" in style}
    blue = {shape for style, shape in used if "#0072b2" in style}
    assert orange
    assert blue
    assert not orange & blue
    assert sum("#d55e00" in style for style, _ in used) == 2 + 1  # and one in the legend
    assert sum("#0072b2" in style for style, _ in used) == 3 + 1


def test_names_of_a_foreign_log_are_no_formulas_and_no_tags(tmp_path: Path) -> None:
    run = run_of((0.0, "$\\frac{.request"), (1.0, "<b onclick=alert(1)>.response"), (2.0, "</script>.response"))
    for suffix in (".png", ".svg", ".html"):
        draw_sequence(run, tmp_path / f"plot{suffix}", title="$ <i>")
    text = (tmp_path / "plot.html").read_text(encoding="utf-8")
    assert "<b onclick" not in text
    assert "</script>.response" not in text


def test_a_page_needs_no_network(tmp_path: Path) -> None:
    draw_sequence(SHORT, tmp_path / "plot.html")
    text = (tmp_path / "plot.html").read_text(encoding="utf-8")
    assert "<script src=" not in text
    assert "<link" not in text
    assert len(text) > 1_000_000  # plotly itself


def test_a_log_of_many_thousands_of_events_stays_quick_and_small(tmp_path: Path) -> None:
    names = [f"e{number}.{'request' if number % 2 else 'response'}" for number in range(20)]
    run = run_of(*((number * 0.01, names[number * 7 % 20]) for number in range(100_000)))
    drawn = draw_sequence(run, tmp_path / "plot.png")
    assert drawn.events == 100_000
    assert drawn.marks <= 600 * 20
    assert (tmp_path / "plot.png").stat().st_size < 500_000


@pytest.mark.parametrize(("package", "suffix"), [("matplotlib", ".png"), ("plotly", ".html")])
def test_without_the_package_that_draws_one_sentence_says_what_to_install(
    package: str, suffix: str, tmp_path: Path
) -> None:
    log = tmp_path / "log.jsonl"
    log.write_text('{"time": 1, "kind": "event", "event": "a.request", "state": {}}\n', encoding="utf-8")
    program = (
        f"import sys; sys.modules[{package!r}] = None\n"
        "from robosc.cli.main import main\n"
        f"sys.exit(main(['plot', {str(log)!r}, '-o', {str(tmp_path / 'plot') + suffix!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, f"robosc: this plot needs {package}: pip install 'robosc[plot]'\n")


def test_reading_and_checking_load_nothing_that_draws() -> None:
    program = (
        "import sys, robosc.event_logs; sys.exit(bool({'matplotlib', 'plotly', 'numpy', 'grpc'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
