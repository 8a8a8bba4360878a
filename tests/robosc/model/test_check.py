"""What a checked model holds: names bound, types known, source order, imports, synthesis variables, places."""

import pytest
from hypothesis import given, settings

from robosc.expressions import (
    Binary,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    ObjectType,
    Received,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.expressions.text import expression_text
from robosc.expressions.tree import children
from robosc.model.structure import ObjectValue, RequirementForm, Update
from support.models import EXAMPLE_NAMES, checked, example_model, model_of
from support.random_expressions import conditions


@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_the_examples_have_no_errors(name: str) -> None:
    assert example_model(name).name


def test_an_access_is_bound_to_what_it_names() -> None:
    model = model_of("""robot R {
        datatype enum Colour from double to { value > 1 -> red default -> green }
        component C {
            outgoing message seen with type: Colour
            incoming message go with type: none
            behaviour {
                variable colour: Colour
                on response from seen do colour := value
                initial marked state idle { transition if colour = red and C.colour != green goto idle }
            }
        }
        requirement go needs C.idle and C.colour = red
        requirement !(C.idle => false) disables { go }
    }""")
    read, red = VariableRead("C", "colour"), EnumValue("Colour", "red")
    behaviour = model.components[0].behaviour
    assert behaviour is not None
    assert behaviour.transitions[0].updates == (Update("colour", Received(())),)
    assert behaviour.transitions[1].guard == Binary(
        "and", Binary("=", read, red), Binary("!=", read, EnumValue("Colour", "green"))
    )
    needs, disables = model.requirements
    assert needs.expression == Binary("and", StateTest("C", "idle"), Binary("=", read, red))
    assert disables.form is RequirementForm.DISABLES
    assert disables.condition == Unary("not", Unary("not", Binary("implies", StateTest("C", "idle"), Constant(False))))


def test_a_component_wins_over_a_type_and_a_variable_over_an_enum_value() -> None:
    model = model_of("""robot R {
        datatype enum C from double to { value > 1 -> idle default -> flag }
        component C {
            incoming message go with type: none
            behaviour { variable flag: boolean initial marked state idle { transition if flag goto idle } }
        }
        requirement go needs C.idle
    }""")
    assert model.requirements[0].expression == StateTest("C", "idle")
    behaviour = model.components[0].behaviour
    assert behaviour is not None
    assert behaviour.transitions[0].guard == VariableRead("C", "flag")


def test_an_enum_rule_may_compare_a_property_that_is_an_enum() -> None:
    model = model_of("""robot R {
        interface i use Pair from p
        datatype enum Side from double to { value > 1 -> far default -> near }
        datatype object Pair { left: Side right: Side }
        datatype enum Both from Pair to { value.left = far and value.right = far -> open default -> shut }
        component C { outgoing message seen with type: Both links i }
    }""")
    (rule,) = model.enum("Both").rules
    far = EnumValue("Side", "far")
    assert rule.condition == Binary(
        "and", Binary("=", Received(("left",)), far), Binary("=", Received(("right",)), far)
    )


def test_initial_values_and_defaults() -> None:
    model = model_of("""robot R {
        datatype enum E from double to { value > 1 -> first default -> fallback }
        component C { behaviour {
            variable a: boolean  variable b: integer(3..7)  variable c: integer  variable d: double
            variable e: string  variable f: E  variable g: double = 2  variable h: E = first  variable i: integer(0..9) = 4
            initial marked state s { }
        } }
    }""")
    behaviour = model.components[0].behaviour
    assert behaviour is not None
    values = {variable.name: variable.initial for variable in behaviour.variables}
    assert values == {
        "a": False, "b": 3, "c": 0, "d": 0.0, "e": "", "f": "fallback", "g": 2.0, "h": "first", "i": 4,
    }  # fmt: skip
    assert isinstance(values["g"], float)


def test_synthesis_variables_are_found_through_updates() -> None:
    model = model_of("""robot R {
        component A {
            outgoing message n with type: integer(0..3)
            incoming message go with type: none
            service s with request: none, response: integer(0..3) links i
            behaviour {
                variable direct: integer(0..9)  variable feeding: integer(0..3)  variable aside: integer(0..3)
                variable guarded: boolean  variable provided: boolean
                on response from n do direct := feeding, aside := value
                on response from s do feeding := value, guarded := true, provided := false
                initial marked state idle { transition if guarded goto idle }
            }
        }
        interface i use S from p
        requirement go needs A.direct > 0
        provide go2 with 1 if A.provided
        component B { incoming message go2 with type: integer }
    }""")
    behaviour = model.components[0].behaviour
    assert behaviour is not None
    assert {v.name for v in behaviour.variables if v.is_synthesis} == {"direct", "feeding", "guarded", "provided"}


LIBRARY = """library Lib {
    interface twist use Twist from geometry_msgs
    datatype object Twist { x: double }
    datatype enum Level from double to { value > 1 -> high default -> low }
    component Unused { outgoing message nothing with type: none }
    component Platform {
        incoming message drive with identifier: "/drive", type: Twist links twist
        outgoing message level with type: Level
        behaviour {
            variable seen: Level
            on response from level do seen := value
            initial marked state ready { transition if Platform.seen = high goto ready }
        }
    }
}"""


def test_an_imported_component_keeps_its_own_types_and_gets_its_local_name() -> None:
    model = model_of(
        """robot R {
            datatype object Twist { y: double }
            interface twist use Twist from my_msgs
            component First { incoming message own with type: Twist links twist }
            component Base from Lib import Platform
            component Last { incoming message last with type: none }
            requirement drive needs Base.ready and Base.seen = high
            provide drive with { x: 1.5 }
            provide own with { y: 2 }
        }""",
        lib=LIBRARY,
    )
    assert [component.name for component in model.components] == ["First", "Base", "Last"]
    assert [item.name for item in model.communications] == ["own", "drive", "level", "last"]
    drive = model.communication("drive")
    assert (drive.component, drive.request, drive.interface and drive.interface.package) == (
        "Base", ObjectType("Lib.Twist"), "geometry_msgs",
    )  # fmt: skip
    assert model.communication("own").request == ObjectType("Twist")
    assert model.communication("level").response == EnumType("Lib.Level", ("high", "low"))
    assert model.taus == ("Base.tau_1",)
    behaviour = model.components[1].behaviour
    assert behaviour is not None
    assert behaviour.transitions[1].guard == Binary("=", VariableRead("Base", "seen"), EnumValue("Lib.Level", "high"))
    assert model.provides[0].value == ObjectValue((("x", Constant(1.5)),))
    assert model.provides[1].value == ObjectValue((("y", Constant(2)),))


def test_import_chains_are_followed() -> None:
    other = "library Other { component Chassis from Lib import Platform }"
    model = model_of("robot R { component Base from Other import Chassis }", lib=LIBRARY, other=other)
    assert model.communication("drive").component == "Base"


@pytest.mark.parametrize(
    ("text", "libraries", "code", "words"),
    [
        (
            "robot R { component C from A import X }",
            {"a": "library A { component X from B import X }", "b": "library B { component X from A import X }"},
            "import-cycle",
            "never ends",
        ),
        (
            "robot R { component C from Lib import Platfrom }",
            {"lib": LIBRARY},
            "unknown-name",
            "did you mean 'Platform'",
        ),
        (
            "robot R { component C from Lib import Platform component D from Lib import Platform }",
            {"lib": LIBRARY},
            "duplicate-communication",
            "imported twice",
        ),
        (
            "robot R { component C from Lib import A }",
            {
                "lib": "library Lib { component A { behaviour { initial marked state s { on response from far goto s } } }"
                " component B { outgoing message far with type: none } }"
            },
            "unknown-name",
            "'far', which is not imported",
        ),
        (
            "robot R { component C from Lib import Platform requirement drive needs C.x = 1 }",
            {"lib": LIBRARY},
            "unknown-name",
            "'x'",
        ),
        ("robot R { component C from Nowhere import X }", {}, "unknown-name", "unknown library 'Nowhere'"),
    ],
)
def test_broken_imports(text: str, libraries: dict[str, str], code: str, words: str) -> None:
    (found,) = checked(text, **libraries).diagnostics
    assert found.code == code
    assert words in found.message
    assert found.location is not None
    assert found.location.file == ("a.rscd" if code == "import-cycle" else "model.rscd")


def test_a_library_can_be_checked_by_itself() -> None:
    found = checked(LIBRARY)
    assert found.model is None
    assert not found.has_errors
    broken = checked(LIBRARY.replace("seen := value", "sen := value"))
    assert [item.code for item in broken.diagnostics] == ["update-out-of-scope"]


def test_places_point_into_the_text() -> None:
    found = checked("""robot R {
        component C {
            incoming message go with type: none
            behaviour {
                variable v: boolean
                initial marked state s { on request to go }
            }
        }
        requirement go needs C.s
        provide go with { }
    }""")
    assert found.model is None
    found = checked("robot R {\n component C { incoming message go with type: none }\n requirement go needs true\n}")
    assert found.places is not None
    assert [str(place) for place in found.places.requirements] == ["model.rscd:3:2"]
    assert str(found.places.communications["go"]) == "model.rscd:2:33"


def test_property_types_are_followed_through_objects_and_arrays() -> None:
    model = model_of("""robot R {
        interface i use Scan from p
        datatype enum Near from double to { value < 1 -> near default -> far }
        datatype object Point { distance: Near  n: integer(0..5) }
        datatype object Scan { points: array(Point) }
        component C {
            outgoing message scan with type: Scan links i
            behaviour {
                variable first: Near  variable n: integer(0..5)
                on response from scan do first := value.points[0].distance, n := value.points[3].n
                initial marked state s { }
            }
        }
    }""")
    behaviour = model.components[0].behaviour
    assert behaviour is not None
    assert [update.expression for update in behaviour.transitions[0].updates] == [
        Received(("points", 0, "distance")),
        Received(("points", 3, "n")),
    ]
    assert {type(variable.type) for variable in behaviour.variables} == {EnumType, IntegerType}


HOME = """robot R {{
    interface i use Scan from p
    datatype enum Colour from double to {{ value > 2 -> red value > 1 -> green default -> blue }}
    datatype object Data {{ list: array(integer) seen: boolean }}
    component A {{
        outgoing message e with type: Data links i
        behaviour {{
            variable flag: boolean  variable small: integer(-2..3)  variable wide: integer  variable colour: Colour
            variable result: boolean
            on response from e do result := {condition}
            initial marked state on_ {{ }} marked state off {{ }} marked state broken {{ }}
        }}
    }}
}}"""


def writable(expression: Expression) -> bool:
    """Whether an expression can be written in part A at all."""
    match expression:
        case Unary(operator="holds") | Constant(value=int() | float()):
            return expression != Unary("holds", expression) and (
                not isinstance(expression, Unary)
                and (isinstance(expression.value, bool) or 0 <= expression.value <= 2**31 - 1)  # type: ignore[operator]
            )
    return all(writable(child) for child in children(expression))


@settings(max_examples=80, deadline=None)
@given(conditions)
def test_a_printed_expression_reads_back_as_itself(condition: Expression) -> None:
    if not writable(condition):
        return
    text = expression_text(condition).replace("A.on", "A.on_")
    home = HOME.format(condition=text).replace("integer(-2..3)", "integer(0..3)")
    found = checked(home)
    assert not found.has_errors, [str(item) for item in found.diagnostics]
    behaviour = found.model_or_raise().components[0].behaviour
    assert behaviour is not None
    read_back = expression_text(behaviour.transitions[0].updates[0].expression).replace("A.on_", "A.on")
    assert read_back == expression_text(condition)
