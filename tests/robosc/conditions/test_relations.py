"""Formulas with relations between integers, or enumerations: the same meaning everywhere, and short where it is."""

from collections.abc import Callable
from itertools import product
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.conditions.cover import Words
from robosc.conditions.formula import STEPS, to_expression
from robosc.conditions.literals import Vocabulary, has_relation, operands
from robosc.conditions.multivalued import Effort, Space
from robosc.conditions.relations import MAXIMUM_PLACES, Description, Relation, Relations
from robosc.conditions.rendering import in_words
from robosc.expressions import Binary, Constant, EnumType, Expression, IntegerType, VariableRead
from robosc.expressions.evaluate import evaluate as evaluate_expression
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Domains, Subject, SubjectDomain, evaluate, validate
from support.effort import examples

Predicate = Callable[..., bool]


def integers(**ranges: tuple[int, int]) -> dict[Subject, SubjectDomain]:
    """Variables `A.n` by name `An` with their ranges."""
    return {
        (name[0], name[1:]): SubjectDomain(range(low, high + 1), IntegerType(low, high))
        for name, (low, high) in ranges.items()
    }


def rooms(*names: str, kind: str = "Room") -> dict[Subject, SubjectDomain]:
    """Variables of an enumeration, `A.r` by name `Ar`."""
    values = ("hall", "attic", "cellar", "yard")
    return {(name[0], name[1:]): SubjectDomain(values, EnumType(kind, values)) for name in names}


def diagram_of(domains: Domains, holds: Predicate) -> DecisionDiagram:
    """The smallest diagram of a predicate, by looking at every state."""
    places = list(domains)
    nodes: list[DecisionNode] = []
    numbers: dict[DecisionNode, int] = {}

    def number(values: tuple[object, ...]) -> int:
        if len(values) == len(places):
            return int(holds(*values))
        place = places[len(values)]
        children = [number((*values, value)) for value in domains[place]]
        starts = [index for index, child in enumerate(children) if not index or child != children[index - 1]]
        if len(starts) == 1:
            return children[0]
        node = DecisionNode(*place, tuple(starts), tuple(children[start] for start in starts))
        if node not in numbers:
            nodes.append(node)
            numbers[node] = len(nodes) + 1
        return numbers[node]

    root = number(())
    diagram = DecisionDiagram(tuple(nodes), root)
    validate(diagram, domains)
    return diagram


def value_of(formula: Expression, domains: Domains, values: tuple[object, ...]) -> object:
    state = dict(zip(domains, values, strict=True))
    return evaluate_expression(formula, lambda a, v: state[a, v], lambda a: str(state[a, None]))  # type: ignore[arg-type,return-value]


def same_everywhere(formula: Expression, domains: Domains, holds: Predicate) -> None:
    for values in product(*domains.values()):
        assert value_of(formula, domains, values) is bool(holds(*values)), (in_words(formula, ()), values)


TWO = integers(An=(0, 9), Bm=(0, 9))
APART = integers(An=(0, 9), Ck=(-3, 12))
THREE = integers(An=(0, 5), Bm=(0, 5), Ck=(0, 5))
FOUR = integers(An=(0, 4), Bm=(0, 4), Ck=(0, 4), Dk=(0, 4))
MODE: dict[Subject, SubjectDomain] = {("X", None): SubjectDomain(("on", "off", "mid"), None), **TWO}


