"""Limits and conditions of requests: what the checker takes, and what it reports where."""

import pytest

from robosc.certification import make_supervisor
from robosc.errors import InvalidSupervisorError
from robosc.model.structure import Bound, Deployment, Limit
from robosc.supervisor import decode, encode
from support.models import bundle_of, checked, marked_place, model_of

ROBOT = """robot R {{
    interface twist use Twist from own_msgs
    datatype object Vector {{ x: double ok: boolean }}
    datatype object Twist {{ linear: Vector }}
    constant SLOW: double = 0.1
    component Base {{
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        incoming message turn with type: double
        incoming message beep with type: none
        incoming message step with type: integer
        incoming message gear with type: integer(0..3)
        outgoing message speed with type: double
        behaviour {{
            variable level: integer(0..3)
            variable speed_: double
            on response from speed do speed_ := value
            initial marked state idle {{ on request to drive goto moving }}
            state moving {{ on request to drive goto idle }}
        }}
    }}
    {}
}}
"""


@pytest.mark.parametrize(
    ("code", "severity", "items"),
    [
        ("limit-on-outgoing", "error", "limit §speed to 0.0..1.0"),
        ("unknown-name", "error", "limit §fly to 0.0..1.0"),
        ("unknown-name", "error", "limit drive to { linear: { §y: 0.0..1.0 } }"),
        ("type-mismatch", "error", "limit drive to { linear: { ok: §0.0..1.0 } }"),
        ("type-mismatch", "error", "limit drive to { linear: §0.0..1.0 }"),
        ("type-mismatch", "error", "limit turn to §{ x: 0.0..1.0 }"),
        ("type-mismatch", "error", "limit beep to §0..1"),
        ("type-mismatch", "error", "limit step to 0..§1.5"),
        ("type-mismatch", "error", "limit turn to 0.0..1.0 if §Base.level"),
        ("not-constant", "error", "limit turn to 0.0..§Base.speed_"),
        ("not-constant", "error", "limit turn to 1.0 §/ 0.0..1.0"),
        ("no-value-here", "error", "limit turn to 0.0..1.0 if §value > 0.5"),
        ("duplicate-property", "error", "limit drive to { linear: { x: 0.0..1.0, §x: 0.0..1.0 } }"),
        ("empty-limit", "error", "limit turn to §1.0..0.0"),
        ("empty-limit", "error", "limit gear to §4..9"),
        ("empty-limit", "error", "limit gear to §-2..-1"),
        ("empty-limit", "error", "limit turn to 0.0..1.0 §limit turn to 2.0..3.0"),
        ("empty-limit", "error", "limit turn to 0.0..1.0 if Base.idle §limit turn to 2.0..3.0 if Base.idle"),
        ("contradictory-limits", "warning", "limit turn to 0.0..1.0 §limit turn to 2.0..3.0 if Base.idle"),
        (
            "contradictory-limits",
            "warning",
            "limit turn to 0.0..1.0 if Base.idle §limit turn to 2.0..3.0 if Base.level > 1",
        ),
        (
            "contradictory-limits",
            "warning",
            "limit turn to 0.0..1.0 if Base.idle §limit turn to 2.0..3.0 if Base.speed_ > 1",
        ),
        ("value-outside-field", "warning", "limit step to 0..1 §limit step to 0..40000"),
    ],
)
def test_what_is_wrong_is_reported_at_its_place(code: str, severity: str, items: str) -> None:
    text, line, column = marked_place(ROBOT.format(items))
    found = [item for item in checked(text).diagnostics if item.code == code]
    assert [(item.severity, item.location.line, item.location.column) for item in found if item.location] == [
        (severity, line, column)
    ], checked(text).diagnostics


@pytest.mark.parametrize(
    "items",
    [
        "limit drive to { linear: { x: -SLOW..SLOW } } if Base.moving",
        "limit turn to -1.0..1.0 limit turn to 1.0..2.0",
        "limit turn to 0..1 if Base.speed_ > 2",
        "limit step to -3..SLOW_ constant SLOW_: integer = 4",
        "limit turn to 0.0..1.0 if Base.idle limit turn to 2.0..3.0 if Base.moving",
        "limit turn to 0.0..1.0 if Base.level > 2 limit turn to 2.0..3.0 if Base.level < 1",
        "limit turn to 0.0..1.0 limit step to 2..3",
        "limit drive to { }",
    ],
)
def test_these_are_sound(items: str) -> None:
    found = checked(ROBOT.format(items))
    assert found.diagnostics == ()
    assert found.model is not None


def test_a_limit_is_bounds_by_path() -> None:
    items = "limit drive to { linear: { x: -SLOW * 2.0..1 } } if Base.idle limit step to -3..4"
    first, second = model_of(ROBOT.format(items)).limits
    assert (first.communication, first.bounds) == ("drive", (Bound(("linear", "x"), -0.2, 1.0),))
    assert type(first.bounds[0].high) is float
    assert (second.bounds, second.condition) == ((Bound((), -3, 4),), None)


