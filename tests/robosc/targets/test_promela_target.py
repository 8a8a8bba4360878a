"""Spin and our own model checkers agree on what the target `promela` writes."""

from pathlib import Path
from random import Random

import pytest

from robosc.automata import System, to_automata
from robosc.automata.state import Subject
from robosc.automata.structure import DiscreteVariable, InputVariable
from robosc.certification import make_supervisor
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    Binary,
    BooleanType,
    Conditional,
    Constant,
    Expression,
    IntegerType,
    Received,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.model.structure import Deployment
from robosc.model_checking import Property, verify_properties
from robosc.model_checking.formulas import Condition, Finally, Formula, Globally, Joined, Not, Until
from robosc.source import Location
from robosc.supervisor import AddedCondition, DecisionDiagram, DecisionNode
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.targets import GenerateOptions, available_targets, generate
from robosc.targets.promela import promela_model
from robosc.targets.promela.expressions import Translator
from robosc.targets.promela.names import Names
from support.effort import SEED, examples
from support.explicit_ctl import ExplicitChecker
from support.families import dining_philosophers
from support.models import EXAMPLE_DEPLOYMENTS, bundle_of, example_bundle
from support.random_formulas import random_formula
from support.random_systems import random_system
from support.spin import IS_INSTALLED, ask_spin
from support.systems import automaton, edge, operation, read, system

needs_spin = pytest.mark.skipif(not IS_INSTALLED, reason="spin and gcc are not installed")


def linear(formula: Formula, translator: Translator) -> str:
    """A formula whose temporal operators all begin with A, in spin's linear temporal logic."""

    def inside(operand: Formula) -> str:
        return f"({linear(operand, translator)})"

    match formula:
        case Condition(expression=expression):
            return translator.condition(expression)
        case Not(operand=operand):
            return f"!{inside(operand)}"
        case Joined(operator=operator, left=left, right=right):
            return f"{inside(left)} {'&&' if operator == 'and' else '||'} {inside(right)}"
        case Globally(operand=operand):
            return f"[] {inside(operand)}"
        case Finally(operand=operand):
            return f"<> {inside(operand)}"
        case Until(left=left, right=right):
            return f"{inside(left)} U {inside(right)}"
    raise AssertionError(formula)


def claims(given: System, random: Random) -> dict[str, Formula]:
    """Formulas that linear and branching time agree about."""
    first, second, third = (Condition(atom(given, random)) for _ in range(3))
    return {
        "p_always": Globally("A", Joined("or", first, Not(second))),
        "p_never": Globally("A", Not(first)),
        "p_comes": Finally("A", second),
        "p_before": Until("A", Joined("or", Not(second), third), second),
        "p_answers": Globally("A", Joined("or", Not(first), Finally("A", third))),
    }


def atom(given: System, random: Random) -> Expression:
    while True:
        formula = random_formula(given, random, depth=0)
        if isinstance(formula, Condition):
            return formula.expression


def agrees(given: System, added: tuple[AddedCondition, ...], random: Random, folder: Path) -> set[bool]:
    """Compare; returns the verdicts that occurred."""
    explicit = ExplicitChecker(given, state_predicates(given, added))
    assert explicit.graph is not None
    formulas = claims(given, random)
    translator = Translator(given, Names(given))
    texts = {name: linear(formula, translator) for name, formula in formulas.items()}
    answer = ask_spin(promela_model(given, added), texts, folder)
    assert not answer.errors
    assert answer.states == len(explicit.graph.states)
    written = [Property(name, "", Location("here", 1, 1), formula) for name, formula in formulas.items()]
    ours = {verdict.property.name: verdict.holds for verdict in verify_properties(given, added, written)}
    assert answer.verdicts == ours
    return set(ours.values())


@needs_spin
@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_examples(name: str, deployment: Deployment, tmp_path: Path) -> None:
    supervisor = make_supervisor(example_bundle(name), deployment=deployment).supervisor
    assert supervisor is not None
    given = to_automata(supervisor.model, deployment)
    assert False in agrees(given, supervisor.added, Random(name), tmp_path)


