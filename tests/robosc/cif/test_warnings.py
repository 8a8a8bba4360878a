"""Warnings about CIF models: one model for each reason, and random ones beside all of their states."""

from itertools import product
from random import Random

import pytest

from robosc.automata import System
from robosc.automata.compile import NO_DATA, compile_expression
from robosc.automata.semantics import Semantics
from robosc.automata.state import subject_domain, subjects
from robosc.cif import check_cif
from robosc.errors import Diagnostic, Severity
from robosc.expressions import Expression
from robosc.source import Bundle, SourceFile
from support.effort import examples

EVENT, STATE = "cif-event-never-happens", "cif-no-state"
INITIAL, MARKED, PREFIX = "cif-no-initial-state", "cif-no-marked-state", "cif-name-prefix"

TANK = """plant tank:
  controllable c_fill; uncontrollable u_drain;
  disc int[0..3] level = 1; disc bool shut;
  location: initial; marked;
    edge c_fill when level < 3 do level := level + 1; edge u_drain when level > 0 do level := level - 1;
end
"""


def checked(text: str) -> tuple[System, tuple[Diagnostic, ...]]:
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    assert found.system is not None, [str(item) for item in found.diagnostics]
    return found.system, found.diagnostics


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("plant q: location: initial; marked; edge tank.c_fill when tank.level > 3; end", EVENT,
         "'tank.c_fill' never happens: 'q' has only edges of it whose guards are never true"),
        ("plant q: location: initial; marked; edge tank.c_fill when tank.level = 3; end", EVENT,
         "'tank.c_fill' never happens: in no state has each plant with this event an edge of it whose guard is true"),
        ("plant q: location a: initial; marked; edge tank.c_fill when q.b; location b: marked; end", EVENT,
         "'tank.c_fill' never happens: 'q' has only edges of it whose guards are never true"),
        ("plant tank.c_fill needs tank.level = 3;", EVENT,
         "'tank.c_fill' never happens: invariants of plants exclude it wherever the plants have edges of it"),
        ("plant invariant tank.level = 3;", EVENT,
         "'tank.c_fill' never happens: invariants of plants exclude it wherever the plants have edges of it"),
        ("requirement tank.c_fill needs tank.level = 3;", EVENT,
         "'tank.c_fill' never happens: requirements forbid it wherever it is possible"),
        ("requirement tank.level < 3 disables tank.c_fill;", EVENT,
         "'tank.c_fill' never happens: requirements forbid it wherever it is possible"),
        ("supervisor tank.level < 3 disables tank.c_fill;", EVENT,
         "'tank.c_fill' never happens: parts of the supervisor forbid it wherever it is possible"),
        ("requirement r: location: initial; marked; edge tank.c_fill when tank.level = 3; end", EVENT,
         "'tank.c_fill' never happens: requirements forbid it wherever it is possible"),
        ("requirement tank.c_fill needs tank.shut and not tank.shut;", EVENT,
         "'tank.c_fill' never happens: this is true in no state, and it must be"),
        ("requirement tank.c_fill needs tank.shut; requirement tank.shut disables tank.c_fill;", EVENT,
         "'tank.c_fill' never happens: requirements forbid it wherever it is possible"),
        ("requirement invariant tank.level > 3;", STATE, "this invariant is true in no state"),
        ("plant invariant tank.shut; plant invariant not tank.shut;", STATE,
         "in no state are the state invariants of plants true"),
        ("plant invariant tank.shut; requirement invariant not tank.shut;", STATE,
         "in no state are all state invariants true"),
        ("plant q: location a: marked; end", INITIAL, "no state is initial: 'q' has no initial location"),
        ("plant q: location a: initial false; marked; end", INITIAL, "no state is initial: 'q' has no initial location"),
        ("plant q: location a: initial tank.level = 2; marked; end", INITIAL,
         "no state is initial: the initial predicates are never all true"),
        ("initial tank.shut;", INITIAL, "no state is initial: the initial predicates are never all true"),
        ("plant invariant tank.level != 1;", INITIAL,
         "no state is initial: the invariants of plants exclude each initial state"),
        ("requirement invariant tank.level != 1;", INITIAL, "no state is initial: the invariants exclude each initial state"),
        ("requirement r: location a: initial; end", MARKED, "no state is marked: 'r' has no marked location"),
        ("plant q: location a: initial; marked tank.level > 3; end", MARKED,
         "no state is marked: the marked predicates are never all true"),
        ("marked tank.shut; marked not tank.shut;", MARKED, "no state is marked: the marked predicates are never all true"),
        ("marked tank.level = 3; plant invariant tank.level < 2;", MARKED,
         "no state is marked: the invariants of plants exclude each marked state"),
        ("marked tank.level = 3; requirement invariant tank.level < 3;", MARKED,
         "no state is marked: the invariants exclude each marked state"),
        ("plant q: controllable u_x; location: initial; marked; edge u_x; end", PREFIX,
         "'u_x' is called like an uncontrollable event, and is none"),
        ("plant q: uncontrollable c_x; location: initial; marked; edge c_x; end", PREFIX,
         "'c_x' is called like a controllable event, and is none"),
        ("plant q: controllable e_x; location: initial; marked; edge e_x; end", PREFIX,
         "'e_x' is called like an event of neither kind, and is none"),
        ("const int c_n = 1; ", PREFIX, "'c_n' is called like a controllable event, and is none"),
        ("group u_g: end", PREFIX, "'u_g' is called like an uncontrollable event, and is none"),
        ("plant q: location c_l: initial; marked; end", PREFIX, "'c_l' is called like a controllable event, and is none"),
    ],
)  # fmt: skip
def test_a_model_for_each_reason(text: str, code: str, message: str) -> None:
    _, found = checked(TANK + text)
    assert [(item.code, item.message) for item in found if item.code == code] == [(code, message)]
    assert all(item.severity is (Severity.NOTE if item.code == PREFIX else Severity.WARNING) for item in found)


