"""Controller properties of small specifications, each with what its author has worked out by hand.

A line is: the bound of uncontrollable events, that of controllable ones (None: there is none), whether there is
confluence, whether it is nonblocking under control, and the specification. Finite response is a bound of controllable
events. In a specification `P:` begins a plant, `S:` a supervisor, and anything else is CIF; `/` is between locations,
of which the first is initial, and each is marked unless it says `open`; `c1[guard](update)>b` is an edge.
"""

import re

import pytest

import robosc
from robosc.automata import as_controlled, composed
from robosc.controller_properties import check_automata
from support.automata_properties import assert_as_defined, system_of

N, Y, F = None, True, False

LINES: list[tuple[int | None, int | None, bool, bool, str]] = [
    # One kind of event
    (0, 0, Y, Y, "P: a"),
    (0, 0, Y, F, "P: a open"),
    (0, 1, Y, Y, "P: a c1>b / b"),
    (0, 1, Y, Y, "P: a open c1>b / b"),
    (0, 1, Y, F, "P: a c1>b / b open"),
    (0, 2, Y, Y, "P: a c1>b / b c2>d / d"),
    (0, 2, Y, F, "P: a c1>b / b c2>d / d open"),
    (0, N, Y, F, "P: a c1>a"),
    (0, N, Y, F, "P: a c1>b / b c1>a"),
    (0, N, Y, F, "P: a c1>b / b c2>a"),
    (0, N, Y, F, "P: a c1>b / b c2>d / d c3>b"),
    (0, N, Y, Y, "P: a c1>a c2>b / b"),
    (1, 0, Y, Y, "P: a u1>b / b"),
    (1, 0, Y, Y, "P: a open u1>b / b"),
    (1, 0, Y, F, "P: a u1>b / b open"),
    (N, 0, Y, Y, "P: a u1>a"),
    (N, 0, Y, Y, "P: a u1>b / b u2>a"),
    (N, 0, Y, F, "P: a open u1>b / b open u2>a"),
    (3, 0, Y, Y, "P: a u1>b / b u1>d / d u1>e / e"),
    (2, 0, Y, Y, "P: a u1>b u2>d / b u1>d / d"),
    # Both kinds
    (1, 1, Y, Y, "P: a u1>b / b c1>a"),
    (1, 1, Y, F, "P: a open u1>b / b c1>a"),
    (1, 1, Y, F, "P: a u1>b / b c1>d / d open u1>d2 / d2 open"),
    (1, 1, Y, Y, "P: a c1>b / b u1>a"),
    (1, 1, Y, F, "P: a c1>b / b open u1>a"),
    (1, 2, Y, Y, "P: a c1>b / b u1>d c2>e / d c2>e / e"),
    (1, 2, Y, F, "P: a c1>b / b u1>d c2>e / d / e open"),
    (1, 1, Y, F, "P: a c1>b u1>d / b open / d"),
    (1, 1, Y, Y, "P: a c1>b u1>d / b / d"),
    (2, 1, Y, Y, "P: a u1>b / b u2>d / d c1>a"),
    (N, 1, Y, Y, "P: a u1>a c1>b / b"),
    (N, N, Y, F, "P: a u1>a c1>a"),
    (N, N, Y, F, "P: a u1>b c1>a / b u2>a c2>b"),
    # An uncontrollable event where a controllable one is possible is no way out
    (1, N, Y, F, "P: a c1>b / b c1>a u1>d / d"),
    (1, 1, Y, F, "P: a open u1>d c1>b / b open / d"),
    (1, 1, Y, Y, "P: a open c1>b / b open u1>d / d"),
    (2, 1, Y, Y, "P: a open c1>b / b open u1>d / d open u1>e / e"),
    # Orders
    (0, 1, F, Y, "P: a c1>b c2>d / b / d"),
    (0, 1, Y, Y, "P: a c1>b c2>b / b"),
    (0, 2, Y, Y, "P: a c1>b c2>d / b c2>e / d c1>e / e"),
    (0, 2, F, Y, "P: a c1>b c2>d / b c2>e / d c1>f / e / f"),
    (0, 2, Y, Y, "P: a c1>d c2>b / b c1>d / d"),
    (0, 3, Y, Y, "P: a c1>b c2>d / b c3>e / d c1>f / f c2>e / e"),
    (0, N, Y, F, "P: a c1>b c2>d / b c3>d / d c3>b"),
    (0, N, F, F, "P: a c1>b c2>d / b c1>b / d c2>d"),
    (0, N, F, F, "P: a c1>b c2>d / b c1>b / d"),
    (1, 1, F, Y, "P: a u1>b / b c1>d c2>e / d / e"),
    (1, 1, Y, Y, "P: a u1>b u2>d / b c1>e / d c2>f / e / f"),
    (0, 1, F, F, "P: a c1>b c2>d / b / d open"),
    # Several automata
    (0, 2, Y, Y, "P: a c1>b / b | P: a c2>b / b"),
    (0, 3, Y, Y, "P: a c1>b / b | P: a c2>b / b | P: a c3>b / b"),
    (0, 1, Y, Y, "P: a c1>b / b | P: a c1>b / b"),
    (0, 0, Y, Y, "P: a c1>b / b | P: a / b c1>a"),
    (2, 0, Y, Y, "P: a u1>b / b | P: a u2>b / b"),
    (1, 1, Y, Y, "P: a u1>b / b | P: a c1>b / b"),
    (0, 2, Y, F, "P: a c1>b / b open | P: a c2>b / b"),
    (0, 1, F, Y, "P: a c1>b / b | P: a c2>b / b | S: a c1>b c2>b / b"),
    (0, 2, Y, Y, "P: a c1>b / b c2>a | S: a c1>b / b c2>d / d"),
    (2, 1, Y, Y, "P: a u1>b / b u2>a | S: a u1>b / b c1>d / d u2>a"),
    (0, 1, Y, Y, "S: a c1>b / b"),
    (1, 1, Y, Y, "S: a c1>b / b u1>a"),
    # Variables, which events change inside an automaton
    (0, 3, Y, Y, "P: int[0..3] n = 0; a c1[n < 3](n := n + 1)>a"),
    # A step out of a range does not happen
    (0, 3, Y, Y, "P: int[0..3] n = 0; a c1(n := n + 1)>a"),
    (0, N, Y, F, "P: bool v = false; a c1(v := not v)>a"),
    (0, N, Y, F, "P: bool v = false; a c1[v](v := false)>a c2[not v](v := true)>a"),
    (0, 1, F, Y, "P: int[0..3] n = 0; a c1(n := 1)>b c2(n := 2)>b / b"),
    (0, 1, Y, Y, "P: int[0..3] n = 0; a c1(n := 1)>b c2(n := 1)>b / b"),
    (
        0,
        2,
        F,
        Y,
        "P: int[0..3] n = 1; a c1(n := n + 1)>b c2(n := n * 2)>d / b c2(n := n * 2 - 1)>e / d c1(n := n)>e / e",
    ),
    (
        0,
        2,
        Y,
        Y,
        "P: int[0..9] n = 1; a c1(n := n + 1)>b c2(n := n + 2)>d / b c2(n := n + 2)>e / d c1(n := n + 1)>e / e",
    ),
    (1, 1, Y, Y, "P: bool v = false; a u1[not v](v := true)>a c1[v](v := false)>a"),
    (1, 0, Y, Y, "P: bool v = false; a u1(v := true)>b / b"),
    # Several initial states, of which each counts
    (0, 3, Y, Y, "P: int[0..3] n in any; a c1[n > 0](n := n - 1)>a"),
    (0, N, Y, F, "P: bool v in any; a c1[v]>a"),
    (0, 1, Y, F, "P: bool v in any; a c1[v]>b / b open"),
    (2, 0, Y, Y, "P: int[0..3] n in {1, 2}; a u1[n > 0](n := n - 1)>a"),
    # Input variables: they change between, and do not count
    (0, 0, Y, Y, "input bool i | P: a"),
    (0, 1, Y, Y, "input bool i | P: a c1[i]>b / b"),
    # ... and not while a controllable event is possible
    (0, N, Y, F, "input bool i | P: a c1[i]>a"),
    (0, 1, Y, Y, "input bool i | P: a c1[i]>b / b c2[not i]>a"),
    (0, N, Y, F, "input bool i, j | P: a c1[i]>b / b c2[j]>a"),
    (0, 1, Y, Y, "input bool i | P: a c1[i]>b c2[not i]>d / b / d"),
    (0, 1, F, Y, "input bool i | P: a c1[i]>b c2>d / b / d"),
    (1, 0, Y, Y, "input bool i | P: a open u1[i]>b / b"),
    (1, 1, Y, Y, "input bool i | P: a u1[i]>b / b open c1[not i]>a"),
    (N, 0, Y, Y, "input int[0..2] i | P: a u1[i = 1]>b u1[i = 2]>a / b u2[i = 0]>a"),
    (0, 1, Y, Y, "input int[0..2] i | P: int[0..2] n = 0; a c1[n != i](n := i)>a"),
    # Predicates on marked and initial states
    (0, 1, Y, Y, "P: bool v = false; marked v; a c1[not v](v := true)>a"),
    (0, 1, Y, F, "P: bool v = false; marked not v; a c1[not v](v := true)>a"),
    (0, 0, Y, F, "input bool i | P: bool v = false; marked v; a"),
    (0, 0, Y, Y, "input bool i | P: marked i; a"),
    (0, N, Y, F, "input bool i | P: marked i; a c1[i]>a"),
    (0, 1, Y, Y, "P: bool v in any; initial not v; a c1[v]>a c2[not v]>b / b"),
    # No state at all
    (0, 0, Y, Y, "P: bool v = false; initial v; a c1>b / b open c1>a"),
    # Monitors neither block an event nor are changed by it where they have no edge
    (N, 0, Y, Y, "S: monitor u1; a u1>b / b"),
    (N, 1, Y, Y, "S: monitor u1; a c1>b / b u1>a"),
    (N, 1, Y, F, "S: monitor u1; a c1>b / b open u1>a"),
    (1, 1, Y, Y, "P: a u1>b / b c1>a | S: monitor u1; a u1>b / b c1>a"),
    # Events that a supervisor leaves out
    (1, 1, Y, Y, "P: a u1>b / b c1>a c2>b | S: a | S: a c1>a | supervisor c2 needs false"),
    (0, 0, Y, Y, "P: a c1>a | supervisor c1 needs false"),
    (0, 1, Y, Y, "P: a c1>b / b c1>a | supervisor A0.b disables c1"),
]

