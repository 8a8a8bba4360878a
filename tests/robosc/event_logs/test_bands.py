"""Bands of states, curves of numbers and the robot's clock in plots, against slow and obvious twins."""

import math
import random
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from robosc.event_logs import LogEntry, LoggedRun, PlotError, draw_sequence
from robosc.event_logs.bands import (
    MAXIMUM_BANDS,
    MAXIMUM_CURVES,
    Band,
    Curve,
    Span,
    bands_of,
    on_robots_clock,
    variables_of,
)
from robosc.event_logs.sequence import sequence_of
from robosc.motion_record import Motion, Sample

SVG = "{http://www.w3.org/2000/svg}"


def run_of(*given: tuple[float, str, Any]) -> LoggedRun:
    """A log: events by the state of a component `Arm`, or entries of other kinds by their fields."""
    entries = []
    for line, (time_s, name, content) in enumerate(given, 1):
        if name in ("restart", "blocked", "fault"):
            entries.append(LogEntry(line, 100.0 + time_s, name, "", False, content))
        else:
            entries.append(LogEntry(line, 100.0 + time_s, "event", name, False, {"state": content}))
    return LoggedRun(tuple(entries))


def arm(state: str, **variables: Any) -> dict[str, Any]:
    return {"Arm": {"state": state, "variables": variables}}


RUN = run_of(
    (0.0, "a", arm("up", n=1, x="nan", flag=True)),
    (1.0, "a", arm("up", n=1, x=0.5, flag=True)),
    (2.0, "b", arm("down", n=2, x=0.5, flag=False)),
    (3.0, "restart", {"what": ""}),
    (4.0, "b", arm("down", n=2, x=0.5, flag=False)),
    (4.5, "blocked", {"identifier": "/cmd_vel", "why": "forbidden"}),
    (5.0, "c", arm("up", n=3, x=1.5, flag=False)),
    (6.0, "c", arm("up", n=3, x=1.5, flag=False)),
)


def test_a_band_has_a_gap_where_the_model_began_again() -> None:
    (band,), notes = bands_of(RUN, 0.0, 6.0)
    assert (band.name, band.texts, notes) == ("Arm", ("up", "down"), ())
    assert band.spans == (Span(0.0, 2.0, "up"), Span(2.0, 3.0, "down"), Span(4.0, 5.0, "down"), Span(5.0, 6.0, "up"))
    (inside,), _ = bands_of(RUN, 1.5, 2.5)
    assert inside.spans == (Span(1.5, 2.0, "up"), Span(2.0, 2.5, "down"))


@pytest.mark.parametrize("seed", range(5))
def test_bands_show_the_state_at_every_time(seed: int) -> None:
    """The twin looks the last event before each time up."""
    chance = random.Random(seed)
    times = sorted(chance.uniform(0.0, 10.0) for _ in range(60))
    given = [(time_s, "e", arm(chance.choice("abc"))) for time_s in times]
    given[chance.randrange(20, 40)] = (times[30], "restart", {"what": ""})
    given.sort(key=lambda item: item[0])
    run = run_of(*given)
    begin_s, end_s = 1.0, times[-1] - times[0]
    (band,), _ = bands_of(run, begin_s, end_s)
    for _ in range(200):
        time_s = chance.uniform(begin_s, end_s)
        before = [entry for entry in run.entries if entry.time_s - run.begin_s <= time_s]
        expected = before[-1].state["Arm"]["state"] if before[-1].kind == "event" else None
        found = [span.text for span in band.spans if span.begin_s <= time_s < span.end_s]
        assert found == ([] if expected is None else [expected])