@pytest.mark.parametrize(
    "text",
    [
        "plant q: location: initial; marked; edge tank.c_fill when tank.level = 2; end",
        "plant tank.c_fill needs tank.level < 3 and tank.shut;",
        "plant invariant tank.level = 1 or tank.level = 2;",
        "plant q: monitor tank.c_fill; location: initial; marked; edge tank.c_fill when tank.level > 3; end",
        "requirement tank.u_drain needs tank.level > 2;",
        "initial tank.level = 1; marked tank.shut and tank.level = 3; requirement invariant tank.level > 0;",
        "plant q: location a: initial; location b: marked; end",
        "input bool i, k; marked i; plant invariant i or k;",
        "plant def D(controllable c_k; uncontrollable u_k): location: initial; marked; edge c_k, u_k; end "
        "d: D(tank.c_fill, tank.u_drain);",
        # Many values are not tried.
        "plant q: disc int[0..50000] n; location: initial; marked; edge tank.c_fill when n > 50000 and n < 3; end",
    ],
)
def test_what_is_possible_is_not_reported(text: str) -> None:
    assert checked(TANK + text)[1] == ()


def test_instances_of_a_definition_have_one_note() -> None:
    _, found = checked(f"{TANK} plant def D(): disc bool c_b; location: initial; marked; end a: D(); b: D();")
    assert [item.code for item in found] == [PREFIX]


def random_text(random: Random) -> str:
    """Return a model of two plants and a requirement whose conditions often exclude each other."""

    def condition(*, is_of_location: bool = False) -> str:
        simple = [f"p.n {random.choice(['<', '=', '>'])} {random.randrange(3)}", "p.b", "i", "not p.b", "not i"]
        if not is_of_location:
            # The predicate of an initial location may not need the location.
            simple += ["q.x", "q.y"]
        return f" {random.choice(['and', 'or', 'and'])} ".join(random.sample(simple, random.randint(1, 3)))

    def maybe(text: str, likely: float = 0.5) -> str:
        return text if random.random() < likely else ""

    def edges(*events: str) -> str:
        return " ".join(maybe(f"edge {event}{maybe(f' when {condition()}', 0.7)};", 0.85) for event in events)

    role = random.choice(["requirement", "supervisor"])
    return "\n".join([
        "input bool i; controllable a; uncontrollable u;",
        f"plant p: alphabet a, u; disc int[0..2] n = {random.randrange(3)}; disc bool b in any; location: initial; marked; "
        f"{edges('a', 'u')} end",
        f"plant q: alphabet a; location x: {maybe('initial; ', 0.7)}marked {condition()}; {edges('a')} "
        f"location y: {maybe(f'initial {condition(is_of_location=True)};')}{maybe(' marked;')} edge a when {condition()} goto x; end",
        maybe(f"{role} r: alphabet u; {maybe('monitor;', 0.2)} location: initial; marked; {edges('u')} end"),
        *(maybe(f"{kind} {form};") for kind in ("plant", role) for form in
          (f"invariant {condition()}", f"a needs {condition()}", f"{condition()} disables u")),
        maybe(f"initial {condition()};", 0.3), maybe(f"marked {condition()};", 0.3),
    ])  # fmt: skip


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(150)))
def test_all_states_agree(seed: int) -> None:
    """With few values, exactly what is true of all states is reported."""
    system, found = checked(random_text(Random(seed)))
    codes = {item.code for item in found}
    places = {subject: place for place, subject in enumerate(subjects(system))}
    everything = list(product(*(subject_domain(system, subject) for subject in places)))

    def where(*conditions: Expression) -> list[tuple[object, ...]]:
        tests = [compile_expression(item, places) for item in conditions]
        return [state for state in everything if all(test(state, NO_DATA) is True for test in tests)]

    met = where(*system.plant_invariants, *system.invariants)
    assert (STATE in codes) is (not met)
    if met:
        begins = {tuple(state) for state in Semantics(system).initial_states}
        assert (INITIAL in codes) is (not begins.intersection(met))
        semantics = Semantics(system)
        assert (MARKED in codes) is (not any(map(semantics.is_marked, met)))  # type: ignore[arg-type]
    never = {item.message.split("'")[1] for item in found if item.code == EVENT}
    for event in ("a", "u"):
        having = [item for item in system.automata if event in item.alphabet and event not in item.monitors]
        conditions = [item.condition for item in (*system.conditions, *system.plant_conditions) if item.event == event]
        possible = [
            state
            for state in where(*system.plant_invariants, *conditions)
            if all(
                any(
                    edge.event == event
                    and edge.source == state[places[subject]]
                    and compile_expression(edge.guard, places)(state, NO_DATA) is True  # type: ignore[arg-type]
                    for edge in item.edges
                )
                for item in having
                for subject in places
                if subject.automaton == item.name and subject.variable is None
            )
        ]
        assert (event in never) is (not possible), event