_EDGE = re.compile(r"([cu]\d)(?:\[([^\]]*)\])?(?:\(([^)]*)\))?>(\w+)")


def specification(line: str) -> str:
    """Return the specification that a line stands for."""
    found = [f"{kind} {', '.join(names)};" for kind, letter in (("controllable", "c"), ("uncontrollable", "u"))
             if (names := sorted(set(re.findall(rf"\b{letter}\d", line))))]  # fmt: skip
    for number, component in enumerate(line.split(" | ")):
        if component[:2] not in ("P:", "S:"):
            found.append(f"{component};".replace(";;", ";"))
            continue
        *heads, locations = component[2:].split(";")
        found.append(f"{'plant' if component[0] == 'P' else 'supervisor'} A{number}:")
        for head in map(str.strip, heads):
            found.append(f"  {'disc ' if head.startswith(('int', 'bool')) else ''}{head};")
        for place, location in enumerate(locations.split(" / ")):
            name, *words = location.split(maxsplit=1)
            edges = _EDGE.findall(location)
            marked = "" if words and words[0].startswith("open") else " marked;"
            parts = [*([" initial;"] if not place else []), marked]
            for event, guard, update, target in edges:
                when, done = (f" when {guard}" if guard else ""), (f" do {update}" if update else "")
                parts.append(f" edge {event}{when}{done} goto {target};")
            found.append(f"  location {name}{':' if any(parts) else ';'}{''.join(parts)}")
        found.append("end")
    return "\n".join(found)


@pytest.mark.parametrize(("uncontrollable", "controllable", "confluence", "nonblocking", "line"), LINES)
def test_each_is_as_worked_out(
    uncontrollable: int | None, controllable: int | None, confluence: bool, nonblocking: bool, line: str
) -> None:
    text = specification(line)
    system = system_of(text)
    assert system is not None, (text, robosc.check(robosc.load(text=text, name="m.cif")))
    assert_as_defined(as_controlled(system))
    found = check_automata(composed(as_controlled(system)), {}, limit=1000)
    assert found is not None
    bounds = found.uncontrollable.bound, found.controllable.bound
    assert (bounds, found.checks) == (
        (uncontrollable, controllable),
        {
            "bounded_response": None not in (uncontrollable, controllable),
            "finite_response": controllable is not None,
            "confluence": confluence,
            "nonblocking_under_control": nonblocking,
        },
    ), text
    verified = robosc.verify(robosc.load(text=text, name="m.cif"), controller=True, as_is=True)
    if "initial v" in line:
        # The definitions hold of no state; the command says what is wrong.
        assert verified.report["reason"] == "there is no initial state"
        return
    assert verified.report["controller"]["checks"] == {
        name: "passed" if holds else "failed" for name, holds in found.checks.items()
    }
