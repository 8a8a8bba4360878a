"""Formulas of diagrams: the same meaning in every state, short, and bounded work."""

from collections.abc import Callable
from itertools import product
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.conditions.formula import STEPS, _searches, to_expression
from robosc.conditions.literals import Vocabulary, membership, operands
from robosc.conditions.multivalued import Effort
from robosc.conditions.rendering import TOTAL_STEPS, Formulas, Line, diagram_lines, in_words
from robosc.expressions import BooleanType, EnumType, Expression, IntegerType
from robosc.expressions.evaluate import evaluate as evaluate_expression
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Subject, SubjectDomain, evaluate, validate
from support.effort import examples

COLOURS = ("red", "green", "blue", "white")
DOMAINS: dict[Subject, SubjectDomain] = {
    ("A", None): SubjectDomain(("on", "off", "broken"), None),
    ("A", "flag"): SubjectDomain((False, True), BooleanType()),
    ("A", "n"): SubjectDomain(range(-2, 4), IntegerType(-2, 3)),
    ("B", None): SubjectDomain(("here", "there"), None),
    ("B", "colour"): SubjectDomain(COLOURS, EnumType("Colour", COLOURS)),
    ("C", None): SubjectDomain(("only",), None),
}
PLACES = tuple(DOMAINS)
STATES = [dict(zip(PLACES, item, strict=True)) for item in product(*(range(len(DOMAINS[place])) for place in PLACES))]


def random_diagram(seed: int, *, is_ordered: bool) -> DecisionDiagram:
    """Some nodes over some places; they may decide nothing, and where the order is free test a place again."""
    dice = Random(seed)
    nodes: list[DecisionNode] = []
    places = [place for place in reversed(PLACES) for _ in range(dice.randint(0, 3))]
    level, below = None, 0
    for place in places if is_ordered else dice.sample(places, len(places)):
        size = len(DOMAINS[place])
        if place != level:
            level, below = place, len(nodes)
        starts = (0, *sorted(dice.sample(range(1, size), dice.randint(0, min(3, size - 1)))))
        # Newer nodes more often: a root that leads to nearly nothing shows little.
        choices = [0, 1, *range(2, below + 2), *range(max(2, below - 2), below + 2)]
        nodes.append(DecisionNode(*place, starts, tuple(dice.choice(choices) for _ in starts)))
    diagram = DecisionDiagram(tuple(nodes), len(nodes) + 1)
    if is_ordered:
        validate(diagram, DOMAINS)
    return diagram


def holds(diagram: DecisionDiagram, state: dict[Subject, int]) -> bool:
    return evaluate(diagram, lambda automaton, variable: state[automaton, variable])


def plain(formula: Expression, state: dict[Subject, int]) -> object:
    return evaluate_expression(
        formula,
        lambda automaton, variable: DOMAINS[automaton, variable][state[automaton, variable]],
        lambda automaton: str(DOMAINS[automaton, None][state[automaton, None]]),
    )


def by_structure(diagram: DecisionDiagram) -> int:
    """The twin: operands of the formula that a diagram spells out branch by branch, true ones only."""
    sizes = [0, 0]
    for node in diagram.nodes:
        place = (node.automaton, node.variable)
        ends = (*node.starts[1:], len(DOMAINS[place]))
        branches: dict[int, list[range]] = {}
        for start, end, child in zip(node.starts, ends, node.children, strict=True):
            branches.setdefault(child, []).append(range(start, end))
        if len(branches) == 1:
            sizes.append(sizes[node.children[0]])
            continue
        tests = {child: membership(place, DOMAINS[place], tuple(runs)).size[0] for child, runs in branches.items()}
        sizes.append(sum(tests[child] + sizes[child] for child in branches if child))
    return sizes[diagram.root]


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_formulas_and_lines_mean_their_diagrams(seed: int, is_ordered: bool) -> None:
    diagram = random_diagram(seed, is_ordered=is_ordered)
    formula = to_expression(diagram, DOMAINS, limit=1000)
    assert formula is not None
    lines = {line.number: line for line in diagram_lines(diagram, Vocabulary(DOMAINS))}
    assert list(lines) == list(range(1, len(lines) + 1))
    for state in STATES:
        expected = holds(diagram, state)
        assert plain(formula, state) is expected
        assert (read_from_the_top(lines, state) if lines else plain(formula, state)) is expected


def read_from_the_top(lines: dict[int, Line], state: dict[Subject, int]) -> bool:
    at: int | bool = 1
    while not isinstance(at, bool):
        line = lines[at]
        following = next((to for test, to in line.cases if plain(test.expression, state)), line.otherwise)
        assert isinstance(following, bool) or following > at
        at = following
    return at


