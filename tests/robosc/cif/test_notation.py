"""Texts about CIF models are in CIF's notation: its reader takes them, and they mean the same."""

from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import robosc
from robosc.automata import System
from robosc.automata.compile import NO_DATA, compile_expression
from robosc.automata.state import subject_domain, subjects
from robosc.cif import check_cif
from robosc.cli.main import main
from robosc.conditions.rendering import Formulas, Line
from robosc.expressions import (
    ITSELF,
    Binary,
    BinaryOperator,
    Call,
    Conditional,
    Constant,
    EnumValue,
    Expression,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.expressions.text import cif_text
from robosc.pipeline.steps import event_text
from robosc.pipeline.system_runs import state_parts
from robosc.pipeline.systems import SystemSupervisor
from robosc.source import Bundle, SourceFile

MODEL = """group io: enum Mode = AUTO, HAND; input bool hit; input int[0..2] level; end
enum Other = LEFT, RIGHT;
plant p:
  controllable c_on, c_off; uncontrollable u_trip;
  disc io.Mode mode; disc Other other; disc bool flag; disc int[0..2] n;
  location off: initial; marked; edge c_on goto on;
  location on: marked; edge c_off goto off; edge u_trip when not io.hit do flag := not flag;
end
"""


def checked(text: str) -> System:
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    assert found.system is not None, [str(item) for item in found.diagnostics]
    return found.system


def _numbers(parts: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    operators: list[BinaryOperator] = ["+", "-", "*"]
    return st.one_of(
        st.builds(Binary, st.sampled_from(operators), parts, parts),
        st.builds(lambda part: Binary("div", part, Constant(2)), parts),
        st.builds(lambda part: Binary("mod", part, Constant(3)), parts),
        st.builds(lambda part: Unary("-", part), parts),
        st.builds(lambda one, other: Call("max", (one, other)), parts, parts),
        st.builds(Conditional, st.just(VariableRead("p", "flag")), parts, parts),
    )


NUMBERS = st.recursive(
    st.sampled_from([VariableRead("p", "n"), VariableRead("io.level", ITSELF), Constant(1), Constant(-2)]),
    _numbers,
    max_leaves=4,
)

COMPARISONS: list[BinaryOperator] = ["=", "!=", "<", "<=", ">", ">="]


def _conditions(parts: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    operators: list[BinaryOperator] = ["and", "or", "=", "!="]
    return st.one_of(
        st.builds(Binary, st.sampled_from(operators), parts, parts),
        st.builds(lambda part: Unary("not", part), parts),
        st.builds(lambda part: Unary("not", Unary("holds", part)), parts),
        st.builds(Conditional, parts, parts, parts),
    )


CONDITIONS = st.recursive(
    st.one_of(
        st.sampled_from(
            [
                StateTest("p", "off"),
                VariableRead("p", "flag"),
                VariableRead("io.hit", ITSELF),
                Binary("=", VariableRead("p", "mode"), EnumValue("io.Mode", "HAND")),
                Binary("!=", VariableRead("p", "other"), EnumValue("Other", "LEFT")),
            ]
        ),
        st.builds(Binary, st.sampled_from(COMPARISONS), NUMBERS, NUMBERS),
    ),
    _conditions,
    max_leaves=8,
)


@given(CONDITIONS)
def test_the_reader_takes_what_is_printed_and_understands_the_same(condition: Expression) -> None:
    text = cif_text(condition)
    system = checked(f"{MODEL}requirement invariant {text};\n")
    # An invariant that is always true is read as such.
    (invariant,) = system.invariants or (Constant(True),)
    places = {subject: place for place, subject in enumerate(subjects(system))}
    written, read = (compile_expression(item, places) for item in (condition, invariant))
    for state in product(*(subject_domain(system, subject) for subject in places)):
        assert written(state, NO_DATA) is read(state, NO_DATA), text


def test_comparisons_have_one_rank() -> None:
    flag, less = VariableRead("p", "flag"), Binary("<", VariableRead("p", "n"), Constant(2))
    assert cif_text(Binary("=", flag, less)) == "p.flag = (p.n < 2)"
    assert cif_text(Binary("!=", less, flag)) == "(p.n < 2) != p.flag"


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    main([str(item) for item in arguments])
    printed = capsys.readouterr()
    return printed.out + printed.err


def model(tmp_path: Path, *lines: str, text: str = MODEL) -> Path:
    path = tmp_path / "m.cif"
    path.write_text(text + "".join(f"{line}\n" for line in lines))
    return path


def test_explanations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = model(
        tmp_path,
        "requirement p.c_on needs not io.hit and p.mode != io.HAND;",
        "requirement p.n = 0 and io.level = 2 or not p.on disables p.c_off;",
        "requirement invariant if p.flag: io.level < 2 else true end;",
    )
    printed = run(capsys, "explain-synthesis", path)
    assert "'requirement p.c_on needs not io.hit and p.mode != io.HAND' forbids it" in printed
    assert "'requirement p.n = 0 and io.level = 2 or not p.on disables p.c_off'" in printed
    assert "'requirement invariant if p.flag: io.level < 2 else true end' is broken" in printed
    assert "p is off, where it has no edge for p.c_off" in printed
    for foreign in ("!p", "!io", "holds", "value", "is here", "= here", "integer", "boolean", "transition"):
        assert foreign not in printed, foreign


def test_blame_has_types_of_cif(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = model(
        tmp_path, text="plant t: uncontrollable u; disc int[1..2] n; location: initial; edge u do n := n + 1; end"
    )
    printed = run(capsys, "synth", path)
    assert "the range of t.n: int[1..2]" in printed


def test_a_supervisor_that_is_not_safe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = model(tmp_path, "supervisor invariant not (p.on and p.flag) or io.level > 0;")
    printed = run(capsys, "verify", path)
    assert "not safe: 'not (p.on and p.flag) or io.level > 0' is not true, after p.c_on, p.u_trip" in printed


def test_simulation(tmp_path: Path) -> None:
    path = model(tmp_path, "requirement p.c_on needs not io.hit;", "plant not p.off disables p.c_on;")
    made = robosc.synthesize(path).supervisor
    assert isinstance(made, SystemSupervisor)
    begin = {"io.hit": True, "io.level": 0}
    stepped = robosc.simulate(made, initial=begin)
    assert stepped.reasons("p.c_on") == ("it needs not io.hit, which does not hold (io.hit is true)",)
    assert {item.name: item.type for item in stepped.data_fields("io.level")} == {"value": "int[0..2]"}
    assert [item.as_json()["is_boolean"] for item in stepped.data_fields("io.hit")] == [True]
    with pytest.raises(robosc.DataError, match=r"'io.level' is 7, and must be int\[0..2\]"):
        stepped.step("io.level", 7)
    with pytest.raises(robosc.DataError, match=r"'io\.hit' is 'HAND', and must be bool"):
        stepped.step("io.hit", "HAND")
    stepped.step("io.hit", False)
    stepped.step("p.c_on")
    assert stepped.reasons("p.c_on")[-1] == "not p.off disables it, and that holds (p is on)"


def test_literals_go_by_both_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = model(
        tmp_path,
        "group g: input io.Mode wish; end",
        "plant q: uncontrollable u; location: initial; marked; edge u when g.wish = io.HAND; end",
    )
    for name in ("io.HAND", "HAND"):
        printed = run(capsys, "explain-synthesis", path, "--event", "p.c_off", "--state", f"g.wish = {name}")
        assert "p is off, where it has no edge for p.c_off" in printed
        assert state_parts(checked(path.read_text()), f"g.wish = {name}") == {"g.wish": "HAND"}
    printed = run(capsys, "explain-synthesis", path, "--state", "g.wsh")
    assert "unknown location or variable 'g.wsh'; did you mean 'g.wish'?" in printed
    printed = run(capsys, "explain-synthesis", path, "--state", "nothing of it")
    assert "here" not in printed.replace("there", "")
    printed = run(capsys, "explain-synthesis", path, "--state", "g.wish = io.FOOT")
    assert "'io.FOOT' is not a value of g.wish" in printed
    made = robosc.synthesize(path).supervisor
    assert isinstance(made, SystemSupervisor)
    stepped = robosc.simulate(made, initial={"g.wish": "AUTO", "io.hit": True, "io.level": 0})
    assert stepped.reasons("q.u") == ("q: g.wish = io.HAND does not hold (g.wish is AUTO)",)
    assert event_text(stepped.step("g.wish", "io.HAND")) == "g.wish (HAND)"
    assert "q.u" in stepped.possible


@pytest.mark.parametrize("target", ["c99", "python"])
def test_comments_of_code(tmp_path: Path, target: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = model(
        tmp_path,
        "requirement p.c_on needs not io.hit;",
        "requirement p.flag and not p.on disables p.c_off;",
        "requirement invariant not p.flag or p.n = 0;",
    )
    run(capsys, "generate", path, "--target", target, "-o", tmp_path / "out")
    written = "".join(item.read_text() for item in (tmp_path / "out").iterdir() if item.suffix in (".c", ".py"))
    assert "not io.hit" in written
    assert "not (p.flag and not p.on)" in written
    for foreign in ("!holds", "!p.", "!io.hit "):
        assert foreign not in written, foreign


def test_conditions_of_supervisors(monkeypatch: pytest.MonkeyPatch) -> None:
    text = """plant q:
      uncontrollable u_x; disc io.Mode m in any; disc int[0..2] k in any; disc bool b in any;
      location a: initial; marked; edge u_x when k > 0 goto c; edge p.c_on; edge p.c_off do k := 2 - k, b := not b;
      location c: marked q.m = io.HAND; edge u_x; edge p.c_off goto a;
    end
    requirement invariant not (q.c and p.on) or q.m = io.HAND and q.b;
    """
    made = robosc.synthesize(robosc.load(text=MODEL + text, name="m.cif")).supervisor
    assert isinstance(made, SystemSupervisor)
    assert [str(item) for item in made.conditions.values()] == ["q.k = 0 or q.b", "q.m = io.HAND"]
    monkeypatch.setattr(Formulas, "formula", lambda self, diagram, limit=0: None)
    del made.__dict__["conditions"]
    on, off = made.conditions.values()
    assert str(on).splitlines()[1:] == ["[1] if q.b: true else [2] end", "[2] q.k = 0"]
    assert str(off).splitlines()[1:] == ["[1] q.m = io.HAND"]
    assert [line.json() for line in off.lines] == [
        {"node": 1, "cases": [{"if": "q.m = io.HAND", "then": True}], "else": False}
    ]
    several = Line(3, tuple((item.cases[0][0], item.number) for item in on.lines), True, is_cif=True)
    assert str(several) == "[3] if q.b: [1] elif q.k = 0: [2] else true end"
