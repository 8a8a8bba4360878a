"""CIF texts that show every construct of the language."""

LANGUAGE = """\
@@doc("All of the language.", "text",)
import "a.cif", "b.cif";
namespace x.y;
type t = int[0..3], u = list[2] bool, v = list[0..4] tuple(int a, b; real c), w = dict(int: set string), f = func int();
@doc("A colour.")
enum Color = @doc("r") RED, GREEN;
event e0, e1; event void n; event int[0..2] ch; event t named; controllable c; uncontrollable event z;
controllable event c2;
const int N = 3, M = 2 * N; const real r = 1.5e-3; const string s = "a\\n\\"b\\\\";
alg bool y = true, y2; alg t q;
input bool i, j;
cont k = 1.0 der 2.0, l;
equation y2 = false, k' = 1.0;
initial y, true; marked N = 3;
invariant true; plant invariant inv: y; requirement y, c needs y; requirement r1: c needs y; plant {c, z} needs y;
supervisor y disables {c, .z}; requirement ^x.y.c needs y; requirement invariant y disables c;
@x:y group g: controllable a; group h: end group def D(): end end
group def E(controllable a, b; event int ch!?, k!; uncontrollable event u~; location l; alg int p, p2; D d; event m):
  svgin id "a" event if x: y else z end;
end
i1: E(a.b, 1 + 2, .x, ^y, $plant, a.final);
print "a;b" for e; svgout id "x" attr "y" value 3;
func int, real fn(int a, b; real c):
  int v = 3, w; bool b;
  while true, false: v := v + 1; break; continue; end
  if v = 1: return 1; elif v = 2: (v, w) := (w, v); else v[0], w := 1, 2; end
  return v, 1.0;
end
func bool ext(): "lib:fn";
automaton A:
  alphabet c, z; monitor; disc int[0..3] d = 1, d2, d3 in any, d4 in {1, 2}; alg int a; plant invariant d = 1;
  location p:
    initial; initial d = 1, d2 = 0; marked; urgent; equation a = 3; requirement inv2: d = 1; edge c;
    edge c, tau, z, ch!3, ch!, ch? when d = 1, d2 = 0 now do
      d := 1, (d2, d3) := (1, 2), if d = 1: d4 := 1 elif y: d4 := 2, d := 1 else d4 := 0 end goto p;
    edge when y; edge now; edge do d := 1; edge tau goto p;
    @@doc("x") edge c; @@doc("y") requirement d = 1;
  location;
end
"""

EXPRESSIONS = (
    "a or b or c and not d => e",
    "1 + 2 - 3 * 4 div 5 mod 6 / 7 < -+3",
    "not x = 1",
    "a.b.c[1][2:3][:][4:](x)(1, 2)",
    "if a, b: 1 elif c: 2 else 3 end",
    "switch x: case 1: 2 case 3: 4 else 5 end",
    "switch x: else 5 end",
    "switch self: case a: 1 end",
    "<int>3.0 + <list int>[1, 2]",
    "{1, 2} = {}",
    "{1: 2, 3: 4}",
    "(1, 2) = [1, 2] and {x} sub y and 1 in {3}",
    "max(1, 2) + sample x + size([])",
    "x' > time",
    "(((a)))",
    "a <=> b",
)

INVALID_EXPRESSIONS = (
    "a => b => c",
    "a <=> b => c",
    "if a: 1 end",
    "switch x: end",
    "a .b.c d",
    "a. b",
    "()",
    "1 +",
    "007",
    "1.",
    "max",
    "'a'",
    "a ! b",
    "{1: 2, 3}",
    "plant",
    '"a\\q"',
    '"abc',
    "<int>-3",
    "a[",
    "f(a,)",
)
