"""Tests of a checked model: names bound, types known, source order, imports, synthesis variables, places."""

import re
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import LanguageError
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
from robosc.expressions.tree import children, leaves
from robosc.language.words import RESERVED_WORDS
from robosc.model.structure import ObjectValue, RequirementForm, Update
from support.effort import examples
from support.models import EXAMPLE_NAMES, checked, example_bundle, example_model, model_of
from support.random_expressions import language_conditions


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
    interface twist use Vector3 from geometry_msgs
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
            "the import of 'C' never ends: 'X' of 'A' from 'X' of 'B' from 'X' of 'A'",
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


CHAIN = """library Chain {
    component Chassis from Lib import Platform
    component Watcher {
        incoming message warn with type: none
        behaviour { initial marked state calm { transition if Chassis.seen = high and Chassis.ready goto calm } }
    }
}"""


@pytest.mark.parametrize("base", ["Chain import Chassis", "Lib import Platform"])
def test_a_library_reads_a_component_that_it_imports_however_the_robot_has_it(base: str) -> None:
    model = model_of(
        f"robot R {{ component Base from {base} component W from Chain import Watcher }}", lib=LIBRARY, chain=CHAIN
    )
    behaviour = model.component("W").behaviour
    assert behaviour is not None
    assert behaviour.transitions[0].guard == Binary(
        "and",
        Binary("=", VariableRead("Base", "seen"), EnumValue("Lib.Level", "high")),
        StateTest("Base", "ready"),
    )


def test_a_library_that_reads_a_component_which_is_not_imported_is_refused() -> None:
    found = checked("robot R { component W from Chain import Watcher }", lib=LIBRARY, chain=CHAIN).diagnostics
    assert {item.code for item in found} == {"unknown-name"}
    assert {item.location and item.location.file for item in found} == {"chain.rscd"}


def test_two_libraries_may_import_from_each_other() -> None:
    main = (
        "library Main { component A from Other import B component C { behaviour { initial marked state idle { } } } }"
    )
    other = """library Other {
        component E from Main import C
        component B { behaviour { initial marked state s { transition if E.idle goto s } } }
    }"""
    assert checked(main, other=other).diagnostics == ()


IMPORTER = """robot R {{
    component Base from Lib import Platform
    component Twin from Copy import Platform
    requirement drive needs {condition}
}}"""
COPY = LIBRARY.replace("Lib ", "Copy ").replace("message drive", "message go").replace("level", "level2")


def test_an_imported_enum_can_be_named() -> None:
    model = model_of(
        "robot R { component Base from Lib import Platform requirement drive needs Base.seen = Level.high }",
        lib=LIBRARY,
    )
    assert model.requirements[0].expression == Binary("=", VariableRead("Base", "seen"), EnumValue("Lib.Level", "high"))


def test_an_own_type_hides_an_imported_enum_of_its_name_but_not_the_values() -> None:
    robot = (
        "robot R {{ datatype object Level {{ }} component Base from Lib import Platform requirement drive needs {} }}"
    )
    assert not checked(robot.format("Base.seen = high"), lib=LIBRARY).has_errors
    (found,) = checked(robot.format("Base.seen = Level.high"), lib=LIBRARY).diagnostics
    assert found.message == "unknown name 'Level'"


def test_a_library_knows_no_enum_of_a_library_that_it_does_not_import() -> None:
    text = "robot R { component Base from Lib import Platform component W from Blind import Watcher }"
    blind = CHAIN.replace("component Chassis from Lib import Platform", "").replace("Chain", "Blind")
    found = checked(text, lib=LIBRARY, blind=blind.replace("Chassis.seen = high and Chassis.ready", "high = high"))
    assert [item.message for item in found.diagnostics] == ["unknown name 'high'"] * 2


def test_a_set_of_communications_holds_each_once() -> None:
    model = model_of("robot R { component C { incoming message m with type: none } requirement { m, m } needs true }")
    assert model.requirements[0].communications == ("m",)


