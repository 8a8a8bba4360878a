import json
import random
import re
from collections.abc import Callable
from functools import cache
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import to_automata
from robosc.certification import make_supervisor
from robosc.errors import InvalidSupervisorError, UnsupportedModelError
from robosc.expressions import TRUE, Binary, Constant, StateTest, Unary, VariableRead
from robosc.model.structure import (
    Assumption,
    Deployment,
    Detour,
    Goal,
    GoalForm,
    Mission,
    Preference,
    Requirement,
    RequirementForm,
)
from robosc.supervisor import Strategy, Supervisor
from robosc.supervisor.codec import MAXIMUM_BYTES, MAXIMUM_EXPRESSION_DEPTH, decode, encode
from support.damaged_json import change_value
from support.effort import examples
from support.models import EXAMPLE_DEPLOYMENTS, example_bundle
from support.supervisors import supervisor


@cache
def canonical() -> bytes:
    return encode(supervisor())


def document() -> dict[str, Any]:
    found = json.loads(canonical())
    assert isinstance(found, dict)
    return found


def as_bytes(value: object) -> bytes:
    return json.dumps(value).encode()


def with_requirement(expression: Any) -> Supervisor:
    made = supervisor()
    requirement = Requirement(("move",), RequirementForm.NEEDS, expression)
    return msgspec.structs.replace(made, model=msgspec.structs.replace(made.model, requirements=(requirement,)))


def with_goals() -> Supervisor:
    """A supervisor of a model with goals and assumptions of every form."""
    made = supervisor()
    idle, few = StateTest("Base", "idle"), Binary("<", VariableRead("Base", "failures"), Constant(2))
    goals = (
        Goal(GoalForm.ALWAYS_EVENTUALLY, idle),
        Goal(GoalForm.LEADS_TO, idle, few),
        Goal(GoalForm.ONCE, few),
    )
    assumptions = (Assumption(GoalForm.ALWAYS_EVENTUALLY, few), Assumption(GoalForm.LEADS_TO, idle, few, True))
    return msgspec.structs.replace(
        made,
        model=msgspec.structs.replace(made.model, goals=goals, assumptions=assumptions),
        certificate=msgspec.structs.replace(made.certificate, goals="not checked"),
        strategy=Strategy(((),) * len(goals)),
    )


def with_missions() -> Supervisor:
    """A supervisor of a model with missions and preferences."""
    made = supervisor()
    idle, few = StateTest("Base", "idle"), Binary("<", VariableRead("Base", "failures"), Constant(2))
    missions = (Mission("rounds", (idle, few), few, (Detour(few, (idle,)),)), Mission("rest", (idle,)))
    preferences = (Preference(("move",), ("calibrate",)), Preference(("calibrate",), ()))
    return msgspec.structs.replace(
        made,
        model=msgspec.structs.replace(made.model, missions=missions, preferences=preferences),
        certificate=msgspec.structs.replace(made.certificate, goals="not checked"),
        strategy=Strategy(((),) * 4),
    )


def document_with_goals() -> dict[str, Any]:
    found = json.loads(encode(with_goals()))
    assert isinstance(found, dict)
    return found


def document_with_missions() -> dict[str, Any]:
    found = json.loads(encode(with_missions()))
    assert isinstance(found, dict)
    return found


def negations(depth: int) -> Any:
    expression: Any = TRUE
    for _ in range(depth):
        expression = Unary("not", expression)
    return expression


