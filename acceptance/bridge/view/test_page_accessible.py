"""The page for everybody: roles and names, keyboard, screen readers, contrast, narrow windows, less motion."""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest
from playwright.sync_api import Browser

from support.browser import Visit, visit
from support.live_view import PAGE, TOKEN, StandIn
from support.view_messages import definition, entry, events, progress, taken, update

LEAST_TEXT, LEAST_SHAPE = 4.5, 3.0
"""Ratios of contrast that WCAG 2.2 asks for (1.4.3 and 1.4.11, level AA)."""

LOG = {"begin_s": 1_750_000_000.0, "end_s": 1_750_000_060.0, "count": 100}


@pytest.fixture
def server() -> Iterator[StandIn]:
    with StandIn([definition(log=LOG), update(progress=progress())]) as standing_in:
        yield standing_in


@pytest.fixture
def seen(browser: Browser, server: StandIn) -> Iterator[Visit]:
    with visit(browser, f"{server.address}?token={TOKEN}") as opened:
        server.wait_for_pages(1)
        opened.wait("() => document.querySelectorAll('.card').length === 3")
        opened.wait("() => document.querySelector('#state-word').textContent === 'running'")
        yield opened


COLOUR = re.compile(r"--([\w-]+): light-dark\((#[0-9a-f]{6}), (#[0-9a-f]{6})\);")