@pytest.mark.parametrize(
    ("update", "leaves"),
    [
        ("value", False),
        ("value + 1", True),
        ("value + 0 - 1", True),
        ("10 - value", False),
        ("value - value", True),
        ("-value", True),
        ("-(-value)", False),
        ("0 - -value", False),
        ("value * 1", False),
        ("value * 2", True),
        ("value * -1 + 10", False),
        ("(value - 10) * (value - 10) - 90", True),
    ],
)
def test_whether_an_update_can_leave_the_range_is_computed_from_its_bounds(update: str, leaves: bool) -> None:
    found = checked(f"""robot R {{ component C {{
        outgoing message n with type: integer(0..10)
        behaviour {{ variable v: integer(0..10) on response from n do v := {update} initial marked state s {{ }} }}
    }} }}""")
    assert [item.code for item in found.diagnostics] == ["may-leave-range"] * leaves


def test_the_type_decides_between_imported_enums_of_one_name() -> None:
    model = model_of(IMPORTER.format(condition="Twin.seen = high or high = Base.seen"), lib=LIBRARY, copy=COPY)
    assert [leaf.enum for leaf in leaves(model.requirements[0].expression) if isinstance(leaf, EnumValue)] == [
        "Copy.Level",
        "Lib.Level",
    ]
    (first, _) = checked(IMPORTER.format(condition="high = high"), lib=LIBRARY, copy=COPY).diagnostics
    assert (first.code, first.fix) == ("ambiguous-name", "Compare it with a variable of its type.")


def test_a_broken_library_that_nothing_imports_is_nobodys_error() -> None:
    text = "robot R { component Base from Lib import Platform }"
    assert checked(text, lib=LIBRARY, broken="library Broken { component").diagnostics == ()


def test_what_is_read_of_a_component_whose_import_failed_is_no_error_of_its_own() -> None:
    text = """robot R {
        component Base from Nowhere import X
        component C {
            incoming message go with type: none
            behaviour { initial marked state s { transition if Base.ready goto s } }
        }
        requirement go needs Base.ready and C.s
    }"""
    (found,) = checked(text).diagnostics
    assert "unknown library" in found.message


def test_an_unknown_library_is_reported_at_every_import() -> None:
    text = (
        "robot R { component A from Nowhere import X component B from Nowhere import Y component C from Libb import Z }"
    )
    found = checked(text, lib=LIBRARY).diagnostics
    assert [item.location and item.location.column for item in found] == [28, 62, 96]
    assert "did you mean 'Lib'" in found[2].message


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(("depth", "codes"), [(150, []), (1500, ["nesting-too-deep"])])
def test_nested_types_need_no_deep_recursion(order: int, depth: int, codes: list[str]) -> None:
    types = [f"datatype object O{n} {{ next: O{n + 1} }}" for n in range(depth)]
    text = " ".join([*types, f"datatype object O{depth} {{ }}"][::order])
    found = checked(f"robot R {{ component C {{ incoming message m with type: none }} {text} }}").diagnostics
    assert sorted({item.code for item in found}) == codes


@pytest.mark.timeout(60)
def test_very_many_unknown_names_are_reported_without_comparing_all_of_them() -> None:
    number = 1000
    messages = " ".join(f"incoming message message_{n} with type: none" for n in range(number))
    requirements = " ".join(f"requirement massage_{n}x needs C.stat or C.idle{n}" for n in range(number))
    text = (
        f"robot R {{ component C {{ {messages} behaviour {{ initial marked state state_ {{ }} }} }} {requirements} }}"
    )
    found = checked(text).diagnostics
    assert len(found) == 3 * number
    assert "did you mean 'message_0'" in found[0].message


TOKENS = re.compile(r'//[^\n]*|"[^"]*"|[A-Za-z_]\w*|\d+(?:\.\d+)?|->|\.\.|:=|=>|!=|<=|>=|\S|\s+')