class TestRoundTrip:
    def test_there_and_back(self) -> None:
        assert decode(canonical()) == supervisor()
        assert encode(decode(canonical())) == canonical()

    def test_canonical_form(self) -> None:
        text = canonical().decode("utf-8")
        assert text == json.dumps(json.loads(text), sort_keys=True, separators=(",", ":"), ensure_ascii=False) + "\n"

    def test_kinds_of_numbers_stay(self) -> None:
        made: Any = decode(canonical()).model
        x, y = made.provides[0].value.properties[0][1].properties
        assert repr(x[1]) == "Constant(value=1.0)"
        assert repr(y[1].operand) == "Constant(value=2)"
        assert repr(made.component("Sensor").behaviour.variables[2].initial) == "1.0"

    def test_goals_there_and_back(self) -> None:
        made = with_goals()
        assert decode(encode(made)) == made
        assert encode(decode(encode(made))) == encode(made)
        assert type(decode(encode(made)).model.goals[0].form) is GoalForm

    def test_missions_there_and_back(self) -> None:
        made = with_missions()
        assert decode(encode(made)) == made
        assert encode(decode(encode(made))) == encode(made)
        assert b'"missions"' not in canonical() and b'"preferences"' not in canonical()

    def test_without_goals_nothing_is_written_of_them(self) -> None:
        assert b'"goals"' in encode(with_goals()) and b'"assumptions"' in encode(with_goals())
        assert b'"goals"' not in canonical() and b'"assumptions"' not in canonical()

    def test_other_layouts_are_read(self) -> None:
        assert decode(json.dumps(document(), indent=3).encode()) == supervisor()

    @pytest.mark.parametrize("depth", [0, 1, 399])
    def test_deep_expressions(self, depth: int) -> None:
        made = with_requirement(negations(depth))
        assert decode(encode(made)) == made


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_made_supervisors_there_and_back(name: str, deployment: Deployment) -> None:
    made = make_supervisor(example_bundle(name), deployment=deployment).supervisor
    assert made is not None
    assert decode(encode(made)) == made
    assert encode(decode(encode(made))) == encode(made)


class TestLimits:
    def test_size(self) -> None:
        with pytest.raises(InvalidSupervisorError, match=f"at most {MAXIMUM_BYTES} bytes"):
            decode(b" " * (MAXIMUM_BYTES + 1))

    @pytest.mark.parametrize("depth", [MAXIMUM_EXPRESSION_DEPTH + 15, 5000])
    def test_too_deep_to_write(self, depth: int) -> None:
        with pytest.raises(UnsupportedModelError, match="deep"):
            encode(with_requirement(negations(depth)))

    @pytest.mark.parametrize("depth", [500, 5_000, 1_000_000])
    @pytest.mark.parametrize(("opening", "closing"), [(b'{"a":', b"}"), (b"[", b"]"), (b"[", b"")])
    def test_too_deep_to_read(self, depth: int, opening: Any, closing: Any) -> None:
        with pytest.raises(InvalidSupervisorError):
            decode(opening * depth + b"1" + closing * depth)

    def test_deep_expression_to_read(self) -> None:
        nested = '{"node":"unary","operator":"not","operand":' * 600 + '{"node":"constant","value":true}' + "}" * 600
        value = document()
        value["supervisor"]["model"]["requirements"][0]["expression"] = "HERE"
        with pytest.raises(InvalidSupervisorError, match="nested too deeply"):
            decode(as_bytes(value).replace(b'"HERE"', nested.encode()))

    def test_many_fields_take_linear_time(self) -> None:
        fields = ",".join(f'"{number}":1' for number in range(300_000))
        with pytest.raises(InvalidSupervisorError, match="format"):
            decode(f"{{{fields}}}".encode())
        with pytest.raises(InvalidSupervisorError, match="twice"):
            decode(f'{{{fields},"299999":1}}'.encode())


