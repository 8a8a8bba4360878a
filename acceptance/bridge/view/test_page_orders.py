"""The stop button and the commands: what is sent, and what the page says became of it."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from support.browser import Visit, visit
from support.live_view import TOKEN, StandIn
from support.view_messages import definition, update

ANSWER_IS = "(words) => document.querySelector('#stop-answer').textContent === words"
STOPPED = {"code": "operator_stop", "text": "An operator has stopped the robot.", "holds_until_reset": True}


@pytest.fixture
def seen(browser: Browser, server: StandIn) -> Iterator[Visit]:
    with visit(browser, server.address) as opened:
        server.wait_for_pages(1)
        yield opened


def test_stop_needs_no_token_and_says_that_it_was_heard(server: StandIn, seen: Visit) -> None:
    button = seen.page.get_by_role("button", name="STOP")
    button.click()
    assert server.wait_for_messages(1) == [{"type": "stop"}]
    server.send(update(reasons=[STOPPED]))
    seen.wait(ANSWER_IS, "STOP was heard: the robot is stopped by an operator.")
    assert not seen.page.locator("#commands").is_visible()
    assert "token" in seen.text("#commands-why")


@pytest.mark.parametrize("focus", ["body", "#stream-filter", "#map", "#stream", "dialog"])
def test_escape_stops_wherever_the_keyboard_is(server: StandIn, seen: Visit, focus: str) -> None:
    seen.wait("() => !document.querySelector('#stop').hidden")
    if focus == "dialog":
        seen.page.get_by_role("button", name="Enlarge the graph of Base").click()
    elif focus != "body":
        # An element that is not shown yet cannot have the keyboard.
        seen.page.locator(focus).wait_for()
        seen.page.locator(focus).focus()
        assert seen.page.evaluate("(wanted) => document.activeElement.matches(wanted)", focus)
    seen.page.keyboard.press("Escape")
    assert server.wait_for_messages(1) == [{"type": "stop"}]
    server.send({"type": "done", "what": "stop"})
    seen.wait(ANSWER_IS, "STOP was heard.")


@pytest.mark.parametrize("size", [(1400, 900), (360, 700)])
def test_a_graph_in_full_size_leaves_the_stop_and_the_age_in_reach(
    browser: Browser, server: StandIn, size: tuple[int, int]
) -> None:
    with visit(browser, server.address, size) as seen:
        server.wait_for_pages(1)
        seen.page.get_by_role("button", name="Enlarge the graph of Base").click()
        dialog = seen.page.get_by_role("dialog", name="Base")
        # A user who opens it by the keyboard does not stop the robot with the next press.
        assert seen.page.evaluate("() => document.activeElement.id") == "large-close"
        # Clicked as a person does: what covers it would be hit instead.
        dialog.get_by_role("button", name="STOP").click()
        assert server.wait_for_messages(1) == [{"type": "stop"}]
        server.send({"type": "done", "what": "stop"})
        seen.wait("() => document.querySelector('#large-answer').textContent === 'STOP was heard.'")
        # A screen reader says it, too: what the dialog covers it does not read.
        seen.wait("() => document.querySelector('dialog #polite').textContent.includes('STOP was heard.')")
        server.away()
        seen.wait("() => document.documentElement.dataset.freshness === 'lost'")
        assert dialog.get_by_role("alert").inner_text() == "Connection lost: nothing shown here is live."
        assert "old" in seen.text("#large-stale-age")
        colours = "() => getComputedStyle(document.querySelector('#large-body')).filter"
        assert seen.page.evaluate(colours) == "grayscale(1)"
        seen.picture(f"large-lost-{size[0]}")
        dialog.get_by_role("button", name="STOP").click()
        seen.wait("() => document.querySelector('#large-answer').textContent.startsWith('STOP was NOT sent')")
        server.back()
        assert server.wait_for_messages(2)[1] == {"type": "stop"}
        seen.wait("() => document.documentElement.dataset.freshness === 'live'")
        assert seen.page.evaluate(colours) == "none"
        assert not dialog.get_by_role("alert").is_visible()
        dialog.get_by_role("button", name="Close").click()
        seen.wait("() => document.querySelector('#polite').parentNode === document.body")
        assert seen.page.get_by_role("button", name="STOP").is_visible()
        # The browser noted the time without a server, and nothing else went wrong.
        assert all("ERR_CONNECTION_REFUSED" in error for error in seen.errors)


def test_another_robot_closes_the_graph_in_full_size(server: StandIn, seen: Visit) -> None:
    seen.page.get_by_role("button", name="Enlarge the graph of Base").click()
    dialog = seen.page.get_by_role("dialog", name="Base")
    assert dialog.is_visible()
    server.send(definition(robot="Another"), update())
    seen.wait("() => document.querySelector('#robot').textContent === 'Another'")
    seen.wait("() => !document.querySelector('dialog').open")
    # The graph of the new robot lives.
    seen.page.get_by_role("button", name="Enlarge the graph of Base").click()
    server.send(update(components={"Base": {"state": "driving", "variables": {}}}))
    seen.wait("() => document.querySelector('dialog .state.is-active')?.dataset.state === 'driving'")
    assert seen.errors == []


def test_a_stop_that_nobody_confirms_is_reported(server: StandIn, seen: Visit) -> None:
    seen.page.get_by_role("button", name="STOP").click()
    server.wait_for_messages(1)
    seen.wait(ANSWER_IS, "STOP was not confirmed within 2 s. Use the switch on the robot.")
    server.send({"type": "done", "what": "stop"})
    seen.wait(ANSWER_IS, "STOP was heard.")


def test_a_stop_without_a_connection_is_reported_and_sent_later(server: StandIn, seen: Visit) -> None:
    seen.wait("() => !document.querySelector('#stop').hidden")
    server.away()
    seen.wait("() => document.documentElement.dataset.freshness === 'lost'")
    seen.page.get_by_role("button", name="STOP").click()
    seen.wait("() => document.querySelector('#stop-answer').textContent.startsWith('STOP was NOT sent')")
    assert server.received == []
    server.back()
    assert server.wait_for_messages(1) == [{"type": "stop"}]


def test_commands_carry_the_token_and_are_answered(browser: Browser, server: StandIn) -> None:
    with visit(browser, f"{server.address}?token={TOKEN}") as seen:
        for i, command in enumerate(("start", "standby", "resume", "reset")):
            seen.page.get_by_role("button", name=command.capitalize(), exact=True).click()
            heard = server.wait_for_messages(i + 1)
            assert heard[-1] == {"type": "command", "command": command, "token": TOKEN}
            server.send({"type": "done", "what": command})
            seen.wait(ANSWER_IS, f"{command}: done.")
        seen.page.get_by_role("button", name="Start", exact=True).click()
        server.wait_for_messages(5)
        server.send({"type": "refused", "what": "start", "why": "The scanner is not there."})
        seen.wait(ANSWER_IS, "start: refused. The scanner is not there.")


def test_the_token_leaves_the_address_and_outlives_a_reload(browser: Browser, server: StandIn) -> None:
    with visit(browser, f"{server.address}?token={TOKEN}") as seen:
        seen.wait("() => !document.querySelector('#commands').hidden")
        assert seen.page.url == server.address
        seen.page.reload()
        seen.page.get_by_role("button", name="Reset", exact=True).click()
        heard = server.wait_for_messages(1)
        assert heard[0]["token"] == TOKEN


def test_who_can_only_watch_is_offered_nothing(browser: Browser) -> None:
    with (
        StandIn([definition(can_command=False), update()]) as server,
        visit(browser, f"{server.address}?token={TOKEN}") as seen,
    ):
        seen.wait("() => document.querySelector('#robot').textContent === 'Carrier'")
        assert not seen.page.get_by_role("button", name="STOP").is_visible()
        assert not seen.page.locator("#commands").is_visible()
        assert seen.text("#commands-why") == "This view only watches: it can neither stop nor command the robot."
        seen.page.keyboard.press("Escape")
        seen.page.evaluate("() => new Promise((done) => setTimeout(done, 100))")
        assert server.received == []
