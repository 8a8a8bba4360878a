"""Every static rule of part A: one model that breaks just it, and one beside it that does not.

`§` stands where the finding must point.
"""

import json
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.errors import Severity
from support.models import checked, marked_place

MESSAGE = "incoming message go with type: none outgoing message seen with type: boolean"
GO = "incoming message go with type: none incoming message stay with type: none"
STATES = "initial marked state a { } marked state b { }"


def robot(*parts: str) -> str:
    return "robot R {\n" + "\n".join(parts) + "\n}"


def component(behaviour: str, communications: str = MESSAGE, name: str = "C") -> str:
    return f"component {name} {{ {communications} behaviour {{ {behaviour} }} }}"


OBJECT = (
    "interface i use Scan from p datatype object Scan { range: double list: array(double) name: string n: integer }"
)

ZONES = (
    (
        OBJECT + " datatype enum Zone from Scan to {{ {} }} "
        "component D {{ outgoing message scan with type: Zone links i behaviour {{ variable zone: Zone = stop "
        "on response from scan do zone := value initial marked state s {{ }} }} }} "
        "component E {{ incoming message go with type: none }}"
    )
    .replace(
        "double list: array(double) name: string n: integer }", "double list: array(double) name: string n: integer }}"
    )
    .replace("object Scan {", "object Scan {{")
)