class TestMalformed:
    @pytest.mark.parametrize(
        ("data", "words"),
        [
            (b"", "not UTF-8 JSON"),
            (b"\xff", "not UTF-8 JSON"),
            (b"\xef\xbb\xbf{}", "not UTF-8 JSON"),
            (b"null", "'format'"),
            (b"[]", "'format'"),
            (b"{}", "'format'"),
            (b'{"format":"robosc-supervisor"}', "version"),
            (b'{"format":"robosc-supervisor","version":2,"supervisor":{}}', "has version 2"),
            (b'{"format":"robosc-supervisor","version":true,"supervisor":{}}', "has version True"),
            (b'{"format":"robosc-supervisor","version":1.0,"supervisor":{}}', "malformed|inconsistent"),
            (b'{"format":"robosc-supervisor","version":1}', "supervisor"),
            (b'{"format":"robosc-supervisor","version":1,"supervisor":{}}', "model"),
            (b'{"format":"x","format":"robosc-supervisor"}', "'format' stands twice"),
            (b'{"a":NaN}', "NaN"),
            (b'{"a":' + b"1" * 5000 + b"}", "not UTF-8 JSON"),
        ],
    )
    def test_document(self, data: Any, words: str) -> None:
        with pytest.raises(InvalidSupervisorError, match=words) as caught:
            decode(data)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 500

    def test_unknown_fields_anywhere(self) -> None:
        places = list(objects(document()))
        assert len(places) > 100
        for place in places:
            value = document()
            at(value, place)["unknown_field"] = 1
            with pytest.raises(InvalidSupervisorError, match="unknown_field"):
                decode(as_bytes(value))

    def test_missing_fields_anywhere(self) -> None:
        optional = {"interface", "request", "response", "feedback", "behaviour", "low", "high", "path"}
        for place in objects(document()):
            for key in at(document(), place):
                value = document()
                del at(value, place)[key]
                if key not in optional:
                    with pytest.raises(InvalidSupervisorError):
                        decode(as_bytes(value))


def objects(value: Any, place: Any = ()) -> Any:
    """The place of every JSON object."""
    if isinstance(value, dict):
        yield place
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(inner, dict | list):
            yield from objects(inner, (*place, key))


def at(value: Any, place: Any) -> Any:
    for key in place:
        value = value[key]
    return value


