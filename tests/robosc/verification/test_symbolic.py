"""The symbolic check agrees with the explicit one, on right supervisors and on wrong ones."""

from collections.abc import Callable, Mapping
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, InputVariable, System, decision
from robosc.automata.decision import Decision, index_in
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.errors import SynthesisCancelled
from robosc.expressions import (
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    Expression,
    IntegerType,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import CheckOutcome, Verification, verify_explicitly
from robosc.verification.symbolic import expressions, order, verify_symbolically
from robosc.verification.symbolic.order import cuthill_mckee, place_order
from robosc.verification.symbolic.reach import Reachability
from robosc.verification.symbolic.relations import Relation, Relations
from robosc.verification.symbolic.variables import Variables
from robosc.verification.symbolic.work import TooMuchWorkError, Work
from support.effort import examples
from support.engines import ENGINES, engine_of_verification
from support.families import FAMILIES
from support.random_supervisors import random_diagram
from support.random_systems import systems
from support.systems import automaton, edge, operation, read, received, replay, system

PASSED, FAILED, NOT_CHECKED = CheckOutcome.PASSED, CheckOutcome.FAILED, CheckOutcome.NOT_CHECKED


def _three(found: Verification) -> tuple[CheckOutcome, CheckOutcome, CheckOutcome]:
    return found.safe, found.controllable, found.nonblocking


def _agrees(made: System, added: Mapping[str, Decision], engine: str = "cudd") -> Verification:
    explicit = verify_explicitly(made, added, permissive_limit=0)
    with engine_of_verification(engine):
        symbolic = verify_symbolically(made, added, engine=engine)
    assert (symbolic.states, _three(symbolic)) == (explicit.states, _three(explicit))
    assert symbolic.maximally_permissive is NOT_CHECKED
    assert symbolic.transitions is None
    traces = {item.property: item.trace for item in explicit.failures}
    for failure in symbolic.failures:
        assert failure.state in replay(made, added, failure.trace)
        assert failure.is_shortest
        if failure.property != "controllable":
            # Each verifier names the first of several disabled events that it meets.
            assert len(failure.trace) == len(traces[failure.property])
    return symbolic


def _conditions(made: System, seed: int) -> dict[str, Decision]:
    dice = Random(seed)
    return state_predicates(
        made, [AddedCondition(event.name, random_diagram(dice, made)) for event in made.events if dice.random() < 0.4]
    )


@settings(max_examples=examples(25))
@given(systems(), st.integers(0, 10**6), st.sampled_from(["cudd", "oxidd"]))
def test_on_any_supervisor_it_agrees_with_the_explicit_search(made: System, seed: int, engine: str) -> None:
    _agrees(made, {}, engine)
    _agrees(made, _conditions(made, seed), engine)


@settings(max_examples=examples(8))
@given(systems(), st.integers(0, 10**6))
def test_all_engines_find_the_same_with_the_same_work(made: System, seed: int) -> None:
    added = _conditions(made, seed)
    for limit in (10**6, 100, 500, 2000):
        ends = []
        for engine in ENGINES:
            with engine_of_verification(engine):
                ends.append(verify_symbolically(made, added, engine=engine, limit=limit))
        assert ends == ends[:1] * len(ends)


@settings(max_examples=examples(10))
@given(systems())
def test_right_supervisors_pass_and_freed_ones_fail(made: System) -> None:
    result = synthesize(made)
    if result.status is SynthesisStatus.EMPTY:
        return
    right = _agrees(made, state_predicates(made, result.added))
    assert _three(right) == (PASSED, PASSED, PASSED)
    assert right.states == result.statistics.states
    for item in result.added:
        freed = [one if one != item else AddedCondition(item.event, DecisionDiagram((), 1)) for one in result.added]
        assert FAILED in _three(_agrees(made, state_predicates(made, freed)))


@pytest.mark.parametrize(
    ("family", "size"),
    [
        ("dining philosophers", 5),
        ("transfer line", 2),
        ("token ring", 20),
        ("cat and mouse, 2 pairs", 1),
        ("counter", 100),
        ("random robot", 6),
        ("random robot", 40),
    ],
)
def test_families(family: str, size: int) -> None:
    made = FAMILIES[family](size)
    result = synthesize(made)
    found = verify_symbolically(made, state_predicates(made, result.added))
    assert (found.states, _three(found)) == (result.statistics.states, (PASSED, PASSED, PASSED))


def test_a_large_robot_fails_without_its_supervisor_and_passes_with_it() -> None:
    """Far too large for any explicit search: forks are taken until nobody can eat."""
    made = FAMILIES["dining philosophers"](12)
    found = verify_symbolically(made, {})
    assert _three(found) == (PASSED, PASSED, FAILED)
    (failure,) = found.failures
    assert failure.state in replay(made, {}, failure.trace)


@settings(max_examples=examples(12))
@given(systems(), st.integers(0, 10**6))
def test_a_run_is_found_even_where_a_shortest_one_is_too_much_work(made: System, seed: int) -> None:
    added = _conditions(made, seed)
    with pytest.MonkeyPatch.context() as patch:

        def too_much(self: Reachability, initial: object, wanted: object) -> None:
            raise TooMuchWorkError

        patch.setattr(Reachability, "_shortest_run", too_much)
        found = verify_symbolically(made, added)
    for failure in found.failures:
        assert not failure.is_shortest
        assert failure.state in replay(made, added, failure.trace)


@settings(max_examples=examples(25))
@given(systems(), st.integers(0, 10**6), st.sampled_from(ENGINES), st.sampled_from([0, 64]))
def test_closures_are_those_of_steps_taken_until_nothing_is_new(
    made: System, seed: int, engine: str, many: int
) -> None:
    """The twin takes each event in turn on whole sets of states; variables go one by one or all at once."""
    work = Work(10**9, lambda: False, lambda message: None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robosc.verification.symbolic.variables._MANY", many)
        with engine_of_verification(engine):
            variables = Variables(made, engine, work)
        relations = [Relations(variables, _conditions(made, seed)).relation(event) for event in made.events]
        reachability = Reachability(variables, relations)
        initial, marked = variables.all_of(variables.initial()), variables.all_of(variables.marked())
        for start, closed, step in (
            (initial, reachability.reachable, Relation.image),
            (marked, reachability.reaching, Relation.preimage),
        ):
            found, before = start, None
            while found != before:
                before = found
                for relation in relations:
                    found = found | step(relation, variables, found)
            assert closed(start) == found


def ring(size: int) -> System:
    """Parts in a ring: each goes out while the next one is at home."""
    parts = [
        automaton(f"P{n}", [f"home -go{n}-> ready", f"ready -u_out{n}-> out", f"out -back{n}-> home"], marked=["home"])
        for n in range(size)
    ]
    return system(*parts, conditions={f"go{n}": StateTest(f"P{(n + 1) % size}", "home") for n in range(size)})


def hub(size: int) -> System:
    """Parts that go out while the first one is out."""
    parts = ring(size)
    conditions = {f"go{n}": StateTest("P0", "out") for n in range(1, size)}
    return system(*parts.automata, conditions=conditions)


@pytest.mark.parametrize("robot", [ring, hub])
def test_a_large_robot_takes_work_that_grows_with_its_size(robot: Callable[[int], System]) -> None:
    """Events on whole diagrams would take work that grows with the cube of a ring's size."""
    for size in (20, 80):
        found = verify_symbolically(robot(size), {}, limit=500 * size)
        assert _three(found) == (PASSED, PASSED, PASSED)


def test_beyond_its_work_nothing_is_claimed() -> None:
    made = FAMILIES["random robot"](5)
    skipped = Verification(None, None, *[NOT_CHECKED] * 4)  # type: ignore[arg-type]
    assert verify_symbolically(made, {}, limit=100) == skipped
    whole = Work(10**9, lambda: False, lambda message: None)
    with pytest.raises(TooMuchWorkError):
        whole.spend(10**9 + 1)
    # Between nothing and all there is a limit that only the last property goes beyond.
    outcomes = {_three(verify_symbolically(made, {}, limit=limit)) for limit in range(500, 3000, 100)}
    assert {(NOT_CHECKED,) * 3, (PASSED, PASSED, NOT_CHECKED), (PASSED, PASSED, PASSED)} == outcomes


def test_it_stops_on_request_and_reports_progress() -> None:
    reported: list[str] = []
    verify_symbolically(FAMILIES["random robot"](5), {}, on_progress=reported.append)
    assert reported[0].startswith("symbolic search, ")
    with pytest.raises(SynthesisCancelled):
        verify_symbolically(FAMILIES["random robot"](5), {}, should_stop=lambda: True)


def test_an_unknown_event_is_refused() -> None:
    with pytest.raises(ValueError, match="does not have: fly"):
        verify_symbolically(FAMILIES["token ring"](2), {"fly": Decision((), 1, ())})


def _measured(condition: Expression | None = None, update: Expression | None = None, high: int = 10**6) -> System:
    """Two integers with a million values each, measured, and a request under a condition."""
    wide = IntegerType(0, high)
    first = received() if update is None else update
    return system(
        automaton("A", [edge("l -u_a-> l", n=first), "l -go-> m"], variables=[DiscreteVariable("n", wide, (0,))]),
        automaton("B", [edge("l -u_b-> l", n=received())], variables=[DiscreteVariable("n", wide, (0,))]),
        inputs=[InputVariable(f"u_{name}", (), wide) for name in "ab"],
        conditions=None if condition is None else {"go": condition},
    )


def test_a_million_values_are_copied_compared_and_computed_with() -> None:
    a, b = read("A.n"), read("B.n")
    million = 10**6 + 1
    found = verify_symbolically(_measured(operation(a, "<", b)), {})
    # From the second location nothing is measured any more of A, but of B still.
    assert (found.states, _three(found)) == (million**2 + (million - 1) * million, (PASSED, PASSED, PASSED))
    sums = verify_symbolically(_measured(update=operation(a, "+", received())), {})
    assert (sums.safe, sums.trace) == (FAILED, ("u_a",))
    bounded = Call("min", (operation(operation(a, "+", received()), "div", 2), Constant(10**6)))
    assert _three(verify_symbolically(_measured(update=bounded), {})) == (PASSED, PASSED, PASSED)
    # A product of two variables has no linear form.
    product = Call("min", (operation(a, "*", received()), Constant(10**6)))
    assert verify_symbolically(_measured(update=product), {}).safe is NOT_CHECKED


@settings(max_examples=examples(40))
@given(systems(), st.integers(0, 10**6))
def test_linear_forms_agree_with_the_explicit_search(made: System, seed: int) -> None:
    """The same with the smallest integers as with wide ones, whose values cannot be gone through."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expressions, "FEW_VALUATIONS", 0)
        patch.setattr(order, "WIDE", 1)
        _agrees(made, {})
        _agrees(made, _conditions(made, seed))


@pytest.mark.parametrize("high", [20, 40])
def test_relations_of_wider_integers_agree_with_the_explicit_search(high: int) -> None:
    a, b = read("A.n"), read("B.n")
    relations = [
        operation(a, "<=", b),
        operation(operation(a, "+", b), ">", high),
        operation(operation(a, "mod", 7), "=", operation(b, "div", 3)),
        operation(Conditional(operation(a, "<", b), operation(b, "-", a), a), "!=", Call("max", (b, Constant(5)))),
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expressions, "FEW_VALUATIONS", 0)
        for relation in relations:
            made = _measured(relation, Call("min", (operation(received(), "-", 0), Constant(high))), high)
            explicit, symbolic = verify_explicitly(made, {}, permissive_limit=0), verify_symbolically(made, {})
            assert (symbolic.states, _three(symbolic)) == (explicit.states, _three(explicit))
            assert explicit.states is not None and explicit.states > (high + 1) ** 2


def test_a_range_without_number_is_not_gone_through() -> None:
    made = system(
        automaton(
            "A",
            [edge("l -go-> l", n=operation(1, "+", 2))],
            variables=[DiscreteVariable("n", IntegerType(-(2**31), 2**31 - 1), (7,))],
        ),
        inputs=[InputVariable("go", (), IntegerType(-(2**31), 2**31 - 1))],
    )
    assert verify_symbolically(made, {}).states == 2


def test_long_chains_and_conditionals_are_taken() -> None:
    test = StateTest("A", "l")
    chain: Binary = Binary("and", test, test)
    for _ in range(3000):
        chain = Binary("and", chain, test)
    choice = Conditional(Unary("not", test), chain, Binary("=", chain, VariableRead("A", "b")))
    made = system(
        automaton(
            "A",
            [edge("l -go-> l", chain, b=choice), edge("l -u_x-> m"), edge("m -back-> l")],
            variables=[DiscreteVariable("b", BooleanType(), (True,))],
        ),
        conditions={"back": chain},
    )
    _agrees(made, {})


def test_what_is_unknown_changes_nothing() -> None:
    """The quotient is unknown, and so is what is compared with it; the event happens all the same."""
    quotient = operation(2, "/", read("A.n"))
    made = system(
        automaton(
            "A",
            [edge("l -go-> m", b=operation(quotient, "=", 1), k=Call("integer", (quotient,))), "m -u_x-> l"],
            variables=[
                DiscreteVariable("n", IntegerType(0, 1), (0,)),
                DiscreteVariable("k", IntegerType(0, 1), (1,)),
                DiscreteVariable("b", BooleanType(), (True,)),
            ],
        )
    )
    assert _agrees(made, {}).states == 2


def test_an_array_has_no_gaps() -> None:
    """Its second element is never known without its first."""
    one = IntegerType(1, 1)
    made = system(
        automaton(
            "A",
            [edge("l -u_got-> l", x=received("scan", 0), y=received("scan", 1))],
            variables=[DiscreteVariable(name, IntegerType(0, 1), (0,)) for name in ("x", "y")],
        ),
        inputs=[InputVariable("u_got", ("scan", index), one, may_be_unknown=True) for index in (0, 1)],
    )
    assert _agrees(made, {}).states == 3


def test_the_order_keeps_neighbours_together() -> None:
    ring = [{(number - 1) % 12: 1.0, (number + 1) % 12: 1.0} for number in range(12)]
    order = cuthill_mckee(ring)
    assert sorted(order) == list(range(12))
    place = {node: number for number, node in enumerate(order)}
    assert max(abs(place[node] - place[other]) for node, ties in enumerate(ring) for other in ties) == 2
    made = FAMILIES["dining philosophers"](6)
    assert sorted(place_order(made)) == list(range(12))


@pytest.mark.timeout(60)
def test_a_condition_in_another_order_is_counted_while_it_is_made() -> None:
    """Ninety nodes of a file can be a thousand million in the verifier's order."""
    count = 60
    flags = [DiscreteVariable("x", BooleanType(), (False,))]
    automata = [automaton(f"C{number}", [f"a -u_turn{number}-> a"], variables=flags) for number in range(count)]
    made = system(*automata, automaton("G", ["a -go-> a"]))
    order = subjects(made)
    nodes: list[decision.Test] = []
    previous = 1
    for number in range(count // 2):
        first, second = (order.index(Subject(f"C{place}", "x")) for place in (number, number + count // 2))
        base = len(nodes) + 2
        nodes += [decision.Test(second, (0, 1), (previous, 0)), decision.Test(second, (0, 1), (0, previous))]
        nodes += [decision.Test(first, (0, 1), (base, base + 1))]
        previous = base + 2
    indices = tuple(index_in(subject_domain(made, subject)) for subject in order)
    found = verify_symbolically(made, {"go": Decision(tuple(nodes), previous, indices)}, limit=5_000, engine="autoref")
    assert found.states is None
