"""CIF models, checked and lowered: every construct, and every finding with its place."""

from pathlib import Path
from random import Random

import pytest

from robosc.automata import System, check_system
from robosc.cif import check_cif, load_cif
from robosc.cif.tokens import tokenize
from robosc.errors import Diagnostic
from robosc.source import Bundle, SourceFile
from robosc.synthesis import SynthesisStatus, synthesize
from support.effort import examples

TANK = """
plant tank:
  controllable c_fill; uncontrollable u_drain;
  disc int[0..3] level = 1;
  location:
    initial; marked;
    edge c_fill do level := level + 1;
    edge u_drain when level > 1 do level := level - 1;
end
"""


def checked(text: str, **others: str) -> tuple[System | None, tuple[Diagnostic, ...]]:
    """The system of a text, and the findings about it."""
    libraries = tuple(SourceFile(f"{name}.cif", other) for name, other in others.items())
    found = check_cif(Bundle(SourceFile("m.cif", text), libraries))
    return found.system, found.diagnostics


def states(text: str, **others: str) -> int:
    """Number of states of the controlled system; 0 where there is none."""
    system, diagnostics = checked(text, **others)
    assert system is not None, [str(item) for item in diagnostics]
    check_system(system)
    result = synthesize(system)
    if result.status is SynthesisStatus.EMPTY:
        return 0
    assert result.statistics is not None
    return result.statistics.states


def counter(declarations: str, edge: str, location: str = "") -> str:
    """A plant with one location, one controllable event `e` and one variable `x` of 0 to 3."""
    return (
        f"plant p: controllable e; disc int[0..3] x; {declarations} "
        f"location: initial; marked; {location} edge e {edge}; end"
    )