# Changes (a path into `supervisor`, its new value) and words of the message.
INCONSISTENT = [
    ("model.components.0.name", "sensor", "communication scan: there is no component Sensor"),
    ("model.components.2.name", "base", "two components"),
    ("model.components.1.behaviour.states.1.is_initial", True, "initial state"),
    ("model.components.1.behaviour.states.0.is_initial", False, "initial state"),
    ("model.components.1.behaviour.states", [], "state"),
    ("model.components.1.behaviour.states.1.name", "IDLE", "two states or variables"),
    ("model.components.1.behaviour.states.1.name", "Ready", "two states or variables"),
    ("model.components.1.behaviour.variables.0.initial", 4, "variable failures: its initial value"),
    ("model.components.1.behaviour.variables.0.initial", 0.0, "initial value"),
    ("model.components.1.behaviour.variables.0.initial", False, "initial value"),
    ("model.components.1.behaviour.variables.1.initial", 0, "initial value"),
    ("model.components.0.behaviour.variables.0.initial", "far", "initial value"),
    ("model.components.0.behaviour.variables.2.initial", True, "initial value"),
    ("model.components.0.behaviour.variables.3.initial", 1, "initial value"),
    ("model.components.1.behaviour.variables.0.type", {"type": "integer"}, "not finite"),
    ("model.components.1.behaviour.variables.0.type", {"type": "integer", "low": 0}, "range"),
    ("model.components.1.behaviour.variables.0.type", {"type": "integer", "low": 3, "high": 0}, "range"),
    ("model.components.1.behaviour.variables.0.type", {"type": "object", "name": "Vector"}, "variable cannot be"),
    ("model.components.1.behaviour.variables.0.type", {"type": "none"}, "variable cannot be"),
    ("model.components.0.behaviour.variables.0.type.values", ["clear"], "no enum Clearance with those values"),
    ("model.components.0.behaviour.variables.0.is_synthesis", False, "Sensor.front is read in synthesis"),
    ("model.components.0.behaviour.variables.1.is_synthesis", True, None),
    ("model.components.0.behaviour.variables.2.is_synthesis", True, "not finite"),
    ("model.components.1.behaviour.transitions.0.source", "nowhere", r"transition 1 \(on move.request\): .*nowhere"),
    ("model.components.1.behaviour.transitions.0.target", "nowhere", "nowhere"),
    ("model.components.1.behaviour.transitions.0.source", None, "apply in one state"),
    ("model.components.1.behaviour.transitions.0.event", "move.response", "no such event"),
    ("model.components.1.behaviour.transitions.0.event", "fly.request", "no such event"),
    ("model.components.1.behaviour.transitions.0.event", "navigate.reset", "no such event"),
    ("model.components.1.behaviour.transitions.0.guard", {"node": "constant", "value": True}, "only a tau"),
    (
        "model.components.1.behaviour.transitions.0.updates",
        [{"variable": "ready", "expression": {"node": "constant", "value": True}}],
        "updates nothing",
    ),
    ("model.components.1.behaviour.transitions.2.event", "Sensor.tau_1", "no tau event of Base"),
    ("model.components.1.behaviour.transitions.2.event", "Base.tau_01", "no tau event of Base"),
    ("model.components.1.behaviour.transitions.2.event", "Base.tau_x", "no tau event of Base"),
    ("model.components.1.behaviour.transitions.2.guard", {"node": "constant", "value": 1}, "not boolean"),
    ("model.components.1.behaviour.transitions.2.guard", {"node": "received"}, "received data is read where none is"),
    ("model.components.1.behaviour.transitions.4.updates.0.variable", "level", "no such variable"),
    ("model.components.1.behaviour.transitions.4.updates.0.expression", {"node": "constant", "value": 1.5}, "not fit"),
    ("model.components.1.behaviour.transitions.4.updates.0.expression", {"node": "received"}, "where none is"),
    ("model.components.1.behaviour.transitions.6.updates.0.expression.path", ["ok", 1], "no part 1"),
    ("model.components.1.behaviour.transitions.6.updates.0.expression.path", ["no"], "no part 'no'"),
    ("model.components.1.behaviour.transitions.6.updates.0.expression.path", [0], "no part 0"),
    ("model.components.1.behaviour.transitions.6.updates.0.expression.path", [], "does not fit"),
    ("model.communications.0.name", "LEVEL", "two communications"),
    ("model.communications.2.component", "Nobody", "no component Nobody"),
    ("model.communications.2.interface", None, "middleware type"),
    ("model.communications.3.interface", None, "middleware type"),
    ("model.communications.0.interface", None, "middleware type"),
    ("model.communications.2.request", None, "data is not that"),
    ("model.communications.2.response", {"type": "none"}, "data is not that"),
    ("model.communications.4.feedback", None, "data is not that"),
    ("model.communications.2.kind", "service", "data is not that"),
    ("model.communications.1.response", {"type": "array", "element": {"type": "double"}}, "array stands outside"),
    ("model.communications.1.response", {"type": "object", "name": "Missing"}, "no object type Missing"),
    ("model.communications.2.identifier", "x" * 256, "malformed"),
    ("model.communications.2.name", "a b", "malformed"),
    ("model.communications.2.name", "os\n", "malformed"),
    ("model.enums.0.name", "Vector", "two data types"),
    ("model.enums.0.values", ["clear", "obstructed", "other"], "not those of its rules"),
    ("model.enums.0.values", ["clear", "Clear"], "two values"),
    ("model.enums.0.default", "clear", "not those of its rules"),
    ("model.enums.0.rules.0.value", "blocked", "not those of its rules"),
    ("model.enums.0.source", {"type": "enum", "name": "Clearance", "values": ["clear", "obstructed"]}, "made from"),
    ("model.enums.0.source", {"type": "array", "element": {"type": "double"}}, "made from"),
    ("model.enums.0.source", {"type": "object", "name": "Vector"}, "rule 1: Vector has no part 'ranges'"),
    ("model.enums.0.rules.0.condition", {"node": "state", "component": "Base", "state": "idle"}, "received data only"),
    ("model.objects.0.properties.1.name", "RANGES", "two properties"),
    ("model.objects.1.properties.0.type", {"type": "object", "name": "Lib.Twist"}, "holds itself"),
    (
        "model.objects.1.properties.0.type",
        {"type": "array", "element": {"type": "object", "name": "Vector"}},
        "Vector holds itself",
    ),
    ("model.requirements.0.communications", ["move", "scan"], "scan has no request"),
    ("model.requirements.0.communications", ["move", "jump"], "no communication jump"),
    ("model.requirements.0.expression", {"node": "constant", "value": "yes"}, "requirement 1: .* not boolean"),
    ("model.requirements.0.expression", {"node": "state", "component": "Base", "state": "flying"}, "no state"),
    ("model.requirements.0.expression.operator", "=", None),
    ("model.requirements.0.expression.operator", "+", r"'\+' does not take boolean and boolean"),
    ("model.requirements.0.expression.left.right.enum", "Other", "no enum Other"),
    ("model.requirements.0.expression.left.right.value", "far", "no value far"),
    ("model.requirements.0.expression.left.right", {"node": "constant", "value": "clear"}, "'=' does not take"),
    ("model.requirements.1.expression.right.value", 2**31, "32 bits"),
    ("model.requirements.1.expression.right.value", True, "'>=' does not take"),
    ("model.requirements.1.expression.operator", "**", "malformed"),
    ("model.provides.0.communication", "scan", "has no request"),
    ("model.provides.0.value.properties.0", ["angular", {"node": "constant", "value": 1}], "no such property"),
    ("model.provides.0.value.properties.0", ["linear", {"node": "constant", "value": 1}], "does not fit Vector"),
    ("model.provides.0.value.properties.1", ["linear", {"node": "object", "properties": []}], "two properties"),
    ("model.provides.0.value.properties.1", ["fast", {"node": "object", "properties": []}], "an object does not fit"),
    ("model.provides.0.value.properties.1", ["fast", {"node": "constant", "value": 1}], "does not fit boolean"),
    ("model.provides.0.condition", {"node": "constant", "value": 1}, "not boolean"),
    ("deployment", "layer", "another deployment"),
    ("deployment", "space", "malformed"),
    ("certificate.deployment", "layer", "another deployment"),
    ("certificate.states", "many", "number of states"),
    ("certificate.states", "0", "number of states"),
    ("certificate.states", "007", "number of states"),
    ("certificate.transitions", "-1", "number of transitions"),
    ("certificate.method", "\x1b[2J", "method"),
    ("certificate.engine_version", "x" * 1001, "engine version"),
    ("certificate.bundle_sha256", "0" * 63, "malformed"),
    ("certificate.safe", "failed", "malformed"),
    ("added.0.event", "scan.response", "no such controllable event"),
    ("added.0.event", "navigate.response", "no such controllable event"),
    ("added.0.event", "fly.request", "no such controllable event"),
    ("added.0.condition.root", 3, "condition added to navigate.request: "),
    ("added.0.condition.nodes.0.automaton", "Nobody", "condition added to navigate.request: "),
    ("added.0.condition.nodes.0.variable", "other", "condition added to navigate.request: "),
    ("added.0.condition.nodes.0.starts", [0, 9], "condition added to navigate.request: "),
    ("added.0.condition.nodes.0.children", [1, 2], "condition added to navigate.request: "),
]


