"""Tests of the meaning of part B's extensions, from text to supervisor; generated code must match the interpreter."""

import math
from array import array
from typing import Any

import pytest

from robosc.certification import OutcomeStatus, make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.expressions.text import expression_text
from robosc.model.structure import Deployment
from support.generated import load_system, same
from support.models import bundle_of, checked, model_of


def systems(text: str, **libraries: str) -> list[Any]:
    """The supervisor of a text, generated and interpreted."""
    made = make_supervisor(bundle_of(text, **libraries))
    assert made.supervisor is not None, (made.diagnostics, made.reason)
    return [load_system(made.supervisor), InterpretedSystem(made.supervisor)]


SCAN = "interface i use Scan from p datatype object Scan { r: array(double) n: integer items: array(Item) } "
SCAN += "datatype object Item { size: integer(0..9) kind: Kind } "
SCAN += "datatype enum Kind from string to { value = 'box' -> box default -> other } "


def classified(condition: str, data: Any) -> tuple[str, bool]:
    """Return an enum rule's value of data, `yes` or `no`, and True if it fell to `no` since the rule was unknown."""
    text = (
        f"robot R {{ {SCAN} datatype enum Answer from Scan to {{ {condition} -> yes default -> no }} "
        "component C { outgoing message seen with type: Answer links i behaviour { variable a: Answer "
        "on response from seen do a := value initial marked state s { } } } }"
    )
    answers = []
    for system in systems(text):
        reading = system.read("seen.response", data)
        assert system.step("seen.response", reading) == ()
        answers.append((system.state()["C"]["variables"]["a"], reading.enum_unknown, reading.unknown))
    assert answers[0] == answers[1]
    return answers[0][:2]


NAN, INFINITY = math.nan, math.inf
YES, NO, UNKNOWN = ("yes", False), ("no", False), ("no", True)


@pytest.mark.parametrize(
    ("condition", "ranges", "expected"),
    [
        ("min(value.r) < 1", [3.0, 0.5, 2.0], YES),
        ("min(value.r[0..0]) < 1", [3.0, 0.5, 2.0], NO),
        ("min(value.r[2..0]) > 1.5", [3.0, 0.5, 2.0], YES),
        ("min(value.r[2..1]) < 1", [3.0, 0.5, 2.0], YES),
        ("max(value.r[1..9]) = 2", [3.0, 0.5, 2.0], YES),
        ("max(value.r[5..9]) = 2", [3.0, 0.5, 2.0], UNKNOWN),
        ("max(value.r[5..0]) = 3", [3.0, 0.5, 2.0], YES),
        ("min(value.r) < 1", [], UNKNOWN),
        ("min(value.r) < 1", [NAN, 0.5, NAN], YES),
        ("min(value.r) < 1", [NAN, NAN], UNKNOWN),
        ("max(value.r) > 1000", [1.0, INFINITY], YES),
        ("min(value.r) < 1", [0.5, "text"], UNKNOWN),
        ("min(value.r) < 1", None, UNKNOWN),
        ("min(value.r) < 1", "text", UNKNOWN),
        ("min(value.r) < 1", array("f", [2.0, 0.25]), YES),
        ("length(value.r) = 0", [], YES),
        ("length(value.r) = 0", None, UNKNOWN),
        ("length(value.r) > 2", [1.0] * 3, YES),
        ("value.r[2] > 1", [1.0, 2.0], UNKNOWN),
        ("any(x in value.r: x > 2)", [1.0, 3.0, NAN], YES),
        ("any(x in value.r: x > 5)", [1.0, 3.0, NAN], UNKNOWN),
        ("any(x in value.r: x > 5)", [1.0, 3.0], NO),
        ("any(x in value.r[7..8]: x > 5)", [1.0, 3.0], UNKNOWN),
        ("all(x in value.r: x > 2)", [1.0, NAN], NO),
        ("all(x in value.r: x > 0)", [1.0, NAN], UNKNOWN),
        ("all(x in value.r: x > 0)", [1.0, 3.0], YES),
        ("all(x in value.r: x > 0)", [], UNKNOWN),
        ("all(x in value.r: any(y in value.r: y > x or y = 3))", [1.0, 2.0, 3.0], YES),
        ("!any(x in value.r: x > 5)", [1.0, NAN], UNKNOWN),
    ],
)
def test_arrays(condition: str, ranges: Any, expected: tuple[str, bool]) -> None:
    assert classified(condition, {"r": ranges, "n": 0, "items": []}) == expected


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("integer(2.9) = 2", YES),
        ("integer(-2.9) = -2", YES),
        ("integer(3000000000.0) = 2147483647", YES),
        ("integer(-3000000000.0) = -2147483648", YES),
        ("double(value.n) / 2 = 2.5", YES),
        ("abs(-3) = 3", YES),
        ("abs(value.n - 7) = 2", YES),
        ("abs(-2147483648) > 0", UNKNOWN),
        ("min(value.n, 3) = 3 and max(value.n, 3) = 5", YES),
        ("min(value.n, 3, -2) = -2", YES),
        ("clamp(value.n, 0, 4) = 4", YES),
        ("clamp(value.n, 6, 9) = 6", YES),
        ("min(1.5, value.n) = 1.5", YES),
        ("if value.n = 5 then value.r[0] = 0.5 else false", YES),
        ("if value.r[9] > 1 then true else true", UNKNOWN),
        ("(if value.n > 5 then 1 else 2) * 3 = 6", YES),
        ("min(1 / (value.n - 5), 3) < 9", UNKNOWN),
        # Both branches are doubles, so this does not overflow as integers would.
        ("(if value.n = 5 then 2147483647 else 0.5) + 1 > 5", YES),
        ("min(2147483647, 3000000000.0) + 1 > 5", YES),
    ],
)
def test_functions(condition: str, expected: tuple[str, bool]) -> None:
    assert classified(condition, {"r": [0.5], "n": 5, "items": []}) == expected


