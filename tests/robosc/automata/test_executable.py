"""The executable system says of every event what the interpreter, which does not know it, does."""

import pytest

from robosc.automata import ExecutableSystem
from robosc.execution.interpreter.rules import event_rules
from robosc.model.structure import Deployment
from support.models import model_of
from support.random_supervisors import random_supervisor

RIVALS = """
robot R {
    component C {
        outgoing message told with identifier: "/t", type: none
        incoming message ask with identifier: "/a", type: none
        behaviour {
            variable n: integer(0..3) = 0
            on response from told do n := 1
            initial marked state a { on response from told do n := 2 goto b }
            state b { on request to ask goto a }
            state c { on response from told goto a on response from told goto b }
        }
    }
    requirement ask needs C.n > 0
}
"""


@pytest.mark.parametrize("seed", range(60))
def test_random_models(seed: int) -> None:
    supervisor = random_supervisor(seed)
    rules = event_rules(supervisor)
    events = supervisor.executable.events
    assert tuple(events) == tuple(rules)
    assert supervisor.executable.issued == tuple(name for name, rule in rules.items() if rule.is_controllable)
    for name, rule in rules.items():
        event = events[name]
        assert event.received == rule.received
        assert (None if event.moves is None else (event.moves.plant, dict(event.moves.targets))) == rule.plant
        assert bool(event.requirements) == bool(rule.conditions)
        assert len(event.needs) == len(rule.conditions)
        assert len(event.participants) == len(rule.participants)
        for mine, other in zip(event.participants, rule.participants, strict=True):
            assert (mine.component, mine.may_block) == (other.name, other.may_block)
            taken = {state: found[0] for state, found in other.transitions.items() if found}
            assert list(mine.taken) == list(taken)
            for state, rule_taken in taken.items():
                transition = mine.taken[state]
                assert transition.target == rule_taken.target
                assert (transition.guard is None) == (rule_taken.guard is None)
                assert [item.variable for item in transition.updates] == [
                    item.variable.name for item in rule_taken.updates
                ]


def test_of_several_transitions_the_states_own_is_taken_then_the_first() -> None:
    system = ExecutableSystem(model_of(RIVALS), Deployment.CONTROLLER)
    (participant,) = system.events["told.response"].participants
    assert [(states, transition.source, transition.target) for states, transition in participant.branches] == [
        (("a",), "a", "b"),
        (("b",), None, None),
        (("c",), "c", "a"),
    ]
    edges = system.executed_automata.automaton("C").edges
    assert [(edge.source, edge.target) for edge in edges if edge.event == "told.response"] == [
        ("b", "b"),
        ("a", "b"),
        ("c", "a"),
    ]
    assert len(system.automata.automaton("C").edges) > len(edges)


def test_where_transitions_never_compete_all_are_executed() -> None:
    text = RIVALS.replace("on response from told do n := 1", "").replace("on response from told goto b", "", 1)
    system = ExecutableSystem(model_of(text), Deployment.CONTROLLER)
    assert system.executed_automata is system.automata