@pytest.mark.parametrize(("path", "new", "words"), INCONSISTENT)
def test_inconsistent(path: Any, new: Any, words: str) -> None:
    value = document()
    *place, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    at(value["supervisor"], place)[last] = new
    if words is None:
        decode(as_bytes(value))
        return
    with pytest.raises(InvalidSupervisorError) as caught:
        decode(as_bytes(value))
    assert re.search(words, str(caught.value)), str(caught.value)
    assert str(caught.value).isprintable()


NUMBER = {"node": "constant", "value": 1}
RECEIVED = {"node": "received", "path": []}
ASIDE = {
    "node": "binary",
    "operator": "<",
    "left": {"node": "variable", "component": "Sensor", "variable": "level"},
    "right": NUMBER,
}
"""A condition on a variable that does not take part in synthesis."""

INCONSISTENT_GOALS: list[tuple[str, Any, str]] = [
    ("goals.0.form", "leads to", "goal 1: the form 'leads to' has a trigger"),
    ("goals.0.form", "sometimes", "malformed"),
    ("goals.0.trigger", NUMBER, "goal 1: the form 'leads to' has a trigger"),
    ("goals.1.form", "always eventually", "goal 2: the form 'leads to' has a trigger"),
    ("goals.1.form", "once", "goal 2: the form 'leads to' has a trigger"),
    ("goals.1.trigger", None, "goal 2: the form 'leads to' has a trigger"),
    ("goals.1.trigger", NUMBER, "goal 2: a condition is .*, not boolean"),
    ("goals.1.trigger", ASIDE, "Sensor.level is read in synthesis"),
    ("goals.1.condition", NUMBER, "goal 2: a condition is .*, not boolean"),
    ("goals.2.condition", {"node": "state", "component": "Base", "state": "flying"}, "goal 3: .*no state"),
    ("goals.2.condition", RECEIVED, "goal 3: "),
    ("goals.2.condition", ASIDE, "Sensor.level is read in synthesis"),
    ("goals.2.condition", "idle", "malformed"),
    ("goals.2.is_allowed", True, "unknown field 'is_allowed'"),
    ("goals.2", {"form": "once"}, "malformed"),
    ("goals", {}, "malformed"),
    ("goals", None, "malformed"),
    ("assumptions.0.form", "once", "assumption 1: an assumption has not the form 'once'"),
    ("assumptions.0.trigger", ASIDE, "assumption 1: the form 'leads to' has a trigger"),
    ("assumptions.0.condition", ASIDE, "Sensor.level is read in synthesis"),
    ("assumptions.1.is_allowed", 1, "malformed"),
    ("assumptions.1.is_allowed", "yes", "malformed"),
    ("assumptions.1.trigger", RECEIVED, "assumption 2: "),
    ("assumptions.1.trigger", {"node": "constant", "value": "yes"}, "assumption 2: .*not boolean"),
    ("assumptions.1.hope", True, "unknown field 'hope'"),
]


