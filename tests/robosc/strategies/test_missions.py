"""Missions and preferences by hand: what strategies do for them, in words and in runs, and what is found about them."""

import json

import msgspec
import pytest

import robosc
from robosc.automata import ExecutableSystem, to_automata
from robosc.cli.simulate import mission_json
from robosc.cli.simulation_steps import state_lines, step_lines
from robosc.conditions.summary import strategy_lines, summary_json
from robosc.controller_properties import check_strategy
from robosc.errors import Diagnostic
from robosc.execution.interpreter import InterpretedSystem
from robosc.model.places import Places
from robosc.model.structure import Deployment, Model, Preference
from robosc.source import Location
from robosc.strategies import goal_findings, layer_goal_findings, put_off_findings
from robosc.strategies.preferences import preferred_order
from robosc.supervisor import Supervisor
from robosc.synthesis import synthesize
from support.execution import Bench
from support.missions import courier, strategic, strategy_result
from support.models import model_of


def robot(*visits: str, asked: bool = False, detour: bool = False, prefer: tuple[str, str] | None = None) -> Model:
    """Return the robot with a mission to places, in their order.

    Args:
        visits: The places.
        asked: True if it is asked for only while the operator works.
        detour: True if it has a detour to the office on each call.
        prefer: Communication that is preferred, and the one that it is preferred to.
    """
    places = " then ".join(f"Base.{item}" for item in visits)
    condition = " while Operator.working" if asked else ""
    call = " on Caller.waiting from anywhere visit Base.office" if detour else ""
    preference = "" if prefer is None else f"prefer {' over '.join(prefer)}"
    return model_of(courier(f"mission rounds{condition} {{ visit {places}{call} }}", preference))


def sent(bench: Bench, periods: int) -> list[str]:
    """Return the messages that are published in some periods."""
    before = len(bench.middleware.sent)
    for _ in range(periods):
        bench.executor.tick()
    return [name for kind, name, *_ in bench.middleware.sent[before:] if kind == "publish"]


def bench_of(model: Model) -> Bench:
    return Bench(InterpretedSystem(strategic(model)))


def test_visits_are_made_in_their_order_round_after_round() -> None:
    bench = bench_of(robot("kitchen", "office", "dock"))
    assert sent(bench, 7) == ["to_kitchen", "to_office", "charge", "to_kitchen", "to_office", "charge", "to_kitchen"]
    bench = bench_of(robot("office", "kitchen"))
    assert sent(bench, 5) == ["to_office", "to_kitchen", "to_office", "to_kitchen", "to_office"]


def test_a_mission_may_have_many_visits() -> None:
    bench = bench_of(robot(*("kitchen", "office", "dock", "office") * 3))
    assert sent(bench, 14) == [*("to_kitchen", "to_office", "charge", "to_office") * 3, "to_kitchen", "to_office"]


def test_a_message_chooses_when_a_mission_is_asked_for_and_it_begins_anew() -> None:
    bench = bench_of(robot("kitchen", "office", "dock", asked=True))
    assert sent(bench, 3) == []
    bench.executor.receive("/begin", None)
    assert sent(bench, 2) == ["to_kitchen", "to_office"]
    bench.executor.receive("/rest", None)
    assert sent(bench, 3) == []
    bench.executor.receive("/begin", None)
    assert sent(bench, 2) == ["to_kitchen", "to_office"]


def test_a_detour_comes_first_and_then_the_mission_goes_on_where_it_was() -> None:
    bench = bench_of(robot("kitchen", "dock", detour=True))
    assert sent(bench, 3) == ["to_kitchen", "charge", "to_kitchen"]
    bench.executor.receive("/call", None)
    assert sent(bench, 3) == ["to_office", "charge", "to_kitchen"]


SPINNER = """robot Spinner {
    component Base {
        incoming message go with identifier: "/go", type: none
        incoming message spin with identifier: "/spin", type: none
        incoming message halt with identifier: "/halt", type: none
        outgoing message fog with identifier: "/fog", type: boolean
        behaviour {
            variable foggy: boolean
            on response from fog do foggy := value
            initial marked state still { on request to go goto driving on request to spin goto spinning }
            marked state driving { on request to halt goto still }
            marked state spinning { on request to halt goto still }
        }
    }
    requirement go needs !Base.foggy
    assume always eventually !Base.foggy
    mission patrol {
        visit Base.driving then Base.still
        on Base.spinning and Base.foggy from anywhere visit Base.still
    }
}"""