@pytest.mark.parametrize(
    ("domains", "holds", "text"),
    [
        (integers(An=(0, 20), Bm=(0, 20)), lambda a, b: a + b <= 20, "A.n + B.m <= 20"),
        (APART, lambda a, c: a < c, "A.n < C.k"),
        (APART, lambda a, c: a > c, "A.n > C.k"),
        (APART, lambda a, c: a <= c, "A.n <= C.k"),
        (APART, lambda a, c: a == c, "A.n = C.k"),
        (APART, lambda a, c: a != c, "A.n != C.k"),
        (APART, lambda a, c: a <= c - 2, "A.n <= C.k - 2"),
        (APART, lambda a, c: a >= c + 2, "A.n >= C.k + 2"),
        (APART, lambda a, c: a + c <= -2, "A.n + C.k <= -2"),
        (TWO, lambda a, b: a + b == 7, "A.n + B.m = 7"),
        (TWO, lambda a, b: abs(a - b) <= 2, "A.n >= B.m - 2 and A.n <= B.m + 2"),
        (TWO, lambda a, b: abs(a - b) >= 2, "A.n <= B.m - 2 or A.n >= B.m + 2"),
        (TWO, lambda a, b: a <= b and a <= 3, "A.n <= 3 and A.n <= B.m"),
        (THREE, lambda a, b, c: a + b + c < 7, "A.n + B.m + C.k <= 6"),
        (THREE, lambda a, b, c: a + b <= c + 2, "A.n + B.m <= C.k + 2"),
        (THREE, lambda a, b, c: a <= b <= c, "A.n <= B.m and B.m <= C.k"),
        (THREE, lambda a, b, c: a <= b or b <= c, "A.n <= B.m or B.m <= C.k"),
        (FOUR, lambda a, b, c, d: a + b + c + d <= 9, "A.n + B.m + C.k + D.k <= 9"),
        (FOUR, lambda a, b, c, d: a < b or c < d, "A.n < B.m or C.k < D.k"),
        (MODE, lambda x, a, b: x == "on" and a <= b, "X.on and A.n <= B.m"),
        (MODE, lambda x, a, b: x == "on" or a != b, "X.on or A.n != B.m"),
        (MODE, lambda x, a, b: a + b <= (9 if x == "on" else 5), "A.n + B.m <= 5 or X.on and A.n + B.m <= 9"),
        (MODE, lambda x, a, b: a <= b if x == "on" else a >= b, "if X.on then A.n <= B.m else A.n >= B.m"),
        (
            MODE,
            lambda x, a, b: {"on": a <= b, "off": True, "mid": a == 2}[x],
            "X.off or X.mid and A.n = 2 or X.on and A.n <= B.m",
        ),
        # Tests of single places read better when the operands are as many.
        (TWO, lambda a, b: a == b == 0, "A.n = 0 and B.m = 0"),
        (integers(An=(0, 1), Bm=(0, 1)), lambda a, b: a < b, "A.n = 0 and B.m = 1"),
        (integers(An=(0, 1), Bm=(0, 1)), lambda a, b: a == b, "A.n = B.m"),
        (TWO, lambda a, b: a <= 3 and b <= 4, "A.n <= 3 and B.m <= 4"),
        (TWO, lambda a, b: a != b and a + b <= 12, "A.n != B.m and A.n + B.m <= 12"),
        (TWO, lambda a, b: a != b and (a, b) not in {(5, 4), (7, 2)}, None),
        (rooms("Ar", "Br"), lambda a, b: a == b, "A.r = B.r"),
        (rooms("Ar", "Br"), lambda a, b: a != b, "A.r != B.r"),
        (rooms("Ar", "Br"), lambda a, b: a != b != "yard", "B.r != yard and A.r != B.r"),
        (rooms("Ar", "Br"), lambda a, b: a == b or a == "hall", "A.r = hall or A.r = B.r"),
        (rooms("Ar", "Br", "Cr"), lambda *v: len(set(v)) == 3, "A.r != B.r and A.r != C.r and B.r != C.r"),
        (rooms("Ar", "Br", "Cr", "Dr"), lambda a, b, c, d: a != b or c != d, "A.r != B.r or C.r != D.r"),
        ({**rooms("Ar", "Br"), **TWO}, lambda a, b, n, m: a != b and n <= m, "A.r != B.r and A.n <= B.m"),
        ({**MODE, **rooms("Ar", "Br")}, lambda x, n, m, a, b: x == "on" or a != b, "X.on or A.r != B.r"),
        # One is of another type, however much their values look alike; nor is one more than the other.
        ({**rooms("Ar"), **rooms("Br", kind="Place")}, lambda a, b: a == b, None),
        (rooms("Ar", "Br"), lambda a, b: a < b, None),
        # No difference and no sum.
        (integers(An=(0, 4), Bm=(0, 4)), lambda a, b: a * b <= 2, None),
    ],
)
def test_relations_read_like_the_model(domains: Domains, holds: Predicate, text: str | None) -> None:
    formula = to_expression(diagram_of(domains, holds), domains)
    assert formula is not None
    same_everywhere(formula, domains, holds)
    if text is not None:
        assert in_words(formula, ()) == text


RANGES = st.tuples(st.integers(-4, 3), st.integers(0, 5)).map(lambda item: (item[0], sum(item)))


