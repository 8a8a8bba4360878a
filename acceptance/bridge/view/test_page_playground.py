"""A model that is played with, in a real browser: events and data, undo, findings, kept runs, links, new files."""

from pathlib import Path

from playwright.sync_api import Browser, expect

from support.browser import visit
from support.models import EXAMPLES
from support.view_servers import view_process

MODEL = EXAMPLES / "navigation" / "navigation.rscd"
GATE = """robot Gate {
    datatype enum Light from double to { value > 300.0 -> day  default -> night }
    datatype object Seen { people: integer(0..9)  name: string }
    interface seen use Seen from seen_msgs
    component Sensor {
        outgoing message light with identifier: "/light", type: Light
        outgoing message seen with identifier: "/seen", type: Seen links seen
        behaviour {
            variable light: Light = night
            variable people: integer(0..9)
            variable name: string
            on response from light do light := value
            on response from seen do people := value.people, name := value.name
            initial marked state watching { }
        }
    }
    component Gate {
        incoming message open with identifier: "/gate/open", type: none
        incoming message shut with identifier: "/gate/shut", type: integer
        behaviour {
            initial marked state closed { on request to open goto opened }
            state opened { on request to shut goto closed }
        }
    }
    requirement open needs Sensor.light = day
    requirement shut needs Sensor.people = 0
    provide shut with Sensor.people + 1
}
"""


def test_a_model_is_played_with(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "gate.rscd"
    file.write_text(GATE, encoding="utf-8")
    with view_process(file) as (_, url), visit(browser, url, accept_downloads=True) as seen:
        page = seen.page

        def event(name: str) -> str:
            return f'form[data-event="{name}"]'

        opening, told = page.locator(event("open.request")), page.locator("#play-report")
        expect(opening.locator("button")).to_have_attribute("aria-disabled", "true")
        expect(opening.locator(".play-why")).to_contain_text("requirement open needs Sensor.light = day")
        expect(page.locator("#requests-panel")).to_be_hidden()
        # An event that cannot happen does not, however its button is pressed.
        opening.locator("button").click(force=True)
        expect(page.locator("#play-count")).to_have_text("0 events · marked")
        page.locator(event("light.response")).locator("select").select_option("day")
        page.locator(event("light.response")).locator("button").click()
        expect(told).to_have_text("light.response (value = day): Sensor.light = day")
        expect(opening.locator(".play-why")).to_be_hidden()
        opening.locator("button").click()
        expect(page.locator('[data-component="Gate"] .card-state')).to_have_text("opened")
        expect(page.locator("#stream-rows .row")).to_have_count(2)
        # One part of an object is entered, and the other stays unknown.
        page.locator(event("seen.response")).locator("input").first.fill("2")
        page.locator(event("seen.response")).locator("button").click()
        expect(told).to_contain_text("Sensor.name keeps its value, since what it was to take is unknown")
        expect(page.locator(event("shut.request")).locator(".play-why")).to_contain_text("(Sensor.people is 2)")
        page.keyboard.press("Control+z")
        expect(told).to_have_text("taken back: seen.response")
        expect(page.locator("#stream-rows .row")).to_have_count(2)
        page.locator("#play-redo").click()
        expect(told).to_have_text("taken again: seen.response")
        page.reload()
        expect(told).to_have_text("what this page did before is here again")
        expect(page.locator("#stream-rows .row")).to_have_count(4)
        page.locator("#play-finding").click()
        expect(told).to_contain_text("Found:")
        for button, name in (("#play-log", "gate.jsonl"), ("#play-test", "test_gate.py")):
            with page.expect_download() as download:
                page.locator(button).click()
            assert download.value.suggested_filename == name
            download.value.save_as(tmp_path / name)
        assert '"event":"light.response"' in (tmp_path / "gate.jsonl").read_text(encoding="utf-8")
        compile((tmp_path / "test_gate.py").read_text(encoding="utf-8"), "test_gate.py", "exec")
        seen.picture("playground")
        page.locator(event("light.response")).locator("select").select_option("day")
        # The file is saved: what has changed is told, and what was entered stays.
        file.write_text(GATE.replace("needs Sensor.people = 0", "needs Sensor.people < 3"), encoding="utf-8")
        expect(told).to_contain_text("the model has changed")
        expect(page.locator(event("light.response")).locator("select")).to_have_value("day")
        page.locator("#play-link").click()
        expect(told).to_contain_text("the link to this model is")
        link = page.evaluate("location.hash")
        page.locator("#play-restart").click()
        expect(page.locator("#play-count")).to_have_text("0 events · marked")
        file.write_text("robot Other { component C { } }", encoding="utf-8")
        expect(page.locator("#robot")).to_have_text("Other")
        with visit(browser, url + link) as linked:
            expect(linked.page.locator("#robot")).to_have_text("Gate")
            expect(linked.page.locator("#play-report")).to_have_text("Saved: this is the model of the link")
            assert linked.errors == []
        file.write_text("robot Gate {", encoding="utf-8")
        expect(page.locator("#causes")).to_contain_text("this is not what it says: gate.rscd, line 1")
        assert seen.errors == []


def test_an_example_is_played_with_on_a_small_screen(browser: Browser) -> None:
    with view_process(MODEL) as (_, url), visit(browser, url, (400, 900)) as seen:
        seen.page.locator('form[data-event="calibrate.request"] button').click()
        expect(seen.page.locator("#play-report")).to_contain_text("calibrate = waiting")
        assert seen.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        seen.picture("playground-small")
        assert seen.errors == []