def test_what_is_unknown_inside_elements_is_reported() -> None:
    data = {"r": [], "n": 0, "items": [{"size": 12, "kind": "box"}, {"size": 3, "kind": 7}]}
    assert classified("any(x in value.items: x.size = 9 and x.kind = box)", data) == ("yes", True)
    assert classified("any(x in value.items: x.size = 3 and x.kind = box)", data) == ("no", True)
    text = (
        f"robot R {{ {SCAN} component C {{ outgoing message seen with type: Scan links i behaviour {{ "
        "variable b: boolean on response from seen do b := any(x in value.items: x.size = 9) "
        "initial marked state s { } } } }"
    )
    for system in systems(text):
        reading = system.read("seen.response", data)
        assert reading.unknown == (
            "value.items[0].size is 12, outside 0..9",
            "value.items[1].kind is other by default: an earlier rule is unknown",
        )
        assert not reading.data
        assert system.step("seen.response", reading) == ()
        assert system.state()["C"]["variables"]["b"] is True


def test_an_update_that_is_unknown_leaves_its_variable() -> None:
    text = (
        f"robot R {{ {SCAN} component C {{ outgoing message seen with type: Scan links i behaviour {{ "
        "variable d: double = 7.5 on response from seen do d := min(value.r) initial marked state s { } } } }"
    )
    for system in systems(text):
        assert system.step("seen.response", system.read("seen.response", {"r": []})) == ("C.d",)
        assert system.step("seen.response", system.read("seen.response", {"r": [INFINITY]})) == ("C.d",)
        assert system.step("seen.response", system.read("seen.response", {"r": [3.0, 2.5]})) == ()
        assert system.state()["C"]["variables"]["d"] == 2.5


COUNTER = """
    component C {
        incoming message up with type: none
        incoming message down with type: none
        behaviour {
            variable n: integer(-3..3) = -2
            initial marked state low { on request to up do up goto high }
            state high { on request to down goto low }
        }
    }
"""

SWITCHES = """
    component A {
        incoming message a with type: none
        incoming message a_off with type: none
        behaviour {
            initial marked state off { on request to a goto on_ }
            state on_ { on request to a_off goto off }
        }
    }
    component B {
        incoming message b with type: none
        incoming message b_off with type: none
        behaviour {
            initial marked state off { on request to b goto on_ }
            state on_ { on request to b_off goto off }
        }
    }
"""