def test_a_condition_of_a_limit_makes_no_synthesis_variable() -> None:
    model = model_of(ROBOT.format("limit turn to 0.0..1.0 if Base.speed_ > 0.5 and Base.level = 1"))
    behaviour = model.component("Base").behaviour
    assert behaviour is not None
    assert [item.is_synthesis for item in behaviour.variables] == [False, False]


def test_a_library_brings_the_limits_of_what_is_imported() -> None:
    library = (
        "library L { component Base { incoming message turn with type: double incoming message up with type: none } "
    )
    library += "limit turn to 0.0..1.0 }"
    robot = "robot R { component Base from L import Base limit turn to 0.5..2.0 }"
    assert [item.bounds[0].low for item in model_of(robot, L=library).limits] == [0.0, 0.5]


def test_a_supervisor_file_keeps_limits_and_is_refused_with_broken_ones() -> None:
    made = make_supervisor(bundle_of(ROBOT.format("limit turn to 0.0..1.0 if Base.idle")))
    assert made.supervisor is not None
    data = encode(made.supervisor)
    assert decode(data).model.limits == made.supervisor.model.limits
    good = b'"high":1.0,"low":0.0'
    assert good in data.replace(b" ", b"")
    compact = data.replace(b" ", b"")
    for bad in (b'"high":1.0,"low":2.0', b'"high":1,"low":0', b'"high":1.0,"low":true'):
        with pytest.raises(InvalidSupervisorError):
            decode(compact.replace(good, bad))
    for before, after in (
        (b'"communication":"turn","condition"', b'"communication":"speed","condition"'),
        (b'"path":[]', b'"path":["x"]'),
    ):
        assert before in compact
        with pytest.raises(InvalidSupervisorError):
            decode(compact.replace(before, after))


LAYER = """robot R {{
    interface twist use {} from geometry_msgs
    datatype object Vector {{ x: double }}
    datatype object Twist {{ linear: Vector }}
    component Base {{
        incoming message walk with identifier: "/cmd_vel", type: Twist{} links twist
        incoming message halt with identifier: "/cmd_vel", type: Twist{} links twist
    }}
}}
"""
MOVES = ", when: value.linear.x != 0.0"
STILL = ", when: value.linear.x = 0.0"
DEFAULT = ", when: default"


@pytest.mark.parametrize(
    ("interface", "first", "last", "codes"),
    [
        ("Twist", "", "", ["ambiguous-layer-topic"]),
        ("Twist", "", DEFAULT, ["ambiguous-layer-topic"]),
        ("Twist", MOVES, "", ["layer-passes-motion"]),
        ("TwistStamped", MOVES, "", ["layer-passes-motion"]),
        ("Twist", MOVES, STILL, ["layer-passes-motion"]),
        ("Twist", MOVES, DEFAULT, []),
        ("Twist", DEFAULT, "", []),
        ("Twist", DEFAULT, MOVES, []),
        ("Accel", MOVES, "", []),
    ],
)
def test_messages_of_a_layer_on_one_topic(interface: str, first: str, last: str, codes: list[str]) -> None:
    made = make_supervisor(bundle_of(LAYER.format(interface, first, last)), deployment=Deployment.LAYER)
    ours = ("ambiguous-layer-topic", "layer-passes-motion")
    assert [item.code for item in made.diagnostics if item.code in ours] == codes
    assert (made.supervisor is None) == ("ambiguous-layer-topic" in codes)
    # A controller sends the messages itself.
    alone = make_supervisor(bundle_of(LAYER.format(interface, first, last)))
    assert [item.code for item in alone.diagnostics if item.code in ours] == []


@pytest.mark.parametrize("kind", ["service", "action"])
@pytest.mark.parametrize(("first", "is_sound"), [("", False), (", when: value.data", True), (DEFAULT, True)])
def test_calls_and_goals_of_a_layer_on_one_name(kind: str, first: str, is_sound: bool) -> None:
    types = "request: Power, response: none" + (", feedback: none" if kind == "action" else "")
    text = f"""robot R {{
        interface power use SetBool from own_msgs
        datatype object Power {{ data: boolean }}
        component Base {{
            {kind} up with identifier: "/arm", {types}{first} links power
            {kind} down with identifier: "/arm", {types} links power
        }}
    }}"""
    made = make_supervisor(bundle_of(text), deployment=Deployment.LAYER)
    assert [item.code for item in made.diagnostics if item.severity == "error"] == (
        [] if is_sound else ["ambiguous-layer-topic"]
    )


def test_an_outgoing_message_has_no_condition() -> None:
    text = "robot R { component C { outgoing message m with type: boolean, when: default } }"
    assert [item.code for item in checked(text).diagnostics] == ["option-not-allowed"]


def test_limits_are_words_only_where_one_stands() -> None:
    text = """robot limit {
        constant limit: double = 1.0
        component to_ { incoming message limit with type: double incoming message turn with type: double }
        requirement turn needs not limit limit limit to limit..limit limit turn to 0.0..limit
    }"""
    found = checked(text.replace("needs not limit", "needs limit > 0.5"))
    assert [item.code for item in found.diagnostics if item.severity == "error"] == []
    assert found.model is not None
    assert found.model.limits == (
        Limit("limit", (Bound((), 1.0, 1.0),), None),
        Limit("turn", (Bound((), 0.0, 1.0),), None),
    )
