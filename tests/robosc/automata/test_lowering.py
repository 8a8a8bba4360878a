"""From a model to its system: events, received data, requirements, deployments."""

from itertools import product

import pytest

from robosc.automata import EventCondition, InputVariable, Semantics, System, to_automata
from robosc.automata.compile import State
from robosc.automata.state import Subject, subjects
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    ArrayType,
    Binary,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    Expression,
    IntegerType,
    ObjectType,
    Received,
    StateTest,
    StringType,
    Unary,
    VariableRead,
)
from robosc.model.structure import Deployment, Model, ObjectDefinition, Property
from support.models_by_hand import (
    action,
    component,
    disables,
    incoming,
    model,
    needs,
    outgoing,
    service,
    transition,
    variable,
)

CONTROLLER, LAYER = Deployment.CONTROLLER, Deployment.LAYER
LINE = EnumType("Line", ("seen", "lost"))
OPEN = StateTest("Door", "open")
EMPTY = StateTest("Room", "empty")


def _controllable(system: System) -> set[str]:
    return {event.name for event in system.events if event.is_controllable}


def _everything() -> Model:
    return model(
        outgoing("scan", component="Lidar"),
        component("Lidar", "clear* blocked", ["clear: scan.response -> blocked", "blocked: Lidar.tau_1 -> clear"]),
        incoming("move", "Base"),
        service("calibrate", component="Base"),
        action("go", component="Base"),
        component("Base", "idle*"),
    )


def test_events_of_a_controller() -> None:
    system = to_automata(_everything(), CONTROLLER)
    assert [event.name for event in system.events] == [
        "scan.response",
        "Lidar.tau_1",
        "move.request",
        "calibrate.request",
        "calibrate.response",
        "calibrate.error",
        "calibrate.reset",
        "go.request",
        "go.response",
        "go.feedback",
        "go.error",
        "go.cancel",
        "go.reset",
    ]
    assert _controllable(system) == {
        "Lidar.tau_1",
        "move.request",
        "calibrate.request",
        "calibrate.reset",
        "go.request",
        "go.cancel",
        "go.reset",
    }


def test_in_a_layer_the_caller_cancels() -> None:
    controller, layer = (to_automata(_everything(), deployment) for deployment in (CONTROLLER, LAYER))
    assert _controllable(controller) - _controllable(layer) == {"go.cancel"}
    assert controller.automata == layer.automata


def test_without_actions_both_deployments_are_the_same() -> None:
    made = model(incoming("move"), service("calibrate"), needs("move", StateTest("C", "x")))
    assert to_automata(made, CONTROLLER) == to_automata(made, LAYER)


def test_plants_stand_in_source_order_a_behaviour_after_its_communications() -> None:
    system = to_automata(_everything(), CONTROLLER)
    assert [item.name for item in system.automata] == [
        "message scan",
        "Lidar",
        "message move",
        "service calibrate",
        "action go",
        "Base",
    ]


def test_a_component_without_behaviour_has_only_its_communications() -> None:
    system = to_automata(model(incoming("move")), CONTROLLER)
    assert [item.name for item in system.automata] == ["message move"]


def _sensor(response: EnumType | ObjectType, *values: Received, is_synthesis: bool = True) -> Model:
    return model(
        outgoing("scan", response, "Lidar"),
        ObjectDefinition("Scan", (Property("ranges", ArrayType(LINE)), Property("pose", ObjectType("Pose")))),
        ObjectDefinition("Pose", (Property("x", IntegerType(0, 3)), Property("text", StringType()))),
        component(
            "Lidar",
            "on*",
            [transition("on: scan.response", **{f"v{n}": value for n, value in enumerate(values)})],
            [variable(f"v{n}", LINE, "seen", is_synthesis) for n in range(len(values))],
        ),
    )


def test_the_datum_itself() -> None:
    system = to_automata(_sensor(LINE, Received(())), CONTROLLER)
    assert system.inputs == (InputVariable("scan.response", (), LINE),)


def test_properties_and_elements_each_once() -> None:
    paths = [Received(("pose", "x")), Received(("ranges", 3)), Received(("ranges", 0)), Received(("ranges", 3))]
    system = to_automata(_sensor(ObjectType("Scan"), *paths), CONTROLLER)
    assert system.inputs == (
        InputVariable("scan.response", ("pose", "x"), IntegerType(0, 3)),
        InputVariable("scan.response", ("ranges", 3), LINE, may_be_unknown=True),
        InputVariable("scan.response", ("ranges", 0), LINE, may_be_unknown=True),
    )


def test_what_only_code_reads_is_no_input() -> None:
    made = _sensor(ObjectType("Scan"), Received(("pose", "text")), is_synthesis=False)
    assert to_automata(made, CONTROLLER).inputs == ()


@pytest.mark.parametrize("path", [("pose", "text"), ("pose", "y"), ("pose", 0), ("pose", "x", "y")])
def test_infinite_or_missing_data_is_one_clear_error(path: tuple[str | int, ...]) -> None:
    with pytest.raises(UnsupportedModelError, match=r"scan\.response: .* at value\.pose\."):
        to_automata(_sensor(ObjectType("Scan"), Received(path)), CONTROLLER)


def test_data_of_response_and_feedback() -> None:
    made = model(
        action("go", response=LINE, feedback=BooleanType(), component="Base"),
        component(
            "Base",
            "on*",
            [transition("on: go.response", line=Received(())), transition("on: go.feedback", near=Received(()))],
            [variable("line", LINE, "seen"), variable("near")],
        ),
    )
    assert to_automata(made, CONTROLLER).inputs == (
        InputVariable("go.response", (), LINE),
        InputVariable("go.feedback", (), BooleanType()),
    )


