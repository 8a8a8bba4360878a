"""Warnings about a model that only synthesis can give: by hand in pairs, and against enumerated states."""

from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import replace

import igraph
import msgspec
import pytest

from robosc.automata import Semantics, System, to_automata
from robosc.automata.compile import NO_DATA, compile_expression
from robosc.automata.state import subjects
from robosc.certification import OutcomeStatus, make_supervisor
from robosc.errors import Diagnostic, UnsupportedModelError
from robosc.exploration import explore
from robosc.model.places import Places
from robosc.model.structure import CommunicationKind, Deployment, EventKind, Model, is_tau
from robosc.source import Location
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, findings, questions_about, synthesize
from robosc.verification import ExplicitSupervisor, synthesize_explicit
from support.models import DOOR, EXAMPLE_DEPLOYMENTS, bundle_of, example_bundle, marked_place
from support.random_supervisors import random_supervisor

LIMIT = 5_000
OF_EVENTS = ("never-enabled", "unused-requirement", "competing-requests")
OF_STATES = ("unreachable-state",)
OF_LOOPS = ("unprompted-request",)
CODES = OF_EVENTS + OF_STATES

INTERFACES = "interface i use S from p"
SWITCH = """component Switch {
    outgoing message up with type: none
    outgoing message down with type: none
    behaviour {
        on response from up goto on_
        on response from down goto off
        initial marked state off { }
        marked state on_ { }
    }
}"""
"""A switch that the environment flips."""

MOTOR = """component Motor {
    action drive with request: none, response: none, feedback: none links i
    behaviour {
        initial marked state still { on request to drive goto driving }
        marked state driving {
            on response from drive goto still
            on error from drive goto still
            on cancel to drive goto still
        }
    }
}"""
"""A motor that reacts to cancel."""


BELL = "component Bell { incoming message §ring with type: none }"

SERVICE = """component Clerk {
    service ask with request: none, response: none links i
    behaviour {
        initial marked state there { on request to ask }
        marked state gone { }
    }
}"""
"""A service, and a state that is never entered."""

LIGHTS = """component Lights {
    incoming message red with identifier: "/light", type: none
    incoming message §green with identifier: "/light", type: none
}"""
"""Two messages on one topic."""


def robot(*parts: str) -> str:
    return "\n".join(["robot R {", INTERFACES, *parts, "}"])


def found(
    text: str, deployment: Deployment = Deployment.CONTROLLER, codes: tuple[str, ...] = OF_EVENTS
) -> tuple[Diagnostic, ...]:
    """The findings of a model that has a supervisor; the two engines agree on them.

    What never happens leaves states unreached: those are reported as well, and are looked at by themselves.
    """
    made = [make_supervisor(bundle_of(text), deployment=deployment, engine=name) for name in ("auto", "autoref")]
    assert made[0].status is OutcomeStatus.SUPERVISOR
    assert made[0].diagnostics == made[1].diagnostics
    return tuple(item for item in made[0].diagnostics if item.code in codes)


def only(text: str, deployment: Deployment = Deployment.CONTROLLER, codes: tuple[str, ...] = OF_EVENTS) -> Diagnostic:
    """The one finding of a model, at the place that is marked in its text."""
    plain, line, column = marked_place(text)
    diagnostics = found(plain, deployment, codes)
    assert len(diagnostics) == 1, [str(item) for item in diagnostics]
    assert diagnostics[0].location is not None
    assert (diagnostics[0].location.line, diagnostics[0].location.column) == (line, column)
    assert "\n" not in diagnostics[0].message
    return diagnostics[0]


# never-enabled


def test_a_request_that_the_behaviours_never_allow() -> None:
    text = DOOR.replace("goto closed }", "goto closed }\n state ajar { on request to slam goto closed }")
    text = text.replace("behaviour", "incoming message §slam with type: none\n behaviour")
    item = only(robot(text))
    assert (item.code, str(item.severity)) == ("never-enabled", "warning")
    assert item.message.startswith("'slam' can never be requested: the behaviours never get to states")
    assert found(robot(text.replace("§", "").replace("to shut goto closed", "to shut goto ajar"))) == ()