def test_variables_are_bands_or_curves() -> None:
    bands, curves, notes = variables_of(RUN, 0.0, 6.0, ("Arm.*",))
    assert notes == ()
    assert bands == (Band("Arm.flag", (Span(0.0, 2.0, "true"), Span(2.0, 3.0, "false"), Span(4.0, 6.0, "false"))),)
    n, x = curves
    assert (n.name, n.times_s) == ("Arm.n", (0.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert [value if not math.isnan(value) else None for value in n.values] == [1, 2, None, 2, 3, 3]
    assert (x.name, math.isnan(x.values[0]), x.values[1]) == ("Arm.x", True, 0.5)
    assert variables_of(RUN, 0.0, 6.0, ()) == ((), (), ())
    with pytest.raises(PlotError, match=r"no variable of the log is called 'Leg.n'; there are Arm.n, Arm.x, Arm.flag"):
        variables_of(RUN, 0.0, 6.0, ("Leg.n",))


def test_of_too_many_bands_those_that_change_most_are_shown() -> None:
    many = MAXIMUM_BANDS + 5

    def state(time_s: int) -> dict[str, Any]:
        return {
            f"C{number}": {"state": str(time_s if number % 2 or number < 10 else 0),
                           "variables": {f"v{number}": number}}
            for number in range(many)
        }  # fmt: skip

    run = run_of(*((float(time_s), "e", state(time_s)) for time_s in range(3)))
    bands, notes = bands_of(run, 0.0, 2.0)
    assert len(bands) == MAXIMUM_BANDS
    assert {f"C{number}" for number in range(many) if number % 2 or number < 10} <= {band.name for band in bands}
    assert notes == (f"of {many} components the {MAXIMUM_BANDS} that change most often are shown",)
    _, curves, notes = variables_of(run, 0.0, 2.0, ("*",))
    assert (len(curves), notes) == (MAXIMUM_CURVES, (f"of {many} numbers the first {MAXIMUM_CURVES} are drawn",))


def test_of_states_that_cannot_be_seen_the_longer_ones_are_drawn() -> None:
    short = Band("A", tuple(Span(float(n), n + (0.9 if n % 2 else 0.1), str(n)) for n in range(100)))
    thin = short.thinned(0.0, 100.0, 10)
    assert len(thin.spans) == 10
    assert all(span.end_s - span.begin_s > 0.8 for span in thin.spans)
    assert short.thinned(0.0, 100.0, 100) is short


def test_a_thinned_curve_keeps_its_peaks() -> None:
    values = [0.0] * 1000
    values[503], values[507] = 9.0, -9.0
    curve = Curve("x", tuple(map(float, range(1000))), tuple(values)).thinned(0.0, 1000.0, 10)
    assert len(curve.times_s) <= 30
    assert {9.0, -9.0} <= set(curve.values)
    assert curve.times_s[-1] == 999.0
    assert list(curve.times_s) == sorted(curve.times_s)


def sample(time: float, world_s: float) -> Sample:
    return Sample(time, world_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0)


def test_the_robots_clock_passes_as_its_world_does() -> None:
    # Ten times as fast, then at rest, then as fast as the clock.
    motion = Motion((sample(101.0, 0.0), sample(102.0, 10.0), sample(103.0, 10.0), sample(105.0, 12.0)), ())
    found = on_robots_clock(RUN, motion)
    times = [entry.time_s for entry in found.entries]
    assert times == pytest.approx([-3.0, 0.0, 10.0, 10.0, 11.0, 11.5, 12.0, 15.0])
    assert [entry.line for entry in found.entries] == [entry.line for entry in RUN.entries]
    with pytest.raises(PlotError, match="too short to give the robot's time"):
        on_robots_clock(RUN, Motion(motion.samples[:1], ()))


def test_a_clock_that_was_set_back_does_not_turn_time_round() -> None:
    motion = Motion((sample(100.0, 0.0), sample(103.0, 3.0), sample(101.0, 4.0), sample(106.0, 6.0)), ())
    times = [entry.time_s for entry in on_robots_clock(RUN, motion).entries]
    assert times == sorted(times)


def test_a_sequence_has_what_is_asked_for() -> None:
    sequence = sequence_of(RUN, variables=("Arm.flag",), is_robots_time=True)
    assert [band.name for band in sequence.bands] == ["Arm", "Arm.flag"]
    assert [(row.event, row.times_s, row.lines) for row in sequence.blocked] == [("/cmd_vel blocked", (4.5,), (6,))]
    assert sequence.axis.startswith("robot’s time")
    bare = sequence_of(RUN, has_bands=False, end_s=4.0)
    assert (bare.bands, bare.curves, bare.blocked) == ((), (), ())
    assert bare.axis.startswith("time")


def test_a_picture_names_each_state_where_there_is_room_or_beside(tmp_path: Path) -> None:
    drawn = draw_sequence(RUN, tmp_path / "plot.svg", variables=("*",))
    assert (drawn.bands, drawn.curves, drawn.blocked) == (("Arm", "Arm.flag"), ("Arm.n", "Arm.x"), 1)
    root = ElementTree.parse(tmp_path / "plot.svg").getroot()
    # Matplotlib writes each text as a comment before its glyphs; elements of bands have the colours of states.
    text = (tmp_path / "plot.svg").read_text(encoding="utf-8")
    assert all(f"<!-- {name} -->" in text for name in ("up", "down", "true", "false", "/cmd_vel blocked", "Arm.n"))
    assert sum("#bfddf0" in (item.get("style") or "") for item in root.iter(f"{SVG}path")) >= 1
    flash = run_of(
        (0.0, "a", arm("long")), (5.0, "a", arm("flash")), (5.001, "a", arm("long")), (9.0, "a", arm("long"))
    )
    draw_sequence(flash, tmp_path / "flash.svg")
    assert (tmp_path / "flash.svg").read_text(encoding="utf-8").count("<!-- flash -->") == 1


@pytest.mark.parametrize("suffix", [".png", ".svg", ".html"])
def test_foreign_names_of_states_are_no_formulas_and_no_tags_and_files_repeat(suffix: str, tmp_path: Path) -> None:
    state = {"$x": {"state": "$\\frac{", "variables": {"<b>": "</script>", "y$": 1}}}
    run = run_of((0.0, "a", state), (1.0, "a", {"$x": {"state": "<i>", "variables": {"<b>": "$", "y$": 2}}}))
    one, two = (draw_sequence(run, tmp_path / f"{name}{suffix}", variables=("*",)).path.read_bytes() for name in "ab")
    assert one == two
    if suffix == ".html":
        assert b"<i>" not in one
        assert b"</script>," not in one