@pytest.mark.parametrize("invariant", ["requirement never A.on_ and B.on_", "requirement always !A.on_ or !B.on_"])
def test_a_state_invariant_keeps_out_of_its_states(invariant: str) -> None:
    for system in systems(f"robot R {{ {SWITCHES} {invariant} }}"):
        assert system.enabled("b.request")
        system.step("a.request", None)
        assert not system.enabled("b.request")
        assert system.enabled("a_off.request")


def test_an_invariant_that_the_initial_state_breaks_leaves_no_supervisor() -> None:
    made = make_supervisor(bundle_of(f"robot R {{ {SWITCHES} requirement always A.on_ }}"))
    assert made.status is OutcomeStatus.EMPTY
    assert "invariant" in made.reason


def test_an_invariant_makes_uncontrollable_ways_into_it_impossible() -> None:
    text = (
        "robot R { component L { incoming message go with type: none outgoing message slip with type: none behaviour { "
        "initial marked state safe { on request to go goto edge } state edge { on response from slip goto fallen } "
        "marked state fallen { } } } requirement never L.fallen }"
    )
    for system in systems(text):
        assert not system.enabled("go.request")


def test_an_invariant_that_is_unknown_does_not_hold() -> None:
    text = (
        "robot R { component C { incoming message m with type: none outgoing message o with type: integer(0..1) "
        "behaviour { variable n: integer(0..1) = 1 on response from o do n := value "
        "initial marked state s { on request to m goto t } marked state t { } } } requirement {} }"
    )
    text = text.replace("requirement {}", "requirement never 1 / C.n > 3")
    made = make_supervisor(bundle_of(text))
    assert made.status is OutcomeStatus.EMPTY  # Any o can set n to 0, where the quotient is unknown.


def test_constants_are_their_values() -> None:
    text = (
        "robot R { constant LIMIT: double = 0.25 constant TWICE: double = LIMIT * 2 constant START: Mode = slow "
        "constant FIRST: integer = 1 constant LAST: integer = FIRST + 1 "
        f"{SCAN} datatype enum Mode from Scan to {{ min(value.r[FIRST..LAST]) < TWICE -> slow default -> fast }} "
        "component C { outgoing message seen with type: Mode links i incoming message go with type: double "
        "behaviour { variable m: Mode = START variable k: integer(-3..3) = -2 on response from seen do m := value "
        "initial marked state s { } } } requirement go needs C.m = START provide go with TWICE if C.k < 0 }"
    )
    for system in systems(text):
        assert system.state()["C"]["variables"] == {"m": "slow", "k": -2}
        assert system.provide("go") == (True, 0.5)
        system.step("seen.response", system.read("seen.response", {"r": [0.0, 0.5, 0.6]}))
        assert system.state()["C"]["variables"]["m"] == "fast"
        assert not system.enabled("go.request")


def test_a_library_brings_what_speaks_of_the_imported_component_alone() -> None:
    library = (
        "library L { constant SPEED: double = 0.5 "
        "component Base { incoming message go with type: double incoming message halt with type: none "
        "behaviour { initial marked state still { on request to go goto moving } "
        "state moving { on request to halt goto still } } } "
        "component Arm { incoming message lift with type: none behaviour { initial marked state down "
        "{ on request to lift goto up } marked state up { } } } "
        "requirement go needs Base.still requirement lift disables {lift} requirement {go, lift} needs Arm.down "
        "requirement never Base.moving and Arm.up provide go with SPEED }"
    ).replace("requirement lift disables {lift}", "requirement Arm.up disables lift")
    one = model_of("robot R { component Mover from L import Base }", L=library)
    assert [item.communications for item in one.requirements] == [("go",)]
    assert len(one.provides) == 1
    assert not one.invariants
    both = model_of("robot R { component Mover from L import Base component Arm from L import Arm }", L=library)
    assert [item.communications for item in both.requirements] == [("go",), ("lift",)]
    assert len(both.invariants) == 1
    used = model_of("robot R { component Mover from L import Base provide go with SPEED * 2 }", L=library)
    assert len(used.provides) == 2


