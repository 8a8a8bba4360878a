"""The store of nodes in the kernel: nodes, answers and steps as in Python; answers as of the states one by one."""

import shutil
from itertools import product
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.conditions.multivalued import CompiledSpace, Cube, Effort, EffortExceededError, Node, Space, space_of
from robosc.expressions import IntegerType
from robosc.kernel import kernel_module
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Subject, SubjectDomain
from support.effort import examples

if shutil.which("cc") is None:
    pytest.skip("there is no C compiler", allow_module_level=True)

SIZES = {"A": 2, "B": 5, "C": 3, "D": 4}


def domains_of(sizes: dict[str, int]) -> dict[Subject, SubjectDomain]:
    return {(name, "n"): SubjectDomain(range(size), IntegerType(0, size - 1)) for name, size in sizes.items()}


def both_stores(effort: int, sizes: dict[str, int] = SIZES) -> tuple[Space, Space]:
    """A store in Python and one in the kernel, in which each value is a class of its own."""
    domains = domains_of(sizes)
    diagrams = [DecisionDiagram((DecisionNode(name, "n", (0, 1), (0, 1)),), 2) for name in sizes]
    plain = Space(diagrams, domains, Effort(10**6), apart=domains)
    compiled = space_of(diagrams, domains, Effort(10**6), apart=domains)
    assert isinstance(compiled, CompiledSpace)
    plain.effort, compiled.effort = Effort(effort).part(effort), Effort(2 * effort).part(effort)
    return plain, compiled


def random_cube(dice: Random, space: Space) -> Cube:
    return tuple(dice.randint(1, full) if dice.random() < 0.7 else full for full in space.full)


def asked(space: Space, question: str, arguments: tuple[Any, ...]) -> object:
    """An answer, or that it takes too many steps."""
    try:
        return getattr(space, question)(*arguments)
    except EffortExceededError:
        return "too many steps"


def holds(space: Space, node: Node, state: tuple[int, ...]) -> bool:
    while node > 1:
        variable, children = space.variable(node), space.children(node)
        node = children[state[variable]]
    return node == 1


@settings(max_examples=examples(60))
@given(seed=st.integers(0, 2**32))
def test_it_does_what_python_does_step_by_step(seed: int) -> None:
    dice = Random(seed)
    plain, compiled = both_stores(dice.choice((30, 300, 10_000)))
    nodes: list[Node] = [0, 1]
    for _ in range(40):
        a, b = dice.choice(nodes), dice.choice(nodes)
        cube = random_cube(dice, plain)
        question, arguments = dice.choice(
            [
                ("of_cube", (cube,)),
                ("of_cube", (cube,)),
                ("both", (a, b)),
                ("either", (a, b)),
                ("without", (a, b)),
                ("fixed", (a, dice.randrange(len(SIZES)))),
                ("meets", (a, cube)),
                ("meeting", (a, cube, dice.randrange(len(SIZES)))),
                ("paths", (a,)),
                *([("shortest_path", (a,)), ("enclosing_cube", (a,))] if a else []),
            ]
        )
        answer = asked(plain, question, arguments)
        assert asked(compiled, question, arguments) == answer, (question, arguments)
        assert compiled.effort.left == plain.effort.left
        if isinstance(answer, int) and question in ("of_cube", "both", "either", "without"):
            nodes.append(answer)
    for node in nodes:
        assert (compiled.variable(node), compiled.children(node)) == (plain.variable(node), plain.children(node))


@settings(max_examples=examples(30))
@given(seed=st.integers(0, 2**32))
def test_answers_are_those_of_the_states(seed: int) -> None:
    dice = Random(seed)
    _, space = both_stores(10**6)
    states = list(product(*(range(len(classes)) for classes in space.classes)))
    sets = []
    for _ in range(2):
        cubes = [random_cube(dice, space) for _ in range(dice.randint(0, 5))]
        sets.append(({state for state in states if any(_is_in(state, cube) for cube in cubes)}, space.sum_of(cubes)))
    (left, a), (right, b) = sets
    expectations = (
        (left & right, space.both(a, b)),
        (left | right, space.either(a, b)),
        (left - right, space.without(a, b)),
    )
    for expected, node in expectations:
        assert {state for state in states if holds(space, node, state)} == expected
    cube = random_cube(dice, space)
    inside = {state for state in left if _is_in(state, cube)}
    assert space.meets(a, cube) == bool(inside)
    for place in range(len(SIZES)):
        free = (*cube[:place], space.full[place], *cube[place + 1 :])
        met = {state[place] for state in left if _is_in(state, free)}
        assert space.meeting(a, free, place) == sum(1 << value for value in met)
    if left:
        path = space.shortest_path(a)
        assert {state for state in states if _is_in(state, path)} <= left


def _is_in(state: tuple[int, ...], cube: Cube) -> bool:
    return all(mask >> value & 1 for value, mask in zip(state, cube, strict=True))


def test_many_nodes_are_kept_apart() -> None:
    """Tables grow more than once."""
    plain, compiled = both_stores(10**6, dict.fromkeys(("A", "B", "C", "D", "E"), 6))
    dice = Random(1)
    for space in (plain, compiled):
        dice.seed(1)
        node = 0
        for _ in range(400):
            node = space.either(node, space.of_cube(tuple(1 << dice.randrange(6) for _ in range(5))))
    assert len(plain._nodes) > 2_000
    assert compiled.diagram(node) == plain.diagram(node)
    assert compiled.effort.left == plain.effort.left


def test_places_with_more_classes_are_left_to_python() -> None:
    domains = domains_of({"A": 65})
    diagrams = [DecisionDiagram((DecisionNode("A", "n", (0, 1), (0, 1)),), 2)]
    assert type(space_of(diagrams, domains, Effort(1_000), apart=domains)) is Space
    assert type(space_of(diagrams, domains, Effort(1_000))) is CompiledSpace


def test_what_cannot_be_is_refused() -> None:
    module = kernel_module()
    assert module is not None
    store = module.space((2, 3))
    with pytest.raises(ValueError, match="1 to 64 classes"):
        module.space((65,))
    with pytest.raises(ValueError, match="a child for each class"):
        module.space_make(store, 0, (0, 1, 0), 10)
    with pytest.raises(ValueError, match="a child for each class"):
        module.space_make(store, 2, (0, 1), 10)
    with pytest.raises(IndexError, match="no node 7"):
        module.space_make(store, 0, (0, 7), 10)
    with pytest.raises(IndexError, match="no node 2"):
        module.space_apply(store, 0, 2, 1, 10)
    with pytest.raises(ValueError, match="a set for each place"):
        module.space_meets(store, 1, (1,))
    with pytest.raises(OverflowError):
        module.space_meets(store, 1, (2**64, 1))
    with pytest.raises(IndexError, match="no place 2"):
        module.space_meeting(store, 1, (3, 7), 2)
    with pytest.raises(ValueError, match="PyCapsule"):
        module.space_meets(object(), 1, (3, 7))