def test_a_request_whose_requirement_never_holds() -> None:
    """The requirement does restrict: it is not reported beside."""
    item = only(robot(SWITCH, BELL, "requirement ring needs Switch.off and Switch.on_"))
    assert item.message == (
        "'ring' can never be requested: wherever the behaviours allow it, a requirement on it does not hold"
    )
    assert [(place.message, place.location.line) for place in item.related] == [("a requirement on it", 14)]
    assert found(robot(SWITCH, BELL, "requirement ring needs Switch.on_").replace("§", "")) == ()


def test_a_request_that_synthesis_forbids() -> None:
    """Check a door that cannot be opened any more once locked.

    The requirement on `unlock` never shows, but it is the reason.
    """
    text = DOOR.replace("goto closed }", "goto closed }\n state locked { on request to unlock goto closed }")
    text = text.replace("goto opened }", "goto opened on request to lock goto locked }")
    text = text.replace(" behaviour", " incoming message §lock with type: none\nMORE\n behaviour")
    more = "incoming message unlock with type: none"
    both = found(robot(text.replace("MORE", more), "requirement unlock needs Door.opened").replace("§", ""))
    assert [item.message for item in both] == [
        "'lock' can never be requested: unlock.request, on the only way back to a marked state, must not happen then: "
        "'requirement unlock needs Door.opened' forbids it: Door is locked",
        "'unlock' can never be requested: wherever the behaviours allow it, a requirement on it does not hold",
    ]
    assert found(robot(text.replace("MORE", more)).replace("§", "")) == ()
    # Written twice, one of the two requirements can go: the later one.
    twice = robot(text.replace("MORE", more), *["requirement unlock needs Door.opened"] * 2).replace("§", "")
    (item,) = (item for item in found(twice) if item.code == "unused-requirement")
    assert item.location is not None
    assert item.location.line == len(twice.splitlines()) - 1


def test_a_request_that_would_break_what_must_always_hold() -> None:
    text = DOOR.replace("incoming message open", "incoming message §open")
    both = found(robot(text, "requirement never Door.opened", "requirement always true").replace("§", ""))
    assert [item.message for item in both if item.code == "never-enabled"] == [
        "'open' can never be requested: wherever it is allowed, what must always hold would not hold after it, or "
        "could not be kept",
        "'shut' can never be requested: what must always hold keeps the behaviours from the states that allow it",
    ]
    assert [(place.message, place.location.line) for place in both[0].related] == [("this would not hold after it", 11)]
    assert [item.fix[:11] for item in both[:2]] == ["Relax what "] * 2


def test_a_request_after_which_what_must_always_hold_could_not_be_kept() -> None:
    """No requirement is broken at once: but then the wind can open the door."""
    text = DOOR.replace("incoming message open", "incoming message §lift").replace(
        "on request to open", "on request to lift"
    )
    text = text.replace("component Door {", "component Door { outgoing message wind with type: none")
    text = text.replace("marked state opened {", "marked state opened { on response from wind goto ajar")
    text = text.replace("initial marked", "marked state ajar { on request to shut goto closed } initial marked")
    broken, unreached = found(robot(text, "requirement never Door.ajar").replace("§", ""))
    assert broken.message.startswith("'lift' can never be requested: wherever it is allowed, what must always hold")
    assert (broken.related, unreached.message.partition(": ")[0]) == ((), "'shut' can never be requested")


def test_a_request_that_requirements_on_others_exclude() -> None:
    text = DOOR.replace("message shut", "message §shut")
    both = found(robot(text, "requirement open needs Door.opened").replace("§", ""))
    assert [item.message for item in both] == [
        "'open' can never be requested: wherever the behaviours allow it, a requirement on it does not hold",
        "'shut' can never be requested: requirements keep the behaviours from the states that allow it",
    ]
    assert both[1].related == ()