def test_one_message_read_by_two_components_is_one_choice() -> None:
    watcher = [transition("on: scan.response", line=Received(()))]
    made = model(
        outgoing("scan", LINE, "A"),
        component("A", "on*", watcher, [variable("line", LINE, "seen")]),
        component("B", "on*", watcher, [variable("line", LINE, "seen")]),
    )
    semantics = Semantics(to_automata(made, CONTROLLER))
    assert semantics.targets(semantics.initial, "scan.response") == {
        ("idle", "on", "seen", "on", "seen"),
        ("idle", "on", "lost", "on", "lost"),
    }


def _house(*requirements: object) -> Model:
    return model(
        incoming("move"),
        incoming("halt"),
        action("go"),
        outgoing("knock"),
        component("Door", "closed* open*", ["closed: knock.response -> open"]),
        component("Room", "empty* full*", ["*: Room.tau_1 -> full"]),
        *requirements,  # type: ignore[arg-type]  # requirements, of either form
    )


def test_needs_and_disables_become_conditions_on_requests() -> None:
    system = to_automata(_house(needs("move", OPEN), disables(EMPTY, "halt move")), CONTROLLER)
    assert system.conditions == (
        EventCondition("move.request", OPEN),
        EventCondition("halt.request", Unary("not", EMPTY)),
        EventCondition("move.request", Unary("not", EMPTY)),
    )


def _at(system: System, **locations: str) -> State:
    initial = Semantics(system).initial
    wanted = {name.replace("_", " "): location for name, location in locations.items()}
    return tuple(
        wanted.get(subject.automaton, value) if subject.variable is None else value
        for subject, value in zip(subjects(system), initial, strict=True)
    )


def _table(system: System, event: str) -> dict[tuple[str, str], bool]:
    """Return a table by the state of Door and Room: True if an event meets its conditions."""
    semantics = Semantics(system)
    return {
        (door, room): semantics.condition(_at(system, Door=door, Room=room), event)
        for door, room in product(("closed", "open"), ("empty", "full"))
    }


def test_all_requirements_must_hold_for_a_request() -> None:
    table = _table(to_automata(_house(needs("move", OPEN), disables(EMPTY, "move")), CONTROLLER), "move.request")
    assert table == {
        ("closed", "empty"): False,
        ("closed", "full"): False,
        ("open", "empty"): False,
        ("open", "full"): True,
    }


@pytest.mark.parametrize("requirement", [needs("go", OPEN), disables(Unary("not", OPEN), "go move")])
def test_cancel_where_the_requirement_does_not_hold(requirement: object) -> None:
    system = to_automata(_house(requirement), CONTROLLER)
    assert _table(system, "go.cancel") == {
        ("closed", "empty"): True,
        ("closed", "full"): True,
        ("open", "empty"): False,
        ("open", "full"): False,
    }
    assert _table(system, "go.request") == {key: not value for key, value in _table(system, "go.cancel").items()}


def test_cancel_where_one_of_several_requirements_does_not_hold() -> None:
    system = to_automata(_house(needs("go", OPEN), disables(EMPTY, "go")), CONTROLLER)
    assert _table(system, "go.cancel") == {
        ("closed", "empty"): True,
        ("closed", "full"): True,
        ("open", "empty"): True,
        ("open", "full"): False,
    }
    all_hold = Unary("holds", Binary("and", OPEN, Unary("not", EMPTY)))
    assert system.conditions[-1] == EventCondition("go.cancel", Unary("not", all_hold))


def test_cancel_without_requirements_is_free() -> None:
    system = to_automata(_house(needs("move", OPEN)), CONTROLLER)
    assert all(_table(system, "go.cancel").values())
    assert [item.event for item in system.conditions] == ["move.request"]


def test_a_layer_has_no_condition_on_cancel() -> None:
    system = to_automata(_house(needs("go", OPEN)), LAYER)
    assert [item.event for item in system.conditions] == ["go.request"]


def test_an_unknown_requirement_forbids_the_request_and_allows_the_cancel() -> None:
    zero = VariableRead("Counter", "n")
    unknown: Expression = Binary(">", Binary("/", Constant(1), zero), Constant(0))
    for requirement in (needs("go", unknown), disables(unknown, "go")):
        made = model(action("go"), component("Counter", "on*", [], [variable("n", IntegerType(0, 1), 0)]), requirement)
        system = to_automata(made, CONTROLLER)
        semantics = Semantics(system)
        assert not semantics.condition(semantics.initial, "go.request")
        assert semantics.condition(semantics.initial, "go.cancel")


def test_a_double_from_outside_is_refused() -> None:
    made = model(
        outgoing("scan", DoubleType(), "Lidar"),
        component(
            "Lidar",
            "on*",
            [transition("on: scan.response", near=Binary(">", Received(()), Constant(0.5)))],
            [variable("near")],
        ),
    )
    with pytest.raises(UnsupportedModelError, match="a value of type double at value;"):
        to_automata(made, CONTROLLER)


def test_the_places_of_a_state() -> None:
    system = to_automata(_sensor(LINE, Received(())), CONTROLLER)
    assert subjects(system) == (Subject("message scan"), Subject("Lidar"), Subject("Lidar", "v0"))
