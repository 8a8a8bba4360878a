"""Goals that are being cancelled, in a real browser: played with, and in a log at any of its moments."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.event_log import json_line
from robosc.model.structure import Deployment
from support.browser import visit
from support.execution import Bench, unsupervised
from support.layers import LayerBench
from support.loaders import MODEL
from support.view_servers import view_process


def event(page: Page, name: str) -> Locator:
    return page.locator(f'form[data-event="{name}"]')


@pytest.mark.parametrize(
    ("way", "happens"),
    [
        ("as cancelled", "travel.cancel"),
        ("succeeded in spite of it", "travel.response"),
        ("with an error", "travel.error"),
    ],
)
def test_a_cancel_is_asked_for_and_one_chooses_how_the_goal_ends(browser: Browser, way: str, happens: str) -> None:
    with view_process(MODEL) as (_, url), visit(browser, url) as seen:
        page = seen.page
        travel, ends = page.locator('[data-component="Drive"] .place'), page.locator("#play-ends")
        reach, newest = event(page, "reach.request"), page.locator("#stream-rows .row").last
        expect(travel).to_have_text("idle")
        event(page, "travel.request").locator("button").click()
        expect(travel).to_have_text("executing")
        expect(ends).to_be_hidden()
        # A boolean, which every message has, cannot be unknown.
        pressed = event(page, "stop.response").locator("select")
        assert pressed.locator("option").all_text_contents() == ["false", "true"]
        pressed.select_option("true")
        event(page, "stop.response").locator("button").click()
        # Asking ends nothing: the drive brakes, and the arm waits.
        expect(travel).to_have_text("cancelling")
        expect(newest).to_contain_text("travel; why: a requirement no longer holds")
        expect(ends).to_contain_text("The goal of travel is being cancelled. It ends")
        expect(page.locator('[data-component="Drive"] .card-state')).to_have_text("driving")
        expect(reach.locator("button")).to_have_attribute("aria-disabled", "true")
        expect(reach.locator(".play-why")).to_contain_text("Drive.idle does not hold (Drive is driving)")
        seen.picture("cancelling")
        ends.get_by_role("button", name=way).click()
        expect(page.locator("#stream-rows .row", has_text=happens)).to_have_count(1)
        expect(ends).to_be_hidden()
        expect(page.locator('[data-component="Drive"] .card-state')).to_have_text("idle")
        expect(reach.locator(".play-why")).to_be_hidden()
        page.keyboard.press("Control+z")
        expect(travel).to_have_text("cancelling")
        expect(ends).to_be_visible()
        assert seen.errors == []


def test_a_log_shows_the_goal_as_cancelling_until_it_has_ended(browser: Browser, tmp_path: Path) -> None:
    bench = Bench(InterpretedSystem(unsupervised(MODEL.read_text(encoding="utf-8"))), cancel_timeout_s=1.0)
    bench.tick()
    bench.executor.on_goal_accepted(1)
    bench.receive("/stop", True)
    bench.tick(20)
    bench.executor.on_goal_ended(1, "cancelled")
    log = tmp_path / "run.jsonl"
    # A moment of its own for each entry.
    entries = [{**entry, "time": 1_750_000_000.0 + number} for number, entry in enumerate(bench.log.entries)]
    log.write_text("".join(map(json_line, entries)), encoding="utf-8")
    kinds = [str(entry.get("event", entry["kind"])) for entry in entries]
    with view_process("--log", log, "--model", MODEL) as (_, url), visit(browser, url) as seen:
        seen.wait("() => !document.querySelector('#replay').hidden")
        place = seen.page.locator('[data-component="Drive"] .place')
        slider = seen.page.get_by_role("slider", name="Time in the log")
        for shown, kind in (
            ("executing", "travel.request"),
            ("executing", "stop.response"),
            ("cancelling", "cancelling"),
            ("cancelling", "cancel_overdue"),
            ("idle", "travel.cancel"),
            ("cancelling", "cancel_overdue"),
        ):
            slider.fill(str(kinds.index(kind)))
            expect(place).to_have_text(shown)
        expect(seen.page.locator("#stream-rows")).to_contain_text("cancel_overdue")
        assert seen.errors == []


def test_what_a_layer_holds_back_meanwhile_is_shown_with_the_reason(browser: Browser, tmp_path: Path) -> None:
    text = MODEL.read_text(encoding="utf-8")
    bench = LayerBench(InterpretedSystem(unsupervised(text, Deployment.LAYER)))
    bench.goal("travel", 1, {"order": 3})
    bench.receive("/stop", True)
    bench.call("reach", 2, {"data": True})
    bench.goal("travel", 3, {"order": 3})
    log = tmp_path / "run.jsonl"
    log.write_text("".join(map(json_line, bench.log.entries)), encoding="utf-8")
    words = ("--log", log, "--model", MODEL, "--deployment", "layer")
    with view_process(*words) as (_, url), visit(browser, url) as seen:
        seen.page.get_by_role("slider", name="Time in the log").fill(str(len(bench.log.entries)))
        rows = seen.page.locator("#stream-rows .row", has_text="blocked")
        expect(rows).to_have_count(2)
        expect(rows.first).to_contain_text("/arm/reach; why: not allowed now")
        expect(rows.last).to_contain_text("/travel; why: its last goal may still be under way")
        expect(seen.page.locator('[data-component="Drive"] .place')).to_have_text("cancelling")
        expect(seen.page.locator("#requests-panel")).to_contain_text("Drive.idle does not hold (Drive is driving)")
        seen.picture("blocked")
        assert seen.errors == []