def test_a_requirement_that_reads_what_is_not_imported_is_an_error_of_the_import() -> None:
    library = (
        "library L { component Base { incoming message go with type: none } "
        "component Arm { behaviour { initial marked state down { } } } requirement go needs Arm.down }"
    )
    (found,) = checked("robot R {\n component B from L import Base\n}", L=library).diagnostics
    assert (found.code, found.location and found.location.line) == ("unknown-name", 2)
    assert "'Arm'" in found.message
    assert not checked(
        "robot R { component B from L import Base component A from L import Arm }", L=library
    ).diagnostics


def test_requirements_come_through_a_chain_of_imports() -> None:
    text = "robot R { component B from M import Mid }"
    middle = "library M { component Mid from L import Base requirement go needs Mid.still }"
    library = (
        "library L { component Base { incoming message go with type: none "
        "behaviour { initial marked state still { } } } requirement Base.still disables go }"
    )
    assert len(model_of(text, M=middle, L=library).requirements) == 2


def test_part_a_readings_of_always_and_never() -> None:
    text = (
        "robot R { component C { incoming message always with type: none incoming message never with type: none "
        "behaviour { variable x: boolean variable n: integer(0..3) initial marked state never { } } } "
        "requirement always needs C.never requirement never needs C.x requirement always C.n - 1 < 3 "
        "requirement never -C.n > 3 requirement never (C.x) requirement always !C.x requirement always if C.x then "
        "C.x else true }"
    )
    model = model_of(text)
    assert [item.communications for item in model.requirements] == [("always",), ("never",)]
    assert [item.is_never for item in model.invariants] == [False, True, True, False, False]


def test_options_reach_the_model() -> None:
    when = 'when: value.header.frame_id = "", '
    text = (
        "robot R { interface t use TwistStamped from geometry_msgs interface s use LaserScan from sensor_msgs "
        "datatype object Twist { header: Header } datatype object Header { frame_id: string } component C { "
        "outgoing message scan with max_age: 0.5, type: Twist, depth: 3 links s "
        'incoming message go with identifier: "/cmd", type: Twist, stamped: "base", ' + when + "qos: latched "
        "links t incoming message halt with qos: latched, identifier: \"/cmd\", type: Twist, stamped: 'base' links t } }"
    )
    model = model_of(text)
    scan, go, halt = model.communications
    assert (scan.effective_quality, scan.effective_depth, scan.max_age) == ("sensor", 3, 0.5)
    assert (go.effective_quality, go.effective_depth, go.frame) == ("latched", 1, "base")
    assert go.when is not None
    assert halt.when is None
    layer = make_supervisor(bundle_of(text), deployment=Deployment.LAYER)
    assert layer.supervisor is not None
    ambiguous = make_supervisor(bundle_of(text.replace(when, "")), deployment=Deployment.LAYER)
    assert [item.code for item in ambiguous.diagnostics if item.severity == "error"] == ["ambiguous-layer-topic"]


def test_equal_values_of_two_enums_and_a_state() -> None:
    text = (
        "robot R { datatype enum A from double to { value > 1 -> near default -> far } "
        "datatype enum B from double to { value > 2 -> near default -> off } component C { "
        "outgoing message a with type: A outgoing message b with type: B behaviour { variable x: A variable y: B "
        "on response from a do x := value on response from b do y := if value = near then near else B.off "
        "initial marked state near { } } incoming message go with type: none } "
        "requirement go needs C.x = near and near != C.y and C.near and A.near = C.x }"
    )
    for system in systems(text):
        assert not system.enabled("go.request")
        system.step("a.response", system.read("a.response", 3.0))
        assert system.enabled("go.request")
        system.step("b.response", system.read("b.response", 3.0))
        assert not system.enabled("go.request")
        assert same(system.state()["C"]["variables"], {"x": "near", "y": "near"})


LIB = "library Lib {{ constant IN: integer = {value} component Base {{ outgoing message seen with type: boolean }} }}"


@pytest.mark.parametrize(
    "use",
    [
        "constant J: integer = IN requirement go needs J = 1",
        "requirement go needs IN = 1",
        "component V { behaviour { variable z: integer(0..3) = IN initial marked state s { } } }",
    ],
)
@pytest.mark.parametrize("library", ["Lib", "Chain"])
def test_constants_of_libraries_can_be_used_wherever_constants_can(use: str, library: str) -> None:
    chain = "library Chain { constant OUT: integer = 2 component Base from Lib import Base }"
    text = f"robot R {{ component B from {library} import Base component G {{ incoming message go with type: none }} {use} }}"
    found = checked(text, lib=LIB.format(value=1), chain=chain)
    assert not found.has_errors, [str(item) for item in found.diagnostics]
    out = checked(text.replace("IN", "OUT"), lib=LIB.format(value=1), chain=chain)
    assert out.has_errors == (library == "Lib")