IDLE = {"node": "state", "component": "Base", "state": "idle"}

INCONSISTENT_MISSIONS: list[tuple[str, Any, str]] = [
    ("missions.0.visits", [], "mission rounds: a mission and each of its detours need a visit"),
    ("missions.0.detours.0.visits", [], "mission rounds: a mission and each of its detours need a visit"),
    ("missions.0.visits", [IDLE] * 51, "mission rounds: a mission and each of its detours have at most 50 visits"),
    ("missions.0.detours.0.visits", [IDLE] * 51, "mission rounds: .* at most 50 visits"),
    ("missions.0.visits.1", NUMBER, "mission rounds: a condition is .*, not boolean"),
    ("missions.0.visits.1", ASIDE, "Sensor.level is read in synthesis"),
    ("missions.0.visits.0", RECEIVED, "mission rounds: "),
    ("missions.0.visits.0", None, "malformed"),
    ("missions.0.condition", NUMBER, "mission rounds: a condition is .*, not boolean"),
    ("missions.0.condition", ASIDE, "Sensor.level is read in synthesis"),
    ("missions.0.condition", {"node": "state", "component": "Base", "state": "flying"}, "mission rounds: .*no state"),
    ("missions.0.detours.0.trigger", NUMBER, "mission rounds: a condition is .*, not boolean"),
    ("missions.0.detours.0.trigger", ASIDE, "Sensor.level is read in synthesis"),
    ("missions.0.detours.0.trigger", None, "malformed"),
    ("missions.0.detours.0.visits.0", ASIDE, "Sensor.level is read in synthesis"),
    ("missions.0.detours.0.name", "x", "unknown field 'name'"),
    ("missions.1.name", "Rounds", "missions"),
    ("missions.1.name", "a mission", "malformed"),
    ("missions.1.visits", [IDLE, IDLE], "not one mode for each goal and each visit"),
    ("missions", [], "strategy belongs to a controller with goals or missions"),
    ("preferences.0.preferred", ["fly"], "preference 1: there is no communication fly"),
    ("preferences.0.others", ["scan"], "preference 1: scan has no request"),
    ("preferences.0.others", ["move"], "the preferences contradict each other"),
    ("preferences.1.others", ["move"], "the preferences contradict each other"),
    ("preferences.1.others", "move", "malformed"),
    ("preferences.1.over", [], "unknown field 'over'"),
]


