"""Tests of the wide integers whose bits are interleaved, and of the benefit of that."""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from itertools import combinations

import pytest
from hypothesis import given, settings

from robosc.automata import DiscreteVariable, Edge, EventCondition, InputVariable, System
from robosc.automata.state import Subject
from robosc.errors import UnsupportedModelError
from robosc.expressions import BooleanType, Call, Conditional, Expression, IntegerType, Unary
from robosc.supervisor.diagram import evaluate
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.synthesis import SynthesisStatus, blocks, diagrams, synthesize
from robosc.synthesis.blocks import blocks_of
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.verification import CheckOutcome, verify_explicitly
from support.effort import examples
from support.random_systems import explicit_supervisor, systems
from support.systems import automaton, edge, operation, read, received, system

WIDE = IntegerType(0, 1000)
NARROW = IntegerType(0, 15)
A, B, C = (Subject(name, "n") for name in "ABC")


def three(
    condition: Expression | None = None,
    *,
    guard: Expression | None = None,
    update: Expression | None = None,
    type_: IntegerType = WIDE,
) -> System:
    """Three automata with an integer each; the first has one edge, the others are still."""
    variables = [DiscreteVariable("n", type_, (0,))]
    first = edge("l -go-> l", *([] if guard is None else [guard]), **({} if update is None else {"n": update}))
    made = system(
        automaton("A", [first, "l -other-> l"], variables=variables),
        *(automaton(name, ["l -other-> l"], variables=variables) for name in "BC"),
    )
    return replace(made, conditions=() if condition is None else (EventCondition("go", condition),))


def together(made: System) -> set[tuple[str, ...]]:
    """The blocks of more than one place."""
    return {tuple(map(str, block)) for block in blocks_of(made).places if len(block) > 1}


a, b, c = (read(f"{name}.n") for name in "ABC")


@pytest.mark.parametrize(
    "relation",
    [
        operation(a, "<=", b),
        operation(operation(a, "-", b), ">", 3),
        operation(operation(a, "*", 3), "=", operation(b, "div", 2)),
        Unary("not", operation(Unary("-", a), "!=", b)),
        operation(Call("min", (a, b)), "<", 7),
        operation(Conditional(read("A.f"), a, b), "=", 7),
        operation(operation(operation(a, "+", 1), "mod", 7), "=", b),
    ],
)
def test_what_is_compared_or_added_belongs_together(relation: Expression) -> None:
    assert together(three(relation)) == {("A.n", "B.n")}
    assert together(three(guard=relation)) == {("A.n", "B.n")}
    assert together(replace(three(), invariants=(relation,))) == {("A.n", "B.n")}
    assert together(replace(three(), marker=relation)) == {("A.n", "B.n")}


@pytest.mark.parametrize(
    "condition",
    [
        operation(operation(a, "<", 7), "and", operation(b, "<", 7)),
        operation(operation(operation(a, "*", b), "<", 7), "and", operation(c, "<", 7)),
        operation(operation(operation(a, "div", b), "<", 7), "or", operation(operation(c, "+", 1), "=", 2)),
    ],
)
def test_what_is_compared_with_constants_or_multiplied_does_not(condition: Expression) -> None:
    assert not together(three(condition))


def test_one_thing_leads_to_another() -> None:
    chain = operation(operation(a, "<", b), "or", operation(b, "=", c))
    assert together(three(chain)) == {("A.n", "B.n", "C.n")}
    assert together(three(operation(a, "<", c), update=operation(b, "+", 1))) == {("A.n", "B.n", "C.n")}
    assert together(three(update=b)) == {("A.n", "B.n")}


def counters(
    count: int,
    *relations: Expression,
    type_: IntegerType = WIDE,
    starts: Sequence[int] = (),
    are_back: bool = False,
) -> System:
    """Integers of one automaton each that go up by one, or back as well, and relations between them."""

    def edges(number: int) -> list[Edge]:
        counter = read(f"C{number}.n")
        up = edge(f"l -up{number}-> l", n=operation(counter, "+", 1))
        return [up, edge(f"l -down{number}-> l", n=operation(counter, "-", 1))] if are_back else [up]

    automata = [
        automaton(
            f"C{number}",
            edges(number),
            variables=[DiscreteVariable("n", type_, (starts[number] if starts else 0,))],
        )
        for number in range(count)
    ]
    return replace(system(*automata), invariants=relations)


