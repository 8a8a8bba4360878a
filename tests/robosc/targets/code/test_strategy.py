"""Statements that take in a stable state, against an obvious twin that goes through missions step by step."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata.goal_memory import MEMORY
from robosc.expressions import FALSE, TRUE, Expression, VariableRead
from robosc.model.structure import MAXIMUM_VISITS, Detour, Mission
from robosc.supervisor import Strategy
from robosc.targets.code.expressions import variable, words_of
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import function
from robosc.targets.code.python.writer import make_writer
from robosc.targets.code.statements import Assign, Let, codes
from robosc.targets.code.strategy import observing
from support.effort import examples
from support.execution import supervisor_of
from support.mission_twin import mission_twin
from support.models import model_of

NAMES = tuple(f"v{number}" for number in range(5))
MODEL = model_of(
    f"""robot R {{
    component C {{
        behaviour {{ {" ".join(f"variable {name}: boolean" for name in NAMES)} initial marked state s {{ }} }}
    }}
    goal once C.v0
}}"""
)

conditions = st.sampled_from([*(VariableRead("C", name) for name in NAMES * 2), TRUE, FALSE])
visits = st.lists(conditions, min_size=1, max_size=4).map(tuple)
missions = st.builds(
    Mission,
    name=st.just("rounds"),
    visits=visits,
    condition=st.none() | conditions,
    detours=st.lists(st.builds(Detour, trigger=conditions, visits=visits), max_size=2).map(tuple),
)
states = st.frozensets(st.sampled_from(NAMES))


class Generated:
    """The statements of a robot with a goal and a mission, executed."""

    def __init__(self, mission: Mission) -> None:
        model = msgspec.structs.replace(MODEL, missions=(mission,))
        supervisor = msgspec.structs.replace(supervisor_of(model), strategy=Strategy(((),)))
        scope = make_writer(supervisor).scope
        self.statements = observing(supervisor.executable, scope, PythonNamer())
        names: dict[str, Any] = {}
        exec("\n".join(function("observe", "Observe.", self.statements, [variable("self")])), names)
        self._observe = names["observe"]
        self._robot = SimpleNamespace()

        def attribute(component: str, name: str) -> str:
            return scope.variable_place(component, name).word.removeprefix("self.")

        self._variables = {name: attribute("C", name) for name in NAMES}
        self._places = {item.name: attribute(MEMORY, item.name) for item in supervisor.executable.obligations.places}
        for place in self._places.values():
            setattr(self._robot, place, False)

    def observe(self, state: frozenset[str]) -> dict[str, bool]:
        """Take in a state, in which some variables are true; return the memory."""
        for name, attribute in self._variables.items():
            setattr(self._robot, attribute, name in state)
        self._observe(self._robot)
        return {name: getattr(self._robot, place) for name, place in self._places.items()}


def truth_of(condition: Expression) -> Callable[[frozenset[str]], bool]:
    match condition:
        case VariableRead(variable=name):
            return lambda state: name in state
        case _:
            return lambda state: condition == TRUE


@settings(max_examples=examples(300))
@given(missions, st.lists(states, min_size=6, max_size=20))
def test_the_memory_is_what_the_twin_says(mission: Mission, run: list[frozenset[str]]) -> None:
    generated, twin = Generated(mission), mission_twin(mission, truth_of)
    mark, was_reached = twin.start, False
    for state in run:
        mark, was_reached = twin.after(mark, state), was_reached or "v0" in state
        assert generated.observe(state) == {"goal 1 was reached": was_reached, **twin.memory(mark)}


@settings(max_examples=examples(100))
@given(missions)
def test_every_local_variable_is_read(mission: Mission) -> None:
    """Compilers warn of others."""
    statements = Generated(mission).statements
    locals_ = [item.place.word for item in statements if isinstance(item, Let)]
    assert len(set(locals_)) == len(locals_)
    values = (item.value for item in statements if isinstance(item, Let | Assign))
    assert set(locals_) <= words_of(values)


def test_each_visit_adds_as_much_as_every_other() -> None:
    sizes = []
    for count in (MAXIMUM_VISITS // 2, MAXIMUM_VISITS):
        reads = tuple(VariableRead("C", NAMES[number % len(NAMES)]) for number in range(count))
        found = Generated(Mission("rounds", reads, None, (Detour(reads[0], reads),)))
        sizes.append(sum(len(list(code.pieces())) for code in codes(found.statements)))
    assert sizes[1] < 2.1 * sizes[0] < 100 * MAXIMUM_VISITS