CHANNEL = """controllable int[0..3] e;
plant p: disc int[0..3] v; location: initial; marked; {s} end
plant q: disc int[0..3] x; location: initial; marked; {r} end
{more}"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (TANK + "requirement tank.u_drain needs tank.level != 3;", 2),
        (TANK + "plant tank.u_drain needs tank.level != 3;", 3),
        (TANK + "requirement invariant tank.level < 3;", 2),
        (TANK + "plant invariant tank.level < 3;", 2),
        (TANK + "requirement tank.level = 2 disables tank.c_fill;", 2),
        (TANK + "requirement {tank.c_fill} needs false;", 1),
        (TANK + "initial tank.level = 0;", 0),
        (TANK + "marked tank.level = 3;", 3),
        (TANK + "marked false;", 0),
        (counter("", "do x := x + 1"), 4),
        (counter("", "do if x = 0: x := 2 elif x = 2: x := 3 else x := 0 end"), 3),
        (counter("", "do if x = 0: x := 2 end"), 2),
        (counter("disc int[0..3] y = 1;", "do (x, y) := (y, x)"), 2),
        (counter("disc int[0..3] y = 1;", "do x := y, y := x"), 2),
        (counter("disc int[0..3] y = 1;", "do (x, y) := if x = 0: (1, 2) else (3, 0) end"), 3),
        (counter("const tuple(int a, b) t = (2, 3);", "do x := t[a]"), 2),
        (counter("const list int l = [1, 3]; const int n = size(l);", "when x < n do x := l[1]"), 2),
        (counter("alg int y = x + 1;", "when y <= 3 do x := y"), 4),
        (counter("alg int y; equation y = 2;", "do x := y"), 2),
        (counter("", "do x := switch x: case 0: 1 case 1: 2 else 0 end"), 3),
        (counter("", "do x := (x + 1) mod 3"), 3),
        (counter("", "do x := 3 - (x + 3) div 2"), 3),
        (counter("enum E = A, B, C; disc E z;", "do z := switch z: case A: B case B: C case C: A end"), 3),
        (counter("enum E = A, B, C; disc E z in {A, C};", "do z := B"), 3),
        (counter("disc bool b in any;", "when b do b := not b"), 2),
        (counter("disc int[1..4] y = x + 1;", "do y := 2"), 2),
        (counter("disc int[2..3] y;", ""), 1),
        (counter("input bool i;", "when i do x := 1"), 4),
        (counter("type t = int[0..1]; disc t y = 1;", "do y := 0"), 2),
        (counter("", "", "requirement x = 0;"), 1),
        (counter("", "do x := 1", "initial x = 1;"), 0),
        (counter("", "do x := floor(2.5) + max(0, 1)"), 2),
        (counter("", "when 1 in {1, 2} do x := <int>\"3\""), 2),
        (counter("print 1; svgout id \"a\" attr \"b\" value x; @doc(\"y\") const int k = 1;", "do x := k"), 2),
        # A listed event without an edge is blocked, an event that is in no plant is always possible.
        ("plant p: controllable e, f; alphabet e, f; location a: initial; marked; edge e goto b; location b: marked; end", 2),
        ("controllable e; plant p: location: initial; marked; end requirement r: location a: initial; marked; edge e goto b;"
         " location b: marked; end", 2),
        ("uncontrollable e; plant p: location: initial; marked; edge e; end"
         " requirement r: location a: initial; marked; edge e goto b; location b: marked; end", 0),
        ("uncontrollable e; plant p: location: initial; marked; edge e; end"
         " requirement r: monitor e; location a: initial; marked; edge e goto b; location b: marked; end", 2),
        ("uncontrollable e; plant p: location: initial; marked; edge e; end"
         " plant r: monitor; location a: initial; marked; edge e goto b; location b: marked; end", 2),
        ("controllable e; plant p: location a: initial; edge e goto b; location b: marked; end", 2),
        ("controllable e; plant p: location a: initial; edge e goto b; location b; end", 0),
        ("controllable e; plant p: location a: initial; marked; location b: initial; marked; edge e goto a; end", 2),
        ("controllable e; plant p: disc bool x in any; location a: initial x; marked; location b: initial not x; marked;"
         " edge e when not x do x := true goto a; end", 2),
        ("controllable e; plant p: alg int y; disc int[0..3] x; location a: initial; marked; equation y = 1; edge e do x := y"
         " goto b; location b: marked; equation y = 3; edge e when y = 3 do x := y; end", 3),
        ("controllable e; plant p: location a: initial; marked; edge e goto b; location b: marked; end"
         " requirement invariant switch p: case a: true else false end;", 1),
        ("controllable e; plant p: location a: initial; marked; requirement e needs false; edge e goto b; location b: marked;"
         " end", 1),
        ("controllable e; plant p: location a: initial; marked; edge e goto b; location b: marked;"
         " requirement true disables e; edge e goto a; end", 2),
        # Definitions: events, locations, expressions and components as arguments; groups, and names from roots.
        ("group def D(controllable e; location l; alg int n; P q): plant a: disc int[0..3] x; location: initial; marked;"
         " edge e when l and q.z < n do x := n; end end plant def P(): controllable e; disc int[0..3] z; location m: initial;"
         " marked; edge e do z := 2; end p: P(); d: D(p.e, p.m, 2, p);", 2),
        ("group g: controllable e; group h: plant p: location: initial; marked; edge .g.e; end end end"
         " group h: plant q: location: initial; marked; edge ^g.e; end end", 1),
        ("plant p: controllable $plant; location $end: initial; marked; edge p.plant; end", 1),
        (counter("", "do x := 1") + " requirement r: p.e needs p.x = 0;", 2),
        # The declared type counts, and integers become real where reals are expected.
        (counter("const real r = 2; const int n = size(<string>r);", "when x < n do x := x + 1"), 4),
        (counter("const real r = 1.0; const bool b = r = 1;", "when b do x := 1"), 2),
        (counter("const list real l = if true: [1] else [2.5] end; const bool b = l = [1];", "when b do x := 1"), 2),
        (counter("const set real s = {3, 4}; const bool b = 3.0 in s;", "when b do x := 1"), 2),
        (counter("const dict(int: real) d = {}; const bool b = empty(d) and d + {1: 2} = {1: 2.0};", "when b do x := 1"), 2),
        (counter("const dict(int: int) d = {1: 2, 3: 4} - [1]; const bool b = d = {3: 4};", "when b do x := 1"), 2),
        (counter('const string s = fmt("%03d|%.2f|%s|%b|%x|%1$-4d|", 7, 2.0, [1.0], true, 255);'
                 ' const bool b = s = "007|2.00|[1.0]|true|ff|7   |";', "when b do x := 1"), 2),
        (counter('const bool b = <string>1e7 = "1.0e7" and <string>0.00025 = "2.5e-4" and <string>(-12.5) = "-12.5";',
                 "when b do x := 1"), 2),
        (counter("const int n = pop([2, 3])[0] + del([1, 2], 0)[0] - floor(scale(1, 0, 2, 0, 4));", "do x := n"), 2),
        (counter("const tuple(bool a; int[0..1] b) l = (true, 1); const int n = switch l: case (true, 1): 1 case (true, 0): 2"
                 " case (false, 0): 2 case (false, 1): 3 end;", "when x < n do x := x + 1"), 2),
        (counter("const list[0..1] bool l = []; const int n = switch l: case []: 1 case [true]: 2 case [false]: 3 end;",
                 "when x < n do x := x + 1"), 2),
        # Variables of tuples, and assignments of their fields.
        (counter("disc tuple(int[0..3] a; bool b) t = (1, true);", "when t[b] do t[a] := t[a] + 1, t[b] := t[a] < 2"), 3),
        (counter("disc tuple(int[0..3] a; tuple(bool c; int[0..1] d) b) t;", "do t[b][c] := true, t[1][1] := 1"), 2),
        (counter("disc tuple(int[0..3] a; bool b) t in {(1, true), (2, false)};", "do t := (3, true)"), 3),
        (counter("disc tuple(int[0..3] a; bool b) t in any;", "do t := (3, true)"), 8),
        (counter("disc tuple(int[0..3] a; bool b) t, u;", "do t := u, u[a] := 3"), 3),
        (counter("disc tuple(int[0..3] a; bool b) t;", "when t = (0, false) do t[a] := 3"), 2),
        (counter("disc tuple(int[0..3] a; bool b) t; disc int[0..1] t_a;", "do if t[b]: t[a] := 3 else t[b] := true end"), 3),
        (counter("disc tuple(int[0..3] a; bool b) t;", "do (x, t[a]) := (1, 2)"), 2),
        # A parameter typed by a definition in an instance.
        ("group def Y(): plant def Q(): controllable c; disc int[0..3] v; location: initial; marked;"
         " edge c when v < 3 do v := v + 1; end q: Q(); end y: Y();"
         " group def X(y.Q p): requirement p.c needs p.v < 2; end x: X(y.q);", 3),
        ("group def D(event int e~!?): end " + counter("", "do x := 1"), 2),
        # Such a definition, in another instance of what is around it; enums with the same literals are one.
        ("group def Y(): plant def Q(): controllable c; disc int[0..3] v; location: initial; marked;"
         " edge c when v < 3 do v := v + 1; end q: Q(); end y: Y(); z: Y();"
         " group def X(y.Q p): requirement p.c needs p.v < 2; end x: X(z.q);", 12),
        ("type t = bool; plant def D(alg t g): type t = int; controllable c; disc bool v; location: initial; marked;"
         " edge c when g do v := true; end a: D(true);", 2),
        # Channels: the value goes from the edge that sends to those that receive.
        (CHANNEL.format(s="edge e!1;", r="edge e? do x := ?;", more=""), 2),
        (CHANNEL.format(s="edge e!v do v := v + 1;", r="edge e? do x := ?;", more="requirement e needs q.x < 1;"), 3),
        (CHANNEL.format(s="edge e!1 when v = 0 do v := 1; edge e!3 when v != 0;", r="edge e? do x := ?;", more=""), 3),
        (CHANNEL.format(s="edge e!if v = 2: 0 else 1 end do v := 2;", r="edge e? when x = 0 do x := ?;", more=""), 2),
        (CHANNEL.format(s="edge e!1;", r="edge e? do x := ?;",
                        more="plant o: location a: initial; marked; edge e goto b; location b: marked; end"), 2),
        (CHANNEL.format(s="edge e!1;", r="", more=""), 1),
        (CHANNEL.format(s="", r="edge e? do x := ?;", more=""), 1),
        (CHANNEL.format(s="edge e!1 when q.x < 2;", r="edge e? do x := ? + 1;",
                        more="plant o: location: initial; marked; edge e!0 when q.x = 2; end"), 3),
        (CHANNEL.format(s="edge e!1;", r="edge e? when x = 0 do x := ?;",
                        more="plant o: disc int[0..3] y; location: initial; marked; edge e? when q.x = 1 do y := ?; end"), 3),
        ("controllable tuple(int[0..3] a; bool b) e; plant p: location: initial; marked; edge e!(2, true); end plant q:"
         " disc int[0..3] x; disc bool b; location: initial; marked; edge e? do (x, b) := ?; end", 2),
        ("uncontrollable void e; plant p: location: initial; marked; edge e!; end plant q: disc int[0..3] x; location:"
         " initial; marked; edge e? do x := 1; end", 2),
        # A missing value is missed only where it is evaluated.
        (counter("const int z = 0; const real r = if z = 0: 0 else 1 / z end; const bool b = z = 0 or 1 / z = 1;",
                 "when b do x := 1"), 2),
        (counter("disc bool b = switch self: case l: true case k: false end;", "when b do x := 1 goto k;"
                 " location k: marked").replace("location:", "location l:"), 2),
    ],
)  # fmt: skip
def test_number_of_states(text: str, expected: int) -> None:
    assert states(text) == expected


def test_imports_are_merged() -> None:
    main = 'import "a.cif", "b.cif"; requirement x.p.e needs false;'
    a = 'namespace x; import "b.cif"; plant p: controllable e; location a: initial; marked; edge e goto b; location b: marked; end'
    b = 'import "m.cif"; group x: const int n = 3; end'
    assert states(main, a=a, b=b) == 1


def test_files_are_read_from_their_folders(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "main.cif").write_text('import "sub/a.cif", "nothing.cif";')
    (tmp_path / "sub" / "a.cif").write_text('import "../main.cif", "b.cif";')
    (tmp_path / "sub" / "b.cif").write_text("controllable e;")
    bundle = load_cif(tmp_path / "main.cif")
    assert [file.name for file in bundle.files] == ["main.cif", "sub/a.cif", "sub/b.cif"]
    (finding,) = check_cif(bundle).diagnostics
    assert (finding.code, finding.location and finding.location.column) == ("cif-import", 21)


@pytest.mark.parametrize(
    ("text", "code", "column"),
    [
        ("invariant x;", "cif-unknown-name", 11),
        ("const int n = a.b;", "cif-unknown-name", 15),
        ("group g: end const int n = g.b;", "cif-unknown-name", 28),
        (counter("", "goto z"), "cif-unknown-name", 85),
        ("const x l = [1, 3]; const int n = size(l);", "cif-unknown-name", 7),
        ("const list int l = if true: [1] else x end;", "cif-unknown-name", 38),
        ("const list x l = [[1]]; const int n = size(if true: [[1]] else l end);", "cif-unknown-name", 12),
        ("plant p: disc list x l; location: initial; edge tau do l := [[1]]; end", "cif-unknown-name", 20),
        ("const bool b = 3;", "cif-type", 16),
        ("const bool b = not 3;", "cif-type", 16),
        ("const bool b = 1 <= 2 <= 3;", "cif-type", 23),
        ("const int n = 2147483647 + 1;", "cif-type", 26),
        ("const int n = 1 div 0;", "cif-type", 17),
        ("const int[0..2] n = 3;", "cif-type", 21),
        ("type t = int[3..2];", "cif-type", 10),
        ("const int n = if true: 1 else false end;", "cif-type", 15),
        ("const int n = switch 3: case 3: 1 case 4: 2 end;", None, 0),
        ("const int n = switch true: case true: 1 end;", "cif-type", 15),
        ("const list int l = [1, true];", "cif-type", 20),
        ("const int n = [1][3];", "cif-type", 15),
        ("const int n = size(3);", "cif-type", 15),
        ("const int n = <int>\"x\";", "cif-type", 15),
        ("const int n = m; const int m = n;", "cif-cycle", 11),
        ("type t = list t;", "cif-cycle", 6),
        (counter("disc int[0..3] y = z; disc int[0..3] z = y;", ""), "cif-cycle", 85),
        ("group def D(): d: D(); end d: D();", "cif-cycle", 19),
        ("q: q();", "cif-cycle", 4),
        ("q: r.D(); r: q.D();", "cif-cycle", 4),
        ("group def D(): end d: D(3);", "cif-arguments", 20),
        ("group def D(event e): end d: D(3); event f;", "cif-arguments", 32),
        ("const int n = 3; type n = int;", "cif-duplicate-name", 23),
        ("enum E = A, A;", "cif-duplicate-name", 13),
        ("const int n = 3; k: n();", "cif-wrong-kind", 21),
        (counter("", "when e"), "cif-wrong-kind", 85),
        ("group a: end group a: end", "cif-duplicate-name", 20),
        ("group a: group b: end group b: end end", "cif-duplicate-name", 29),
        ("type t = tuple(int a);", "cif-type", 10),
        ("type t = tuple(int a; bool a);", "cif-duplicate-name", 28),
        ("const real x = 1e309;", "cif-syntax-error", 16),
        ("const real x = 1e308 * 10;", "cif-type", 22),
        ("const int n = 2147483648;", "cif-syntax-error", 15),
        ("const list int k = [1]; const list real l = k;", "cif-type", 45),
        ("const list int k = [1, 2]; const int n = k[true];", "cif-type", 42),
        ("const list int k = [1, 2]; const list int l = k[1.0:];", "cif-type", 49),
        ("const int[0..5] n = 2; alg int[2..2] m = n;", "cif-type", 42),
        ('const string s = fmt("%d", true);', "cif-type", 22),
        ("const tuple(bool a, b) l = (true, true); const int n = switch l: case (true, true): 1 end;", "cif-type", 56),
        ("group def D(event e!): end", "cif-structure", 19),
        ("group def D(event int e!?!): end", "cif-structure", 23),
        (counter("", "do x := ?"), "cif-type", 88),
        (counter("", "").replace("edge e", "edge e!1"), "cif-type", 78),
        (counter("disc tuple(int[0..3] a; bool b) t;", "do t := (1, true), t[a] := 3"), "cif-assignment", 133),
        (counter("disc tuple(int[0..3] a; bool b) t;", "do t[a] := true"), "cif-type", 117),
        (counter("", "do x := 1, x := 2"), "cif-assignment", 91),
        (counter("", "do (x, x) := (1, 2)"), "cif-assignment", 87),
        ("func real f(): real a; a, a := 1, 2; return a; end", "cif-assignment", 27),
        (counter("", "do if x = 1: x := 2 end, if x = 2: x := 1 end"), "cif-assignment", 115),
        (counter("alg int y;", ""), "cif-structure", 52),
        (counter("alphabet; monitor e;", ""), "cif-structure", 44),
        ("plant p: location: initial; location a; end", "cif-structure", 10),
        ("event e;", "cif-unsupported", 7),
        (counter("disc int[0..3] e;", ""), "cif-duplicate-name", 59),
        ("func int f(int a): return true; end", "cif-type", 27),
        ("func int f(int a): a := true; return a; end", "cif-type", 20),
        ("func int f(int a): a := 1; end", "cif-structure", 20),
        ("func int f(int a): if a = 1: return 1; elif a = 2: a := 1; else return 2; end end", "cif-structure", 52),
        ("func int f(int a): while true: return 1; end end", "cif-structure", 20),
        ("func int f(int a): break; return a; end", "cif-structure", 20),
        ("func int f(int a): int a; return a; end", "cif-duplicate-name", 24),
        ("func int f(int a): int b = true; return b; end", "cif-type", 28),
        ("func int, bool f(): return 1; end", "cif-type", 28),
        ("func real f(): return time; end", "cif-type", 23),
        ("alg int n = 1; func int f(): return n; end", "cif-type", 37),
        ("func int f(): n := 1; return 1; end const int n = 1;", "cif-wrong-kind", 15),
        ("group def D(): func int f(): return b; end end", "cif-unknown-name", 37),
        ("const int k = 2; const real r = k;", "cif-type", 33),
        ("const bool b = 1 = 1.0;", "cif-type", 18),
        ("const bool b = (if true: 1 else 2.0 end) = 1.0;", "cif-type", 17),
        ("const set real s = {1}; const bool b = 1 in s;", "cif-type", 42),
        ("const int n = <int>3;", "cif-type", 15),
        ("const int n = size([]);", "cif-type", 20),
        ("const bool b = {} = {1};", "cif-type", 16),
        ("const int[0..2] n = 2 mod 5;", "cif-type", 23),
        ("const int[0..3] n = round(2.5);", "cif-type", 21),
        ("const list[3] int l = [1, 2];", "cif-type", 23),
        ("const tuple(int a, b) t = (1, 2); const int n = (if true: t else t end)[a];", "cif-unknown-name", 73),
        ("const int n = switch 1: case 1: 1 case 1: 2 else 3 end;", "cif-type", 40),
        ("const int n = 0; const int m = 1 div n;", "cif-type", 34),
        ("const int n = floor(0.5); const int m = 1 div n;", "cif-type", 43),
        ("input bool i; const bool b = false and i;", "cif-type", 40),
        ("group g: end type t = g;", "cif-wrong-kind", 23),
        ("type t = set func int();", "cif-type", 10),
        ("alg dist int d = uniform(1, 2);", "cif-type", 18),
        ("cont c der true;", "cif-type", 12),
        ("equation x' = 1;", "cif-structure", 10),
        ("group def D(alg t g): type t = int; end", "cif-unknown-name", 17),
        ("group def A(B b; b.C c): end group def B(): plant def C(): location; end end", "cif-unknown-name", 18),
        ("group def Y(): group g: group def Z(): end end end y: Y(); z: y.g.Z();", "cif-unknown-name", 63),
        ("plant def B(controllable c): location; end group def A(event e): b: B(e); end", "cif-arguments", 71),
        (counter("disc bool v = k;", "goto k; location k: initial v").replace("location:", "location l:"), "cif-cycle", 126),
        (counter("", "goto k; location k: initial k").replace("location:", "location l:"), "cif-cycle", 110),
        (CHANNEL.format(s="edge e!1; edge e!2;", r="edge e? do x := ?;", more=""), "cif-unsupported", 70),
        (CHANNEL.format(s="edge e!1;", r="edge e? do x := ?;", more="requirement o: location: edge e?; end"),
         "cif-unsupported", 31),
        (CHANNEL.format(s="edge e!1;", r="edge e? do x := ?;", more="plant o: location: initial; edge e!1; end"),
         "cif-unsupported", 34),
        (CHANNEL.format(s="edge e!1; edge e?;", r="", more=""), "cif-structure", 70),
        (CHANNEL.format(s="edge e!1; edge e;", r="", more=""), "cif-structure", 7),
        (CHANNEL.format(s="edge e!1; edge e!true;", r="edge e?;", more=""), "cif-type", 72),
        (CHANNEL.format(s="edge e!1;", r="edge e? when ? = 1;", more=""), "cif-type", 68),
        ("controllable real e; plant p: location: initial; edge e!1; end", "cif-unsupported", 57),
        ("cont c;", "cif-unsupported", 6),
        ("invariant true;", "cif-unsupported", 11),
        (counter("", "") + " supervisor p.e needs true; requirement p.e needs true;", "cif-unsupported", 125),
        ("automaton a: location; end", "cif-unsupported", 11),
        (counter("disc real r;", ""), "cif-unsupported", 54),
        (counter("disc int n;", ""), "cif-unsupported", 53),
        (counter("", "when time > 1.0"), "cif-unsupported", 85),
        (counter("", "when [1, x] = [1, 2]"), "cif-unsupported", 85),
        (counter("disc int[1..2] y;", "do x := x div y"), "cif-unsupported", 107),
        (counter("", "").replace("edge e", "edge tau"), "cif-unsupported", 78),
        (counter("", "").replace("edge e", "edge when true"), "cif-unsupported", 73),
        (counter("disc int[0..2000000] y;", ""), "cif-too-large", 65),
    ],
)  # fmt: skip
def test_findings(text: str, code: str | None, column: int) -> None:
    _, found = checked(text)
    reported = [(item.code, item.location.column) for item in found if item.location]
    assert ((code, column) in reported) if code else (reported == [("cif-unsupported", 1)]), reported


def test_everything_that_synthesis_does_not_take_is_reported_in_one_run() -> None:
    text = """event e; cont c; func int f(int x): return x; end
