"""Page in a real browser: it shows what the server has reported."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser

from robosc.execution.interpreter import InterpretedSystem
from support.browser import Visit, visit
from support.execution import Bench
from support.live_view import StandIn
from support.rounds import rounds_supervisor
from support.view_messages import component, definition, entry, events, graph, progress, taken, update


@pytest.fixture
def server() -> Iterator[StandIn]:
    with StandIn([definition()]) as standing_in:
        yield standing_in


# The page's whole report of the state, in the words of the server.
SHOWN = """() => {
  const text = (element) => element.textContent.trim();
  const components = {};
  for (const card of document.querySelectorAll(".card")) {
    const variables = {};
    for (const line of card.querySelectorAll(".variables > div")) {
      variables[text(line.querySelector("dt"))] = text(line.querySelector("dd"));
    }
    components[card.dataset.component] = {
      state: text(card.querySelector(".card-state")),
      active: [...card.querySelectorAll(".state.is-active")].map((state) => state.dataset.state),
      last: [...card.querySelectorAll(".edge.is-last")].map((edge) => Number(edge.dataset.id)),
      variables,
      places: [...card.querySelectorAll(".place")].map(text),
    };
  }
  return {
    state: text(document.querySelector("#state-word")),
    causes: [...document.querySelectorAll(".cause > span:last-child")].map(text),
    devices: [...document.querySelectorAll("#devices li")].map(text),
    components,
    requests: Object.fromEntries([...document.querySelectorAll(".request")].map((request) => [
      request.dataset.request, [request.dataset.enabled, [...request.querySelectorAll(".whys li")].map(text)]])),
  };
}"""


def shown_when(seen: Visit, condition: str, argument: Any = None) -> Any:
    seen.wait(condition, argument)
    return seen.page.evaluate(SHOWN)


def parts(**states: str) -> Any:
    """Components in states, without variables."""
    return {name: {"state": state, "variables": {}} for name, state in states.items()}


# Brightness of each transition's light in the browser, in its order. A light fades within two seconds: an occasional
# look at the page may miss it.
NOTE_LIGHTS = """() => {
  window.lights = {};
  new MutationObserver((records) => {
    for (const { target } of records) {
      (lights[target.parentElement.dataset.id] ??= []).push(Number(target.dataset.glow));
    }
  }).observe(document.querySelector("#cards"), { subtree: true, attributeFilter: ["data-glow"] });
}"""
STATE_IS = "(word) => document.querySelector('#state-word').textContent === word"


@pytest.mark.smoke
def test_everything_that_an_update_reports_is_shown(server: StandIn, seen: Visit) -> None:
    server.send(update())

    shown = shown_when(seen, STATE_IS, "running")
    assert shown["causes"] == ["Nothing keeps the robot from moving."]
    assert shown["devices"] == ["base works", "scanner works"]
    assert shown["components"] == {
        "Gripper": {"state": "open", "active": ["open"], "last": [], "variables": {}, "places": []},
        "Base": {
            "state": "still", "active": ["still"], "last": [],
            "variables": {"speed": "0.22", "is_loaded": "false"}, "places": ["idle", "waiting"],
        },
        "Sensor": {"state": "", "active": [], "last": [], "variables": {}, "places": []},
    }  # fmt: skip
    assert shown["requests"] == {
        "grip.request": ["true", ["Nothing holds it back."]],
        "move.request": ["true", ["Nothing holds it back."]],
        "go.request": ["false", ["Gripper must be in closed, it is in open."]],
        "dock.request": ["false", ["dock is waiting for its response.", "Base must be in still."]],
    }


def test_why_nothing_moves_stands_there_in_words(server: StandIn, seen: Visit) -> None:
    reason = {"code": "battery_low", "text": "The battery is empty.", "holds_until_reset": True}
    warning = {"code": "scan_noisy", "text": "Many frames of the scanner are damaged."}
    server.send(
        update(
            state="fault",
            problem="a motor is lost",
            reasons=[reason],
            warnings=[warning],
            stops=["/scan is stale."],
            devices={"base": False},
        )
    )

    shown = shown_when(seen, STATE_IS, "fault")
    assert shown["causes"] == [
        "Fault: a motor is lost",
        "Nothing moves: The battery is empty. (until reset)",
        "Nothing is requested: /scan is stale.",
        "Warning: Many frames of the scanner are damaged.",
    ]
    assert shown["devices"] == ["base is not there"]


def test_the_transition_taken_last_is_lit_in_each_component(server: StandIn, seen: Visit) -> None:
    seen.wait("() => document.querySelectorAll('.card').length === 3")
    seen.page.evaluate(NOTE_LIGHTS)
    server.send(
        update(components=parts(Gripper="closing", Base="driving")),
        events(
            [
                entry(1, transitions=[taken("Base", 10)]),
                entry(2, event="grip.request", transitions=[taken("Gripper", 1)]),
                entry(3, transitions=[taken("Base", 12)]),
            ]
        ),
    )

    # Two are marked as the last of their components; all three have been alight, and go out.
    shown = shown_when(seen, "() => document.querySelectorAll('.edge.is-last').length === 2")
    assert shown["components"]["Base"]["last"] == [12]
    assert shown["components"]["Gripper"]["last"] == [1]
    words = str(seen.page.locator("[data-component=Base] desc").text_content())
    assert words.startswith("2 states, 3 transitions. Active state: driving.")
    assert words.endswith("Last transition: move.request, from driving to driving.")
    seen.wait("() => Object.values(lights).filter((steps) => steps.at(-1) === 0).length === 3")
    assert seen.page.evaluate("() => lights") == {id_: [6, 5, 4, 3, 2, 1, 0] for id_ in ("1", "10", "12")}


def test_only_the_latest_of_many_updates_counts(server: StandIn, seen: Visit) -> None:
    states = ["still", "driving"] * 100
    server.send(
        *(
            update(number=i, components={"Base": {"state": state, "variables": {"n": i}}})
            for i, state in enumerate(states)
        )
    )

    shown = shown_when(seen, "() => document.querySelector('[data-component=Base] dd')?.textContent === '199'")
    assert shown["components"]["Base"]["state"] == "driving"
    assert shown["components"]["Base"]["active"] == ["driving"]
    # Its state is not sent any more.
    assert shown["components"]["Gripper"]["state"] == "not known"
    assert shown["components"]["Gripper"]["active"] == []


BOXES = """() => [...document.querySelectorAll(".state")].map((state) => {
  const box = state.querySelector(".state-box").getBBox();
  const isMarked = state.querySelector(".state-inner") !== null;
  return [state.dataset.state, box.x + box.width / 2, box.y + box.height / 2, box.width, box.height, isMarked];
})"""
ENDS = """() => {
  const line = document.querySelector(".edge .edge-line");
  return [0, line.getTotalLength()].map((at) => line.getPointAtLength(at)).map(({ x, y }) => [x, y]);
}"""


def test_a_graph_as_the_layout_has_it(browser: Browser) -> None:
    laid_out = graph(["a", "b"], [("a", "b", "go.request", "controllable")])
    defined = definition(components=[component("C", [], laid_out)], communications=[])
    with StandIn([defined]) as server, visit(browser, server.address) as seen:
        seen.wait("() => document.querySelector('.graph')")
        assert seen.page.evaluate(BOXES) == [
            [state["name"], state["x"], state["y"], state["width"], state["height"], state["is_marked"]]
            for state in laid_out["states"]
        ]
        # The layout goes from middle to middle: what is drawn, from the border of the one box to that of the other.
        for (x, y), state in zip(seen.page.evaluate(ENDS), laid_out["states"], strict=True):
            across, up = abs(x - state["x"]) - state["width"] / 2, abs(y - state["y"]) - state["height"] / 2
            assert max(across, up) == pytest.approx(0.0, abs=0.2)
        assert seen.errors == []


def test_a_graph_that_is_too_large_is_reported(server: StandIn, seen: Visit) -> None:
    note = "() => document.querySelector('[data-component=Sensor] p')?.textContent"
    seen.wait(f"() => ({note})() === 'No behaviour of its own.'")
    server.send(update(components=parts(Sensor="seeing")))
    seen.wait(f"() => ({note})() === 'Its graph is too large to be drawn.'")
    assert seen.text("[data-component=Sensor] .card-state") == "seeing"


def test_components_and_requests_are_narrowed_by_name(server: StandIn, seen: Visit) -> None:
    server.send(update())
    shown_when(seen, STATE_IS, "running")
    seen.page.get_by_label("Filter components by name").fill("GRI")
    assert seen.page.locator(".card:visible h3").all_inner_texts() == ["Gripper"]
    assert seen.text("#components-count") == "1 of 3"
    seen.page.get_by_label("Filter requests by name").fill("dock")
    assert seen.page.locator(".request:visible .request-name").all_inner_texts() == ["dock.request"]


def test_another_robot_takes_the_place_of_the_first(server: StandIn, seen: Visit) -> None:
    server.send(update())
    shown_when(seen, STATE_IS, "running")
    server.send(definition(robot="Other", components=[], communications=[], requests=[]))
    seen.wait("() => document.querySelector('#robot').textContent === 'Other'")
    assert seen.page.locator(".card").count() == 0
    assert seen.text("#state-word") == "not known"
    assert seen.page.title() == "Other – RoboSC live view"
    assert seen.text("#requests-none") == "The model has no requests."


def test_a_graph_in_full_size_goes_on_living(server: StandIn, seen: Visit) -> None:
    server.send(update())
    seen.page.get_by_role("button", name="Enlarge the graph of Base").click()
    seen.page.get_by_role("dialog", name="Base").wait_for()
    server.send(update(components=parts(Base="driving")))
    seen.wait("() => document.querySelector('dialog .state.is-active')?.dataset.state === 'driving'")
    seen.page.get_by_role("button", name="Close").click()
    # A dialog reports that it is closed a moment later.
    seen.page.locator("[data-component=Base] svg.graph").wait_for()
    seen.wait("() => document.activeElement?.getAttribute('aria-label') === 'Enlarge the graph of Base'")


# Goals and assumptions in the browser by name: the state of each, and the words about it.
GOALS = """() => Object.fromEntries([...document.querySelectorAll(".goal")].map((goal) => [
  goal.dataset.name, [goal.dataset.state, goal.lastElementChild.innerText.replace(/\\s+/g, " ").trim()]]))"""


def test_goals_are_shown_with_the_one_that_is_approached(server: StandIn, seen: Visit) -> None:
    server.send(update())
    seen.wait(STATE_IS, "running")
    assert seen.page.locator("#goals").is_hidden()

    server.send(update(progress=progress()))
    seen.wait("() => !document.querySelector('#goals').hidden")
    assert seen.page.evaluate(GOALS) == {
        "goal 1": ["now", "goal 1 now, for 5 s reached once Caller.waiting leads to Base.inside"],
        "goal 2": ["met", "goal 2 true reached 3 times always eventually Base.outside"],
        "assumption 1": ["owed", "assumption 1 has been owed for 4 s Door.opening leads to Door.ajar"],
    }
    assert seen.page.locator("#goals-count").inner_text() == "1 of 2 true"
    assert seen.page.locator("#goals-choice").inner_text() == "The strategy requests open, for goal 1."

    late = {**progress()["assumptions"][0], "unmet_s": 130.0}
    server.send(update(progress=progress(overdue=["assumption 1"], assumptions=[late], chosen=None)))
    seen.wait("() => document.querySelector('.goal[data-state=overdue]') !== null")
    assert seen.page.evaluate(GOALS)["assumption 1"][1].startswith("assumption 1 has been owed for 2 min")
    assert seen.page.locator("#goals-choice").inner_text() == "The strategy waits, for goal 1."
    # A screen reader hears it.
    seen.wait("() => document.querySelector('#polite').textContent.includes('assumption 1 is owed for too long.')")

    server.send(update())
    seen.wait("() => document.querySelector('#goals').hidden")


def test_missions_are_shown_with_the_detour_that_is_under_way(server: StandIn, seen: Visit) -> None:
    """The messages are those of an executor."""
    robot = Bench(InterpretedSystem(rounds_supervisor()))

    def shown(condition: str) -> tuple[str, dict[str, list[str]]]:
        """Send the progress of the robot; return where its mission is, and its visits, once a condition is true."""
        assert robot.executor.progress is not None
        server.send(update(progress=robot.executor.progress.plain()))
        seen.wait(f"() => document.querySelector('.mission p')?.innerText.includes('{condition}')")
        return seen.page.locator(".mission p").inner_text(), seen.page.evaluate(GOALS)

    robot.tick()
    where, visits = shown("not asked for")
    assert where == "not asked for 0 rounds made"
    assert [state for state, _ in visits.values()] == ["unmet"] * 3
    assert seen.page.locator("#goals-count").inner_text() == ""
    assert seen.page.locator("#goals-choice").inner_text() == "No goal or visit is left: nothing is requested."

    robot.receive("/begin")
    robot.tick()
    robot.receive("/call")
    where, visits = shown("detour 1 under way")
    assert where == "at visit 2, Base.office; detour 1 under way, at visit 1, Base.hall 0 rounds made"
    # No tick stands at the visit that waits for the detour.
    assert visits == {
        "visit 1 of mission rounds": ["met", "visit 1 of mission rounds made in this round reached once Base.kitchen"],
        "visit 2 of mission rounds": [
            "unmet",
            "visit 2 of mission rounds after the detour reached 0 times Base.office",
        ],
        "visit 1 of detour 1 of mission rounds": [
            "unmet",
            "visit 1 of detour 1 of mission rounds wanted, for 0 s reached 0 times Base.hall",
        ],
    }
    robot.clock.advance(5.0)
    robot.tick(2)
    where, visits = shown("at visit 1, Base.kitchen")
    assert where == "at visit 1, Base.kitchen 1 round made"
    assert [state for state, _ in visits.values()] == ["unmet", "unmet", "unmet"]
    assert visits["visit 2 of mission rounds"][1] == "visit 2 of mission rounds reached once Base.office"
    robot.tick()
    where, visits = shown("at visit 2, Base.office")
    assert visits["visit 1 of mission rounds"][0] == "met"
