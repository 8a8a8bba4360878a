"""Draws the way of the courier through its house, coloured by what it was on its way for; `make pictures` calls it.

The robot is driven in the twin on a clock that nothing else moves, so that the picture is the same each time.
"""

import itertools
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

from robosc_examples.house import House, Settings
from robosc_simulated import Scene, load_scene
from support.stepped_twin import SteppedTwin

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "courier.svg"

ORDERED_S, ORDERED = 62.0, "kitchen"
"""Time of the order, in seconds, and the room that it names."""

SETTINGS = Settings(opens_after_s=12.0, drain_v_s=0.0045, charge_v_s=0.06)
LIMIT_S = 600.0

ROUNDS, ORDER, CHARGE = "on its rounds", "to a caller", "to its dock, with a low battery"
COLOURS = {ROUNDS: "#0b6bb5", ORDER: "#d9730d", CHARGE: "#2e8b57"}
_NAMES = {
    (1.5, 2.75): "kitchen",
    (3.5, 0.75): "office",
    (1.5, -2.85): "lab",
    (0.05, 0.37): "dock",
    (0.75, -0.85): "hall",
}
_SCALE, _LEFT_M, _TOP_M, _WIDTH_M, _HEIGHT_M = 100.0, -0.6, 3.2, 5.3, 7.3
_EVERY = 4
"""Steps of the twin from one point of the way to the next."""


@dataclass(frozen=True)
class Point:
    """Point of the way.

    Attributes:
        time_s: Time at which the robot was there.
        x_m: x of its middle.
        y_m: y of the same.
        purpose: Purpose for which it was on its way, one of `COLOURS`.
    """

    time_s: float
    x_m: float
    y_m: float
    purpose: str


@dataclass(frozen=True)
class Note:
    """Happening that is written at its place.

    Attributes:
        time_s: Time at which it happened.
        x_m: x of the robot then.
        y_m: y of the same.
        text: Happening, in words.
    """

    time_s: float
    x_m: float
    y_m: float
    text: str


def driven(folder: Path) -> tuple[Scene, list[Point], list[Note]]:
    """Drive the courier until it has charged: its house, its way, and what happened.

    Args:
        folder: Empty folder for the records of the run.

    Raises:
        AssertionError: The courier has touched something, or has not charged in time.
    """
    scene = load_scene("rooms")
    points: list[Point] = []
    notes: list[Note] = []
    with SteppedTwin("courier/courier", scene, folder, house=House(SETTINGS)) as twin:

        def note(text: str) -> None:
            notes.append(Note(twin.now_s, *twin.place, text))

        was_low = False
        before = twin.state
        for step in itertools.count():
            twin.step()
            state = twin.state
            is_low, is_waiting = state["Battery"]["variables"]["low"], state["Caller"]["state"] == "waiting"
            if step % _EVERY == 0:
                points.append(Point(twin.now_s, *twin.place, CHARGE if is_low else ORDER if is_waiting else ROUNDS))
            if twin.now_s >= ORDERED_S > twin.now_s - 0.05:
                twin.receive("/order", ORDERED)
                note(f"somebody calls it to the {ORDERED}")
            for component, location, text in (
                ("Door", "opening", "requests the door to open"),
                ("Tray", "offered", "offers its tray"),
            ):
                if state[component]["state"] == location != before[component]["state"]:
                    note(text)
            if is_low and not was_low:
                note("the battery is low")
            if was_low and not is_low:
                note("is full again, and goes on")
                break
            if twin.now_s > LIMIT_S:
                raise AssertionError(f"the courier has not charged within {LIMIT_S:g} s")
            was_low, before = is_low, state
        if twin.world.collisions:
            raise AssertionError("the courier has touched something")
    return scene, points, notes


def drawn() -> str:
    """Return the picture."""
    with tempfile.TemporaryDirectory(prefix="robosc-courier-") as folder:
        scene, points, notes = driven(Path(folder))
    return "\n".join(_lines(scene, points, notes)) + "\n"


def _lines(scene: Scene, points: list[Point], notes: list[Note]) -> Iterator[str]:
    width, height = _WIDTH_M * _SCALE + 330, _HEIGHT_M * _SCALE
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        'font-family="sans-serif" font-size="14">'
    )
    yield "<title>The way of the courier through its house</title>"
    yield f'<rect width="{width:.0f}" height="{height:.0f}" fill="#ffffff"/>'
    for x1_m, y1_m, x2_m, y2_m in scene.walls.segments:
        (x1, y1), (x2, y2) = _at(x1_m, y1_m), _at(x2_m, y2_m)
        yield f'<path d="M{x1} {y1}L{x2} {y2}" stroke="#333333" stroke-width="3"/>'
    for obstacle in scene.obstacles:
        x, y = _at(obstacle.x_m, obstacle.y_m)
        radius = obstacle.radius_m * _SCALE
        yield f'<circle cx="{x}" cy="{y}" r="{radius:.0f}" fill="none" stroke="#8c6d31" stroke-dasharray="4 4"/>'
        yield f'<text x="{float(x) + radius + 6:.0f}" y="{float(y) + 22:.0f}" fill="#8c6d31">door</text>'
    for (x_m, y_m), name in _NAMES.items():
        x, y = _at(x_m, y_m)
        yield f'<text x="{x}" y="{y}" text-anchor="middle" fill="#555555" font-style="italic">{name}</text>'
    for purpose, part in itertools.groupby(itertools.pairwise(points), lambda pair: pair[1].purpose):
        pairs = list(part)
        # Ways there and back would hide each other.
        aside_m = 0.03 * (1 - list(COLOURS).index(purpose))
        way = [pairs[0][0], *(pair[1] for pair in pairs)]
        places = [place for place, _ in itertools.groupby(_at(it.x_m + aside_m, it.y_m + aside_m) for it in way)]
        text = "L".join(f"{x} {y}" for x, y in places)
        yield f'<path d="M{text}" fill="none" stroke="{COLOURS[purpose]}" stroke-width="2.5" stroke-opacity="0.8"/>'
    for number, note in enumerate(notes, start=1):
        x, y = _at(note.x_m, note.y_m)
        # Several happenings at one place stand side by side.
        before = sum(1 for other in notes[: number - 1] if abs(other.x_m - note.x_m) + abs(other.y_m - note.y_m) < 0.2)
        shifted = float(x) + 24 * before
        yield f'<circle cx="{shifted:.0f}" cy="{y}" r="11" fill="#ffffff" stroke="#333333"/>'
        yield f'<text x="{shifted:.0f}" y="{float(y) + 5:.0f}" text-anchor="middle" font-size="13">{number}</text>'
    left = _WIDTH_M * _SCALE - 60
    for number, (purpose, colour) in enumerate(COLOURS.items()):
        y_text = 24 + 22 * number
        yield f'<path d="M{left:.0f} {y_text - 5}h28" stroke="{colour}" stroke-width="4"/>'
        yield f'<text x="{left + 36:.0f}" y="{y_text}">{escape(purpose)}</text>'
    for number, note in enumerate(notes, start=1):
        y_note = height - 22 * (len(notes) - number) - 20
        yield f'<text x="{left:.0f}" y="{y_note:.0f}">{number}  {note.time_s:.0f} s: {escape(note.text)}</text>'
    yield "</svg>"


def _at(x_m: float, y_m: float) -> tuple[str, str]:
    return f"{(x_m - _LEFT_M) * _SCALE:.1f}", f"{(_TOP_M - y_m) * _SCALE:.1f}"


def main() -> int:
    """Draw the picture; returns the exit status."""
    PICTURE.write_text(drawn(), encoding="utf-8")
    print(PICTURE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