def test_no_request_is_made_to_begin_a_detour_instead_of_a_visit() -> None:
    model = model_of(SPINNER)
    assert strategy_result(model).unneeded == ()
    bench = bench_of(model)
    bench.executor.receive("/fog", True)
    assert sent(bench, 5) == []
    bench.executor.receive("/fog", False)
    assert sent(bench, 3) == ["go", "halt", "go"]


def test_a_detour_is_begun_where_the_way_to_a_visit_leads_through_it() -> None:
    text = """robot House {
        component Base {
            incoming message forth with identifier: "/forth", type: none
            incoming message back with identifier: "/back", type: none
            behaviour {
                initial marked state dock { on request to forth goto hall }
                marked state hall { on request to forth goto kitchen on request to back goto dock }
                marked state kitchen { on request to back goto hall }
            }
        }
        component Light {
            incoming message light with identifier: "/light", type: none
            behaviour {
                initial marked state dark { on request to light goto bright }
                marked state bright { on request to back goto dark }
            }
        }
        requirement light needs Base.hall
        mission rounds {
            visit Base.kitchen then Base.dock
            on Base.hall and Light.dark from anywhere visit Light.bright
        }
    }"""
    bench = bench_of(model_of(text))
    assert sent(bench, 8) == ["forth", "light", "forth", "back", "light", "back", "forth", "light"]
    assert findings(model_of(text)) == ()
    # Without the requirement no detour is needed.
    bench = bench_of(model_of(text.replace("requirement light needs Base.hall", "")))
    assert sent(bench, 3) == ["light", "forth", "forth"]


def test_a_visit_is_not_put_off_until_its_mission_is_not_asked_for_any_more() -> None:
    """The surroundings end each mission sooner or later; until then, it is made."""
    text = courier(
        "mission rounds while Operator.working { visit Base.kitchen then Base.office }",
        "mission waiting while Operator.resting { visit Base.dock then Base.kitchen }",
        "assume always eventually Operator.working",
    )
    bench = bench_of(model_of(text))
    assert sent(bench, 3) == ["to_kitchen", "charge", "to_kitchen"]
    bench.executor.receive("/begin", None)
    assert sent(bench, 2) == ["to_office", "to_kitchen"]


def test_what_the_surroundings_may_fail_at_is_tried_again() -> None:
    """The robot could wait for the assumption, which fails for as long as it does not ask."""
    text = """robot Gripping {
        component Gripper {
            incoming message grip with identifier: "/grip", type: none
            incoming message release with identifier: "/release", type: none
            outgoing message held with identifier: "/held", type: none
            outgoing message missed with identifier: "/missed", type: none
            behaviour {
                initial marked state open { on request to grip goto closing }
                state closing { on response from held goto holding on response from missed goto open }
                marked state holding { on request to release goto open }
            }
        }
        goal always eventually Gripper.holding
        goal always eventually Gripper.open
        assume allow Gripper.closing leads to Gripper.holding
    }"""
    bench = bench_of(model_of(text))
    assert sent(bench, 2) == ["grip"]
    for _ in range(3):
        bench.executor.receive("/missed", None)
        assert sent(bench, 2) == ["grip"]
    bench.executor.receive("/held", None)
    assert sent(bench, 2) == ["release", "grip"]


FLIGHT = """robot Drone {
    interface trigger use Trigger from std_srvs
    component Battery {
        outgoing message voltage with identifier: "/voltage", type: boolean
        behaviour {
            variable low: boolean
            on response from voltage do low := value
            initial marked state measured { }
        }
    }
    component Flight {
        service arm with identifier: "/arm", request: none, response: none links trigger
        service take_off with identifier: "/take_off", request: none, response: none links trigger
        incoming message survey with identifier: "/survey", type: none
        incoming message land with identifier: "/land", type: none
        behaviour {
            initial marked state grounded { on request to arm goto arming }
            state arming { on response from arm goto armed on error from arm goto grounded }
            state armed { on request to take_off goto climbing }
            state climbing { on response from take_off goto flying on error from take_off goto armed }
            state flying { on request to survey goto surveying }
            state surveying { on request to land goto grounded }
        }
    }
    requirement take_off needs !Battery.low
    assume always eventually !Battery.low
    assume allow Flight.arming leads to Flight.armed
    assume allow Flight.climbing leads to Flight.flying
    §
}"""