def test_a_request_in_states_that_synthesis_keeps_from() -> None:
    """A door that is locked can only be broken, and is then repaired only where that is not needed."""
    door = """component Door {
        incoming message lock with type: none
        incoming message smash with type: none
        incoming message repair with type: none
        behaviour {
            initial marked state closed { on request to lock goto locked }
            state locked { on request to smash goto broken }
            state broken { on request to repair goto closed }
        }
    }"""
    assert found(robot(door)) == ()
    lock, smash, repair = found(robot(door, "requirement repair needs Door.closed"))
    assert repair.message.endswith("a requirement on it does not hold")
    assert (lock.message, smash.message) == (
        "'lock' can never be requested: repair.request, on the only way back to a marked state, must not happen then: "
        "'requirement repair needs Door.closed' forbids it: Door is broken",
        "'smash' can never be requested: synthesis keeps the behaviours from the states that allow it, because of what "
        "could follow there",
    )
    assert "robosc explain-synthesis" in smash.fix


def test_of_a_call_that_is_never_made_only_the_request_is_reported() -> None:
    motor = MOTOR.replace("action drive", "action §drive")
    assert only(robot(motor, SWITCH, "requirement drive needs Switch.off and Switch.on_")).code == "never-enabled"
    service = SERVICE.replace("service ask", "service §ask")
    assert "can never be requested" in only(robot(service, "requirement ask needs Clerk.gone")).message


def test_cancel_counts_where_a_behaviour_reacts_to_it() -> None:
    """Without requirements it is free; with one that holds as long as the action runs it never happens."""
    assert found(robot(MOTOR)) == ()
    # The door cannot be shut while it drives.
    requirements = ("requirement drive needs Door.opened", "requirement shut needs Motor.still")
    item = only(robot(MOTOR.replace("action drive", "action §drive"), DOOR, *requirements))
    assert item.message == (
        "'drive.cancel' can never happen: wherever the behaviours allow it, a requirement on it does not hold"
    )
    without_reaction = MOTOR.replace("on cancel to drive goto still", "")
    assert found(robot(without_reaction, DOOR, *requirements)) == ()
    # The caller of a layer may always cancel.
    assert found(robot(MOTOR, DOOR, *requirements), Deployment.LAYER) == ()


def test_a_tau_that_can_never_be_taken() -> None:
    lamp = """component Lamp {
        incoming message glow with type: none
        behaviour {
            variable n: integer(0..3) = 1
            initial marked state dark { on request to glow goto lit §transition if n > 1 goto dark }
            marked state lit { transition if n = 1 goto dark }
        }
    }"""
    item = only(robot(lamp))
    assert item.message == (
        "'Lamp.tau_1' can never happen: its component never gets to a state where it stands and its guard holds"
    )
    assert found(robot(lamp.replace("n > 1", "n > 0").replace("§", ""))) == ()


def test_a_tau_of_the_whole_behaviour_is_reported_once() -> None:
    lamp = """component Lamp {
        outgoing message glow with type: none
        behaviour {
            variable n: integer(0..3)
            §transition if n > 1 goto dark
            initial marked state dark { on response from glow goto lit }
            marked state lit { on response from glow goto dark }
        }
    }"""
    assert "tau_1" in only(robot(lamp)).message


# unused-requirement


def test_a_requirement_that_always_holds_where_it_matters() -> None:
    item = only(robot(DOOR, "§requirement shut needs Door.opened"))
    assert (item.code, item.message) == ("unused-requirement", "this requirement never restricts 'shut'")
    assert found(robot(DOOR, SWITCH, "requirement shut needs Switch.on_")) == ()


def test_disables_means_the_opposite() -> None:
    assert only(robot(DOOR, "§requirement Door.closed disables shut")).code == "unused-requirement"
    assert found(robot(DOOR, SWITCH, "requirement Switch.off disables shut")) == ()


def test_a_set_is_used_where_one_member_is_restricted() -> None:
    item = only(robot(DOOR, BELL.replace("§", ""), "§requirement { shut, ring } needs Door.closed or Door.opened"))
    assert item.message == "this requirement never restricts 'shut', 'ring'"
    assert found(robot(DOOR, BELL.replace("§", ""), "requirement { shut, ring } needs Door.opened")) == ()