# code, severity, broken, sound
RULES: list[tuple[str, str, str, str]] = [
    (
        "duplicate-component",
        "error",
        robot("component A { } component §a { }"),
        robot("component A { } component B { }"),
    ),
    (
        "duplicate-communication",
        "error",
        robot("component A { incoming message m with type: none } component B { incoming message §m with type: none }"),
        robot("component A { incoming message m with type: none } component B { incoming message n with type: none }"),
    ),
    (
        "duplicate-data-type",
        "error",
        robot("datatype object T { } datatype enum §t from double to { default -> x }", component(STATES)),
        robot("datatype object T { } datatype enum U from double to { default -> x }", component(STATES)),
    ),
    (
        "duplicate-interface",
        "error",
        robot("interface i use A from p interface §i use B from p", component(STATES)),
        robot("interface i use A from p interface j use A from p", component(STATES)),
    ),
    (
        "duplicate-property",
        "error",
        robot("datatype object T { x: double §X: double }", component(STATES)),
        robot("datatype object T { x: double y: double }", component(STATES)),
    ),
    (
        "duplicate-state",
        "error",
        robot(component("initial marked state a { } marked state §A { }")),
        robot(component("initial marked state a { } marked state b { }")),
    ),
    (
        "duplicate-variable",
        "error",
        robot(component("variable v: boolean variable §v: boolean " + STATES)),
        robot(component("variable v: boolean variable w: boolean " + STATES)),
    ),
    (
        "duplicate-variable",
        "error",
        robot(component("variable §a: boolean " + STATES)),
        robot(component("variable go: boolean " + STATES)),
    ),
    (
        "duplicate-enum-value",
        "error",
        robot("datatype enum E from double to { value > 1 -> x default -> §X }", component(STATES)),
        robot("datatype enum E from double to { value > 1 -> x default -> y }", component(STATES)),
    ),
    (
        "no-initial-state",
        "error",
        robot(component("marked state §a { }")),
        robot(component(STATES)),
    ),
    (
        "multiple-initial-states",
        "error",
        robot(component("initial marked state a { } initial marked state §b { }")),
        robot(component(STATES)),
    ),
    (
        "marked-unreachable",
        "error",
        robot(component("initial marked state a { on request to go goto b } state §b { }")),
        robot(component("initial marked state a { on request to go goto b } state b { on response from seen goto a }")),
    ),
    (
        "multiple-behaviours",
        "error",
        robot(component(STATES).removesuffix("}") + f"§behaviour {{ {STATES} }} }}"),
        robot(component(STATES)),
    ),
    (
        "wrong-result-kind",
        "error",
        robot(component("§on feedback from seen " + STATES)),
        robot(component("on response from seen " + STATES)),
    ),
    (
        "wrong-result-kind",
        "error",
        robot(component("§on response from go on request to go " + STATES)),
        robot(component("on request to go " + STATES)),
    ),
    (
        "wrong-result-kind",
        "error",
        robot(component("on response from go " + STATES).replace("message go", "message §go")),
        robot(component("on response from seen " + STATES)),
    ),
    (
        "wrong-result-kind",
        "error",
        robot(component("§on response from go " + STATES), "requirement go needs C.a"),
        robot(component("on request to go " + STATES), "requirement go needs C.a"),
    ),
    (
        "wrong-preposition",
        "warning",
        robot(component("on response §to seen " + STATES)),
        robot(component("on response from seen " + STATES)),
    ),
    (
        "provide-to-outgoing",
        "error",
        robot(component(STATES), "provide §seen with true"),
        robot(component(STATES, "incoming message go with type: boolean"), "provide go with true"),
    ),
    (
        "requirement-on-outgoing",
        "error",
        robot(component(STATES), "requirement §seen needs C.a"),
        robot(component(STATES), "requirement go needs C.a"),
    ),
    (
        "update-on-incoming",
        "error",
        robot(component("variable v: boolean on request to go do §v := true " + STATES)),
        robot(component("variable v: boolean on response from seen do v := true " + STATES)),
    ),
    (
        "update-out-of-scope",
        "error",
        robot(
            component("on response from seen do §D.v := true " + STATES),
            component("variable v: boolean initial marked state a { }", "", "D"),
        ),
        robot(component("variable v: boolean on response from seen do C.v := true " + STATES)),
    ),
    (
        "duplicate-assignment",
        "error",
        robot(component("variable v: boolean on response from seen do v := true, §v := false " + STATES)),
        robot(
            component("variable v: boolean variable w: boolean on response from seen do v := true, w := v " + STATES)
        ),
    ),
    (
        "nondeterministic-request",
        "error",
        robot(component("initial marked state a { on request to go goto b §on request to go } marked state b { }")),
        robot(component("initial marked state a { on request to go goto b } marked state b { on request to go }")),
    ),
    (
        "nondeterministic-event",
        "warning",
        robot(component("on response from seen initial marked state a { §on response from seen goto a }")),
        robot(component("initial marked state a { on response from seen goto a }")),
    ),
    (
        "type-mismatch",
        "error",
        robot(component("variable v: boolean on response from seen do v := §3 " + STATES)),
        robot(component("variable v: double on response from seen do v := 3 " + STATES)),
    ),
    (
        "type-mismatch",
        "error",
        robot(component("variable v: integer(1..3) = §4 " + STATES)),
        robot(component("variable v: integer(1..3) = 3 " + STATES)),
    ),
    (
        "unknown-name",
        "error",
        robot(component(STATES), "requirement go needs C.§c"),
        robot(component(STATES), "requirement go needs C.a"),
    ),
    (
        "ambiguous-name",
        "error",
        robot(
            "datatype enum E from double to { default -> x } datatype enum F from double to { default -> x }",
            component(STATES),
            "requirement go needs §x = true",
        ),
        robot(
            "datatype enum E from double to { default -> x } datatype enum F from double to { default -> x }",
            component("variable v: E " + STATES),
            "requirement go needs x = C.v",
        ),
    ),
    (
        "no-value-here",
        "error",
        robot(component(STATES), "requirement go needs §value"),
        robot(
            component("variable v: boolean on response from seen do v := value " + STATES), "requirement go needs C.v"
        ),
    ),
    (
        "integer-range-required",
        "error",
        robot(component("variable v: §integer " + STATES), "requirement go needs C.v > 0"),
        robot(component("variable v: integer(0..3) " + STATES), "requirement go needs C.v > 0"),
    ),
    (
        "double-in-synthesis",
        "error",
        robot(component("variable v: §double " + STATES), "requirement go needs C.v > 0"),
        robot(component("variable v: double " + STATES)),
    ),
    (
        "string-in-synthesis",
        "error",
        robot(component("variable v: §string " + STATES), 'requirement go needs C.v = "x"'),
        robot(component("variable v: string " + STATES)),
    ),
    (
        "may-leave-range",
        "warning",
        robot(
            component(
                "variable v: integer(0..10) on response from n do v := §value " + STATES,
                "outgoing message n with type: integer(0..100)",
            )
        ),
        robot(
            component(
                "variable v: integer(0..10) on response from n do v := value " + STATES,
                "outgoing message n with type: integer(1..9)",
            )
        ),
    ),
    (
        "infinite-source",
        "error",
        robot(
            component(
                "variable v: boolean on response from d do v := value §> 0.5 " + STATES,
                "outgoing message d with type: double incoming message go with type: none",
            ),
            "requirement go needs C.v",
        ),
        robot(
            "datatype enum E from double to { value > 0.5 -> yes default -> no }",
            component(
                "variable v: boolean on response from d do v := value = yes " + STATES,
                "outgoing message d with type: E incoming message go with type: none",
            ),
            "requirement go needs C.v",
        ),
    ),
    (
        "array-not-allowed",
        "error",
        robot(component(STATES, "incoming message m with type: §array(double)")),
        robot(OBJECT, component(STATES, "incoming message m with type: Scan links i")),
    ),
    (
        "object-variable",
        "error",
        robot(OBJECT, component("variable v: §Scan " + STATES)),
        robot(OBJECT, component("variable v: double " + STATES)),
    ),
    (
        "enum-default",
        "error",
        robot("datatype enum §E from double to { value > 1 -> x }", component(STATES)),
        robot("datatype enum E from double to { value > 1 -> x default -> y }", component(STATES)),
    ),
    (
        "enum-default",
        "error",
        robot("datatype enum E from double to { default -> x default -> §y }", component(STATES)),
        robot("datatype enum E from double to { default -> y }", component(STATES)),
    ),
    (
        "enum-default",
        "error",
        robot(
            "datatype enum E from double to { default -> x } datatype enum F from §E to { default -> y }",
            component(STATES),
        ),
        robot("datatype enum E from double to { default -> x }", component(STATES)),
    ),
    (
        "links-required",
        "error",
        robot(OBJECT, component(STATES, "incoming message m with type: §Scan")),
        robot(OBJECT, component(STATES, "incoming message m with type: Scan links i")),
    ),
    (
        "links-required",
        "error",
        robot(
            OBJECT,
            "datatype enum E from Scan to { value.range > 1 -> x default -> y }",
            component(STATES, "outgoing message m with type: §E"),
        ),
        robot(
            OBJECT,
            "datatype enum E from Scan to { value.range > 1 -> x default -> y }",
            component(STATES, "outgoing message m with type: E links i"),
        ),
    ),
    (
        "shared-topic",
        "warning",
        robot(
            'component A { outgoing message m with identifier: "/t", type: none }',
            'component B { outgoing message §n with identifier: "/t", type: none }',
        ),
        robot(
            'component A { outgoing message m with identifier: "/t", type: none outgoing message n with identifier: "/t", type: none }'
        ),
    ),
    (
        "conflicting-topic",
        "warning",
        robot(
            'component A { outgoing message m with identifier: "/t", type: none outgoing message §n with identifier: "/t", type: double }'
        ),
        robot(
            'component A { outgoing message m with identifier: "/t", type: none outgoing message n with identifier: "/u", type: double }'
        ),
    ),
    (
        "conflicting-topic",
        "warning",
        robot(
            "interface i use A from p interface j use B from p",
            'component A { service s with identifier: "/t", request: none, response: none links i }',
            'component B { service §r with identifier: "/t", request: none, response: none links j }',
        ),
        robot(
            "interface i use A from p interface j use B from p",
            'component A { service s with identifier: "/t", request: none, response: none links i }',
            'component B { outgoing message r with identifier: "/t", type: none links j }',
        ),
    ),
    (
        "links-required",
        "error",
        robot("component C { action §act with request: none, response: none, feedback: none }"),
        robot(
            "interface i use A from p",
            "component C { action act with request: none, response: none, feedback: none links i }",
        ),
    ),
    (
        "partial-update",
        "note",
        robot(
            component(
                "variable §v: double initial marked state a { on response from seen do v := 1 goto b } marked state b { }"
            )
        ),
        robot(component("variable v: double on response from seen do v := 1 " + STATES)),
    ),
    (
        "request-leaves-requirement",
        "note",
        robot(
            "interface i use A from p",
            component(
                "initial marked state a { on request to act goto b } state b { on response from act goto a }",
                "action act with request: none, response: none, feedback: none links i",
            ),
            "§requirement act needs C.a",
        ),
        robot(
            "interface i use A from p",
            component(
                "on request to act " + STATES, "action act with request: none, response: none, feedback: none links i"
            ),
            "requirement act needs C.a",
        ),
    ),
    ("empty-model", "warning", "robot §R { }", robot(component(STATES))),
    (
        "integer-too-large",
        "error",
        robot(component("variable v: integer = §2147483648 " + STATES)),
        robot(component("variable v: integer = 2147483647 " + STATES)),
    ),
    (
        "name-too-long",
        "error",
        f"robot §{'r' * 256} {{ {component(STATES)} }}",
        f"robot {'r' * 255} {{ {component(STATES)} }}",
    ),
    (
        "empty-requirement",
        "warning",
        robot(component(STATES, GO), "§requirement { } needs C.a"),
        robot(component(STATES, GO), "requirement { go } needs C.a"),
    ),
    (
        "result-not-read",
        "note",
        robot(
            "interface t use Trigger from p datatype object A { success: boolean } component C { "
            "service §ask with request: none, response: A links t }"
        ),
        robot(
            "interface t use Trigger from p datatype object A { success: boolean } component C { "
            "service ask with request: none, response: A links t behaviour { variable done: boolean "
            "initial marked state s { on response from ask do done := value.success } } }"
        ),
    ),
    (
        "permissive-default",
        "warning",
        robot(
            ZONES.format("min(value.list[330..30]) < 0.4 -> stop default -> §clear"),
            "requirement go needs D.zone = clear",
        ),
        robot(
            ZONES.format("min(value.list[330..30]) >= 0.4 -> clear default -> stop"),
            "requirement go needs D.zone = clear",
        ),
    ),
    (
        "needless-acceptance",
        "note",
        robot("§// robosc: accept shared-topic: both are meant", component(STATES)),
        robot(
            'component A { outgoing message m with identifier: "/m", type: none }',
            "// robosc: accept shared-topic: both are meant",
            'component B { outgoing message n with identifier: "/m", type: none }',
        ),
    ),
]


