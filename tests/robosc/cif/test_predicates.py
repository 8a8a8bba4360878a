"""Random predicates: what the front end and synthesis say of states is what the syntax tree says."""

from collections.abc import Mapping
from random import Random

import pytest

from robosc.automata import check_system
from robosc.automata.semantics import Semantics
from robosc.automata.state import subject_domain, subjects
from robosc.cif import check_cif
from robosc.expressions import Expression, Value
from robosc.expressions.evaluate import evaluate
from robosc.source import Bundle, SourceFile
from robosc.synthesis import SynthesisStatus, synthesize
from support.cif_predicates_twin import Predicates
from support.cif_synthesis_twin import Synthesis
from support.effort import examples
from support.random_cif_predicates import EVENTS, INPUTS, random_predicates


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(25)))
def test_states_are_as_the_syntax_tree_says(seed: int) -> None:
    random = Random(seed)
    text = random_predicates(random)
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    assert found.system is not None, [str(item) for item in found.diagnostics]
    check_system(found.system)
    system, semantics, twin = found.system, Semantics(found.system), Predicates(text)
    places = subjects(system)
    domains = [subject_domain(system, place) for place in places]
    initial = set(semantics.initial_states)
    others = [tuple(map(random.choice, domains)) for _ in range(150)]
    for state in [*random.sample(sorted(initial, key=repr), min(len(initial), 50)), *others]:
        values = dict(zip(map(str, places), state, strict=True))
        read = {(place.automaton, place.variable): value for place, value in zip(places, state, strict=True)}
        assert (state in initial) is twin.is_initial(values), (text, values)
        assert semantics.is_marked(state) is twin.is_marked(values), (text, values)
        required = all(_is_true(item, read) for item in system.invariants)
        assert required is twin.holds("requirement", values), (text, values)
        # States against a plant invariant do not exist.
        for event, is_controllable in EVENTS.items() if twin.holds("plant", values) else ():
            allowed, targets = twin.meaning.targets(values, event, is_controllable=is_controllable)
            if not twin.allows("plant", event, values):
                targets = []
            expected = {
                tuple(target[str(place)] for place in places) for target in targets if twin.holds("plant", target)
            }
            assert semantics.targets(state, event) == expected, (text, values, event)
            if expected:
                assert semantics.condition(state, event) is (allowed and twin.allows("requirement", event, values)), (
                    text, values, event,
                )  # fmt: skip


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(60)))
def test_synthesis_is_as_the_syntax_tree_says(seed: int) -> None:
    text = random_predicates(Random(seed), is_open=True)
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    assert found.system is not None, [str(item) for item in found.diagnostics]
    check_system(found.system)
    names = list(map(str, subjects(found.system)))
    initial = Semantics(found.system).initial_states
    if len(initial) > 200:
        return
    inputs = {name: values for name, (_, values) in INPUTS.items() if name in names}
    twin = Synthesis(Predicates(text), EVENTS, inputs)
    states = twin.controlled((dict(zip(names, state, strict=True)) for state in initial), limit=600)
    if states is not None:
        result = synthesize(found.system)
        is_empty = result.status is SynthesisStatus.EMPTY
        assert (0 if is_empty else result.statistics.states) == states, text


def _is_true(expression: Expression, values: Mapping[tuple[str, str | None], Value]) -> bool:
    return (
        evaluate(
            expression,
            lambda automaton, variable: values[automaton, variable],
            lambda automaton: str(values[automaton, None]),
        )
        is True
    )