invariant true;
plant p:
  controllable a; disc real r; disc int n; controllable real ch;
  location:
    edge a, tau, ch!3 when f(1) = 2;
end
"""
    _, found = checked(text)
    assert {item.code for item in found} == {"cif-unsupported"}
    assert [item.location.line for item in found if item.location] == [1, 1, 2, 4, 4, 6, 6, 6]
    assert all(item.fix for item in found)


def test_functions_that_nobody_calls_are_taken() -> None:
    text = """const int n = 3;
func int f(int a, b; list int l): int c = n, d; while a > 0: if a = 2: continue; elif b = 1: break; end a, l[0] := b, c;
  end if size(l) = 0: return f(a, b, [1]); else (c, d) := (d, 1); return c; end end
func real, bool g(tuple(int x; bool y) t): t[x] := 1; return 1, t[y]; end
func bool h(): "java:x.y";
"""
    _, found = checked(text + TANK)
    assert found == ()


def test_a_definition_that_nobody_instantiates_is_checked_for_types_alone() -> None:
    system, found = checked(TANK + "automaton def D(alg int n; event e): cont c; location: edge e when n > 1; end")
    assert system is not None
    assert found == ()
    _, found = checked(TANK + "automaton def D(alg int n): location: edge when n; end")
    assert [item.code for item in found] == ["cif-type"]


def test_one_file_with_two_names_is_one_file(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.cif").write_text('import "sub/b.cif", "./c.cif", "link.cif";')
    (tmp_path / "sub" / "b.cif").write_text('import "../a.cif"; const int n = 2;' + counter("", "do x := n"))
    (tmp_path / "c.cif").write_text("const int m = 3;")
    (tmp_path / "link.cif").symlink_to("c.cif")
    for main in ("a.cif", "sub/b.cif"):
        found = check_cif(load_cif(tmp_path / main))
        assert found.system is not None, [str(item) for item in found.diagnostics]


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("controllable z;", ["cif-unused-event"]),
        ("plant def D(): controllable y, z; location: initial; marked; edge y; end a: D(); b: D();", ["cif-unused-event"]),
        ("plant q: alphabet tank.c_fill; location: initial; marked; end", ["cif-event-never-happens"]),
        ("plant q: monitor; alphabet tank.c_fill; location: initial; marked; end", []),
        ("plant q: location: initial; marked; edge tank.c_fill when false; end", ["cif-event-never-happens"]),
        ("requirement r: location a: initial; marked; edge tank.c_fill goto b; location b: marked; end"
         " plant tank.u_drain needs r.a; plant q: disc bool b = r.b; location: initial; marked; end",
         ["cif-plant-reads-requirement"] * 2),
        ("requirement r: location a: initial; marked; edge tank.c_fill goto b; location b: marked; end"
         " plant q: disc bool b; location: initial; marked; edge tank.u_drain when r.a do b := r.b; end",
         ["cif-plant-reads-requirement"] * 2),
        ("requirement r: location a: initial; marked; edge tank.c_fill goto b; location b: marked; end"
         " requirement tank.c_fill needs r.a;", []),
        ("controllable void s; plant q: location: initial; marked; edge s!; end", ["cif-event-never-happens"]),
    ],
)  # fmt: skip
def test_what_is_mostly_meant_otherwise_is_a_warning(text: str, codes: list[str]) -> None:
    system, found = checked(TANK + text)
    assert system is not None, [str(item) for item in found]
    assert [item.code for item in found] == codes


def test_chains_of_algebraic_variables_do_not_explode() -> None:
    chain = "".join(f"alg bool y{n} = y{n - 1} = (y{n - 1} and x{n}); input bool x{n};" for n in range(1, 60))
    _, found = checked(f"{TANK} input bool y0; {chain} requirement invariant y59;")
    assert [item.code for item in found] == ["cif-too-large"]


def test_exclusions_of_events_that_nobody_has_are_dropped_with_a_warning() -> None:
    system, found = checked(TANK + "controllable z; requirement z needs false;")
    assert [item.code for item in found] == ["cif-no-effect"]
    assert system is not None
    assert system.conditions == ()


WHOLE = """
import "a.cif"; type t = int[0..3]; enum E = A, B; controllable c, d; uncontrollable u; input bool i;
const int n = 3, m = 2 * n; const list int l = [1, 2]; const tuple(int a; bool b) p2 = (1, true);
alg bool y = g.p.x = 1; group g: plant p: disc t x in any, z = 1; disc E e; monitor u; alg int w;
location a: initial x = 1; marked; equation w = x + 1; requirement x < 3; edge c when w < n, y do (x, z) := (z, 1) goto b;
location b: marked y; equation w = l[0]; edge d, u do if x = 1: x := 2 elif i: z := p2[a] else e := B end goto a; end end
group def D(controllable k; location q; alg int v; R o): requirement r: location: initial; marked; edge k when q and v < 2; end
plant o.s needs q; end plant def R(): controllable s; location: initial; marked; edge s; end
ri: R(); di: D(c, g.p.a, g.p.x + 1, ri); requirement {c, d} needs switch g.p: case a: true else y end; marked i or y;
plant invariant g.p.e = switch g.p.e: case A: A case B: B end; requirement y disables c; initial g.p.z = 1;
"""


def test_whole_model_is_sound() -> None:
    system, found = checked(WHOLE, a="const bool k = true;")
    assert system is not None, [str(item) for item in found]
    check_system(system)


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(20)))
def test_damaged_models_end_in_findings(seed: int) -> None:
    random = Random(seed)
    whole = tokenize(WHOLE).texts[:-3]
    words = sorted({word for word in whole if word.replace(".", "").isalnum()})
    for _ in range(20):
        tokens = list(whole)
        for _ in range(random.randint(1, 3)):
            place = random.randrange(len(tokens))
            tokens[place] = random.choice(words if tokens[place] in words else whole)
        system, found = checked(" ".join(tokens), a="const bool k = true;")
        assert all(item.location is not None and item.fix for item in found)
        if system is not None:
            check_system(system)


PLANT = "plant p: controllable e; location: initial; marked; edge e when {}; end "


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (PLANT.format("y2000") + "input bool y0;" + "".join(f"alg bool y{i} = not y{i - 1};" for i in range(1, 2001)),
         "cif-too-large"),
        (PLANT.format("n5000 = 1") + "const int n0 = 1;" + "".join(f"const int n{i} = n{i - 1};" for i in range(1, 5001)),
         None),
        ("const list int n0 = [1];" + "".join(f"const list int n{i} = n{i - 1} + n{i - 1};" for i in range(1, 45)),
         "cif-too-large"),
        ('const string n0 = "a";' + "".join(f"const string n{i} = n{i - 1} + n{i - 1};" for i in range(1, 45)),
         "cif-too-large"),
        ("group def D0(): end " + "".join(f"group def D{i}(): a: D{i - 1}(); b: D{i - 1}(); end " for i in range(1, 30))
         + "d: D29();", "cif-too-large"),
        ("type t0 = int;" + "".join(f"type t{i} = tuple(t{i - 1} a; t{i - 1} b);" for i in range(1, 40)),
         "cif-too-large"),
        ("const int n = pow(2, 2147483647);", "cif-type"),
    ],
    ids=["algebraic", "constants", "lists", "texts", "definitions", "types", "powers"],
)  # fmt: skip
def test_what_would_grow_without_bounds_is_refused(text: str, code: str | None) -> None:
    system, found = checked(text + TANK)
    assert {item.code for item in found} == ({code} if code else set())
    assert (system is None) is (code is not None)
