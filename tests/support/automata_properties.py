"""Controller properties of automata by their definitions, written out: slow, and nothing that the product uses."""

from collections.abc import Callable

from robosc.automata import System, composed
from robosc.automata.controlled import ControlledGraph, controlled_graph
from robosc.automata.semantics import Semantics
from robosc.cif import check_cif
from robosc.controller_properties import AutomataProperties, check_automata
from robosc.source import Bundle, SourceFile


def system_of(text: str) -> System | None:
    return check_cif(Bundle(SourceFile("m.cif", text))).system


def checked(system: System) -> AutomataProperties:
    found = check_automata(composed(system), {}, limit=20_000)
    assert found is not None
    return found


def _bound(graph: ControlledGraph, is_wanted: Callable[[str], bool]) -> int | None:
    """CIF's manual: all states, the states after one event, after two, ... until there is none, or nothing changes."""
    states, number = frozenset(range(len(graph.states))), 0
    while True:
        following = frozenset(
            target for state in states for event, to in graph.steps[state] if is_wanted(event) for target in to
        )
        if not following:
            return number
        if following == states:
            return None
        states, number = following, number + 1


def _ahead(graph: ControlledGraph, start: int, may: Callable[[int, str], bool]) -> set[int]:
    found = {start}
    while True:
        more = found | {
            target for state in found for event, to in graph.steps[state] if may(state, event) for target in to
        }
        if more == found:
            return found
        found = more


def assert_as_defined(system: System) -> AutomataProperties | None:
    system = composed(system)
    semantics = Semantics(system)
    graph = controlled_graph(semantics, {}, limit=400)
    if graph is None:
        return None
    own = {event.name for event in system.events if event.is_controllable}
    inputs = {item.event for item in system.inputs}
    found = checked(system)
    assert found.controllable.bound == _bound(graph, own.__contains__)
    assert found.uncontrollable.bound == _bound(graph, lambda event: event not in own | inputs)
    for response, kind in ((found.controllable, True), (found.uncontrollable, False)):
        assert all((event in own) is kind for event in response.events)
        assert response.bound is None or response.bound == len(response.events)
    every = range(len(graph.states))
    able = [any(event in own for event, _ in graph.steps[state]) for state in every]
    reached = [_ahead(graph, state, lambda _, event: event in own) for state in every]
    assert found.checks["confluence"] == all(
        reached[one] & reached[other] for state in every for one in reached[state] for other in reached[state]
    )
    complete = [
        any(
            semantics.is_marked(graph.states[target]) and not able[target]
            for target in _ahead(graph, state, lambda at, event: event in own or not able[at])
        )
        for state in every
    ]
    assert found.checks["nonblocking_under_control"] == all(complete)
    if found.blocking is not None:
        assert found.blocking == graph.trace(complete.index(False))
    return found
