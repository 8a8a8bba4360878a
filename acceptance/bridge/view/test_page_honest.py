"""The page never shows old data as present ones, runs nothing that a robot sends, and loads nothing from elsewhere."""

import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser

from support.browser import Visit, visit
from support.live_view import PAGE, Message, StandIn
from support.view_messages import component, definition, entry, events, graph, taken, update

FRESHNESS_IS = "(word) => document.documentElement.dataset.freshness === word"


@pytest.fixture
def seen(browser: Browser, server: StandIn) -> Iterator[Visit]:
    with visit(browser, server.address) as opened:
        server.wait_for_pages(1)
        opened.wait(FRESHNESS_IS, "live")
        yield opened


def test_a_lost_connection_is_unmistakable_and_ends_by_itself(server: StandIn, seen: Visit) -> None:
    seen.page.get_by_label("Filter components by name").fill("Base")
    # Choices of the reader are made before the robot comes anew.
    seen.wait("() => document.querySelector('#components-count').textContent === '1 of 3'")
    server.away()
    seen.wait(FRESHNESS_IS, "lost")
    banner = seen.page.get_by_role("alert")
    assert banner.inner_text() == "Connection lost: nothing shown here is live."
    seen.wait("() => /^The state below is \\d+ s old\\.$/.test(document.querySelector('#stale-age').textContent)")
    assert seen.text("#link-word") == "no connection"
    assert seen.page.evaluate("() => getComputedStyle(document.querySelector('main')).filter") == "grayscale(1)"

    server.greet([definition(), update(state="standby")])
    server.back()
    seen.wait(FRESHNESS_IS, "live")
    seen.wait("() => document.querySelector('#state-word').textContent === 'standby'")
    assert not banner.is_visible()
    assert seen.page.evaluate("() => getComputedStyle(document.querySelector('main')).filter") == "none"
    # It is the same robot: what the reader has chosen stays. The gap stands in the stream.
    assert seen.page.locator(".card:visible h3").all_inner_texts() == ["Base"]
    assert seen.page.locator(".row-text").all_inner_texts() == [
        "The connection is lost.",
        "The connection is back. What happened meanwhile is not here.",
    ]


def test_a_server_that_falls_silent_is_noticed(server: StandIn, seen: Visit) -> None:
    server.is_beating = False
    seen.wait(FRESHNESS_IS, "silent")
    assert seen.page.get_by_role("alert").inner_text() == "The server is silent: nothing shown here is live."
    server.is_beating = True
    seen.wait(FRESHNESS_IS, "live")


def test_a_loop_that_hangs_is_reported_with_its_age(server: StandIn, seen: Visit) -> None:
    server.send(update(age_s=75.0))
    seen.wait(FRESHNESS_IS, "old")
    assert seen.page.get_by_role("alert").inner_text() == "The bridge's loop hangs: nothing shown here is live."
    age = re.fullmatch(r"The state below is (\d+) s old\.", seen.text("#stale-age"))
    assert age is not None and int(age[1]) >= 75


def test_a_source_that_is_gone_says_why_until_it_is_back(server: StandIn, seen: Visit) -> None:
    server.send({"type": "gone", "why": "the bridge has ended"})
    seen.wait(FRESHNESS_IS, "gone")
    assert seen.page.get_by_role("alert").inner_text() == "The source is lost: the bridge has ended"
    server.send(definition(), update())
    seen.wait(FRESHNESS_IS, "live")


def test_a_source_that_stays_gone_is_noted_once(server: StandIn, seen: Visit) -> None:
    for why in ("the bridge has ended", "the bridge has ended", "it does not answer", "it does not answer"):
        server.send({"type": "gone", "why": why})
    server.send(definition(), update())
    seen.wait("() => document.querySelectorAll('.row').length >= 3")
    seen.wait(FRESHNESS_IS, "live")
    assert seen.page.locator(".row-text").all_inner_texts() == [
        "The source is lost: the bridge has ended",
        "The source is lost: it does not answer",
        "The connection is back. What happened meanwhile is not here.",
    ]


