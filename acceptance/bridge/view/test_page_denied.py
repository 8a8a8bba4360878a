"""A model that is played against the surroundings, in a real browser: whatever one does, the goal is not reached."""

from pathlib import Path

from playwright.sync_api import Browser, expect

from support.browser import visit
from support.view_servers import view_process

GATE = """robot Gate {
    component Door {
        incoming message open with identifier: "/open", type: none
        outgoing message opened with identifier: "/opened", type: none
        outgoing message stuck with identifier: "/stuck", type: none
        behaviour {
            initial marked state closed { on request to open goto opening }
            state opening { on response from opened goto ajar on response from stuck goto closed }
            marked state ajar { }
        }
    }
    assume Door.opening leads to Door.ajar or Door.closed
    goal once Door.ajar
}
"""


def test_the_surroundings_play_against_a_person(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "gate.rscd"
    file.write_text(GATE, encoding="utf-8")
    with view_process("--counter-strategy", file) as (_, url), visit(browser, url) as seen:
        page = seen.page
        expect(page.locator("#play-denied")).to_contain_text("The surroundings deny goal 1, whatever you do.")
        expect(page.locator("#play-goals li")).to_have_text(["goal once Door.ajar: not yet"])
        for hidden in ("#play-world", "#play-finding", "#play-test", "#play-link"):
            expect(page.locator(hidden)).to_be_hidden()
        outcome = page.locator("#play-report")
        for _ in range(3):
            page.locator('form[data-event="open.request"] button').click()
            expect(outcome).to_contain_text("open.request: Door = opening")
            page.locator("#play-wait").click()
            expect(outcome).to_contain_text("you wait")
            page.locator("#play-wait").click()
            expect(page.locator('[data-component="Door"] .card-state')).to_have_text("closed")
        expect(page.locator("#play-goals li")).to_have_text(["goal once Door.ajar: not yet"])
        expect(page.locator("#play-denied")).to_contain_text("assumption 1 came true")
        page.locator("#play-undo").click()
        expect(outcome).to_have_text("taken back: open.request")
        seen.picture("denied")


ROOM = """robot Courier {
    component Door {
        outgoing message opened with identifier: "/door/opened", type: none
        behaviour { initial marked state shut { on response from opened goto ajar } marked state ajar { } }
    }
    component Bell {
        incoming message ring with identifier: "/ring", type: none
        behaviour { initial marked state still { on request to ring goto rung } marked state rung { } }
    }
    component Base {
        incoming message enter with identifier: "/enter", type: none
        behaviour { initial marked state outside { on request to enter goto inside } marked state inside { } }
    }
    requirement enter needs Door.ajar
    mission delivery { visit Bell.rung then Base.inside }
}
"""


def test_a_mission_is_shown_as_far_as_it_can_be_made(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "room.rscd"
    file.write_text(ROOM, encoding="utf-8")
    with view_process("--counter-strategy", file) as (_, url), visit(browser, url) as seen:
        page = seen.page
        denied, mission = page.locator("#play-denied"), page.locator("#play-goals li")
        expect(denied).to_have_text(
            "The surroundings deny visit 1 of mission delivery; if it comes true, visit 2 of mission delivery."
        )
        expect(mission).to_have_text(["mission delivery: at visit 1, Bell.rung"])
        expect(page.locator("#play-wait")).to_be_visible()
        expect(page.locator("#play-world")).to_be_hidden()
        page.locator('form[data-event="ring.request"] button').click()
        expect(mission).to_have_text(["mission delivery: at visit 2, Base.inside"])
        expect(denied).to_have_text("The surroundings deny visit 2 of mission delivery, whatever you do.")
        page.locator("#play-wait").click()
        expect(mission).to_have_text(["mission delivery: at visit 2, Base.inside"])
        seen.picture("denied-mission")
