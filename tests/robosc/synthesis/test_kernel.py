"""The kernel does what its twins in Python do, operation by operation, and leaves nothing behind."""

import gc
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc import kernel
from robosc.dd_modules import load_dd
from robosc.errors import NodeLimitError, SynthesisCancelled
from robosc.kernel import kernel_module, kernel_problem
from robosc.synthesis import EngineOptions, SynthesisProgress, connection, nodes, synthesize
from robosc.synthesis.compiled import kernel_of
from robosc.synthesis.engines import Manager, limited, make_manager
from robosc.synthesis.image import Image
from robosc.synthesis.monitor import BoundedMonitor, ProgressMonitor
from robosc.synthesis.result import Closure
from robosc.synthesis.saturation import CompiledSaturation, Saturation, saturation
from robosc.synthesis.step import Step
from robosc.synthesis.walks import DdNodes
from support.effort import examples
from support.families import FAMILIES

PLACES = ("a", "b", "c", "d", "e", "f")
HIDDEN = ("h", "i")
ORDER = (*(name for place in PLACES for name in (place, place + "'")), *HIDDEN)
LEVELS = {name: level for level, name in enumerate(ORDER)}

if shutil.which("cc") is None:
    pytest.skip("there is no C compiler", allow_module_level=True)


def test_it_is_there() -> None:
    assert kernel_problem() == ""


def manager_with(names: tuple[str, ...]) -> Manager:
    manager = make_manager("cudd")
    manager.declare(*names)
    return manager


def random_predicate(manager: Manager, dice: Random, names: tuple[str, ...], depth: int = 4) -> Any:
    if depth == 0 or dice.random() < 0.1:
        return dice.choice((manager.var(dice.choice(names)), ~manager.var(dice.choice(names)), manager.true))
    left, right = (random_predicate(manager, dice, names, depth - 1) for _ in range(2))
    return dice.choice((left & right, left | right, manager.ite(left, ~right, right)))


def random_step(manager: Manager, dice: Random) -> Step:
    """A step that leads forwards or backwards, with and without each of the parts of an image."""
    names = tuple(dice.sample(PLACES, dice.randint(1, 3)))
    changed = dice.sample(names, dice.randint(1, len(names)))
    composed = dice.sample(changed, dice.randint(0, len(changed)))
    constants = {name: dice.random() < 0.5 for name in changed if name not in composed}
    arrival = manager.true
    for name, value in constants.items():
        arrival = arrival & (manager.var(name) if value else ~manager.var(name))
    source = random_predicate(manager, dice, names) if dice.random() < 0.7 else None
    room = arrival if dice.random() < 0.5 else None
    if dice.random() < 0.5:
        following = tuple(name + "'" for name in composed)
        image = Image(
            manager=manager,
            inside=source,
            relation=random_predicate(manager, dice, (*names, *following)),
            hidden=tuple(changed),
            names=dict(zip(following, composed, strict=True)),
            outside=arrival if constants else None,
        )
        return Step(image, frozenset(names), room)
    image = Image(
        manager=manager,
        needed=arrival,
        constants=constants,
        functions={name: random_predicate(manager, dice, (*names, *HIDDEN)) for name in composed},
        relation=random_predicate(manager, dice, (*names, *HIDDEN)),
        hidden=HIDDEN if dice.random() < 0.7 else (),
        outside=source,
    )
    # The result would depend on hidden variables if they were not quantified.
    return Step(image, frozenset(names) | (frozenset() if image.hidden else frozenset(HIDDEN)))


Reported = list[tuple[int, int]]


def monitor_of(reported: Reported) -> ProgressMonitor:
    return ProgressMonitor(lambda: False, lambda progress: reported.append((progress.iteration, progress.nodes)))