@st.composite
def shapes(draw: st.DrawFn, count: int, depth: int = 2) -> Predicate:
    """A predicate over a location and some integers: relations, tests of single places, and what joins them."""
    kind = draw(st.sampled_from(["relation", "relation", "single", "location", *["joined"] * 3 * (depth > 0)]))
    if kind == "location":
        where = draw(st.sampled_from(["on", "off", "mid"]))
        return lambda x, *values: x == where
    if kind == "joined":
        first, second = draw(shapes(count, depth - 1)), draw(shapes(count, depth - 1))
        ways: list[Predicate] = [
            lambda *values: first(*values) and second(*values),
            lambda *values: first(*values) or second(*values),
            lambda *values: not (first(*values) and second(*values)),
            lambda *values: first(*values) if values[0] == "on" else second(*values),
        ]
        return draw(st.sampled_from(ways))
    signs = draw(st.lists(st.sampled_from([1, -1, 0]), min_size=count, max_size=count))
    if kind == "single":
        place = draw(st.integers(0, count - 1))
        signs = [int(number == place) for number in range(count)]
    bound = draw(st.integers(-5, 8))
    compare = draw(st.sampled_from(["<=", ">=", "=", "!="]))

    def holds(x: object, *values: int) -> bool:
        total = sum(sign * value for sign, value in zip(signs, values, strict=True))
        return {"<=": total <= bound, ">=": total >= bound, "=": total == bound, "!=": total != bound}[compare]

    return holds


@settings(max_examples=examples(60))
@given(st.data(), st.integers(2, 3))
def test_predicates_with_relations_in_them(data: st.DataObject, count: int) -> None:
    ranges = {f"{name}n": data.draw(RANGES) for name in "ABC"[:count]}
    domains = {("X", None): SubjectDomain(("on", "off", "mid"), None), **integers(**ranges)}
    holds = data.draw(shapes(count))
    formula = to_expression(diagram_of(domains, holds), domains, limit=1000, effort=Effort(20 * STEPS))
    if formula is not None:
        same_everywhere(formula, domains, holds)


@st.composite
def enum_shapes(draw: st.DrawFn, depth: int = 2) -> Predicate:
    """A predicate over enumerations and an integer: relations, tests of single places, and what joins them."""
    ways: list[Predicate]
    if depth and draw(st.booleans()):
        first, second = draw(enum_shapes(depth - 1)), draw(enum_shapes(depth - 1))
        ways = [
            lambda *values: first(*values) and second(*values),
            lambda *values: first(*values) or second(*values),
            lambda *values: not first(*values),
        ]
        return draw(st.sampled_from(ways))
    place, other = draw(st.permutations(range(3)))[:2]
    value = draw(st.sampled_from(["hall", "yard"]))
    ways = [
        lambda *values: values[place] == values[other],
        lambda *values: values[place] != value,
        lambda *values: values[3] <= 2,
    ]
    return draw(st.sampled_from(ways))


@settings(max_examples=examples(60))
@given(st.data())
def test_predicates_with_relations_between_enumerations(data: st.DataObject) -> None:
    domains = {**rooms("Ar", "Br", "Cr"), **integers(Dn=(0, 4))}
    holds, matters = data.draw(enum_shapes()), data.draw(enum_shapes())
    formula = to_expression(diagram_of(domains, holds), domains, limit=1000, effort=Effort(20 * STEPS))
    if formula is not None:
        same_everywhere(formula, domains, holds)
    check_descriptions(domains, tuple(domains)[:3], holds, matters)