@pytest.mark.parametrize(
    "aim",
    [
        "goal always eventually Flight.surveying",
        "goal once Flight.surveying",
        "mission m { visit Flight.surveying then Flight.grounded }",
        "mission m { visit Flight.surveying on Battery.low from anywhere visit Flight.surveying }",
    ],
)
def test_what_may_fail_is_tried_again_though_more_has_to_follow(aim: str) -> None:
    """Success leads to a state farther from the goal than waiting for it would be."""
    bench = bench_of(model_of(FLIGHT.replace("§", aim)))

    def calls(service: str) -> list[int]:
        return [number for kind, name, number, *_ in bench.tick(3) if kind == "call" and name == service]

    for service in ("arm", "take_off"):
        for _ in range(3):
            [call] = calls(service)
            bench.executor.on_call_failed(call, "it failed")
        bench.receive("/voltage", data=True)
        waiting = calls(service)
        bench.receive("/voltage", data=False)
        [call] = waiting or calls(service)
        assert bool(waiting) is (service == "arm")
        bench.executor.on_reply(call, None)
    assert sent(bench, 1) == ["survey"]


def test_luck_is_not_waited_for_where_the_robot_can_help() -> None:
    """An empty battery excuses it for as long as it is not at its dock, and somebody may carry it away."""
    text = """robot Sweeper {
        component Base {
            incoming message home with identifier: "/home", type: none
            outgoing message at_dock with identifier: "/at_dock", type: none
            incoming message present with identifier: "/present", type: none
            outgoing message carried with identifier: "/carried", type: none
            behaviour {
                initial state away { on request to home goto homing on response from carried goto held }
                marked state held { on request to home goto homing }
                state homing { on response from at_dock goto docked }
                state docked { on request to present goto ready }
                marked state ready { }
            }
        }
        component Battery {
            outgoing message charge with identifier: "/charge", type: boolean
            behaviour {
                variable full: boolean
                on response from charge do full := value and (full or Base.docked)
                initial marked state measured { }
            }
        }
        goal always eventually Base.ready or Base.held
        assume Base.homing leads to Base.docked
        assume allow always eventually Battery.full
    }"""
    bench = bench_of(model_of(text))
    assert sent(bench, 3) == ["home"]
    bench.receive("/at_dock")
    assert sent(bench, 3) == ["present"]


def test_of_requests_that_lead_nearer_the_preferred_one_is_chosen() -> None:
    ways = """robot Ways {
        component Base {
            incoming message left with identifier: "/left", type: none
            incoming message middle with identifier: "/middle", type: none
            incoming message right with identifier: "/right", type: none
            incoming message back with identifier: "/back", type: none
            behaviour {
                initial marked state out {
                    on request to left goto home on request to middle on request to right goto home
                }
                marked state home { on request to back goto out }
            }
        }
        §
    }"""

    def way(*preferences: str) -> list[str]:
        mission = "mission m { visit Base.home then Base.out }"
        return sent(bench_of(model_of(ways.replace("§", "\n".join((mission, *preferences))))), 2)

    assert way() == ["left", "back"]
    assert way("prefer right over left") == ["right", "back"]
    # A request that leads nowhere is not chosen, however much it is preferred.
    assert way("prefer middle over { left, right }") == ["left", "back"]


def test_preferences_refine_the_order_of_the_source() -> None:
    requests = [f"{name}.request" for name in "abcd"]

    def order(*preferences: tuple[str, str]) -> str:
        items = [Preference(tuple(first), tuple(second)) for first, second in preferences]
        return "".join(event[0] for event in preferred_order(requests, items))

    assert order() == "abcd"
    assert order(("c", "a")) == "bcad"
    assert order(("d", "abc")) == "dabc"
    assert order(("cd", "ab")) == "cdab"
    assert order(("b", "a"), ("d", "b")) == "cdba"
    with pytest.raises(ValueError, match=r"the preferences of a\.request, b\.request contradict each other"):
        order(("b", "a"), ("a", "b"))


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    return strategic(robot("kitchen", "dock", asked=True, detour=True, prefer=("to_office", "to_kitchen")))


def test_strategies_are_told_visit_by_visit(supervisor: Supervisor) -> None:
    assert "a strategy for 3 visits" in repr(supervisor)
    lines = strategy_lines(supervisor)
    assert lines[0] == "the strategy approaches its visits in turn; it requests the first that applies"
    assert [line for line in lines if line.startswith("  for ")] == [
        "  for visit 1 of mission rounds, Base.kitchen",
        "  for visit 2 of mission rounds, Base.dock",
        "  for visit 1 of detour 1 of mission rounds, Base.office",
    ]
    found = json.loads(json.dumps(summary_json(supervisor)))["goals"]
    assert [(item["name"], item["goal"]) for item in found][:2] == [
        ("visit 1 of mission rounds", "Base.kitchen"),
        ("visit 2 of mission rounds", "Base.dock"),
    ]
    # Each goal and each visit has a mode.
    assert check_strategy(supervisor.executable, supervisor.added, supervisor.strategy).result == "passed"  # type: ignore[arg-type]