def test_many_names_are_cut() -> None:
    names = [f"m{number}" for number in range(8)]
    messages = " ".join(f"incoming message {name} with type: none" for name in names)
    item = only(robot(f"component C {{ {messages} }}", f"§requirement {{ {', '.join(names)} }} needs true"))
    assert item.message == "this requirement never restricts 'm0', 'm1', 'm2', 'm3', 'm4' and 3 more"


def test_an_empty_set_restricts_nothing() -> None:
    """The check of the model has said so: `empty-requirement`."""
    assert found(robot(DOOR, "requirement { } needs false")) == ()


def test_a_requirement_that_must_always_hold() -> None:
    """Without it the door could be opened while the motor drives, or the other way round."""
    item = only(robot(DOOR, MOTOR, "§requirement always Door.closed or Door.opened"))
    assert (item.code, item.message) == ("unused-requirement", "this requirement never restricts anything")
    assert found(robot(DOOR, MOTOR, "requirement always Door.closed or Motor.still")) == ()
    used, unused = "requirement never Door.opened and Motor.driving", "§requirement never Door.opened and Door.closed"
    assert only(robot(DOOR, MOTOR, used, unused)).message == "this requirement never restricts anything"
    # The second requirement, though it says less, forbids nothing more than the first; the first one does.
    weaker = "§requirement never Door.opened and Motor.driving and Switch.on_"
    assert only(robot(DOOR, MOTOR, SWITCH, used, weaker)).code == "unused-requirement"


def test_a_requirement_that_can_cancel_an_action_is_used() -> None:
    """The requirement holds whenever the motor may be started, and turns false while it drives."""
    starter = MOTOR.replace("marked state driving {", "marked state driving {\n on response from down goto driving")
    kept = "requirement drive needs Switch.off or Motor.still"
    assert found(robot(starter, SWITCH, kept)) == ()
    item = only(
        robot(
            MOTOR.replace("on cancel to drive goto still", ""), "§requirement drive needs Motor.still or Motor.driving"
        )
    )
    assert item.code == "unused-requirement"


# competing-requests


def test_two_requests_on_one_identifier() -> None:
    item = only(robot(LIGHTS, SWITCH, "requirement green needs Switch.on_"))
    assert item.message == "'green' and 'red' can both be requested on '/light' after up.response"
    assert [(place.message, place.location.line) for place in item.related] == [("the other one is here", 4)]
    assert "priority list" in item.fix
    exclusive = (
        LIGHTS.replace("§", ""),
        SWITCH,
        "requirement green needs Switch.on_",
        "requirement red needs Switch.off",
    )
    assert found(robot(*exclusive)) == ()


def test_a_pair_that_competes_from_the_start() -> None:
    assert only(robot(LIGHTS)).message.endswith("on '/light' in the initial state")


def test_in_a_layer_nothing_competes() -> None:
    lights = """component Lights {
        incoming message red with identifier: "/light", type: boolean, when: value
        incoming message §green with identifier: "/light", type: boolean
    }"""
    assert only(robot(lights)).code == "competing-requests"
    assert found(robot(lights).replace("§", ""), Deployment.LAYER) == ()


def test_services_and_messages_have_names_of_their_own() -> None:
    service = SERVICE.replace("ask with", 'ask with identifier: "/light",')
    one = LIGHTS.replace('incoming message §green with identifier: "/light", type: none', "")
    assert found(robot(service, one)) == ()
    two = service.replace(
        "behaviour", 'service §tell with identifier: "/light", request: none, response: none links i behaviour'
    )
    assert only(robot(two, one)).message.startswith("'tell' and 'ask' can both be requested")


