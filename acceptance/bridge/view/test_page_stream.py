"""The event stream in a real browser: whole, in order, bounded, filtered, paused; and a large robot at full speed."""

import json
import time
from typing import Any

from playwright.sync_api import Browser

from support.browser import Visit, visit
from support.live_view import StandIn
from support.view_messages import BEGIN_S, entry, events, many, taken, update

EVENTS_A_S = 50
PARTS = 60


def counted(seen: Visit, words: str) -> None:
    seen.wait("(words) => document.querySelector('#stream-count').textContent === words", words)


def saved(seen: Visit) -> list[Any]:
    """Return the entries that the page has kept, as it saves them."""
    with seen.page.expect_download() as download:
        seen.page.get_by_role("button", name="Save").click()
    return [json.loads(line) for line in download.value.path().read_text(encoding="utf-8").splitlines()]


def rows(seen: Visit) -> list[int]:
    """Numbers of the entries in the rows that are in the document, from top to bottom."""
    found = seen.page.evaluate(
        "() => [...document.querySelectorAll('.row')].map((row) => [row.offsetTop, Number(row.dataset.number)])"
    )
    return [number for _, number in sorted(found)]


def test_every_entry_is_there_once_and_in_order(server: StandIn, seen: Visit) -> None:
    for first in range(1, 1001, 50):
        server.send(events([entry(number) for number in range(first, first + 50)]))

    counted(seen, "1,000 entries")
    assert [item["number"] for item in saved(seen)] == list(range(1, 1001))
    # Few rows are in the document; they are the newest, in their order.
    shown = rows(seen)
    assert shown == list(range(shown[0], 1001))
    assert len(shown) < 100


# Numbers of the rows in the browser's view, once they fill the box; null: the page has not painted yet.
IN_VIEW = """() => {
  const box = document.querySelector("#stream");
  const from = box.scrollTop;
  const to = Math.min(from + box.clientHeight, box.scrollHeight);
  const rows = [...document.querySelectorAll(".row")]
    .filter((row) => row.offsetTop < to && row.offsetTop + row.offsetHeight > from)
    .sort((one, other) => one.offsetTop - other.offsetTop);
  const isFilled = rows.length > 0 && rows[0].offsetTop <= from
    && rows.every((row, i) => i === 0 || row.offsetTop - rows[i - 1].offsetTop <= row.offsetHeight)
    && rows.at(-1).offsetTop + rows.at(-1).offsetHeight >= to;
  return isFilled ? rows.map((row) => Number(row.dataset.number)) : null;
}"""
SCROLL = """(top) => {
  const box = document.querySelector("#stream");
  box.scrollTop = top;
  return [box.scrollTop, box.scrollTop + box.clientHeight >= box.scrollHeight];
}"""


def test_scrolling_shows_all_of_them(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(number) for number in range(1, 301)]))
    counted(seen, "300 entries")
    found: list[int] = []
    top, is_end = 0.0, False
    while not is_end:
        top, is_end = seen.page.evaluate(SCROLL, top)
        shown = seen.found(IN_VIEW)
        assert shown == list(range(shown[0], shown[-1] + 1))
        # Each view begins where the one before it has ended, at the latest.
        assert shown[0] <= (found[-1] + 1 if found else 1)
        found += shown
        top += 250
    assert set(found) == set(range(1, 301))
    assert found[0] == 1
    server.send(events([entry(301)]))
    counted(seen, "301 entries")


def test_lost_entries_are_reported_where_they_are_missing(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(1)]), events([entry(15), entry(16)], lost=13))
    counted(seen, "4 entries")
    assert [item["kind"] for item in saved(seen)] == ["event", "lost", "event", "event"]
    assert seen.text("#stream-lost") == "13 entries were lost on the way: they came too quickly."
    # No filter hides it.
    seen.page.get_by_label("Filter events by text").fill("no such thing")
    counted(seen, "1 entry of 4")
    assert "13 entries were lost" in seen.text(".row")


def test_filters_by_text_and_by_kind(server: StandIn, seen: Visit) -> None:
    server.send(
        events(
            [
                entry(1, event="grip.request"),
                entry(2, event="gripped.response", controllable=False, text="Value 7"),
                entry(3, kind="fault", event="", text="motor lost"),
                entry(4, event="move.request", text="value 8"),
            ]
        )
    )
    counted(seen, "4 entries")
    seen.page.get_by_label("Filter events by text").fill("VALUE")
    counted(seen, "2 entries of 4")
    assert rows(seen) == [2, 4]
    seen.page.get_by_role("checkbox", name="uncontrollable").uncheck()
    counted(seen, "1 entry of 4")
    assert rows(seen) == [4]
    seen.page.get_by_label("Filter events by text").fill("")
    counted(seen, "3 entries of 4")
    seen.page.get_by_role("checkbox", name="fault").uncheck()
    seen.page.get_by_role("checkbox", name="controllable", exact=True).uncheck()
    counted(seen, "0 entries of 4")
    # Later entries are filtered, too.
    server.send(events([entry(5), entry(6, controllable=False), entry(7, kind="stop", event="", text="a signal")]))
    counted(seen, "1 entry of 7")
    assert rows(seen) == [7]