@pytest.mark.random
@needs_spin
def test_random_systems(tmp_path: Path) -> None:
    found: list[set[bool]] = []
    seed = SEED
    while len(found) < examples(3):
        seed += 1
        given = random_system(seed)
        result = synthesize(given)
        if result.status is SynthesisStatus.EMPTY or result.statistics.states < 3:
            continue
        folder = tmp_path / str(seed)
        folder.mkdir()
        found.append(agrees(given, result.added, Random(seed), folder))
    assert set().union(*found) == {True, False}


@needs_spin
def test_large_diagrams(tmp_path: Path) -> None:
    given = dining_philosophers(4)
    assert agrees(given, synthesize(given).added, Random(1), tmp_path)


def by_value(updates: dict[str, Expression], *types: tuple[str, IntegerType | BooleanType, int]) -> System:
    """A system whose one event writes what expressions say of variables and received data."""
    variables = [DiscreteVariable(name, type_, (initial,)) for name, type_, initial in types]
    inputs = (
        InputVariable("u_set", ("x",), IntegerType(-2, 2)),
        InputVariable("u_set", ("list", 1), IntegerType(0, 2), may_be_unknown=True),
        InputVariable("u_set", ("list", 3), BooleanType(), may_be_unknown=True),
        InputVariable("u_set", ("maybe",), BooleanType(), may_be_unknown=True),
    )
    return system(automaton("C", [edge("here -u_set-> here", **updates)], variables=variables), inputs=inputs)


X, FIRST, FLAG, MAYBE = Received(("x",)), Received(("list", 1)), Received(("list", 3)), Received(("maybe",))
TO_THREE = IntegerType(0, 3)
SMALL = ("n", IntegerType(-4, 4), 1)
WIDE = ("w", IntegerType(2**31 - 4, 2**31 - 1), 2**31 - 3)


@needs_spin
@pytest.mark.parametrize(
    "given",
    [
        by_value({"n": operation(X, "*", 2)}, SMALL),
        by_value({"n": FIRST, "b": FLAG}, SMALL, ("b", BooleanType(), 0)),
        by_value({"n": operation(FIRST, "-", X), "b": Binary("=", FLAG, MAYBE)}, SMALL, ("b", BooleanType(), 0)),
        by_value({"b": Binary("implies", MAYBE, Binary("<", FIRST, X))}, ("b", BooleanType(), 0)),
        by_value({"b": Binary("<", operation(1, "/", X), Constant(0.7)), "n": X}, SMALL, ("b", BooleanType(), 1)),
        # 3 stands for never known: which of them are 3 together shows where each is unknown.
        by_value(
            {
                "n": Conditional(Binary("=", FLAG, MAYBE), Constant(1), Constant(0)),
                "m": Conditional(Binary("implies", FLAG, MAYBE), Constant(1), Constant(0)),
                "k": Conditional(FLAG, Constant(1), Constant(0)),
                "j": Conditional(MAYBE, Constant(1), Constant(0)),
                "i": Conditional(Binary("and", Unary("holds", MAYBE), FLAG), Constant(1), Constant(0)),
            },
            *((name, TO_THREE, 3) for name in "nmkji"),
        ),
        by_value({"w": operation(read("C.w"), "+", FIRST)}, WIDE),
    ],
)
def test_data(given: System, tmp_path: Path) -> None:
    """Unknown data, doubles, and what goes beyond 32 bits: the same states as by the explicit meaning."""
    explicit = ExplicitChecker(given, {})
    assert explicit.graph is not None
    answer = ask_spin(promela_model(given, ()), {}, tmp_path)
    assert (answer.errors, answer.states) == (False, len(explicit.graph.states))


@needs_spin
def test_diagrams_over_negative_numbers(tmp_path: Path) -> None:
    variables = [DiscreteVariable("n", IntegerType(-3, 3), (-2,))]
    given = system(automaton("C", [edge("here -go-> here", n=operation(read("C.n"), "+", 1))], variables=variables))
    allowed = DecisionDiagram((DecisionNode("C", "n", (0, 3), (1, 0)),), 2)
    assert ask_spin(promela_model(given, (AddedCondition("go", allowed),)), {}, tmp_path).states == 3