def test_a_request_of_which_nothing_was_reported_is_not_known(server: StandIn, seen: Visit) -> None:
    server.send(update(enabled=["grip.request"], disabled=[{"event": "go.request", "why": ["No."]}]))
    seen.wait("() => document.querySelector('#requests-count').textContent === '1 of 4 enabled, 2 not known'")
    texts = {
        line.get_attribute("data-request"): (
            line.get_attribute("data-enabled"),
            line.locator(".request-word").inner_text(),
        )
        for line in seen.page.locator(".request").all()
    }
    unknown = ("unknown", "? not known")
    assert texts == {
        "grip.request": ("true", "✓ enabled"),
        "move.request": unknown,
        "go.request": ("false", "✕ not now"),
        "dock.request": unknown,
    }
    seen.page.locator("[data-request='dock.request'] summary").click()
    assert seen.text("[data-request='dock.request'] .whys") == "It is not known whether it is enabled."
    server.send(update())
    seen.wait("() => document.querySelector('#requests-count').textContent === '2 of 4 enabled'")


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("bridge", "✓ Nothing keeps the robot from moving."),
        ("ros2", "? This source does not report what keeps the robot from moving."),
        ("log", ""),
    ],
)
def test_only_who_knows_says_that_nothing_keeps_the_robot(
    server: StandIn, seen: Visit, source: str, words: str
) -> None:
    server.send(definition(robot="Another", source=source), update(number=7))
    seen.wait("() => document.querySelector('#robot').textContent === 'Another' && document.querySelector('.chip')")
    assert seen.text("#causes") == words


def test_what_comes_after_a_definition_is_shown_even_if_it_is_as_before(server: StandIn, seen: Visit) -> None:
    server.send(definition(robot="Another"))
    seen.wait("() => document.querySelector('#robot').textContent === 'Another' && !document.querySelector('.chip')")
    server.send(update())
    seen.wait("() => document.querySelectorAll('.chip').length === 2")


LAST = """() => Object.fromEntries([...document.querySelectorAll('.card')].map((card) =>
  [card.dataset.component, card.querySelector('.edge.is-last')?.dataset.id]))"""
LAST_IS = f"""([gripper, base]) => {{
  const last = ({LAST})();
  return last.Gripper == gripper && last.Base == base;
}}"""
BOTH = [taken("Gripper", 1), taken("Base", 10)]


def test_the_last_transition_is_that_of_the_place_in_a_recorded_run(server: StandIn, seen: Visit) -> None:
    server.send(definition(source="log", can_command=False), update(last={}))
    seen.wait("() => document.querySelector('#link-word').textContent === 'recorded'")
    server.send(events([entry(1, transitions=BOTH)]), update(last={"Gripper": 1, "Base": 10}))
    seen.wait(LAST_IS, [1, 10])
    words = "() => document.querySelector('[data-component=Gripper] desc').textContent.includes('Last transition')"
    assert seen.page.evaluate(words)
    # Elsewhere, with entries that were not sent.
    server.send(update(last={"Gripper": 2}))
    seen.wait(LAST_IS, [2, None])
    server.send(update(last={}))
    seen.wait(LAST_IS, [None, None])
    assert not seen.page.evaluate(words)


def test_a_transition_is_the_last_one_as_long_as_that_is_sure(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(1, transitions=BOTH)]))
    seen.wait(LAST_IS, [1, 10])
    server.send(update())
    server.send(events([entry(9, transitions=[taken("Base", 11)])], lost=7))
    seen.wait(LAST_IS, [None, 11])
    server.send(events([entry(10, transitions=BOTH), entry(11, kind="restart", event="")]))
    seen.wait(LAST_IS, [None, None])
    server.send(events([entry(12, transitions=BOTH)]))
    seen.wait(LAST_IS, [1, 10])
    # The same robot again after an interruption.
    server.send(definition(), update())
    seen.wait(LAST_IS, [None, None])


OWN_OF_OBJECTS = ["toString", "constructor", "__proto__", "valueOf", "hasOwnProperty"]


def test_names_that_objects_have_by_themselves_are_names(browser: Browser) -> None:
    parts = [component(name, [], graph(["still"], [])) for name in OWN_OF_OBJECTS]
    services = [
        {"name": name, "component": name, "kind": "service", "identifier": "", "channel": ""} for name in OWN_OF_OBJECTS
    ]
    known = {"communications": {"__proto__": "waiting"}, "components": {"__proto__": {"state": "still"}}}
    greeting: list[Message] = [
        definition(source="constructor", components=parts, communications=services, requests=[]),
        update(enabled=[], disabled=[], last={}, **known),
        events([entry(i, kind=name, event=name) for i, name in enumerate(OWN_OF_OBJECTS)]),
    ]
    with StandIn(greeting) as server, visit(browser, server.address) as seen:
        server.wait_for_pages(1)
        seen.wait("(count) => document.querySelectorAll('.row').length === count", len(OWN_OF_OBJECTS))
        places = ["waiting" if name == "__proto__" else "not known" for name in OWN_OF_OBJECTS]
        states = ["still" if name == "__proto__" else "not known" for name in OWN_OF_OBJECTS]
        assert seen.page.locator(".place").all_text_contents() == places
        assert seen.page.locator(".card-state").all_text_contents() == states
        assert seen.text("#about") == "controller · constructor · 0.1.0"
        assert {row.get_attribute("data-group") for row in seen.page.locator(".row").all()} == {"other"}
        assert set(seen.page.locator(".row-sign").all_text_contents()) == {"·"}
        assert seen.errors == []