@pytest.mark.parametrize("height", [1, 12, 13, 40])
def test_a_long_run_is_cut(height: int) -> None:
    states = "\n".join(
        f"{'initial ' if number == 0 else ''}marked state s{number} {{ on response from step goto s{number + 1} }}"
        for number in range(height)
    )
    text = robot(
        "component Stairs { outgoing message step with type: none",
        f"behaviour {{ {states} marked state s{height} {{ }} }} }}",
        LIGHTS,
        f"requirement green needs Stairs.s{height}",
    )
    message = only(text).message
    shown = ", ".join(["step.response"] * min(height, 12))
    assert message.endswith(f" after {shown}" if height <= 12 else f" after {shown}, ... ({height} in all)")


# unprompted-request


def loops(text: str, deployment: Deployment = Deployment.CONTROLLER) -> list[str]:
    return [item.message for item in found(text.replace("§", ""), deployment, OF_LOOPS)]


def test_a_service_that_nobody_asks_for() -> None:
    item = only(robot(SERVICE.replace("service ask", "service §ask")), codes=OF_LOOPS)
    assert str(item.severity) == "note"
    assert item.message == (
        "'ask' can be requested again and again with no message of the robot in between, in the initial state: "
        "ask.request, ask.response, ask.reset, and so on"
    )
    assert loops(robot(SERVICE), Deployment.LAYER) == []


def test_a_service_that_a_message_asks_for_each_time() -> None:
    """The order is taken back by the request that follows it."""
    clerk = SERVICE.replace("on request to ask", "on request to ask goto gone").replace(
        "state gone { }", "state gone { on response from up goto there }"
    )
    assert loops(robot(SWITCH, clerk)) == []
    # The message is needed before the first one alone.
    after = loops(robot(SWITCH, SERVICE, "requirement ask needs Switch.on_"))
    assert [text.partition("between, ")[2] for text in after] == [
        "after up.response: ask.request, ask.response, ask.reset, and so on"
    ]


def test_an_action_ends_with_its_supply() -> None:
    """A counter that only a message fills again bounds what happens in between."""
    motor = MOTOR.replace("behaviour {", "behaviour { variable left: integer(0..2) = 2", 1)
    motor = motor.replace("on request to drive", "on request to drive do left := left - 1")
    filled = motor.replace("state still {", "state still { on response from up do left := 2")
    assert loops(robot(SWITCH, filled, "requirement drive needs Motor.left >= 1")) == []
    assert len(loops(robot(SWITCH, filled.replace("left - 1", "left"), "requirement drive needs Motor.left >= 1"))) == 1


def test_one_loop_is_reported_once() -> None:
    clerk = SERVICE.replace("behaviour", "service §tell with request: none, response: none links i behaviour")
    clerk = clerk.replace("on request to ask", "on request to ask goto gone")
    clerk = clerk.replace("state gone { }", "state gone { on request to tell goto there }")
    (item,) = found(robot(clerk).replace("§", ""), codes=OF_LOOPS)
    assert item.message.startswith("'ask' can be requested again and again")
    assert "tell.request" in item.message
    assert [(place.message, place.location.line) for place in item.related] == [("requested in the same loop", 5)]


def test_what_happens_once_on_the_way_is_no_part_of_the_loop() -> None:
    """The nearest state from which the rest goes round is another one than where it begins."""
    clerk = SERVICE.replace("behaviour", "service §once with request: none, response: none links i behaviour")
    clerk = clerk.replace("on request to ask", "on request to ask on request to once goto gone")
    clerk = clerk.replace("state gone { }", "state gone { on request to ask }")
    (item,) = found(robot(clerk).replace("§", ""), codes=OF_LOOPS)
    assert item.message.startswith("'ask' can be requested again and again")
    assert item.related == ()


# Sound models, and models without a supervisor


def test_a_state_that_no_transition_leads_to() -> None:
    text = DOOR.replace("marked state opened", "marked state §ajar { on request to shut } marked state opened")
    item = only(robot(text), codes=CODES)
    assert (item.code, str(item.severity)) == ("unreachable-state", "warning")
    assert item.message == "Door never gets to 'ajar': no transition leads there"