@settings(max_examples=examples(90))
@given(seed=st.integers(0, 2**32))
def test_it_saturates_as_python_does(seed: int) -> None:
    """The same states, the same progress after the same steps, and the same end at a limit of steps."""
    dice = Random(seed)
    manager = manager_with(ORDER)
    steps = [random_step(manager, dice) for _ in range(dice.randint(1, 6))]
    within = random_predicate(manager, dice, PLACES) if dice.random() < 0.7 else manager.true
    begin = within & random_predicate(manager, dice, PLACES, 3)
    until = random_predicate(manager, dice, PLACES, 2) if dice.random() < 0.3 else None
    expected_reported: Reported = []
    reported: Reported = []
    limit = dice.randint(1, 60) if dice.random() < 0.5 else None
    around, expected_around = (BoundedMonitor(monitor_of(item)) for item in (reported, expected_reported))
    inner, expected_inner = (BoundedMonitor(item, limit) for item in (around, expected_around))
    expected = Saturation(manager, LEVELS, steps, within, expected_inner)
    found = saturation(manager, LEVELS, steps, within, inner)
    assert isinstance(found, CompiledSaturation)
    states = inner.result_of(lambda: found.of(begin, "test", until))
    assert states == expected_inner.result_of(lambda: expected.of(begin, "test", until))
    assert (inner.steps, around.steps) == (expected_inner.steps, expected_around.steps)
    if states is not None:
        assert reported == expected_reported


@settings(max_examples=examples(120))
@given(seed=st.integers(0, 2**32))
def test_it_restricts_as_python_does(seed: int) -> None:
    dice = Random(seed)
    manager = manager_with(PLACES)
    predicate, care = (random_predicate(manager, dice, PLACES, 5) for _ in range(2))
    found = kernel_of(manager)
    assert found is not None
    assert found.restrict(predicate, care) == nodes._Restrict(DdNodes(manager)).walk(predicate, care)


@settings(max_examples=examples(60))
@given(seed=st.integers(0, 2**32))
def test_implication_agrees_with_python(seed: int) -> None:
    dice = Random(seed)
    manager = manager_with(PLACES)
    predicate, other = (random_predicate(manager, dice, PLACES, 2) for _ in range(2))
    found = kernel_of(manager)
    assert found is not None
    for left, right in ((predicate, other), (predicate & other, other), (predicate, predicate | other)):
        assert found.implies(left, right) == (left & ~right == manager.false)


def separated_one_by_one(manager: Manager, one: Any, other: Any, groups: list[tuple[str, ...]]) -> tuple[Any, Any]:
    for names in groups:
        fewer = manager.exist(names, one), manager.exist(names, other)
        if fewer[0] & fewer[1] == manager.false:
            one, other = fewer
    return one, other


@settings(max_examples=examples(120))
@given(seed=st.integers(0, 2**32), engine=st.sampled_from(["cudd", "oxidd", "autoref"]))
def test_places_that_do_not_tell_sets_apart_are_left_out(seed: int, engine: str) -> None:
    """The kernel tries by halves, and Python place by place: both leave out what can go first."""
    dice = Random(seed)
    manager = make_manager(engine)
    manager.declare(*PLACES)
    assert (kernel_of(manager) is not None) == (engine == "cudd")
    one, other = (random_predicate(manager, dice, PLACES, 5) for _ in range(2))
    one = one & ~other
    names = dice.sample(PLACES, dice.randint(0, len(PLACES)))
    groups: list[tuple[str, ...]] = []
    while names:
        count = dice.randint(1, 2)
        groups.append(tuple(names[:count]))
        names = names[count:]
    cubes = [manager.cube(dict.fromkeys(group, True)) for group in groups]
    found = nodes.separated(manager, one, other, cubes)
    assert found == separated_one_by_one(manager, one, other, groups)
    away = [name for group in groups for name in group]
    assert nodes.without(manager, one, cubes) == (manager.exist(away, one) if away else one)


def counter(manager: Manager, bits: int) -> tuple[dict[str, int], Step]:
    """Counts with some bits upwards: as many rounds as there are numbers."""
    names = tuple(f"x{place}" for place in range(bits))
    manager.declare(*(name for place in names for name in (place, place + "'")))
    relation, carry = manager.true, manager.true
    for name in reversed(names):
        value, following = manager.var(name), manager.var(name + "'")
        flipped = manager.ite(carry, ~value, value)
        relation = relation & manager.ite(following, flipped, ~flipped)
        carry = carry & value
    image = Image(manager=manager, relation=relation, hidden=names, names={name + "'": name for name in names})
    levels = {name: 2 * place for place, name in enumerate(names)}
    return levels, Step(image, frozenset(names))