def test_what_is_no_message_changes_nothing(server: StandIn, seen: Visit) -> None:
    for text in ("{", "7", "null", "[]", '{"type":"constructor"}', '{"type":"__proto__"}', '{"type":"nothing"}'):
        server.send_text(text)
    server.send(update(state="standby"))
    seen.wait("() => document.querySelector('#state-word').textContent === 'standby'")
    assert seen.errors == []


HOSTILE = [
    "<img src=x onerror=window.wasRun=1>",
    "</title></svg><script>window.wasRun=1</script>",
    "&lt;b&gt; &amp;",
    "{{7*7}} ${window.wasRun=1} javascript:alert(1)",
    "\u202eevil\u202c \u200f \u0645\u0631\u062d\u0628\u0627",
    "🤖🦾 ☠️",
    "x" * 3000,
    "__proto__",
    "constructor",
    "a\"b'c\\d\n\te",
    "\u0000\u001b[2J",
]


def _hostile_robot(names: list[str]) -> list[Any]:
    components = [
        component(name, [], graph([name, f"{name}2"], [(name, f"{name}2", name, "controllable")], first_id=i))
        for i, name in enumerate(names, start=1)
    ]
    communications = [
        {"name": name, "component": name, "kind": "service", "identifier": name, "channel": name} for name in names
    ]
    return [
        definition(
            robot=names[0], version=names[1], components=components, communications=communications, requests=names
        ),
        update(
            state=names[0],
            problem=names[1],
            reasons=[{"code": names[0], "text": name, "holds_until_reset": False} for name in names],
            warnings=[{"code": "", "text": name} for name in names],
            stops=names,
            devices=dict.fromkeys(names, False),
            components={name: {"state": name, "variables": {other: other for other in names}} for name in names},
            communications={name: name for name in names},
            enabled=[],
            disabled=[{"event": name, "why": names} for name in names],
        ),
        events([
            entry(i, kind=name, event=name, text=name, transitions=[taken(name, i)])
            for i, name in enumerate(names, start=1)
        ]),
        {"type": "refused", "what": names[0], "why": names[1]},
    ]  # fmt: skip


@pytest.mark.parametrize("size", [(1400, 900), (360, 700)])
def test_names_of_a_robot_are_text_and_nothing_else(browser: Browser, size: tuple[int, int]) -> None:
    with StandIn(_hostile_robot(HOSTILE)) as server, visit(browser, server.address, size) as seen:
        server.wait_for_pages(1)
        seen.wait("(count) => document.querySelectorAll('.row').length >= count", 6)
        assert seen.page.evaluate("() => window.wasRun") is None
        assert seen.page.locator("img").count() == 1  # the page's own
        assert seen.page.locator("main script, main img, main b").count() == 0
        names = seen.page.evaluate("() => [...document.querySelectorAll('.card h3')].map((it) => it.textContent)")
        # The document has no place for the sign of number zero.
        assert names == HOSTILE
        assert (
            seen.page.evaluate("() => [...document.querySelectorAll('.request-name')].map((it) => it.textContent)")
            == HOSTILE
        )
        assert seen.page.evaluate(
            "() => document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        ), "long names make the page wider than the window"
        seen.picture(f"hostile-{size[0]}")
        assert seen.errors == []


def test_the_page_asks_nobody_but_its_server(server: StandIn, seen: Visit) -> None:
    seen.page.get_by_role("button", name="Theme").click()
    seen.page.reload()
    seen.wait(FRESHNESS_IS, "live")
    assert len(seen.asked) > 20
    assert {urlsplit(address).netloc for address in seen.asked} == {f"127.0.0.1:{server.port}"}
    assert seen.errors == []


def test_no_part_of_the_page_makes_markup_or_code_of_text() -> None:
    for path in PAGE.glob("*.js"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function|DOMParser", text
        )
        assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", text), path.name
    index = (PAGE / "index.html").read_text(encoding="utf-8")
    assert not re.search(r"\son\w+=|style=|<script(?! type=\"module\" src)", index)
    assert "url(" not in (PAGE / "style.css").read_text(encoding="utf-8")