def kind_of(token: str) -> str:
    """Tokens of one kind can stand for each other without a syntax error, mostly."""
    if token in ("double", "string", "integer", "boolean", "none"):
        return "type"
    if token in ("request", "response", "feedback", "error", "cancel"):
        return "kind"
    if token in ("and", "or", "=", "!=", "<", ">", "+", "-", "*", "/"):
        return "operator"
    if token in ("true", "false") or token[0].isdigit():
        return "literal"
    return "name" if token.isidentifier() and token not in RESERVED_WORDS else token


@settings(max_examples=examples(40))
@given(st.sampled_from(EXAMPLE_NAMES), st.randoms(use_true_random=False))
def test_models_with_swapped_words_never_raise(name: str, random: Random) -> None:
    tokens = TOKENS.findall(example_bundle(name).main.text)
    for _ in range(random.randint(1, 5)):
        place = random.randrange(len(tokens))
        tokens[place] = random.choice([token for token in tokens if kind_of(token) == kind_of(tokens[place])])
    found = checked("".join(tokens))
    assert (found.model is None) == found.has_errors
    assert all(item.location is not None and item.fix for item in found.diagnostics)


def test_a_library_can_be_checked_by_itself() -> None:
    found = checked(LIBRARY)
    assert found.model is None
    assert not found.has_errors
    with pytest.raises(LanguageError, match="no-robot"):
        found.model_or_raise()
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
    """Return True if an expression can be written in part A at all, and in one way only."""
    match expression:
        case Unary(operator="holds"):
            return False
        case Unary(operator="-", operand=Constant(value=0)):
            return False  # `-0` is read as the number 0.
        case Constant(value=int(value)) if not isinstance(value, bool):
            return 0 <= value <= 2**31 - 1
    return all(writable(child) for child in children(expression))


@settings(max_examples=examples(50))
@given(language_conditions)
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


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("datatype object O { x: bool }", "boolean"),
        ("datatype object O { x: int }", "integer"),
        ("datatype object O { x: float64 }", "double"),
        ("datatype object O { x: boolen }", "boolean"),
        ("component C { behaviour { variable v: boolean = flase initial marked state s { } } }", "false"),
        ("datatype enum E from boolean to { vlaue -> a default -> b }", "value"),
        ("datatype enum E from boolean to { value -> a defualt -> b }", "default"),
    ],
)
def test_words_of_the_language_that_are_misspelt(text: str, meant: str) -> None:
    found = checked(f"robot R {{ {text} component Z {{ incoming message m with type: none }} }}").diagnostics
    assert any(f"'{meant}'" in item.fix for item in found if item.code == "unknown-name")


def test_a_communication_that_is_there_but_broken_is_not_unknown() -> None:
    (found,) = checked(
        "robot R { component C { incoming message m with type: zork behaviour { initial marked state s { on request to m } } }"
        " requirement m needs C.s requirement C.s disables m provide m with 1 }"
    ).diagnostics
    assert found.message == "unknown data type 'zork'"


BROKEN = """robot R {
    component A {
        incoming message go with identifier: "/a", type: none
        behaviour {
            variable n: integer(0..3)
            initial marked state idle { on request to go goto busy }
            state busy { on request to go do goto idle }
        }
    }
    requirement go needs A.nope
    requirement go needs A.n
    requirement go needs B.there and C.gone
    component B { behaviour { initial marked state there { } foo } }
    component C { behaviour { initial marked state here { } } state gone { } }
}
"""


def test_a_syntax_error_hides_no_finding_of_the_sound_parts() -> None:
    found = [(item.code, item.location.line if item.location else 0) for item in checked(BROKEN).diagnostics]
    # 'busy' leads back, in the part that is not sound; 'C.gone' may be the state of that name.
    assert found == [
        ("syntax-error", 7),
        ("unknown-name", 10),
        ("type-mismatch", 11),
        ("syntax-error", 13),
        ("syntax-error", 14),
    ]