def chained(count: int, type_: IntegerType = WIDE) -> System:
    """Counters of which none is above the next one."""
    return counters(
        count,
        *(operation(read(f"C{one}.n"), "<=", read(f"C{one + 1}.n")) for one in range(count - 1)),
        type_=type_,
    )


def total(count: int) -> System:
    """Counters of which the sum is bounded."""
    reads: list[Expression] = [read(f"C{number}.n") for number in range(count)]
    return counters(count, operation(reduce(lambda left, right: operation(left, "+", right), reads), "<", 500))


@pytest.mark.parametrize(
    ("made", "are_together"),
    [
        (chained(3), True),
        (chained(4), False),
        (chained(2, IntegerType(0, 50)), True),
        (chained(3, IntegerType(0, 50)), False),
        # A million values would take more than a chain of six.
        (chained(6, IntegerType(0, 10**6)), True),
        (total(4), True),
        (total(6), False),
        # If every two are compared, nothing is near all that it is compared with.
        (
            counters(5, *(operation(read(f"C{a}.n"), "!=", read(f"C{b}.n")) for a, b in combinations(range(5), 2))),
            True,
        ),
    ],
)
def test_long_chains_and_sums_of_counters_stand_one_after_the_other(made: System, are_together: bool) -> None:
    assert bool(together(made)) == are_together


def test_a_datum_stands_by_what_it_is_compared_with() -> None:
    late = replace(
        chained(4),
        inputs=(InputVariable("up2", (), WIDE),),
        conditions=(EventCondition("up2", operation(read("C1.n"), "<", received())),),
    )
    assert blocks_of(late).data == {("up2", ()): Subject("C1", "n")}


def test_a_long_chain_takes_no_more_nodes_for_each_place() -> None:
    """With all bits among each other, each place of the chain would take several times as many as the one before."""
    shorter, longer = (synthesize(chained(count, IntegerType(0, 50))).statistics.peak_nodes for count in (4, 8))
    assert longer < 4 * shorter


def test_three_places_of_a_thousand_values_have_conditions_on_two() -> None:
    """Restricted to what matters, a condition relates all three, in more ways than a diagram has branches for."""
    made = counters(
        3,
        *(operation(read(f"C{one}.n"), "<", read(f"C{one + 1}.n")) for one in range(2)),
        starts=(0, 333, 666),
        are_back=True,
    )
    added = {item.event: item.condition for item in synthesize(made).added}
    assert {node.automaton for node in added["up1"].nodes} == {"C1", "C2"}
    for values in ((0, 333, 666), (0, 665, 666), (997, 998, 999), (1, 2, 4)):
        assert evaluate(added["up1"], lambda name, _: values[int(name[1:])]) == (values[1] + 1 < values[2])  # noqa: B023


def test_narrow_integers_stay_as_they_are() -> None:
    assert not together(three(operation(a, "<=", b), type_=NARROW))
    assert together(three(operation(a, "<=", b), type_=IntegerType(0, 16))) == {("A.n", "B.n")}


def with_data(*updates: Expression, targets: tuple[str, ...] = ("n",), condition: Expression | None = None) -> System:
    """An event that brings a wide integer, and what is made of it; another wide integer beside it."""
    values = [DiscreteVariable("f", BooleanType(), (False,)), DiscreteVariable("n", WIDE, (0,))]
    return system(
        automaton("A", [edge("l -u_got-> l", **dict(zip(targets, updates, strict=True)))], variables=values),
        automaton("B", ["l -go-> l"], variables=[DiscreteVariable("n", WIDE, (0,))]),
        inputs=[InputVariable("u_got", (), WIDE)],
        conditions=None if condition is None else {"go": condition},
    )


def test_data_belong_to_what_they_are_compared_with_or_written_to() -> None:
    assert blocks_of(with_data(received())).data == {("u_got", ()): A}
    assert blocks_of(with_data(operation(received(), "<", b), targets=("f",))).data == {("u_got", ()): B}
    # By the datum, two places belong together that no expression names together.
    both = with_data(received(), operation(received(), "<", b), targets=("n", "f"))
    assert together(both) == {("A.n", "B.n")}
    assert blocks_of(with_data(operation(received(), "*", b))).data == {}