@pytest.mark.parametrize(
    ("document_of", "path", "new", "words"),
    [
        *((document_with_goals, *item) for item in INCONSISTENT_GOALS),
        *((document_with_missions, *item) for item in INCONSISTENT_MISSIONS),
    ],
)
def test_inconsistent_goals(document_of: Callable[[], dict[str, Any]], path: Any, new: Any, words: str) -> None:
    value = document_of()
    decode(as_bytes(value))
    *place, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    at(value["supervisor"]["model"], place)[last] = new
    with pytest.raises(InvalidSupervisorError) as caught:
        decode(as_bytes(value))
    assert re.search(words, str(caught.value)), str(caught.value)
    assert str(caught.value).isprintable()


def test_goals_nest_no_deeper_than_requirements() -> None:
    for depth, is_read in ((MAXIMUM_EXPRESSION_DEPTH - 1, True), (600, False)):
        value = document_with_goals()
        value["supervisor"]["model"]["assumptions"][1]["trigger"] = "HERE"
        nested = (
            '{"node":"unary","operator":"not","operand":' * depth + '{"node":"constant","value":true}' + "}" * depth
        )
        data = as_bytes(value).replace(b'"HERE"', nested.encode())
        if is_read:
            assert decode(data)
        else:
            with pytest.raises(InvalidSupervisorError, match="nested too deeply"):
                decode(data)


def test_an_event_has_one_added_condition() -> None:
    value = document()
    value["supervisor"]["added"] *= 2
    with pytest.raises(InvalidSupervisorError, match="twice"):
        decode(as_bytes(value))


def test_a_layer_may_not_restrict_cancel() -> None:
    value = document()
    value["supervisor"]["added"][0]["event"] = "navigate.cancel"
    assert decode(as_bytes(value))
    value["supervisor"]["deployment"] = value["supervisor"]["certificate"]["deployment"] = "layer"
    with pytest.raises(InvalidSupervisorError, match="controllable"):
        decode(as_bytes(value))


def survives(data: bytes) -> bool:
    """Return True if bytes are a supervisor; then every later stage must be able to take it."""
    try:
        made = decode(data)
    except InvalidSupervisorError as error:
        assert str(error)
        assert "\n" not in str(error)
        return False
    again = encode(made)
    assert decode(again) == made
    assert encode(decode(again)) == again
    to_automata(made.model, made.deployment)
    return True


@settings(max_examples=examples(60))
@given(seed=st.integers(0, 2**64))
def test_mutated_bytes(seed: Any) -> None:
    chance = random.Random(seed)
    data = bytearray(canonical())
    for _ in range(chance.randint(1, 3)):
        start = chance.randrange(len(data))
        match chance.randrange(4):
            case 0:
                data[start] = chance.randrange(256)
            case 1:
                data[start] = chance.choice(b'0123456789{}[]",:-.etfn\\')
            case 2:
                del data[start : start + chance.randint(1, 20)]
            case 3:
                data[start:start] = data[chance.randrange(len(data)) :][: chance.randint(1, 40)]
    survives(bytes(data))


@settings(max_examples=examples(60))
@given(seed=st.integers(0, 2**64))
def test_mutated_values(seed: Any) -> None:
    chance = random.Random(seed)
    value = chance.choice((document, document_with_goals, document_with_missions))()
    for _ in range(chance.randint(1, 2)):
        change_value(value, chance)
    survives(as_bytes(value))


def test_mutations_reach_both_outcomes() -> None:
    accepted = 0
    for seed in range(400):
        chance = random.Random(seed)
        value = document()
        change_value(value, chance)
        accepted += survives(as_bytes(value)) and value != document()
    assert 5 <= accepted <= 300
    print(f"accepted {accepted} of 400 changed supervisors")


def test_a_constant_beyond_binary64_is_refused() -> None:
    data = canonical().replace(b'"value":0.5', b'"value":1e999')
    assert data != canonical()
    with pytest.raises(InvalidSupervisorError, match="out of range"):
        decode(data)


def test_values_are_compared_with_their_kind() -> None:
    assert encode(with_requirement(Constant(True))) != encode(with_requirement(Constant(1)))
