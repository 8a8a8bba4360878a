"""A request has a reason if and only if the interpreter, which executes supervisors, does not enable it."""

from contextlib import suppress
from random import Random
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.event_log import plain
from robosc.execution.runtime.protocol import MissingData
from robosc.explanation.blocked import MAXIMUM_REASONS, Requests, StateError, read_value
from robosc.explanation.notation import MAXIMUM_NAMES
from robosc.expressions import BooleanType, DoubleType, EnumType, IntegerType, StringType
from robosc.model.structure import CommunicationKind
from robosc.supervisor import Supervisor
from support.effort import examples
from support.execution import supervisor_of
from support.generated import example_supervisor
from support.models import model_of
from support.random_supervisors import random_data, random_supervisor

_CALLED = (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def locations(supervisor: Supervisor, system: InterpretedSystem) -> dict[str, str]:
    return {item.name: system.location(item.name) for item in supervisor.model.communications if item.kind in _CALLED}


def enabled(system: InterpretedSystem, requests: Requests) -> tuple[str, ...]:
    return tuple(requests.events[number] for number in system.enabled_requests())


def wander(supervisor: Supervisor, dice: Random, steps: int) -> Any:
    """The states along a random run."""
    system = InterpretedSystem(supervisor)
    events = [event for item in supervisor.model.communications for event in item.events] + [*supervisor.model.taus]
    for _ in range(steps if events else 0):
        yield system
        event = dice.choice(events)
        # Events that the supervisor would not let through are taken, too: their states are judged as well.
        with suppress(MissingData):
            system.step(event, system.read(event, random_data(dice)))
    yield system


def as_texts(components: Any) -> Any:
    """Return components as the topic `/state` has them."""

    def text(value: Any) -> str:
        return str(value).lower() if isinstance(value, bool) else str(value)

    return {
        name: {
            "state": part["state"],
            "variables": {variable: text(value) for variable, value in part["variables"].items()},
        }
        for name, part in components.items()
    }


@given(st.integers(0, 10**6))
@settings(max_examples=examples(60))
def test_a_request_has_a_reason_if_and_only_if_it_is_not_enabled(seed: int) -> None:
    supervisor, dice = random_supervisor(seed), Random(seed)
    requests = Requests(supervisor.executable, supervisor.added)
    for system in wander(supervisor, dice, 12):
        known, components = locations(supervisor, system), system.state()
        available = requests.availability(components, known)
        assert available.enabled == enabled(system, requests)
        assert available.unknown == ()
        assert {item.event for item in available.blocked} == set(requests.events) - set(available.enabled)
        for item in available.blocked:
            assert 0 < len(item.why) <= MAXIMUM_REASONS
            assert all(why and "\n" not in why for why in item.why)
        # The same out of a log file, and out of the topic.
        assert requests.availability(plain(components), known) == available
        assert requests.availability(as_texts(components), known) == available


@given(st.integers(0, 10**6))
@settings(max_examples=examples(40))
def test_a_report_without_locations_holds_with_them(seed: int) -> None:
    supervisor, dice = random_supervisor(seed), Random(seed)
    requests = Requests(supervisor.executable, supervisor.added)
    for system in wander(supervisor, dice, 6):
        known = locations(supervisor, system)
        some = {name: place for name, place in known.items() if dice.random() < 0.5}
        whole, part = requests.availability(system.state(), known), requests.availability(system.state(), some)
        assert set(part.enabled) <= set(whole.enabled)
        assert {item.event for item in part.blocked} <= {item.event for item in whole.blocked}
        reported = {*part.enabled, *part.unknown, *(item.event for item in part.blocked)}
        assert reported == set(requests.events)


def test_the_sentences_are_in_the_words_of_the_model() -> None:
    supervisor = example_supervisor("maze_solver/maze_solver")
    system, requests = InterpretedSystem(supervisor), Requests(supervisor.executable, supervisor.added)
    turning: dict[str, Any] = {**system.state(), "Rotator": {"state": "idle", "variables": {}}}
    states = [item.name for item in supervisor.model.component("Rotator").behaviour.states]  # type: ignore[union-attr]
    turning["Rotator"]["state"] = next(name for name in states if name != "idle")
    found = {item.event: item.why for item in requests.availability(turning, {}).blocked}
    (first, second) = found["rotate_left.request"]
    assert first == f"Rotator is in {turning['Rotator']['state']}, not in idle"
    assert second.startswith("requirement rotate_left needs Rotator.idle and LidarSensor.front = front_wall: ")
    assert second.endswith(f"Rotator.idle does not hold (Rotator is {turning['Rotator']['state']})")


@pytest.mark.parametrize(
    ("type_", "raw", "value"),
    [
        (BooleanType(), "true", True),
        (BooleanType(), 1, None),
        (IntegerType(), 3.0, 3),
        (IntegerType(), "-3", -3),
        (IntegerType(), 3.5, None),
        (IntegerType(), True, None),
        (IntegerType(0, 5), 6, None),
        (IntegerType(), "9" * 50, None),
        (DoubleType(), "1.5", 1.5),
        (DoubleType(), 10**400, None),
        (DoubleType(), "x" * 10**6, None),
        (EnumType("Kind", ("small",)), "small", "small"),
        (EnumType("Kind", ("small",)), "large", None),
        (StringType(), "large", "large"),
        (StringType(), ["large"], None),
    ],
)
def test_what_comes_from_elsewhere_is_read_by_its_type(type_: Any, raw: Any, value: Any) -> None:
    found = read_value(type_, raw)
    assert (found, type(found)) == (value, type(value))


def test_a_state_of_another_model_is_refused() -> None:
    supervisor = example_supervisor("maze_solver/maze_solver")
    requests, state = Requests(supervisor.executable, supervisor.added), InterpretedSystem(supervisor).state()
    for wrong in ({}, {**state, "Rotator": 3}, {**state, "Rotator": {"state": "flying"}}, {**state, "LidarSensor": {}}):
        with pytest.raises(StateError):
            requests.availability(wrong, {})


def test_what_a_requirement_reads_is_listed_up_to_a_limit() -> None:
    names = [f"v{number}" for number in range(MAXIMUM_NAMES + 1)]
    variables = "".join(f"variable {name}: integer(0..9) = 1 " for name in names)
    model = model_of(
        f"robot R {{ component C {{ incoming message few with type: none incoming message many with type: none "
        f"behaviour {{ {variables} initial marked state s {{ }} }} }} "
        f"requirement few needs C.v0 > C.v1 requirement many needs {' + '.join(f'C.{name}' for name in names)} > 9 }}"
    )
    supervisor = supervisor_of(model)
    available = Requests(supervisor.executable, ()).availability(InterpretedSystem(supervisor).state(), {})
    few, many = (item.why[0] for item in available.blocked)
    assert few.endswith("C.v0 > C.v1, which does not hold (C.v0 is 1, C.v1 is 1)")
    assert many.endswith(f"({', '.join(f'C.{name} is 1' for name in names[:MAXIMUM_NAMES])}, ...)")