def _luminance(colour: str) -> float:
    """Relative luminance, as WCAG 2.2 defines it."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    """Between 1 and 21."""
    darker, lighter = sorted((_luminance(one), _luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)


TEXTS = [
    *((text, ground) for text in ("ink", "quiet", "good", "bad", "warn") for ground in ("ground", "panel", "raised")),
    *((text, ground) for text in ("controllable", "uncontrollable", "silent") for ground in ("panel", "raised")),
    ("accent", "panel"), ("active-ink", "active"), ("stop-ink", "stop"), ("stale-ink", "stale"),
    ("map-ink", "map-canvas"),
]  # fmt: skip
SHAPES = [
    ("control", "panel"), ("control", "ground"), ("active", "panel"), ("focus", "panel"), ("focus", "ground"),
    ("stop", "panel"), ("map-wall", "map-canvas"), ("map-path", "map-canvas"), ("map-scan", "map-canvas"),
    ("map-robot", "map-canvas"),
]  # fmt: skip


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_colours_stand_out(theme: str) -> None:
    found = COLOUR.findall((PAGE / "style.css").read_text(encoding="utf-8"))
    colours = {name: light if theme == "light" else dark for name, light, dark in found}
    faint = [
        f"{text} on {ground}: {contrast(colours[text], colours[ground]):.2f}"
        for pairs, least in ((TEXTS, LEAST_TEXT), (SHAPES, LEAST_SHAPE))
        for text, ground in pairs
        if contrast(colours[text], colours[ground]) < least
    ]
    assert faint == []


def test_black_and_white_is_the_greatest_contrast() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


def test_landmarks_and_headings(seen: Visit) -> None:
    for role in ("banner", "main"):
        assert seen.page.get_by_role(role).count() == 1
    assert seen.page.get_by_role("heading", level=1).all_inner_texts() == ["Carrier"]
    titles = seen.page.get_by_role("heading", level=2).all_inner_texts()
    assert titles == ["Status", "Replay", "Components", "Surroundings", "Goals", "Requests", "Events"]
    assert seen.page.get_by_role("heading", level=3).all_inner_texts() == [
        *("Gripper", "Base", "Sensor", "Assumed of the surroundings")
    ]
    for name in titles:
        assert seen.page.get_by_role("region", name=name, exact=True).count() == 1
    assert seen.page.locator("html").get_attribute("lang") == "en"


# Controls in the browser that have no name for a screen reader.
NAMELESS = """() => [...document.querySelectorAll("button, input, select, summary, a, canvas, [tabindex]")]
  .filter((it) => it.checkVisibility())
  .filter((it) => {
    const by = it.getAttribute("aria-labelledby");
    const named = by ? by.split(" ").map((id) => document.getElementById(id)?.textContent).join("") : "";
    return !(it.getAttribute("aria-label") || named || [...(it.labels ?? [])].map((label) => label.textContent).join("")
      || it.textContent.trim());
  }).map((it) => it.outerHTML)"""


def test_whatever_can_be_operated_has_a_name(seen: Visit) -> None:
    assert seen.page.evaluate(NAMELESS) == []
    assert seen.page.get_by_role("slider", name="Time in the log").count() == 1
    assert seen.page.get_by_role("combobox", name="Speed").count() == 1
    broken = (
        "() => [...document.querySelectorAll('[aria-labelledby], [aria-describedby], [aria-controls]')].flatMap((it) =>"
        " ['aria-labelledby', 'aria-describedby', 'aria-controls'].flatMap((name) =>"
        " (it.getAttribute(name) ?? '').split(' ').filter(Boolean))).filter((id) => !document.getElementById(id))"
    )
    assert seen.page.evaluate(broken) == []
    ids = seen.page.evaluate("() => [...document.querySelectorAll('[id]')].map((it) => it.id)")
    assert len(ids) == len(set(ids))


def test_tab_goes_through_everything_in_the_order_of_the_page(seen: Visit) -> None:
    """And the place of the keyboard is always seen."""
    order: list[Any] = []
    for _ in range(80):
        seen.page.keyboard.press("Tab")
        found = seen.page.evaluate(
            "() => { const it = document.activeElement; const style = getComputedStyle(it);"
            " return it === document.body ? null : [it.id || it.dataset.command || it.ariaLabel || it.tagName,"
            " style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2]; }"
        )
        if found is None or (order and found[0] == order[0][0]):
            break
        order.append(found)
    names = [name for name, _ in order]
    expected = [
        "theme", "stop", "start", "standby", "resume", "reset", "replay-play", "replay-speed", "replay-time",
        "components-filter", "Enlarge the graph of Gripper", "Enlarge the graph of Base", "map-out", "map",
        "requests-filter", "stream-pause", "stream-filter", "stream",
    ]  # fmt: skip
    assert [name for name in names if name in expected] == expected
    assert [name for name, is_seen in order if not is_seen and name != "INPUT"] == []


def test_graph_and_canvas_are_described_in_words(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(1, transitions=[taken("Base", 10)])]))
    picture = seen.page.get_by_role("img", name="Automaton of Base")
    seen.wait("() => document.querySelector('[data-component=Base] desc').textContent.includes('Last transition')")
    described = picture.evaluate("(it) => document.getElementById(it.getAttribute('aria-describedby')).textContent")
    assert (
        described
        == "2 states, 3 transitions. Active state: still. Last transition: move.request, from still to driving."
    )
    table = seen.page.locator("[data-component=Base] table")
    seen.page.locator("[data-component=Base] summary").click()
    assert table.locator("tbody tr").all_inner_texts()[0].split("\t") == [
        "still",
        "move.request",
        "controllable",
        "driving",
    ]
    canvas = seen.page.get_by_role("img", name="Surroundings")
    assert canvas.get_attribute("aria-describedby") == "map-text map-keys"
    seen.wait("() => document.querySelector('#map-text').textContent.includes('x 0.50 m, y 0.25 m, heading 34°')")


def test_a_screen_reader_hears_what_matters_and_no_flood(server: StandIn, seen: Visit) -> None:
    seen.page.evaluate(
        "() => { window.said = []; const polite = document.querySelector('#polite');"
        " new MutationObserver(() => said.push([performance.now(), polite.textContent]))"
        ".observe(polite, {childList: true, characterData: true, subtree: true}); }"
    )
    live = seen.page.locator("[aria-live], [role=status], [role=alert], [role=log]")
    assert sorted(live.evaluate_all("(all) => all.map((it) => it.id)")) == ["large-stale-what", "polite", "stale-what"]
    for number in range(1, 101):
        server.send(events([entry(number)]), update(number=number, state="stopping" if number % 2 else "running"))
    server.send(update(state="fault", problem="a motor is lost"))
    seen.wait("() => said.some(([, words]) => words.includes('State: fault.') && words.includes('a motor is lost'))")
    times_ms = [at_ms for at_ms, _ in seen.page.evaluate("() => said")]
    # However long the hundred messages take: never more than one in one and a half seconds.
    assert all(later - earlier > 1490 for earlier, later in pairwise(times_ms))


# Controls in the browser that are lower than the 24 pixels that WCAG 2.2 asks for (2.5.8).
SMALL = """() => [...document.querySelectorAll("button, select, summary, label, input[type=search]")]
  .filter((it) => it.checkVisibility())
  .filter((it) => it.getBoundingClientRect().height < 23.5)
  .map((it) => it.outerHTML)"""


@pytest.mark.parametrize(
    ("name", "size", "options"),
    [
        ("light", (1720, 1150), {"color_scheme": "light"}),
        ("dark", (1280, 1000), {"color_scheme": "dark"}),
        ("narrow", (360, 780), {"color_scheme": "dark", "has_touch": True}),
        ("narrow-light", (360, 780), {"color_scheme": "light"}),
        ("zoomed", (640, 500), {"color_scheme": "light", "device_scale_factor": 2}),
        ("widest", (2560, 1300), {"color_scheme": "light"}),
    ],
)
def test_every_window_shows_all(browser: Browser, server: StandIn, name: str, size: Any, options: Any) -> None:
    with visit(browser, f"{server.address}?token={TOKEN}", size, **options) as seen:
        server.wait_for_pages(1)
        server.send(events([entry(number, transitions=[taken("Base", 10)]) for number in range(1, 60)]))
        seen.wait("() => document.querySelectorAll('.row').length > 5")
        seen.picture(name)
        assert seen.page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")
        stop = seen.page.get_by_role("button", name="STOP")
        box = stop.bounding_box()
        assert box is not None
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0]
        assert box["y"] >= 0 and box["y"] + box["height"] <= size[1]
        assert box["height"] >= 44
        stop.click()
        assert server.wait_for_messages(1)[-1] == {"type": "stop"}
        assert seen.page.evaluate(SMALL) == []


def test_the_switch_goes_before_the_computer_and_is_kept(browser: Browser, server: StandIn) -> None:
    ground = "() => getComputedStyle(document.body).backgroundColor"
    with visit(browser, server.address, color_scheme="dark") as seen:
        dark = seen.page.evaluate(ground)
        button = seen.page.get_by_role("button", name="Theme: auto")
        button.click()
        light = seen.page.evaluate(ground)
        assert light != dark
        seen.page.reload()
        seen.wait("() => document.querySelector('#theme').textContent === 'Theme: light'")
        assert seen.page.evaluate(ground) == light
        seen.page.get_by_role("button", name="Theme: light").click()
        assert seen.page.evaluate(ground) == dark


# Steps of each light in the browser: the strength of its paint then, and the count of moving elements.
NOTE_MOTION = """() => {
  window.motion = [];
  new MutationObserver(([{ target }]) => {
    motion.push([target.dataset.glow, getComputedStyle(target).strokeOpacity, document.getAnimations().length]);
  }).observe(document.querySelector("#cards"), { subtree: true, attributeFilter: ["data-glow"] });
}"""


def test_who_wants_less_motion_sees_no_fading(browser: Browser, server: StandIn) -> None:
    with visit(browser, server.address, reduced_motion="reduce") as seen:
        server.wait_for_pages(1)
        seen.wait("() => document.querySelectorAll('.card').length === 3")
        seen.page.evaluate(NOTE_MOTION)
        server.send(events([entry(1, transitions=[taken("Base", 10)])]))
        seen.wait("() => motion.length === 7")
        shown = seen.page.evaluate("() => motion")
        assert [step for step, _, _ in shown] == ["6", "5", "4", "3", "2", "1", "0"]
        assert {opacity for _, opacity, _ in shown} == {"0", "1"}
        assert {animations for _, _, animations in shown} == {0}