def test_a_pause_goes_on_collecting(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(1), entry(2)]))
    counted(seen, "2 entries")
    seen.page.get_by_role("button", name="Pause").click()
    server.send(events([entry(number) for number in range(3, 103)]))
    button = seen.page.locator("#stream-pause")
    seen.wait("() => document.querySelector('#stream-pause').textContent === 'Go on (100 new)'")
    assert rows(seen) == [1, 2]
    assert button.get_attribute("aria-pressed") == "true"
    button.click()
    counted(seen, "102 entries")
    assert rows(seen)[-1] == 102
    assert [item["number"] for item in saved(seen)] == list(range(1, 103))


def test_memory_is_bounded_and_what_goes_is_reported(server: StandIn, seen: Visit) -> None:
    for first in range(1, 23_001, 1000):
        server.send(events([entry(number) for number in range(first, first + 1000)]))
    seen.wait("() => document.querySelector('#stream-lost').textContent.includes('not kept any more')")
    seen.wait("() => [...document.querySelectorAll('.row')].some((row) => row.dataset.number === '23000')")
    kept = [item["number"] for item in saved(seen)]
    assert kept == list(range(kept[0], 23_001))
    assert 20_000 <= len(kept) <= 21_000
    assert f"The oldest {kept[0] - 1:,} entries are not kept any more." in seen.text("#stream-lost")


def test_the_keyboard_goes_through_the_stream(server: StandIn, seen: Visit) -> None:
    server.send(events([entry(number, text=f"text {number}") for number in range(1, 201)]))
    counted(seen, "200 entries")
    box = seen.page.get_by_role("listbox", name="Events")
    box.focus()
    seen.page.keyboard.press("Home")
    seen.wait("() => document.querySelector('#stream-detail').textContent.includes('text 1')")
    for _ in range(3):
        seen.page.keyboard.press("ArrowDown")
    seen.wait("() => document.querySelector('#stream-detail').textContent.endsWith('text 4')")
    seen.wait(
        "() => document.getElementById(document.querySelector('#stream').getAttribute('aria-activedescendant'))"
        "?.getAttribute('aria-posinset') === '4'"
    )
    seen.page.keyboard.press("End")
    seen.wait("() => document.querySelector('#stream-detail').textContent.endsWith('text 200')")


# Number of changes of the document in the browser for the cards of the components.
COUNT_CHANGES = """() => {
  window.changes = 0;
  const observer = new MutationObserver((records) => { window.changes += records.length; });
  const everything = { subtree: true, childList: true, characterData: true, attributes: true };
  observer.observe(document.querySelector("#cards"), everything);
}"""
MOST_CHANGES = 16
"""Maximum number of changes for one event.

The state in words, two boxes, two lines and their labels, the description, the steps of a light.
"""


def test_sixty_components_at_fifty_events_a_second(browser: Browser) -> None:
    """No entry is left out, the last state is shown at the end, and no event costs more than what it has changed."""
    defined = many(PARTS)
    count = 4 * EVENTS_A_S
    busy = [False] * PARTS
    with StandIn([defined, update(components=_state_of(busy))]) as server, visit(browser, server.address) as seen:
        server.wait_for_pages(1)
        seen.wait("(count) => document.querySelectorAll('.state.is-active').length === count", PARTS)
        seen.page.evaluate(COUNT_CHANGES)
        begin_s = time.monotonic()
        for number in range(1, count + 1):
            part = (number * 7) % PARTS
            busy[part] = not busy[part]
            name, edge = f"Part{part}", 2 * part + (1 if busy[part] else 2)
            server.send(
                events([entry(number, event=f"event{number}", transitions=[taken(name, edge)])]),
                update(number=number, components=_state_of(busy), time_s=BEGIN_S + number),
            )
            time.sleep(max(begin_s + number / EVENTS_A_S - time.monotonic(), 0.0))

        counted(seen, f"{count} entries")
        assert [item["event"] for item in saved(seen)] == [f"event{number}" for number in range(1, count + 1)]
        states = "() => [...document.querySelectorAll('.card-state')].map((state) => state.textContent)"
        active = "() => [...document.querySelectorAll('.state.is-active')].map((state) => state.dataset.state)"
        expected = ["busy" if is_busy else "idle" for is_busy in busy]
        # The last update comes after the last event, and is perhaps painted in another frame.
        wanted = json.dumps(expected, separators=(",", ":"))
        for shown in (states, active):
            seen.wait(f"(wanted) => JSON.stringify(({shown})()) === wanted", wanted)
        last = "() => [...document.querySelectorAll('.edge.is-last')].map((edge) => Number(edge.dataset.id))"
        assert sorted(seen.page.evaluate(last)) == [2 * i + (1 if expected[i] == "busy" else 2) for i in range(PARTS)]
        assert 0 < seen.page.evaluate("() => window.changes") <= MOST_CHANGES * count
        assert seen.errors == []


def _state_of(busy: list[bool]) -> Any:
    return {
        f"Part{i}": {"state": "busy" if is_busy else "idle", "variables": {"count": i}}
        for i, is_busy in enumerate(busy)
    }