def enum(condition: str) -> str:
    """A robot with one enum rule over a scan."""
    return robot(OBJECT, f"datatype enum T from Scan to {{ {condition} -> near default -> far }}", SEEN)


SEEN = (
    "component S { outgoing message scanned with type: T links i "
    "behaviour { variable t: T on response from scanned do t := value initial marked state a { } } }"
)

EXTENSION_RULES: list[tuple[str, str, str, str]] = [
    (
        "duplicate-constant",
        "error",
        robot("constant K: integer = 1 constant §k: integer = 2", component(STATES)),
        robot("constant K: integer = 1 constant L: integer = 2", component(STATES)),
    ),
    (
        "constant-cycle",
        "error",
        robot("constant §K: integer = L constant L: integer = K + 1", component(STATES)),
        robot("constant K: integer = L constant L: integer = 1", component(STATES)),
    ),
    (
        "not-constant",
        "error",
        robot("constant K: double = 1 §/ 0", component(STATES)),
        robot("constant K: double = 1 / 2", component(STATES)),
    ),
    (
        "type-mismatch",
        "error",
        robot("constant K: integer(0..3) = §4", component(STATES)),
        robot("constant K: integer(0..3) = 3", component(STATES)),
    ),
    (
        "object-variable",
        "error",
        robot(OBJECT, "constant K: §Scan = 4", component(STATES)),
        robot(OBJECT, "constant K: double = 4", component(STATES)),
    ),
    ("unknown-name", "error", enum("§least(value.list) > 1"), enum("min(value.list) > 1")),
    ("type-mismatch", "error", enum("§abs(1, 2) > value.range"), enum("abs(-1) < value.range")),
    ("type-mismatch", "error", enum("min(§value.range) > 1"), enum("min(value.list) > 1")),
    ("type-mismatch", "error", enum("value.list§[1..2] = 3.0"), enum("value.list[1] = 3.0")),
    ("type-mismatch", "error", enum("length(§value.list[1..2]) = 3"), enum("length(value.list) = 3")),
    ("type-mismatch", "error", enum("value.list[0 §- 1] > 0.0"), enum("value.list[2 - 1] > 0.0")),
    ("type-mismatch", "error", enum("§any(value.list)"), enum("any(x in value.list: x > 1)")),
    ("type-mismatch", "error", enum("any(x in value.list: §x)"), enum("all(x in value.list[1..2]: x < 1)")),
    ("unknown-name", "error", enum("any(x in value.list: §y > 1)"), enum("any(y in value.list: y > 1)")),
    (
        "type-mismatch",
        "error",
        enum("if value.n = 1 then value.n = 2 else §value.range"),
        enum("if value.n = 1 then value.n = 2 else value.range > 1"),
    ),
    (
        "type-mismatch",
        "error",
        robot(component("variable v: boolean " + STATES), "requirement always §1"),
        robot(component("variable v: boolean " + STATES), "requirement always !C.v"),
    ),
    (
        "double-in-synthesis",
        "error",
        robot(component("variable v: §double " + STATES), "requirement never C.v > 1"),
        robot(component("variable v: integer(0..3) " + STATES), "requirement never C.v > 1"),
    ),
    (
        "double-in-synthesis",
        "error",
        robot(component("variable v: §double " + STATES), "goal C.a leads to C.v > 1"),
        robot(component("variable v: integer(0..3) " + STATES), "goal C.a leads to C.v > 1"),
    ),
    (
        "goal-in-library",
        "error",
        f"library L {{ {component(STATES)} §assume allow always eventually C.a }}",
        robot(component(STATES), "assume allow always eventually C.a"),
    ),
    (
        "goal-in-library",
        "error",
        f"library L {{ {component(STATES)} §mission m {{ visit C.a }} }}",
        robot(component(STATES), "mission m { visit C.a }"),
    ),
    (
        "duplicate-mission",
        "error",
        robot(component(STATES), "mission m { visit C.a } mission §M { visit C.b }"),
        robot(component(STATES), "mission m { visit C.a } mission n { visit C.b }"),
    ),
    (
        "too-many-visits",
        "error",
        robot(component(STATES), f"mission m {{ visit {'C.a then ' * 50}§C.b }}"),
        robot(component(STATES), f"mission m {{ visit {'C.a then ' * 49}C.b }}"),
    ),
    (
        "too-many-visits",
        "error",
        robot(component(STATES), f"mission m {{ visit C.a on C.b from anywhere visit {'C.a then ' * 50}§C.b }}"),
        robot(component(STATES), f"mission m {{ visit C.a on C.b from anywhere visit {'C.a then ' * 49}C.b }}"),
    ),
    (
        "preference-on-outgoing",
        "error",
        robot(component(STATES, f"{GO} outgoing message sent with type: none"), "goal once C.a prefer go over §sent"),
        robot(component(STATES, GO), "goal once C.a prefer go over stay"),
    ),
    (
        "contradictory-preferences",
        "error",
        robot(component(STATES, GO), "goal once C.a prefer go over stay §prefer stay over go"),
        robot(component(STATES, GO), "goal once C.a prefer go over stay prefer go over {stay}"),
    ),
    (
        "unused-preference",
        "warning",
        robot(component(STATES, GO), "§prefer go over stay"),
        robot(component(STATES, GO), "prefer go over stay mission m { visit C.a }"),
    ),
    (
        "option-not-allowed",
        "error",
        robot("component C { incoming message m with type: none, §max_age: 1.0 }"),
        robot("component C { outgoing message m with type: none, max_age: 1.0 }"),
    ),
    (
        "option-value",
        "error",
        robot("component C { outgoing message m with type: none, §depth: 0 }"),
        robot("component C { outgoing message m with type: none, depth: 1 }"),
    ),
    (
        "links-required",
        "error",
        robot('component C { incoming message m with type: none, §stamped: "base" }'),
        robot('interface i use T from p component C { incoming message m with type: none, stamped: "base" links i }'),
    ),
    (
        "type-mismatch",
        "error",
        robot("component C { incoming message m with type: double, when: §value }"),
        robot("component C { incoming message m with type: double, when: value > 1 }"),
    ),
    (
        "unprintable-identifier",
        "error",
        robot("component C { incoming message m with identifier: §'a\x1b[2Jb', type: none }"),
        robot("component C { incoming message m with identifier: '/a/b', type: none }"),
    ),
    (
        "unprintable-identifier",
        "error",
        robot("component C { incoming message m with identifier: §'a\u202eb', type: none }"),
        robot("component C { incoming message m with identifier: '/a/b', type: none }"),
    ),
    (
        "invalid-identifier",
        "warning",
        robot("component C { incoming message m with identifier: §'a b', type: none }"),
        robot("component C { incoming message m with identifier: '/a/b', type: none }"),
    ),
    (
        "conflicting-topic",
        "warning",
        robot(
            "component C { incoming message m with identifier: 't', type: none, qos: reliable "
            "incoming message §n with identifier: 't', type: none, qos: best_effort }"
        ),
        robot(
            "component C { incoming message m with identifier: 't', type: none, qos: best_effort "
            "incoming message n with identifier: 't', type: none, qos: best_effort }"
        ),
    ),
]