def test_formulas_are_not_longer_than_diagrams_spelt_out() -> None:
    total = spelt_out = 0
    for seed in range(150):
        diagram = random_diagram(seed, is_ordered=True)
        formula = to_expression(diagram, DOMAINS, limit=1000)
        assert formula is not None
        # A choice counts as an operand, and single steps may miss a little.
        assert operands(formula) <= by_structure(diagram) + 2, (seed, in_words(formula, ()))
        total, spelt_out = total + operands(formula), spelt_out + by_structure(diagram)
    assert total < 0.7 * spelt_out


def node(automaton: str, variable: str | None, starts: tuple[int, ...], children: tuple[int, ...]) -> DecisionNode:
    return DecisionNode(automaton, variable, starts, children)


FLAG = node("A", "flag", (0, 1), (0, 1))


@pytest.mark.parametrize(
    ("nodes", "text"),
    [
        ([FLAG], "A.flag"),
        ([node("A", "flag", (0, 1), (1, 0))], "not A.flag"),
        ([node("A", None, (0, 1), (1, 0))], "A.on"),
        ([node("A", None, (0, 1), (0, 1))], "not A.on"),
        ([node("B", None, (0, 1), (0, 1))], "B.there"),
        ([node("B", "colour", (0, 1, 2), (0, 1, 0))], "B.colour = green"),
        ([node("B", "colour", (0, 1, 2), (1, 0, 1))], "B.colour != green"),
        ([node("B", "colour", (0, 2), (0, 1))], "B.colour = blue or B.colour = white"),
        ([node("A", "n", (0, 2), (1, 0))], "A.n <= -1"),
        ([node("A", "n", (0, 2), (0, 1))], "A.n >= 0"),
        ([node("A", "n", (0, 2, 4), (0, 1, 0))], "A.n >= 0 and A.n <= 1"),
        ([node("A", "n", (0, 2, 4), (1, 0, 1))], "A.n <= -1 or A.n >= 2"),
        ([node("A", "n", (0, 2, 3), (0, 1, 0))], "A.n = 0"),
        ([node("A", "n", (0, 2, 3), (1, 0, 1))], "A.n != 0"),
        ([node("A", "n", (0, 1, 2, 3, 4), (1, 0, 1, 0, 1))], "A.n != -1 and A.n != 1"),
        ([FLAG, node("A", None, (0, 1), (2, 0))], "A.on and A.flag"),
        ([FLAG, node("A", None, (0, 1), (1, 2))], "A.on or A.flag"),
        ([FLAG, node("A", None, (0, 1, 2), (2, 0, 1))], "A.broken or A.on and A.flag"),
        ([FLAG, node("A", None, (0, 1), (2, 1))], "not A.on or A.flag"),
        ([node("A", "flag", (0, 1), (1, 0)), node("A", None, (0, 1), (2, 1))], "not (A.on and A.flag)"),
        # Two sums that share nothing, each in its own shortest form.
        (
            [
                node("B", "colour", (0, 1, 2), (0, 1, 0)),
                node("B", None, (0, 1), (2, 1)),
                node("A", "flag", (0, 1), (0, 3)),
                node("A", None, (0, 1), (3, 4)),
            ],
            "(A.on or A.flag) and (B.there or B.colour = green)",
        ),
    ],
)
def test_small_diagrams_read_like_the_model(nodes: list[DecisionNode], text: str) -> None:
    formula = to_expression(DecisionDiagram(tuple(nodes), len(nodes) + 1), DOMAINS, limit=20)
    assert formula is not None
    assert in_words(formula, ()) == text


def test_a_choice_is_printed_as_one() -> None:
    domains: dict[Subject, SubjectDomain] = {(name, None): SubjectDomain(("no", "yes"), None) for name in "XABCDEF"}
    nodes = [node("C", None, (0, 1), (0, 1)), node("B", None, (0, 1), (0, 2)), node("A", None, (0, 1), (0, 3))]
    nodes += [node("F", None, (0, 1), (0, 1)), node("E", None, (0, 1), (0, 5)), node("D", None, (0, 1), (0, 6))]
    diagram = DecisionDiagram((*nodes, node("X", None, (0, 1), (7, 4))), 8)
    formula = to_expression(diagram, domains)
    assert formula is not None
    assert in_words(formula, ()) == "if X.no then D.yes and E.yes and F.yes else A.yes and B.yes and C.yes"