def zero(manager: Manager, bits: int) -> Any:
    found = manager.true
    for place in range(bits):
        found = found & ~manager.var(f"x{place}")
    return found


@pytest.fixture
def manager() -> Iterator[Any]:
    """A manager in which nothing that a test has dropped is left."""
    found: Any = make_manager("cudd")
    before = len(found)
    yield found
    # The variables stay.
    assert len(found) - before <= len(found.vars)


def closed(manager: Manager, monitor: ProgressMonitor, bits: int = 8) -> int:
    levels, step = counter(manager, bits)
    begin = zero(manager, bits)
    found = saturation(manager, levels, [step], manager.true, monitor).of(begin, "test")
    return nodes.count_models(manager, found, [f"x{place}" for place in range(bits)])


def test_it_counts(manager: Manager) -> None:
    reported: list[SynthesisProgress] = []
    assert closed(manager, ProgressMonitor(lambda: False, reported.append)) == 256
    assert {progress.phase for progress in reported} == {"test"}
    assert [progress.iteration for progress in reported] == list(range(1, len(reported) + 1))


def test_the_figures_count_its_nodes() -> None:
    system = FAMILIES["token ring"](2)
    engines = (EngineOptions("cudd"), EngineOptions("autoref"), EngineOptions("cudd", is_reordering=True))
    found = [synthesize(system, engine=engine).statistics.closure for engine in engines]
    assert found == [Closure.COMPILED_SATURATION, Closure.SATURATION, Closure.CHAINING]


def test_sets_that_are_told_apart_leave_nothing_behind(manager: Manager) -> None:
    manager.declare("a", "b", "c")
    a, b, c = map(manager.var, "abc")
    found = nodes.separated(manager, a & b & c, ~a & b, [c, b, a])
    assert found == (a, ~a)
    assert nodes.without(manager, a & b, [a, c]) == b


def test_it_stops_on_request(manager: Manager) -> None:
    asked: list[None] = []

    def should_stop() -> bool:
        asked.append(None)
        return len(asked) == 5

    with pytest.raises(SynthesisCancelled):
        closed(manager, ProgressMonitor(should_stop, lambda progress: None))
    assert len(asked) == 5


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_what_progress_raises_ends_it(manager: Manager, error: type[BaseException]) -> None:
    reported: list[None] = []

    def report(progress: SynthesisProgress) -> None:
        reported.append(None)
        if len(reported) == 9:
            raise error

    with pytest.raises(error):
        closed(manager, ProgressMonitor(lambda: False, report))
    assert len(reported) == 9


def test_an_operation_that_cudd_gives_up_is_a_limit_of_nodes() -> None:
    """Pairs of equal bits, far from each other in the order, come of pairs of neighbours."""
    manager, pairs = make_manager("cudd"), range(20)
    near = [name for place in pairs for name in (f"x{place}", f"h{place}")]
    far = [f"y{place}" for place in pairs]
    manager.declare(*near, *far)
    begin = manager.true
    for place in pairs:
        x, h = manager.var(f"x{place}"), manager.var(f"h{place}")
        begin = begin & manager.ite(x, h, ~h)
    names = {f"h{place}": f"y{place}" for place in reversed(pairs)}
    image = Image(manager=manager, relation=manager.true, names=names)
    levels = {name: level for level, name in enumerate((*near, *far))}
    steps = [Step(image, frozenset(levels))]
    silent = ProgressMonitor(lambda: False, lambda progress: None)
    with pytest.raises(NodeLimitError), limited(manager, 20_000):
        saturation(manager, levels, steps, manager.true, silent).of(begin, "test")
    # The frames of the error hold predicates, and are to go before the manager does.
    gc.collect()