def test_python_shows_visits(supervisor: Supervisor) -> None:
    made = robosc.Supervisor.of(supervisor, None)
    assert repr(made.goals) == "<3 visits>"
    assert str(made.goals[1]).splitlines()[0] == "visit 2 of mission rounds, Base.dock:"
    assert made.goals[1].is_visit and "visit 2 of mission rounds" in made.goals._repr_html_()


def test_a_run_shows_how_far_missions_are(supervisor: Supervisor) -> None:
    run = robosc.simulate(supervisor)
    assert [line for line in state_lines(run) if line.startswith(("goals", "mission"))] == [
        "mission   rounds: not asked for"
    ]
    run.step("begin.response")
    assert (str(run.missions[0]), run.chosen) == ("rounds: at visit 1, Base.kitchen", "to_kitchen.request")
    before = run.state
    step = run.step("to_kitchen.request")
    assert step.visits == ("visit 1 of mission rounds",)
    assert step_lines(2, step, before)[-1] == "      reached: visit 1 of mission rounds"
    run.step("call.response")
    text = "rounds: at visit 2, Base.dock; detour 1 under way, at visit 1, Base.office"
    assert f"mission   {text}" in state_lines(run)
    assert mission_json(run.missions[0]) == {
        "mission": "rounds",
        "asked": True,
        "visit": 2,
        "condition": "Base.dock",
        "round": False,
        "detours": [{"detour": 1, "visit": 1, "condition": "Base.office"}],
    }
    # Meanwhile the mission's own visits still count.
    assert run.step("charge.request").visits == ("visit 2 of mission rounds",)
    assert run.step("to_office.request").visits == ("visit 1 of detour 1 of mission rounds",)
    run.undo()
    run.undo()
    assert str(run.missions[0]) == text
    run.restart()
    assert (run.missions[0].is_asked, run.missions[0].visit) == (False, 1)


def test_a_mission_whose_visits_are_all_true_is_at_rest() -> None:
    run = robosc.simulate(strategic(robot("dock", detour=True)))
    assert str(run.missions[0]) == "rounds: every visit is true" and run.chosen is None
    assert run.step("begin.response").visits == ()
    assert run.step("to_kitchen.request").visits == ()
    assert run.step("charge.request").visits == ("visit 1 of mission rounds",)


STUCK = courier("§").replace("on request to charge goto dock", "").replace("/charge", "/unused")


def stuck(mission: str) -> Model:
    return model_of(STUCK.replace("§", mission))


def findings(model: Model, deployment: Deployment = Deployment.CONTROLLER) -> tuple[Diagnostic, ...]:
    def place(line: int) -> Location:
        return Location("robot.rscd", line, 1, 1)

    visits = [
        tuple(place(100 * number + visit) for visit in range(20)) for number, _ in enumerate(model.missions, start=1)
    ]
    places = Places(
        place(1),
        goals=[place(10 + number) for number, _ in enumerate(model.goals)],
        missions=[place(50 + number) for number, _ in enumerate(model.missions)],
        visits=visits,
        preferences=[place(60 + number) for number, _ in enumerate(model.preferences)],
    )
    if deployment is Deployment.LAYER:
        return layer_goal_findings(model, places, deployment)
    executable = ExecutableSystem(model, deployment)
    aims, result = executable.obligations.aims, strategy_result(model)
    if result.strategy is None:
        return goal_findings(aims, places, result)
    added = synthesize(to_automata(model, deployment)).added
    late = check_strategy(executable, added, result.strategy).put_off
    return (*goal_findings(aims, places, result), *put_off_findings(aims, places, result, late))


def line(found: Diagnostic) -> int:
    assert found.location is not None
    return found.location.line


def test_a_visit_that_cannot_be_made_is_found_where_it_stands() -> None:
    (found,) = findings(stuck("mission m { visit Base.kitchen then Base.dock then Base.office }"))
    assert (found.code, line(found)) == ("unreachable-goal", 101)
    assert found.message.startswith(
        "these visits together cannot be reached again and again, whatever the surroundings"
    )
    assert [(item.message, item.location.line) for item in found.related] == [("this visit belongs to them", 100)]
    (found,) = findings(stuck("mission m { visit Base.dock and Base.office }"))
    assert (line(found), found.message.split(",")[0]) == (100, "this visit cannot be reached again and again")
    (found,) = findings(
        stuck(
            "mission m { visit Base.kitchen then Base.office on Caller.waiting from anywhere visit Operator.working }"
        )
    )
    assert found.message == "the surroundings can keep this visit from coming true, for ever"
    assert line(found) == 102