@settings(max_examples=examples(20))
@given(st.integers(0, 2**32 - 1))
def test_any_predicate(seed: int) -> None:
    """Tables of dice: neighbours are often equal, so that values merge into ranges that relations cut through."""
    dice = Random(seed)
    domains = integers(An=(-2, dice.randint(0, 4)), Bm=(dice.randint(-3, 0), 3), Ck=(0, dice.randint(1, 2)))
    steps = [dice.randint(1, 3) for _ in domains]
    table: dict[tuple[int, ...], bool] = {}

    def holds(*values: int) -> bool:
        cell = tuple(value // step for value, step in zip(values, steps, strict=True))
        return table.setdefault(cell, dice.random() < 0.6)

    # The diagram is asked first, so that the table is whole.
    diagram = diagram_of(domains, holds)
    formula = to_expression(diagram, domains, limit=1000)
    if formula is not None:
        same_everywhere(formula, domains, holds)


@st.composite
def modes(draw: st.DrawFn) -> Predicate:
    """A relation that is narrower in one mode, and ranges of single places."""
    sign, wide, narrow = draw(st.sampled_from([1, -1])), draw(st.integers(-3, 6)), draw(st.integers(1, 4))
    low, high = draw(st.integers(-4, 0)), draw(st.integers(1, 6))

    def holds(x: object, a: int, b: int) -> bool:
        return a + sign * b <= wide - narrow * (x == "on") and low <= a and b <= high

    return holds


@settings(max_examples=examples(60))
@given(st.data())
def test_descriptions_between_what_must_be_and_what_must_not(data: st.DataObject) -> None:
    """With states that do not matter: true where wanted, false where forbidden, for merged values and single ones."""
    domains = {
        ("X", None): SubjectDomain(("on", "off", "mid"), None),
        **integers(An=data.draw(RANGES), Bn=data.draw(RANGES)),
    }
    holds, matters = data.draw(st.one_of(modes(), shapes(2))), data.draw(st.one_of(modes(), shapes(2)))
    check_descriptions(domains, tuple(domains)[1:], holds, matters)


def check_descriptions(domains: Domains, compared: tuple[Subject, ...], holds: Predicate, matters: Predicate) -> None:
    """Each description is right where it matters, whether the values of the places are all distinguished or not."""
    sets = [
        diagram_of(domains, lambda *values: matters(*values) and holds(*values)),
        diagram_of(domains, lambda *values: matters(*values) and not holds(*values)),
    ]
    if min(diagram.root for diagram in sets) < 2:
        return
    for apart in ((), compared):
        space = Space(sets, domains, Effort(200_000), apart=apart)
        relations = Relations(space, Words(space, Vocabulary(domains)), domains)
        places = relations.comparable(range(len(space.subjects)))
        if not places:
            return
        wanted, forbidden = (space.of(diagram) for diagram in sets)
        for description in relations.descriptions(wanted, forbidden, places):
            for values in product(*domains.values()):
                if matters(*values):
                    assert is_described(relations, space, description, domains, values) is bool(holds(*values))
            if apart:
                states = relations.states(description)
                assert space.without(wanted, states) == 0
                assert space.both(forbidden, states) == 0


def is_described(
    relations: Relations, space: Space, description: Description, domains: Domains, values: tuple[object, ...]
) -> bool:
    state = dict(zip(domains, values, strict=True))
    single = space.diagram(description.single)
    return (
        all(value_of(relations.expression(item), domains, values) is True for item in description.relations)
        and evaluate(single, lambda a, v: list(domains[a, v]).index(state[a, v]))  # type: ignore[arg-type]
        and (description.inner is None or not is_described(relations, space, description.inner, domains, values))
    )


@pytest.mark.parametrize("low", [2**31 - 4, -(2**31), 2**30 - 1])
@pytest.mark.parametrize(
    "holds",
    [lambda a, b: a <= b + 1, lambda a, b: a >= b - 2, lambda a, b: a <= b, lambda a, b: abs(a + b) < 2**32 - 4],
)
def test_no_number_in_a_relation_leaves_32_bits(low: int, holds: Predicate) -> None:
    domains = integers(An=(low, low + 3), Bm=(low, low + 3))
    formula = to_expression(diagram_of(domains, holds), domains)
    assert formula is not None
    same_everywhere(formula, domains, holds)


def test_enumerations_of_two_types_are_not_compared() -> None:
    domains = {**rooms("Ar"), **rooms("Br", kind="Place")}
    formula = to_expression(diagram_of(domains, lambda a, b: a == b), domains)
    assert formula is not None and not has_relation(formula)


def test_so_many_integers_are_left_alone() -> None:
    names = [f"{name}n" for name in "ABCDEFG"]
    assert len(names) > MAXIMUM_PLACES
    domains = integers(**dict.fromkeys(names, (0, 1)))
    effort = Effort(10 * STEPS)
    formula = to_expression(diagram_of(domains, lambda *values: sum(values) <= 3), domains, effort=effort)
    assert formula is None or not has_relation(formula)
    assert effort.left >= 9 * STEPS - 1000


@pytest.mark.parametrize("seed", range(3))
def test_the_work_on_dense_tables_is_bounded(seed: int) -> None:
    dice = Random(seed)
    domains = integers(An=(0, 40), Bm=(0, 40))
    diagram = diagram_of(domains, lambda a, b: dice.random() < 0.5)
    effort = Effort(10 * STEPS)
    assert to_expression(diagram, domains, effort=effort) is None
    assert effort.left >= 9 * STEPS - 5000


def test_a_comparison_counts_once_for_each_variable() -> None:
    total: Expression = Binary("+", VariableRead("A", "n"), VariableRead("B", "m"))
    assert operands(Binary("<=", total, VariableRead("C", "k"))) == 3
    assert operands(Binary("<=", total, Constant(3))) == 2
    assert operands(Binary("<=", VariableRead("A", "n"), Constant(3))) == 1


def test_relations_of_more_than_two_places_have_opposites() -> None:
    form = ((0, 1), (1, 1), (2, -1))
    assert Relation(form, "<=", 3).opposite == Relation(form, ">=", 4)
    assert Relation(form, "=", 3).opposite.opposite == Relation(form, "=", 3)
