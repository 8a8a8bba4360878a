"""Replay of a log, and the picture of the surroundings."""

import math
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser

from support.browser import Visit, visit
from support.live_view import StandIn
from support.view_messages import BEGIN_S, definition, drive, entry, events, update

LOG = {"begin_s": BEGIN_S, "end_s": BEGIN_S + 60.0, "count": 120}
SCENE = {
    "walls": [[-1, -1, 2, -1], [2, -1, 2, 2], [2, 2, -1, 2], [-1, 2, -1, -1]],
    "line": [[-0.5 + 0.05 * i, 1 + 0.3 * math.sin(i / 6)] for i in range(45)],
}


def position(at_s: float, is_playing: bool = False, speed: float = 1.0) -> Any:
    return {"type": "position", "time_s": BEGIN_S + at_s, "is_playing": is_playing, "speed": speed}


@pytest.fixture
def server() -> Iterator[StandIn]:
    recorded = definition(source="log", can_command=False, log=LOG)
    with StandIn([recorded, update(), position(0.0)]) as standing_in:
        yield standing_in


@pytest.fixture
def seen(browser: Browser, server: StandIn) -> Iterator[Visit]:
    with visit(browser, server.address) as opened:
        server.wait_for_pages(1)
        opened.wait("() => !document.querySelector('#replay').hidden")
        yield opened
        assert opened.errors == []


def test_playing_pausing_and_speed(server: StandIn, seen: Visit) -> None:
    seen.page.get_by_label("Speed").select_option("5")
    seen.page.get_by_role("button", name="Play").click()
    assert server.wait_for_messages(1) == [{"type": "play", "speed": 5}]
    server.send(position(12.34, is_playing=True, speed=5.0))
    seen.wait("() => document.querySelector('#replay-at').textContent === '00:12.3 of 01:00.0 · 120 entries'")
    assert seen.page.get_by_role("slider").get_attribute("aria-valuetext") == "00:12.3 of 01:00.0"
    seen.page.get_by_label("Speed").select_option("0.5")
    assert server.wait_for_messages(2)[1] == {"type": "play", "speed": 0.5}
    seen.page.locator("#replay").get_by_role("button", name="Pause").click()
    assert server.wait_for_messages(3)[2] == {"type": "pause"}
    assert seen.text("#link-word") == "recorded"
    assert seen.text("#commands-why") == "A recorded run: nothing here moves a robot."
    seen.picture("replay")


def test_the_slider_goes_to_a_time(server: StandIn, seen: Visit) -> None:
    slider = seen.page.get_by_role("slider")
    slider.focus()
    seen.page.keyboard.press("End")
    assert server.wait_for_messages(1) == [{"type": "seek", "time_s": BEGIN_S + 60.0}]
    slider.fill("7.25")
    assert server.wait_for_messages(2)[1] == {"type": "seek", "time_s": BEGIN_S + 7.25}


def test_a_jump_back_takes_back_what_was_later(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(number, time_s=BEGIN_S + number) for number in range(1, 31)]), position(30.0))
    seen.wait("() => document.querySelector('#stream-count').textContent === '30 entries'")
    server.send(position(10.5))
    seen.wait("() => document.querySelector('#stream-count').textContent === '10 entries'")
    # Repeated entries are shown once.
    server.send(events([entry(number, time_s=BEGIN_S + number) for number in range(8, 13)]), position(12.5))
    seen.wait("() => document.querySelector('#stream-count').textContent === '12 entries'")
    found = seen.page.evaluate("() => [...document.querySelectorAll('.row')].map((row) => Number(row.dataset.number))")
    assert sorted(found) == list(range(1, 13))


# Share of the canvas in the browser with a colour of the style sheet, within the change by a line's soft edge.
SHARE = """(name) => {
  const probe = document.createElement("i");
  probe.style.color = `var(--map-${name})`;
  document.body.append(probe);
  const [r, g, b] = getComputedStyle(probe).color.match(/[\\d.]+/g).map(Number);
  probe.remove();
  const canvas = document.querySelector("#map");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let found = 0;
  for (let i = 0; i < data.length; i += 4) {
    found += Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 12;
  }
  return found;
}"""


# A pixel at the soft edge of a letter may be of the same colour.
NO_WALL = f"() => ({SHARE})('wall') < 20"


