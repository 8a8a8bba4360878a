"""Random CIF models: what the front end makes of them steps as the syntax tree says."""

from random import Random

import pytest

from robosc.automata import check_system
from robosc.automata.semantics import Semantics
from robosc.automata.state import subject_domain, subjects
from robosc.cif import check_cif
from robosc.source import Bundle, SourceFile
from support import random_cif_instances
from support.cif_meaning import Meaning
from support.effort import examples
from support.random_cif import EVENTS, random_model
from support.random_cif_instances import random_instances


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(25)))
def test_steps_are_those_of_the_syntax_tree(seed: int) -> None:
    random = Random(seed)
    text = random_model(random)
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    if found.system is None:
        # Ranges that do not even overlap are an error, and so are results of constants beyond all ranges.
        assert {item.code for item in found.diagnostics} == {"cif-type"}, [str(item) for item in found.diagnostics]
        assert seed == 2 or seed >= 40
        return
    check_system(found.system)
    semantics, meaning = Semantics(found.system), Meaning(text)
    names = [str(subject) for subject in subjects(found.system)]
    states = semantics.initial_states
    for state in random.sample(states, min(60, len(states))):
        values = dict(zip(names, state, strict=True))
        for event, is_controllable in EVENTS.items():
            if not any(event in item.alphabet for item in found.system.automata):
                continue
            allowed, expected = meaning.targets(values, event, is_controllable=is_controllable)
            targets = {tuple(target[name] for name in names) for target in expected}
            assert semantics.targets(state, event) == targets, (text, values, event)
            if targets:
                assert semantics.condition(state, event) is allowed, (text, values, event)


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(25)))
def test_instances_step_as_the_syntax_tree_says(seed: int) -> None:
    random = Random(seed)
    text = random_instances(random)
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    if found.system is None:
        assert {item.code for item in found.diagnostics} == {"cif-type"}, [str(item) for item in found.diagnostics]
        assert seed >= 25
        return
    check_system(found.system)
    semantics, meaning = Semantics(found.system), Meaning(text)
    places = subjects(found.system)
    for _ in range(60):
        state = tuple(random.choice(subject_domain(found.system, place)) for place in places)
        values = dict(zip(map(str, places), state, strict=True))
        for event, is_controllable in random_cif_instances.EVENTS.items():
            allowed, expected = meaning.targets(values, event, is_controllable=is_controllable)
            targets = {tuple(target[str(place)] for place in places) for target in expected}
            assert semantics.targets(state, event) == targets, (text, values, event)
            if targets:
                assert semantics.condition(state, event) is allowed, (text, values, event)
