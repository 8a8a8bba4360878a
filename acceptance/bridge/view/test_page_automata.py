"""Automata that are played with, in a real browser: outcomes, states to begin in, hostile names, files that change."""

from pathlib import Path

from playwright.sync_api import Browser, expect

from support.automata_models import TANK_AND_BELT
from support.browser import visit
from support.view_servers import view_process

SYNTHESIS_MS = 60_000.0
"""Maximum time for a process that synthesizes what was saved, in milliseconds."""

MARKUP = "<img src=x onerror=alert(1)>"
HOSTILE = f"""\
<Generator>
"odd"
<Alphabet> "constructor" +C+ "__proto__" "{MARKUP}" "toString" </Alphabet>
<States> "hasOwnProperty" "{MARKUP}" </States>
<TransRel>
"hasOwnProperty" "constructor" "{MARKUP}"
"{MARKUP}" "{MARKUP}" "hasOwnProperty"
"hasOwnProperty" "__proto__" "hasOwnProperty"
</TransRel>
<InitStates> "hasOwnProperty" </InitStates>
<MarkedStates> "hasOwnProperty" </MarkedStates>
</Generator>
"""


def form_of(name: str) -> str:
    return f'form[data-event="{name}"]'


def test_automata_are_played_with(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "tank.cif"
    file.write_text(TANK_AND_BELT, encoding="utf-8")
    with view_process(file) as (_, url), visit(browser, url) as seen:
        page = seen.page
        told, count = page.locator("#play-report"), page.locator("#play-count")

        def happen(name: str) -> None:
            page.locator(form_of(name)).locator("button").first.click()

        expect(page.locator("#components-title")).to_have_text("Automata")
        expect(page.locator("#about")).to_have_text("automata · model alone")
        expect(page.locator('[data-component="order"] .card-head')).to_contain_text("requirement")
        # A run of automata is not saved: nothing offers that.
        for button in ("#play-log", "#play-test"):
            expect(page.locator(button)).to_be_hidden()
        expect(told).to_contain_text("there are 4 states to begin in, and this begins where tank.level = 0")
        page.locator("#play-beginning").select_option("tank.level = 1")
        page.locator("#play-restart").click()
        expect(told).to_have_text("back in the initial state")
        expect(page.locator('[data-component="tank"] .variables')).to_have_text("level1")
        draining = page.locator(form_of("tank.u_drain"))
        expect(draining.locator("button")).to_have_attribute("aria-disabled", "true")
        expect(draining.locator(".play-why")).to_have_text("tank: tank.level > 1 does not hold (tank.level is 1)")
        # The person chooses one of several outcomes, and the page marks the edge that was taken.
        happen("line.belt.u_go")
        expect(told).to_contain_text("line.belt.u_go can lead to 2 states: choose one beside its button")
        ways = page.locator(form_of("line.belt.u_go")).locator(".play-ways button")
        expect(ways).to_have_text(["line.belt = jam", "line.belt = run"])
        seen.picture("automata-choice")
        ways.first.click()
        expect(page.locator('[data-component="line.belt"] .card-state')).to_have_text("jam")
        expect(page.locator('[data-component="line.belt"] .edge.is-last')).to_have_count(1)
        expect(ways).to_have_count(0)
        # The value of an input variable is entered.
        page.locator(form_of("sensor")).locator("select").select_option("true")
        happen("sensor")
        expect(told).to_have_text("sensor (value = true): sensor.value = true")
        for _ in range(2):
            happen("tank.c_fill")
        filling = page.locator(form_of("tank.c_fill"))
        expect(filling.locator(".play-why")).to_contain_text("the supervisor forbids it")
        page.keyboard.press("Control+z")
        expect(told).to_have_text("taken back: tank.c_fill")
        page.keyboard.press("Control+y")
        expect(count).to_contain_text("4 events")
        page.reload()
        expect(told).to_have_text("what this page did before is here again")
        expect(page.locator("#play-beginning")).to_have_value("tank.level = 1")
        # The page shows the findings of a wrong file, too.
        file.write_text(TANK_AND_BELT.replace("!= 4", "< 3"), encoding="utf-8")
        expect(told).to_contain_text("the supervisor adds to tank.c_fill: tank.level <= 1", timeout=SYNTHESIS_MS)
        expect(page.locator("#play-beginning")).to_have_value("tank.level = 1")
        seen.picture("automata")
        page.locator("#play-finding").click()
        expect(told).to_contain_text("Found: blocked at ")
        page.locator("#play-link").click()
        expect(told).to_contain_text("the link to this model is")
        link = page.evaluate("location.hash")
        assert link.startswith("#model.cif=")
        file.write_text(TANK_AND_BELT.replace("when level > 1 do", "do"), encoding="utf-8")
        expect(page.locator("#causes")).to_contain_text("no supervisor exists", timeout=SYNTHESIS_MS)
        expect(page.locator("#causes")).to_contain_text("to blame")
        file.write_text(TANK_AND_BELT.replace("c_fill do", "c_fil do"), encoding="utf-8")
        expect(page.locator("#causes")).to_contain_text("[cif-unknown-name]", timeout=SYNTHESIS_MS)
        seen.picture("automata-findings")
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        assert seen.errors == []
    gate = tmp_path / "gate.rscd"
    gate.write_text("robot Gate { component C { } }", encoding="utf-8")
    with view_process(gate) as (_, url), visit(browser, url + link) as linked:
        expect(linked.page.locator("#play-report")).to_have_text(
            "Saved: this is the model of the link", timeout=SYNTHESIS_MS
        )
        expect(linked.page.locator("#components-title")).to_have_text("Automata")
        assert linked.errors == []


def test_names_are_never_markup(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "odd.gen"
    file.write_text(HOSTILE, encoding="utf-8")
    with view_process(file) as (_, url), visit(browser, url, (400, 900)) as seen:
        page = seen.page
        constructor = page.locator(form_of("constructor"))
        expect(page.locator(form_of("toString")).locator("button")).to_have_attribute("aria-disabled", "true")
        expect(page.locator(form_of("__proto__")).locator("button")).to_have_attribute("aria-disabled", "false")
        constructor.locator("button").click()
        expect(page.locator("#play-report")).to_have_text(f"constructor: odd = {MARKUP}")
        expect(constructor.locator(".play-why")).to_contain_text("is in <img src=x")
        expect(page.locator(".card-state")).to_have_text(MARKUP)
        page.locator(form_of(MARKUP)).locator("button").click()
        expect(page.locator("#play-count")).to_contain_text("2 events")
        assert page.locator("main img").count() == 0
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        assert seen.errors == []


def test_a_large_system_is_filtered_and_drawn_in_part(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "many.cif"
    ring = "".join(f"location l{place}: edge p0.c_a goto l{(place + 1) % 1500}; " for place in range(1, 1500))
    file.write_text(
        f"plant ring: location l0: initial; marked; edge p0.c_a goto l1; {ring} end\n"
        f"plant twin: location l0: initial; marked; edge p0.c_a goto l1; {ring} end\n"
        + "".join(
            f"plant p{number}: controllable c_a; uncontrollable u_b;\n"
            "location l: initial; marked; edge c_a goto m; location m: edge u_b goto l; end\n"
            for number in range(250)
        ),
        encoding="utf-8",
    )
    with view_process(file) as (_, url), visit(browser, url) as seen:
        page = seen.page
        expect(page.locator(".play-event")).to_have_count(500)
        expect(page.locator('[data-component="ring"]')).to_contain_text("too large to be drawn")
        expect(page.locator('[data-component="p0"]')).to_contain_text("It is not drawn: the automata before it")
        page.locator("#play-filter").fill("p17.")
        expect(page.locator(".play-event:visible")).to_have_count(2)
        page.locator(form_of("p17.c_a")).locator("button").click()
        expect(page.locator("#play-report")).to_have_text("p17.c_a: p17 = m")
        page.locator("#play-walk").click()
        expect(page.locator("#play-report")).to_contain_text("10 events by chance")
        assert seen.errors == []
