"""Plants of communications and behaviours, written out by hand."""

import pytest

from robosc.automata import Automaton, Edge
from robosc.automata.plants import communication_plant, component_plant
from robosc.expressions import FALSE, TRUE, IntegerType, Received, StringType, VariableRead
from robosc.model.structure import Communication, Component
from support.models_by_hand import action, component, incoming, outgoing, service, transition, variable
from support.systems import edge


def _arcs(plant: Automaton) -> set[str]:
    return {f"{arc.source} -{arc.event}-> {arc.target}" for arc in plant.edges}


def test_incoming_message() -> None:
    plant = communication_plant(incoming("move"))
    assert (plant.name, plant.locations, plant.initial) == ("message move", ("idle",), ("idle",))
    assert plant.marked == {"idle"}
    assert plant.alphabet == {"move.request"}
    assert _arcs(plant) == {"idle -move.request-> idle"}


def test_outgoing_message() -> None:
    plant = communication_plant(outgoing("scan"))
    assert plant.name == "message scan"
    assert plant.marked == {"idle"}
    assert plant.alphabet == {"scan.response"}
    assert _arcs(plant) == {"idle -scan.response-> idle"}


@pytest.mark.parametrize(
    ("communication", "name", "busy", "kinds", "arcs"),
    [
        (service("go"), "service go", "waiting", "request response error reset", ()),
        (
            action("go"),
            "action go",
            "executing",
            "request response feedback error cancel reset",
            ("executing -go.feedback-> executing", "executing -go.cancel-> idle"),
        ),
    ],
    ids=["service", "action"],
)
def test_service_and_action(
    communication: Communication, name: str, busy: str, kinds: str, arcs: tuple[str, ...]
) -> None:
    plant = communication_plant(communication)
    assert plant.name == name
    assert plant.locations == ("idle", busy, "ready", "failed")
    assert plant.initial == ("idle",)
    assert plant.marked == {"idle"}
    assert plant.alphabet == {f"go.{kind}" for kind in kinds.split()}
    assert _arcs(plant) == {
        f"idle -go.request-> {busy}",
        f"{busy} -go.response-> ready",
        f"{busy} -go.error-> failed",
        "ready -go.reset-> idle",
        "failed -go.reset-> idle",
        *arcs,
    }


def _plant(made: Component) -> Automaton:
    assert made.behaviour is not None
    return component_plant(made.name, made.behaviour)


def test_states_become_locations() -> None:
    plant = _plant(component("Base", "idle* driving halted*", ["idle: move.request -> driving"]))
    assert plant.name == "Base"
    assert plant.locations == ("idle", "driving", "halted")
    assert plant.initial == ("idle",)
    assert plant.marked == {"idle", "halted"}
    assert plant.alphabet == {"move.request"}


def test_a_request_is_blocked_where_it_is_not_written() -> None:
    plant = _plant(component("Base", "idle* driving", ["idle: move.request -> driving"]))
    assert _arcs(plant) == {"idle -move.request-> driving"}


@pytest.mark.parametrize("kind", ["response", "feedback", "error", "cancel"])
def test_every_state_accepts_other_events_that_are_mentioned(kind: str) -> None:
    plant = _plant(component("Base", "idle* driving", [f"idle: go.{kind} -> driving"]))
    assert plant.alphabet == {f"go.{kind}"}
    assert _arcs(plant) == {f"idle -go.{kind}-> driving", f"driving -go.{kind}-> driving"}


def test_a_transition_of_the_behaviour_stands_in_every_state() -> None:
    plant = _plant(component("Base", "a* b c", ["*: stop.request -> a", "*: scan.response"]))
    assert _arcs(plant) == {f"{place} -stop.request-> a" for place in "abc"} | {
        f"{place} -scan.response-> {place}" for place in "abc"
    }


def test_a_tau_of_the_behaviour_is_one_event() -> None:
    guard = VariableRead("Base", "full")
    made = component("Base", "a* b", [transition("*: Base.tau_1 -> a", guard), transition("a: Base.tau_2 -> b")])
    plant = _plant(made)
    assert plant.alphabet == {"Base.tau_1", "Base.tau_2"}
    assert set(plant.edges) == {
        Edge("a", "Base.tau_1", "a", guard),
        Edge("b", "Base.tau_1", "a", guard),
        Edge("a", "Base.tau_2", "b", TRUE),
    }


def test_both_transitions_of_a_nondeterministic_event_are_kept() -> None:
    plant = _plant(component("Base", "a* b", ["a: scan.response -> b", "*: scan.response -> a"]))
    assert _arcs(plant) == {"a -scan.response-> b", "a -scan.response-> a", "b -scan.response-> a"}


def test_only_synthesis_variables_and_their_updates_are_kept() -> None:
    made = component(
        "Base",
        "a*",
        [transition("a: scan.response", n=Received(("n",)), text=Received(("text",)))],
        [variable("n", IntegerType(0, 3), 2), variable("text", StringType(), "", is_synthesis=False)],
    )
    plant = _plant(made)
    assert [(item.name, item.type, item.initial) for item in plant.variables] == [("n", IntegerType(0, 3), (2,))]
    assert plant.edges == (edge("a -scan.response-> a", n=Received(("n",))),)


def test_a_guard_is_kept_as_written() -> None:
    plant = _plant(component("Base", "a* b", [transition("a: Base.tau_1 -> b", FALSE)]))
    assert [arc.guard for arc in plant.edges] == [FALSE]