def parity(places: int) -> tuple[DecisionDiagram, dict[Subject, SubjectDomain]]:
    """Return a diagram for an odd number of places that are on: each doubles the formula but adds two nodes."""
    domains: dict[Subject, SubjectDomain] = {
        (f"P{number}", None): SubjectDomain(("off", "on"), None) for number in range(places)
    }
    even, odd, nodes = 0, 1, list[DecisionNode]()
    for name, _ in reversed(domains):
        nodes += [node(name, None, (0, 1), (even, odd)), node(name, None, (0, 1), (odd, even))]
        even, odd = len(nodes), len(nodes) + 1
    return DecisionDiagram(tuple(nodes), even), domains


@pytest.mark.parametrize("places", [5, 12, 40, 90, 400])
def test_what_would_explode_is_given_up(places: int) -> None:
    diagram, domains = parity(places)
    effort = Effort(10 * STEPS)
    assert to_expression(diagram, domains, effort=effort) is None
    assert effort.left >= 9 * STEPS - 1000
    formulas = Formulas(domains)
    assert formulas.formula(diagram) is None
    assert len(diagram_lines(diagram, Vocabulary(domains))) == len(diagram.nodes) - 1


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
@settings(max_examples=examples(40))
def test_a_formula_is_never_longer_than_the_limit(seed: int, limit: int) -> None:
    formula = to_expression(random_diagram(seed, is_ordered=True), DOMAINS, limit=limit)
    assert formula is None or operands(formula) <= limit


@pytest.mark.parametrize("seed", range(40))
def test_earlier_searches_change_nothing(seed: int) -> None:
    """The same formula after the same steps, whether its search is remembered or not, for every limit."""
    diagram, dice = random_diagram(seed, is_ordered=True), Random(seed)
    limits = [dice.randint(1, 40) for _ in range(3)]

    def searched() -> list[tuple[Expression | None, int]]:
        efforts = [Effort(TOTAL_STEPS) for _ in limits]
        return [
            (to_expression(diagram, DOMAINS, limit=limit, effort=effort), effort.left)
            for limit, effort in zip(limits, efforts, strict=True)
        ]

    first, remembered = searched(), searched()
    _searches.cache_clear()
    limits.reverse()
    assert first == remembered == searched()[::-1]


def test_the_effort_of_all_formulas_together_is_bounded() -> None:
    formulas = Formulas(DOMAINS)
    formulas.effort = Effort(10)
    diagram = random_diagram(7, is_ordered=True)
    assert len(diagram.nodes) > 3
    assert formulas.formula(diagram) is None
    assert Formulas(DOMAINS).formula(diagram) is not None
    # A constant takes no effort.
    assert formulas.formula(DecisionDiagram((), 1)) is not None


@pytest.mark.parametrize("count", [200, 20_000])
@pytest.mark.parametrize("make", [range, lambda count: [f"l{number}" for number in range(count)]])
def test_many_ranges_of_one_place_are_printed_without_a_formula(
    count: int, make: Callable[[int], range | list[str]]
) -> None:
    values = make(count)
    type_ = IntegerType(0, count - 1) if isinstance(values, range) else None
    subject = ("A", None if type_ is None else "n")
    domains = {subject: SubjectDomain(values, type_)}
    starts = tuple(range(count))
    diagram = DecisionDiagram((node(*subject, starts, tuple(index % 2 for index in starts)),), 2)
    assert to_expression(diagram, domains, limit=10**6) is None
    assert Formulas(domains).formula(diagram) is None
    (line,) = diagram_lines(diagram, Vocabulary(domains))
    assert line.operands == count // 2
    assert str(line).startswith("[1] A.n = 1 or A.n = 3 or" if type_ else "[1] A.l1 or A.l3 or")


def test_a_diagram_line_by_line() -> None:
    nodes = [
        node("B", "colour", (0, 1, 3), (0, 1, 0)),
        node("A", "n", (0, 2, 4), (2, 1, 0)),
        node("C", None, (0,), (3,)),
        node("A", None, (0, 1), (4, 2)),
    ]
    diagram = DecisionDiagram(tuple(nodes), 5)
    lines = diagram_lines(diagram, Vocabulary(DOMAINS))
    assert [str(line) for line in lines] == [
        "[1] if A.on then [2] else [3]",
        "[2] if A.n >= 2 then false else if A.n <= -1 then [3] else true",
        "[3] B.colour = green or B.colour = blue",
    ]
    assert lines[1].json() == {
        "node": 2,
        "cases": [{"if": "A.n >= 2", "then": False}, {"if": "A.n <= -1", "then": 3}],
        "else": True,
    }
    assert diagram_lines(DecisionDiagram((), 1), Vocabulary(DOMAINS)) == ()