def test_the_nearest_library_defines_a_constant() -> None:
    chain = "library Chain { constant IN: integer = 7 component Base from Lib import Base }"
    model = model_of(
        "robot R { component B from Chain import Base component G { incoming message go with type: none }"
        " requirement go needs IN = 1 }",
        lib=LIB.format(value=1),
        chain=chain,
    )
    assert expression_text(model.requirements[0].condition) == "7 = 1"


@pytest.mark.parametrize(
    ("extra", "use"),
    [
        ("constant X: integer = 1", "X = 1"),
        ("datatype enum M from boolean to { value -> run default -> no }", "M.run = M.run"),
    ],
)
def test_a_name_of_two_libraries_is_ambiguous(extra: str, use: str) -> None:
    libraries = {
        name: f"library {name.upper()} {{ {extra} component {name} {{ outgoing message m{name} with type: none }} }}"
        for name in ("a", "b")
    }
    text = (
        "robot R { component A from A import a component B from B import b"
        f" component G {{ incoming message go with type: none }} requirement go needs {use} }}"
    )
    found = [item for item in checked(text, **libraries).diagnostics if item.code != "unused-definition"]
    assert {item.code for item in found} == {"ambiguous-name"}
    assert "is defined by the libraries 'A' and 'B'" in found[0].message
    assert not checked(text.replace("robot R {", f"robot R {{ {extra}"), **libraries).has_errors


def test_constants_of_two_libraries_that_need_each_other() -> None:
    a = "library A { constant X: integer = Y component P { outgoing message p with type: none } component Q from B import Q }"
    b = "library B { constant Y: integer = X component Q { outgoing message q with type: none } component P from A import P }"
    found = checked("robot R { component P from A import P component Q from B import Q }", a=a, b=b).diagnostics
    assert [item.code for item in found if item.severity == "error"] == ["constant-cycle"]


@pytest.mark.parametrize(
    "condition",
    ["e = open", "open = e", "(if c then open else shut) = e", "e = (if c then open else shut)", "open = c"],
)
def test_the_expected_type_decides_on_either_side(condition: str) -> None:
    text = (
        "robot R { constant open: boolean = true datatype enum E from boolean to { value -> open default -> shut }"
        " datatype enum F from boolean to { value -> open default -> shut }"
        " component S { outgoing message m with type: E behaviour { variable e: E variable c: boolean"
        " initial marked state s { on response from m do e := value } } } component G { incoming message go with type: none }"
        f" requirement go needs {condition} }}"
    ).replace(condition, condition.replace("e =", "S.e =").replace("= e", "= S.e").replace(" c", " S.c"))
    found = checked(text)
    assert not found.has_errors, [str(item) for item in found.diagnostics]


@pytest.mark.parametrize(
    ("requirement", "is_noted"),
    [
        ("ac needs C.idle", True),
        ("C.busy disables ac", True),
        ("ac needs !C.busy", True),
        ("ac needs !C.b", True),
        ("ac needs C.c < 2", True),
        ("ac needs C.idle and D.idle", True),
        ("ac needs C.c < 3", False),
        ("ac needs D.idle", False),
        ("ac needs C.idle or D.idle", False),
        ("D.idle disables ac", False),
    ],
)
def test_a_request_that_makes_its_own_requirement_false(requirement: str, is_noted: bool) -> None:
    found = checked(
        "robot R { interface i use T from p component C { action ac with request: none, response: none, feedback: none"
        " links i behaviour { variable b: boolean variable c: integer(0..3)"
        " initial marked state idle { on request to ac do b := true, c := 2 goto busy }"
        " state busy { on response from ac goto idle } } } component D { outgoing message o with type: none"
        f" behaviour {{ initial marked state idle {{ on response from o }} }} }} requirement {requirement} }}"
    )
    assert not found.has_errors
    assert ("request-leaves-requirement" in [item.code for item in found.diagnostics]) == is_noted