def test_bits_of_equal_weight_stand_side_by_side(engine: str) -> None:
    made = with_data(received(), condition=operation(a, "<=", b))
    encoding = Encoding(made, make_manager(engine))
    places = [encoding.subjects[subject] for subject in (A, B)]
    data = encoding.inputs_of("u_got")[()]
    levels = {name: level for level, name in enumerate(encoding.order)}
    first = levels[places[0].names[0]]
    for rank in range(10):
        # The bit of A, its next-state bit, that of the datum, that of B, which is never written.
        bits = [places[0].names[rank], places[0].names[rank] + "'", data.names[rank], places[1].names[rank]]
        assert [levels[name] for name in bits] == list(range(first + 4 * rank, first + 4 * rank + 4))
    assert [levels[name] for name in encoding.state_names] == sorted(levels[name] for name in encoding.state_names)


def test_a_wider_integer_has_its_high_bits_above(engine: str) -> None:
    made = three(operation(a, "<=", b))
    wider = automaton("B", ["l -other-> l"], variables=[DiscreteVariable("n", IntegerType(0, 9999), (0,))])
    made = replace(made, automata=(made.automata[0], wider, made.automata[2]))
    encoding = Encoding(made, make_manager(engine))
    low, high = (encoding.subjects[subject].names for subject in (A, B))
    names = [name for name in encoding.order if name in {*low, *high}]
    assert names[:4] == list(high[:4])
    assert names[4:] == [name for pair in zip(low, high[4:], strict=True) for name in pair]


def sensors(high: int, condition: Expression, *, is_late: bool = False) -> System:
    """Two measured integers and a request that needs a relation between them; or something needs it only after it."""
    variables = [DiscreteVariable("n", IntegerType(0, high), (0,))]
    inputs = [InputVariable(f"u_{name}", (), IntegerType(0, high)) for name in "ab"]
    ends = ["l -go-> m", "m -u_end-> l"]
    made = system(
        automaton("A", [edge("l -u_a-> l", n=received()), *ends], variables=variables),
        automaton("B", [edge("l -u_b-> l", n=received()), *ends], variables=variables),
        inputs=inputs,
    )
    return replace(made, conditions=(EventCondition("u_end" if is_late else "go", condition),))


@pytest.mark.parametrize("relation", [operation(a, "<=", b), operation(operation(a, "+", b), "<=", 1_500_000)])
def test_a_million_values_are_compared_and_added(engine: str, relation: Expression) -> None:
    """With the bits of one integer above those of the other this would take a million nodes."""
    million = 10**6 + 1
    result = synthesize(sensors(10**6, relation), engine=engine)
    assert result.status is SynthesisStatus.SUPERVISOR
    # Pairs of values: all of them, and those where the request is allowed.
    allowed = million * (million + 1) // 2 if relation == operation(a, "<=", b) else million**2 - 500_000 * 500_001 // 2
    assert result.statistics.states == million**2 + allowed
    assert result.statistics.peak_nodes < 500


def test_a_relation_that_no_list_of_values_describes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check an event's need that is small over bits, while the supervisor's diagram has a branch for each value."""
    monkeypatch.setattr(diagrams, "MAXIMUM_BRANCHES", 5000)
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    with pytest.raises(UnsupportedModelError, match=r"more than 5000 ranges of the values of 'A\.n'"):
        synthesize(sensors(10**6, operation(a, "<=", b), is_late=True), engine="cudd")


@settings(max_examples=examples(40))
@given(systems())
def test_among_each_other_or_not_the_supervisor_is_right(made: System) -> None:
    """Even the narrowest integers together: what comes out is the supervisor that is worked out state by state."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "MINIMUM_BITS", 1)
        result = synthesize(made, engine="autoref")
    explicit = explicit_supervisor(made)
    assert explicit is not None
    assert (result.status is SynthesisStatus.EMPTY) == explicit.is_empty
    if not explicit.is_empty:
        added = state_predicates(made, result.added)
        initial = None if result.initial is None else state_predicate(made, result.initial)
        found = verify_explicitly(made, added, initial=initial)
        assert {found.safe, found.controllable, found.nonblocking, found.maximally_permissive} == {CheckOutcome.PASSED}
        assert result.statistics.states == len(explicit.reachable)