@pytest.mark.parametrize(
    ("code", "severity", "broken", "sound"),
    [*RULES, *EXTENSION_RULES],
    ids=[rule[0] for rule in (*RULES, *EXTENSION_RULES)],
)
def test_rule(code: str, severity: str, broken: str, sound: str) -> None:
    text, line, column = marked_place(broken)
    found = checked(text).diagnostics
    places = [(item.location.line, item.location.column) for item in found if item.location]
    assert [(item.code, str(item.severity)) for item in found] == [(code, severity)]
    assert places == [(line, column)]
    assert found[0].fix.endswith(".")
    assert code not in {item.code for item in checked(sound).diagnostics}
    assert not checked(sound).has_errors, checked(sound).diagnostics


@pytest.mark.parametrize(("code", "severity", "broken"), [rule[:3] for rule in (*RULES, *EXTENSION_RULES)])
def test_the_command_prints_just_this_finding(
    code: str, severity: str, broken: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, line, column = marked_place(broken)
    model = tmp_path / "model.rscd"
    model.write_text(text, encoding="utf-8")
    assert main(["check", "--json", str(model)]) == (1 if severity == "error" else 0)
    assert main(["check", "--strict", str(model)]) == (0 if severity == "note" else 1)
    document, _ = json.JSONDecoder().raw_decode(capsys.readouterr().out)
    found = [(item["code"], item["severity"], item["line"], item["column"]) for item in document["diagnostics"]]
    # Packages of these models are made up.
    assert [item for item in found if item[0] != "definition-not-found"] == [(code, severity, line, column)]


def test_services_without_a_link_have_no_type_that_could_conflict() -> None:
    service = 'service {} with identifier: "/t", request: {}, response: none'
    text = robot(f"component C {{ {service.format('a', 'none')} {service.format('b', 'double')} }}")
    assert [item.code for item in checked(text).diagnostics] == ["links-required"] * 2


def test_all_findings_come_in_one_run_sorted_by_place() -> None:
    text = robot(
        component("variable v: boolean = 3 on response to seen do w := true " + STATES),
        "requirement seen needs C.x",
        "provide go with 1",
    )
    found = checked(text).diagnostics
    assert [item.code for item in found] == [
        "type-mismatch",
        "wrong-preposition",
        "update-out-of-scope",
        "requirement-on-outgoing",
        "unknown-name",
        "type-mismatch",
    ]
    assert [item.location for item in found] == sorted(item.location for item in found if item.location)


@pytest.mark.parametrize(
    ("expression", "near"),
    [("Camera.restin", "resting"), ("camera.resting", "Camera"), ("Camera.v = near_by", "nearby")],
)
def test_a_near_name_is_suggested(expression: str, near: str) -> None:
    text = robot(
        "datatype enum E from double to { value > 1 -> nearby default -> far }",
        component("variable v: E initial marked state resting { }", name="Camera"),
        f"requirement go needs {expression}",
    )
    (found,) = checked(text).diagnostics
    assert found.severity is Severity.ERROR
    assert f"did you mean '{near}'?" in found.message