@needs_spin
def test_a_range_that_is_left_is_reported(tmp_path: Path) -> None:
    given = by_value({"n": operation(read("C.n"), "+", X)}, SMALL)
    assert ask_spin(promela_model(given, ()), {}, tmp_path).errors


@needs_spin
def test_names_that_are_words_elsewhere_or_meet(tmp_path: Path) -> None:
    text = """robot active {
        component do { outgoing message od with type: boolean
            behaviour { variable atomic: boolean
                on response from od do atomic := value goto unix
                initial marked state unix { transition if atomic goto fi } marked state fi { } } }
        component a_b { behaviour { initial marked state c { transition goto d_step } marked state d_step { } } }
        component a { behaviour { initial marked state b_c { transition goto c } marked state c { } } }
    }"""
    supervisor = make_supervisor(bundle_of(text.replace("component do", "component ^do"))).supervisor
    assert supervisor is not None
    files = generate(supervisor, "promela")
    assert sorted(files) == ["README.md", "active.pml"]
    model = files["active.pml"]
    assert "#define in_a_b_c (at_a_b == 0)" in model
    assert "#define in_a_b_c_2 (at_a == 0)" in model
    explicit = ExplicitChecker(to_automata(supervisor.model, supervisor.deployment), {})
    assert explicit.graph is not None
    answer = ask_spin(model, {"moves": "[] (in_do_unix -> <> in_do_fi)"}, tmp_path)
    assert answer.states == len(explicit.graph.states)
    assert answer.verdicts == {"moves": False}


@needs_spin
def test_what_the_readme_of_a_model_shows(tmp_path: Path) -> None:
    supervisor = make_supervisor(example_bundle("navigation/navigation")).supervisor
    assert supervisor is not None
    files = generate(supervisor, "promela", GenerateOptions())
    examples = [line for line in files["README.md"].splitlines() if line.startswith("ltl ")]
    formulas = {line.split()[1]: line.partition("{")[2].rpartition("}")[0] for line in examples}
    assert set(ask_spin(files["Navigation.pml"], formulas, tmp_path).verdicts) == {"never_both", "comes_back"}


def test_the_target_is_listed() -> None:
    assert "promela" in [target.name for target in available_targets()]


def test_the_same_text_every_time() -> None:
    given = random_system(3)
    added = synthesize(given).added
    assert promela_model(given, added) == promela_model(given, added)


def test_long_chains_and_large_tables() -> None:
    names = [VariableRead("C", "n")]
    condition: Expression = Binary("=", names[0], Constant(0))
    for number in range(10_000):
        condition = Binary("or", condition, Binary("=", names[0], Constant(number % 3)))
    variables = [DiscreteVariable("n", IntegerType(0, 5), (0,))]
    plant = automaton("C", [edge("here -go-> here", condition)], variables=variables)
    assert promela_model(system(plant), ()).count("||") == 2
    ratio = Binary("<", operation(read("C.v"), "/", read("C.w")), Constant(2))
    wide = [DiscreteVariable(name, IntegerType(0, 999), (0,)) for name in ("v", "w")]
    plant = automaton("C", [edge("here -go-> here", ratio)], variables=wide)
    with pytest.raises(UnsupportedModelError, match=r"'C\.v / C\.w < 2' has more than 20000"):
        promela_model(system(plant), ())


def test_a_text_that_would_explode_is_refused() -> None:
    flag: Expression = Received(("maybe",))
    for _ in range(30):
        flag = Binary("=", flag, FLAG)
    with pytest.raises(UnsupportedModelError, match="longer than"):
        promela_model(by_value({"b": flag}, ("b", BooleanType(), 0)), ())


def test_names_of_places() -> None:
    given = system(automaton("service s", ["idle -go-> busy"]), automaton("s", ["idle -go-> busy"]))
    names = Names(given)
    assert names.places == {Subject("service s"): "at_s", Subject("s"): "at_s_2"}
    assert names.locations["s", "idle"] == "in_s_idle_2"
    assert Translator(given, names).condition(StateTest("s", "busy")) == "in_s_busy_2"