@pytest.fixture
def placed(browser: Browser) -> Iterator[tuple[StandIn, Visit]]:
    with StandIn([definition(scene=SCENE)]) as server, visit(browser, server.address) as opened:
        server.wait_for_pages(1)
        opened.wait("() => document.querySelectorAll('.card').length === 3")
        yield server, opened
        assert opened.errors == []


def shares(seen: Visit) -> dict[str, int]:
    names = ("wall", "line", "path", "scan", "robot", "ink")
    return {name: seen.page.evaluate(SHARE, name) for name in names}


def test_the_canvas_has_walls_line_way_scan_robot_and_scale(placed: tuple[StandIn, Visit]) -> None:
    server, seen = placed
    seen.wait(f"() => ({SHARE})('wall') > 500")
    before = shares(seen)
    assert before["line"] > 100 and before["ink"] > 50
    assert before["path"] == before["scan"] == before["robot"] == 0
    for i in range(20):
        server.send(update(drive=drive(-0.5 + 0.05 * i, 0.2, 0.0)))
    server.send({"type": "scan", "ranges_m": [0.6 if i % 2 else None for i in range(360)], "pose": [0.45, 0.2, 0.0]})
    seen.wait(f"() => ({SHARE})('scan') > 200")
    after = shares(seen)
    assert after["path"] > 100 and after["robot"] > 20
    seen.wait("() => document.querySelector('#map-text').textContent.includes('Nearest thing 0.60 m away')")


def test_the_keyboard_moves_and_zooms_the_picture(placed: tuple[StandIn, Visit]) -> None:
    server, seen = placed
    seen.wait(f"() => ({SHARE})('wall') > 500")
    fitted = shares(seen)["wall"]
    seen.page.locator("#map").focus()
    for _ in range(6):
        seen.page.keyboard.press("+")
    # The view shows the middle of the room alone.
    seen.wait(NO_WALL)
    seen.page.keyboard.press("0")
    seen.wait(f"() => ({SHARE})('wall') === {fitted}")
    for _ in range(30):
        seen.page.keyboard.press("ArrowLeft")
    seen.wait(NO_WALL)
    seen.page.keyboard.press("f")
    assert seen.page.locator("#map-follow").get_attribute("aria-pressed") == "true"
    server.send(update(drive=drive(2.0, 2.0, 0.0)))
    seen.wait(f"() => ({SHARE})('robot') > 20")


ZOOMED = """async () => {
  const { Viewport } = await import("/page/viewport.js");
  const view = Object.assign(new Viewport(), { width: 400, height: 300 });
  const before = view.toScreen(1, 1);
  view.zoom(2, ...before);
  const after = view.toScreen(1, 1);
  view.fit([[0, 0], [4, 2]]);
  return [before, after, view.toScreen(2, 1)];
}"""


def test_a_wheel_zooms_around_the_pointer_and_a_drag_moves(placed: tuple[StandIn, Visit]) -> None:
    _, seen = placed
    seen.wait(f"() => ({SHARE})('wall') > 500")
    before, after, middle = seen.page.evaluate(ZOOMED)
    assert after == pytest.approx(before)
    assert middle == pytest.approx([200, 150])
    box = seen.page.locator("#map").bounding_box()
    assert box is not None
    seen.page.mouse.move(box["x"] + 20, box["y"] + 20)
    seen.page.mouse.down()
    seen.page.mouse.move(box["x"] + box["width"] - 10, box["y"] + 20, steps=4)
    seen.page.mouse.move(box["x"] + 3 * box["width"], box["y"] + 20, steps=4)
    seen.page.mouse.up()
    seen.wait(NO_WALL)


def test_the_way_is_bounded(placed: tuple[StandIn, Visit]) -> None:
    _, seen = placed
    count, ends = seen.page.evaluate(
        "async () => { const { Path } = await import('/page/path.js'); const path = new Path();"
        " for (let i = 0; i < 100000; i += 1) path.add(i / 100, 0); path.add(0, 0);"
        " return [path.points.length, [path.points[0], path.points.at(-2), path.points.at(-1)]]; }"
    )
    assert count <= 4001
    assert ends == [[0, 0, False], [999.99, 0, True], [0, 0, False]]