def test_other_steps_are_left_to_python(manager: Manager) -> None:
    manager.declare("a")
    step = Step(lambda states: manager.let({"a": ~manager.var("a")}, states), frozenset({"a"}))
    found = saturation(manager, {"a": 0}, [step], manager.true, ProgressMonitor(lambda: False, lambda progress: None))
    assert isinstance(found, Saturation)
    assert found.of(manager.var("a"), "test") == manager.true


# Reasons for having none


def test_there_is_none_for_the_plain_engine() -> None:
    assert kernel_of(make_manager("autoref")) is None


@pytest.fixture
def looked_for_anew() -> Iterator[None]:
    for found in (kernel._found, connection.connected):
        found.cache_clear()
    yield
    for found in (kernel._found, connection.connected):
        found.cache_clear()


@pytest.mark.usefixtures("looked_for_anew")
class TestLeftAside:
    def test_as_the_environment_says(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("ROBOSC_KERNEL", "0")
        assert kernel_problem() == "ROBOSC_KERNEL is 0"
        assert kernel_of(make_manager("cudd")) is None

    def test_of_another_source(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        shutil.copytree(kernel.FOLDER, tmp_path / "kernel")
        with (tmp_path / "kernel" / "spaces.c").open("a", encoding="utf-8") as file:
            file.write("\n")
        monkeypatch.setattr(kernel, "FOLDER", tmp_path / "kernel")
        assert kernel_problem() == "it was made from other sources"

    def test_of_another_dd(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(connection, "layout_problem", lambda module, cudd: "another layout")
        assert (kernel_problem(), connection.left_aside()) == ("", "another layout")
        assert kernel_of(make_manager("cudd")) is None

    def test_not_made(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "robosc.kernel._kernel", None)
        assert kernel_problem() == connection.left_aside() == "it was not made: there was no C compiler"


@pytest.mark.usefixtures("looked_for_anew")
def test_a_dd_that_keeps_cudd_to_itself_is_left_to_python(monkeypatch: pytest.MonkeyPatch) -> None:
    module = kernel_module()
    assert module is not None
    cudd = load_dd("cudd")
    hiding = SimpleNamespace(BDD=cudd.BDD, Function=cudd.Function, __file__=module.__file__)
    monkeypatch.setattr(connection, "load_dd", lambda name: hiding)
    assert kernel_of(make_manager("cudd")) is None
    assert "has no Cudd_Ref" in connection.left_aside()


def test_a_library_without_cudd_is_refused() -> None:
    module = kernel_module()
    assert module is not None
    with pytest.raises(ImportError, match=r"has no Cudd_Ref"):
        module.connect(module.__file__)
    with pytest.raises(ImportError, match="cannot be opened"):
        module.connect("/nowhere.so")
    # The connection that was there before still is.
    assert kernel_of(make_manager("cudd")) is not None


# Making it


def test_it_is_made_without_a_warning(build: ModuleType, tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    assert compiler is not None
    module = tmp_path / build.MODULE
    assert build.make_kernel(kernel.FOLDER, module) == ""
    assert module.exists()
    warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-fsyntax-only", "-std=c11")
    include = build.include_folder()
    sources = map(str, kernel.FOLDER.glob("*.c"))
    subprocess.run([compiler, *warnings, f"-I{include}", *sources], check=True)


def test_what_does_not_compile_is_reported(build: ModuleType, tmp_path: Path) -> None:
    source = tmp_path / "kernel.c"
    source.write_text("int main(void) { return nothing; }\n", "utf-8")
    assert "nothing" in build.make_kernel(tmp_path, tmp_path / build.MODULE)
    assert not (tmp_path / build.MODULE).exists()


def test_without_a_compiler_the_message_names_a_package_with_one(
    build: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "apt install gcc" in build.make_kernel(kernel.FOLDER, tmp_path / build.MODULE)


def test_without_the_headers_of_python_the_message_names_their_package(
    build: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(build, "include_folder", lambda: tmp_path)
    assert "apt install python3-dev" in build.make_kernel(kernel.FOLDER, tmp_path / build.MODULE)