def test_a_visit_that_no_run_makes_is_found() -> None:
    text = courier("mission m while Base.dock { visit Base.kitchen then Base.office }")
    assert [(item.code, line(item)) for item in findings(model_of(text))] == [
        ("visit-never-made", 100),
        ("visit-never-made", 101),
    ]
    text = courier("mission m { visit Base.kitchen on Base.dock and Base.office from anywhere visit Base.dock }")
    assert [(item.code, line(item)) for item in findings(model_of(text))] == [("visit-never-made", 101)]


_ROOMS = """robot Rooms {
    component Base {
        incoming message to_hall with identifier: "/hall", type: none
        incoming message to_kitchen with identifier: "/kitchen", type: none
        incoming message to_dock with identifier: "/dock", type: none
        behaviour {
            initial marked state dock { on request to to_hall goto hall }
            marked state hall { on request to to_kitchen goto kitchen on request to to_dock goto dock }
            marked state kitchen { on request to to_hall goto hall }
        }
    }
    component Operator {
        outgoing message begin with identifier: "/begin", type: none
        outgoing message rest with identifier: "/rest", type: none
        behaviour {
            initial marked state resting { on response from begin goto working }
            marked state working { on response from rest goto resting }
        }
    }
    §
}"""


@pytest.mark.parametrize(
    ("mission", "lines"),
    [
        ("{ visit Base.kitchen on Base.hall from anywhere visit Base.dock }", [100]),
        # The first visit is made by the request that begins the detour.
        ("{ visit Base.hall then Base.kitchen on Base.hall from anywhere visit Base.dock }", [101]),
        # The surroundings could bring the detour about as well.
        ("{ visit Base.kitchen on Base.hall or Operator.working from anywhere visit Base.dock }", [100]),
        # The detour itself leads on.
        ("{ visit Base.kitchen on Base.hall from anywhere visit Base.kitchen }", []),
        ("{ visit Base.kitchen then Base.dock on Base.hall from anywhere visit Base.kitchen then Base.dock }", []),
        ("{ visit Base.kitchen on Operator.working and Base.kitchen from anywhere visit Base.dock }", []),
        # While the operator works, to leave the dock is to begin the detour.
        ("{ visit Base.kitchen on Operator.working from anywhere visit Base.dock }", [100]),
        # The robot leaves where the mission is asked for, and need not come back.
        ("while Base.dock or Operator.working { visit Base.kitchen }", [100]),
        ("while Operator.working { visit Base.kitchen }", []),
        # The operator alone can keep the detour from its end.
        ("while Operator.resting { visit Base.kitchen on Base.hall from anywhere visit Base.kitchen }", []),
        # The assumption ends the detour.
        (
            "{ visit Base.kitchen on Base.hall from anywhere visit Operator.working }"
            " assume allow Base.hall leads to Operator.working",
            [],
        ),
    ],
)
def test_a_visit_that_the_robot_itself_puts_off_is_found(mission: str, lines: list[int]) -> None:
    model = model_of(_ROOMS.replace("§", f"mission m {mission}"))
    assert [(item.code, line(item)) for item in findings(model)] == [("visit-put-off", number) for number in lines]


def test_in_a_layer_missions_have_no_effect() -> None:
    model = robot("kitchen", "office", prefer=("charge", "to_office"))
    (found,) = findings(model, Deployment.LAYER)
    assert (found.code, line(found)) == ("goals-in-layer", 50)
    assert found.message.startswith("missions have no effect in a supervision layer")
    assert [(item.message, item.location.line) for item in found.related] == [
        ("this preference has no effect, either", 60)
    ]
    assert findings(msgspec.structs.replace(model, missions=()), Deployment.LAYER) == ()


@pytest.mark.parametrize(
    ("count", "last"),
    [
        (6, "this goal has no effect, either"),
        (7, "this goal has no effect, either (1 more is not shown)"),
        (9, "this goal has no effect, either (3 more are not shown)"),
    ],
)
def test_a_finding_says_how_many_places_it_does_not_show(count: int, last: str) -> None:
    model = model_of(courier(*["goal always eventually Base.dock"] * count))
    (found,) = findings(model, Deployment.LAYER)
    assert [item.message for item in found.related] == ["this goal has no effect, either"] * 4 + [last]
    assert [item.location.line for item in found.related] == [11, 12, 13, 14, 15]