def test_states_that_only_lead_to_each_other() -> None:
    more = "marked state x { on request to open goto y } marked state y { on request to shut goto x }"
    items = found(robot(DOOR.replace("marked state opened", f"{more} marked state opened")), codes=CODES)
    assert [item.message for item in items] == [
        f"Door never gets to '{state}': no transition leads there" for state in "xy"
    ]


def test_a_state_that_the_supervisor_keeps_away_from() -> None:
    door = DOOR.replace(
        "to shut goto closed }",
        "to shut goto closed on response from up goto wide } marked state wide { on request to shut goto closed }",
    )
    items = found(robot(SWITCH, door, "requirement open needs Switch.off and Switch.on_"), codes=OF_STATES)
    assert [item.message for item in items] == [
        f"Door never gets to '{state}': what would lead there never happens under the supervisor"
        for state in ("opened", "wide")
    ]
    assert "explain-synthesis" in items[0].fix


def test_a_transition_of_the_whole_behaviour_leads_from_every_state() -> None:
    assert found(robot(SWITCH), codes=CODES) == ()


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_the_examples_have_none_of_these(name: str, deployment: Deployment) -> None:
    made = make_supervisor(example_bundle(name), deployment=deployment)
    assert made.status is OutcomeStatus.SUPERVISOR
    assert not [item for item in made.diagnostics if item.code in CODES]


def test_without_a_supervisor_there_are_no_findings() -> None:
    text = robot(
        LIGHTS, "component C { behaviour { initial state a { transition if false goto b } marked state b { } } }"
    )
    made = make_supervisor(bundle_of(text.replace("§", "")))
    assert (made.status, made.diagnostics) == (OutcomeStatus.EMPTY, ())


def test_findings_stand_among_the_others_by_place() -> None:
    text = robot(LIGHTS, DOOR, "requirement shut needs Door.opened").replace("§", "")
    text = text.replace("on request to open", "on request from open")
    made = make_supervisor(bundle_of(text))
    assert [item.code for item in made.diagnostics] == [
        "competing-requests",
        "unprompted-request",
        "wrong-preposition",
        "unused-requirement",
    ]


PACE = """component Pace {
    incoming message §creep with identifier: "/speed", type: none
    incoming message full with identifier: "/speed", type: none
    behaviour {
        initial marked state fast { on request to creep goto slow }
        marked state slow { on request to full goto fast }
    }
}"""


def repeats(text: str, deployment: Deployment = Deployment.CONTROLLER) -> list[str]:
    made = make_supervisor(bundle_of(text.replace("§", "")), deployment=deployment)
    return [item.message for item in made.diagnostics if item.code == "unprompted-request"]


def test_messages_that_alternate_for_ever() -> None:
    assert repeats(robot(PACE)) == [
        "'creep' can be sent again and again with no message of the robot in between, in the initial state: "
        "creep.request, full.request, and so on"
    ]
    # In a layer the existing controller sends them, and a message that changes nothing is sent once a period anyway.
    assert repeats(robot(PACE), Deployment.LAYER) == []
    assert repeats(robot("component Base { incoming message go with type: none }")) == []
    # A button prompts each of them.
    assert repeats(robot(PACE, SWITCH, "requirement creep needs Switch.on_", "requirement full needs Switch.off")) == []


def test_under_a_strategy_nothing_competes_and_nothing_is_unprompted() -> None:
    lights = LIGHTS.replace("§", "")
    assert {item.code for item in make_supervisor(bundle_of(robot(lights, PACE.replace("§", "")))).diagnostics} == {
        "competing-requests",
        "unprompted-request",
    }
    text = robot(lights, PACE.replace("§", ""), "goal always eventually Pace.slow")
    made = make_supervisor(bundle_of(text))
    assert made.supervisor is not None and made.supervisor.strategy is not None
    assert made.diagnostics == ()


# Random models against enumerated states


