"""The line follower behind a supervision layer over serial lines, with an existing follower that cares for nothing."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.event_logs import read_log
from robosc_experiments.line import run_line
from robosc_simulated import load_scene
from robosc_simulated import scene as scene_module

pytestmark = pytest.mark.real_time

SPEED = 5.0


@pytest.mark.parametrize("scene", ["line-oval", "line-curves"])
def test_it_keeps_to_the_line_and_stands_still_whenever_it_must(
    scene: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    said: list[str] = []
    outcome = run_line(tmp_path / "run", scene, speed=SPEED, say=said.append)
    assert outcome.faults == ()
    # More than the judge asks: its middle stays above the line, which is 5 cm wide.
    assert outcome.figures["aside_most_m"] < 0.025
    assert outcome.figures["collisions"] == 0
    # The follower was never asked to stop: the layer held back what it went on asking for.
    assert outcome.figures["blocked"] > 20
    events = [entry.event for entry in read_log(outcome.event_log).events]
    assert (events.count("stop.response"), events.count("resume.response")) == (2, 2)
    for what in ("for the box on the line", "after the stop button", "after the operator's stop"):
        assert any(text.startswith(f"stands {what}") for text in said), what
    record_property(f"most off the line of {scene}", f"{outcome.figures['aside_most_m'] * 1e3:.0f} mm")


def test_it_does_so_on_a_bad_day(tmp_path: Path) -> None:
    oval = (Path(scene_module.__file__).parent / "scenes" / "line-oval.yaml").read_text(encoding="utf-8")
    scene = tmp_path / "oval.yaml"
    scene.write_text(f"{oval}\nprofile: bad-day\n", encoding="utf-8")
    assert load_scene(scene).profile == "bad-day"
    outcome = run_line(tmp_path / "run", scene, speed=2.0, say=lambda text: None)
    assert outcome.faults == ()
    assert outcome.figures["aside_most_m"] < 0.03
    assert outcome.figures["collisions"] == 0