def places_of(model: Model) -> Places:
    """A place of its own for every part of a model; lines say which part."""
    places = Places(Location("m", 1, 1))
    places.communications.update({item.name: Location("c", n + 1, 1) for n, item in enumerate(model.communications)})
    places.requirements.extend(Location("r", n + 1, 1) for n in range(len(model.requirements)))
    for number, item in enumerate(model.components):
        if item.behaviour:
            rows = range(len(item.behaviour.transitions))
            places.transitions[item.name] = tuple(Location(f"t{number}", row + 1, 1) for row in rows)
            places.states.update(
                ((item.name, state.name), Location(f"s{number}", row + 1, 1))
                for row, state in enumerate(item.behaviour.states)
            )
    return places


def random_model(seed: int) -> Model:
    """A random model; one identifier for all, and every state marked so that most have a supervisor."""
    model = random_supervisor(seed).model
    components = [
        msgspec.structs.replace(
            item,
            behaviour=item.behaviour
            and msgspec.structs.replace(
                item.behaviour,
                states=tuple(msgspec.structs.replace(state, is_marked=True) for state in item.behaviour.states),
            ),
        )
        for item in model.components
    ]
    communications = [msgspec.structs.replace(item, identifier="/shared") for item in model.communications]
    return msgspec.structs.replace(model, components=tuple(components), communications=tuple(communications))


class TooLargeError(Exception):
    """More states than a test should go through."""


def explicit(system: System) -> ExplicitSupervisor:
    supervisor = synthesize_explicit(system, limit=LIMIT)
    if supervisor is None:
        raise TooLargeError
    return supervisor


class Twin:
    """Expected findings, from the graph of the controlled system."""

    def __init__(self, model: Model, system: System) -> None:
        self.model = model
        self.system = system
        self.semantics = Semantics(system)
        self.supervisor = explicit(system)
        added = state_predicates(system, synthesize(system).added)
        graph = explore(system, added, model, limit=LIMIT)
        self.enabled = [set(state.enabled) for state in graph.states]
        self._leaving: defaultdict[int, list[tuple[int, str, int]]] = defaultdict(list)
        for item in graph.transitions:
            self._leaving[item[0]].append(item)
        self._places = {subject: place for place, subject in enumerate(subjects(system))}

    def findings(self, places: Places, deployment: Deployment) -> set[tuple[str, Location]]:
        expected = {("never-enabled", place) for place in self._never(places)}
        expected |= {
            ("unused-requirement", place)
            for number, place in enumerate(places.requirements)
            if number in self._unused(deployment)
        }
        if deployment is Deployment.CONTROLLER:
            expected |= {("competing-requests", place) for place in self._competing(places)}
        return expected | {("unreachable-state", place) for place in self._unreached(places)}

    def repeated(self, places: Places) -> set[Location]:
        """The communications whose request is on a circle of the graph without messages of the robot.

        A message counts if its request leads to another state there.
        """
        messages = {item.name for item in self.model.communications if item.kind is CommunicationKind.OUTGOING_MESSAGE}
        begun, steps, todo = {0}, [], [0]
        while todo:
            here = todo.pop()
            # Resets and silent steps that change something go before everything else.
            first = [item for item in self._leaving[here] if item[1].endswith(".reset") or is_tau(item[1])]
            first = [item for item in first if item[2] != here]
            for item in first or [item for item in self._leaving[here] if not is_tau(item[1])]:
                if item[2] not in begun:
                    begun.add(item[2])
                    todo.append(item[2])
                if item[1].rpartition(".")[0] not in messages:
                    steps.append(item)
        graph = igraph.Graph(len(self.enabled), [(source, target) for source, _, target in steps], directed=True)
        circle = graph.connected_components(mode="strong").membership
        incoming = {
            item.event(EventKind.REQUEST)
            for item in self.model.communications
            if item.kind is CommunicationKind.INCOMING_MESSAGE
        }
        on_circles = {
            event
            for source, event, target in steps
            if circle[source] == circle[target] and not (event in incoming and source == target)
        }
        return {
            places.communications[item.name]
            for item in self.model.communications
            if item.kind is not CommunicationKind.OUTGOING_MESSAGE and item.event(EventKind.REQUEST) in on_circles
        }

    def _unreached(self, places: Places) -> set[Location]:
        been = {
            (subject.automaton, state[number])
            for subject, number in self._places.items()
            if subject.variable is None
            for state in self.supervisor.reachable
        }
        return {place for state, place in places.states.items() if state not in been}

    def _never(self, places: Places) -> set[Location]:
        never = {event.name for event in self.system.events}.difference(*self.enabled)
        written = {
            (transition.event, places.transitions[item.name][row])
            for item in self.model.components
            if item.behaviour
            for row, transition in reversed(list(enumerate(item.behaviour.transitions)))
        }
        events = {event for event, _ in written}
        reported = {
            places.communications[item.name]
            for item in self.model.communications
            for event in item.events
            if event in never
            and (not event.endswith(".cancel") or event in events or item.event(EventKind.REQUEST) in never)
        }
        for event in {name for name in never if ".tau_" in name}:
            reported.add(min(place for name, place in written if name == event))
        return reported

    def _unused(self, deployment: Deployment) -> list[int]:
        """One after the other is left out for good if nothing changes, later ones first."""
        unused: list[int] = []
        for number in reversed(range(len(self.model.requirements))):
            if self._is_unused(number, unused, deployment):
                unused.append(number)
        return unused

    def _is_unused(self, number: int, removed: list[int], deployment: Deployment) -> bool:
        requirement = self.model.requirements[number]
        holds = compile_expression(requirement.condition, self._places)
        for name in requirement.communications:
            item = self.model.communication(name)
            kinds = [EventKind.REQUEST, *[EventKind.CANCEL] * (item.kind is CommunicationKind.ACTION)]
            for state in self.supervisor.reachable:
                for kind in kinds:
                    if self.semantics.enabled(state, item.event(kind)) and holds(state, NO_DATA) is not True:
                        return False
        rest = tuple(item for place, item in enumerate(self.model.requirements) if place not in (number, *removed))
        other = to_automata(msgspec.structs.replace(self.model, requirements=rest), deployment)
        # Omissions must not change when the action may be cancelled.
        conditions = [
            *(item for item in other.conditions if not item.event.endswith(".cancel")),
            *(item for item in self.system.conditions if item.event.endswith(".cancel")),
        ]
        found = explicit(replace(self.system, conditions=tuple(conditions)))
        return found.reachable == self.supervisor.reachable and {
            pair for pair in found.allowed if pair[0] in found.reachable
        } == {pair for pair in self.supervisor.allowed if pair[0] in found.reachable}

    def _competing(self, places: Places) -> set[Location]:
        requested = [item for item in self.model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
        return {
            places.communications[second.name]
            for number, second in enumerate(requested)
            for first in requested[:number]
            if (first.kind, first.identifier) == (second.kind, second.identifier)
            and any({first.event(EventKind.REQUEST), second.event(EventKind.REQUEST)} <= here for here in self.enabled)
        }


def test_random_models(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(160):
        model, deployment = random_model(seed), list(Deployment)[seed % 3 == 0]
        try:
            system = to_automata(model, deployment)
        except UnsupportedModelError:
            continue
        result = synthesize(system, questions=questions_about(model, system, deployment))
        if result.status is SynthesisStatus.EMPTY:
            continue
        places = places_of(model)
        reported = findings(model, places, result.answers)
        try:
            twin = Twin(model, system)
            expected = twin.findings(places, deployment)
        except TooLargeError:
            continue
        assert {(item.code, item.location) for item in reported if item.code in CODES} == expected, seed
        # A loop is reported once: it names all that are requested in it.
        in_loops = [item for item in reported if item.code not in CODES]
        named = {place for item in in_loops for place in (item.location, *(each.location for each in item.related))}
        assert named == (twin.repeated(places) if deployment is Deployment.CONTROLLER else set()), seed
        met.update(item.code for item in reported)
        met["models"] += 1
    record_property("findings compared with enumerated states", ", ".join(f"{k} {met[k]}" for k in sorted(met)))
    assert met["models"] >= 100
    assert all(met[code] >= 5 for code in (*CODES, *OF_LOOPS)), met
