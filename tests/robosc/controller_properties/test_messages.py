"""Events of one middleware message: a fault that needs them to disagree is none, any other one is."""

import re

import pytest

from robosc.automata import ExecutableSystem, to_automata
from robosc.controller_properties import check_controller
from robosc.model.structure import Deployment
from robosc.synthesis import synthesize
from support.models import model_of

ROBOT = """robot R {
    interface sample use Sample from sensing
    datatype object Sample {
        x: double y: double on_: boolean name: string n: integer w: integer(0..9) part: array(double)
    }
    datatype enum First from %(first_type)s to { %(first)s -> first_yes default -> first_no }
    datatype enum Second from %(second_type)s to { %(second)s -> second_yes default -> second_no }
    component Eye {
        outgoing message one with identifier: "/%(topic)s", type: First %(links)s
        outgoing message two with identifier: "/sample", type: Second %(links)s
        behaviour {
            variable a: First
            variable b: Second
            on response from one do a := value
            on response from two do b := value
            initial marked state s { }
        }
    }
    component Spin { behaviour {
        initial marked state p { transition if Eye.a = first_yes and Eye.b = second_yes goto q }
        marked state q { transition if Eye.a = first_yes and Eye.b = second_yes goto p }
    } }
}"""
"""A robot that spins for ever once both enums are `yes`."""


def spins(first: str, second: str, *types: str, topic: str = "sample") -> bool:
    """Return True if a livelock is reported."""
    first_type, second_type = types if len(types) == 2 else types * 2
    links = "links sample" if first_type == "Sample" else ""
    values = {"first": first, "second": second, "first_type": first_type, "second_type": second_type}
    model = model_of(ROBOT % {**values, "topic": topic, "links": links})
    added = synthesize(to_automata(model, Deployment.CONTROLLER)).added
    found = check_controller(ExecutableSystem(model, Deployment.CONTROLLER), added, is_nonblocking=True)
    assert found.finite_response in ("passed", "failed")
    return found.finite_response == "failed"


@pytest.mark.parametrize(
    ("first", "second", "can_be"),
    [
        ("value < 1.0", "value > 2.0", False),
        ("value < 2.0", "value > 1.0", True),
        ("value < 1.0", "value >= 1.0", False),
        ("value <= 1.0", "value >= 1.0", True),
        ("value < 1.0", "1.0 < value", False),
        ("value < 1.0", "!(value < 1.0)", False),
        ("value = 1.0", "value != 1.0", False),
        ("value > 1.0 and value < 2.0", "value <= 1.0 or value >= 2.0", False),
        ("value > 1.0 and value < 2.0", "value <= 1.0 or value > 1.5", True),
        # Subterms that are not analysed are equal where they are written alike, else they can be anything.
        ("value * 2.0 < 1.0", "!(value * 2.0 < 1.0)", False),
        ("value * 2.0 < 1.0", "value * 2.0 > 3.0", False),
        ("value * 2.0 < 1.0", "value > 2.0", True),
    ],
)
def test_a_number(first: str, second: str, can_be: bool) -> None:
    assert spins(first, second, "double") is can_be
    # Each of two messages brings its own data.
    assert spins(first, second, "double", topic="other")


@pytest.mark.parametrize(
    ("first", "second", "types", "can_be"),
    [
        ("value > 7", "value < 5", ("integer(0..10)", "integer(0..5)"), False),
        ("value > 7", "value > 4", ("integer(0..10)", "integer(0..5)"), True),
        ("value > 3", "value < 4", ("integer",), False),
        ("value > 2", "value < 4", ("integer",), True),
        ("value > 2.5", "value < 3", ("integer",), False),
        # Values out of range are clamped to it: 1 is 4 for the second one.
        ("value < 3", "value > 3", ("integer(0..10)", "integer(4..9)"), True),
        ("value < 3", "value > 3", ("integer(0..10)", "integer(0..9)"), False),
        ("value", "!value", ("boolean",), False),
        ("value", "value = true", ("boolean",), True),
        ("value = 'a'", "value = 'b'", ("string",), False),
        ("value = 'a'", "value != 'b'", ("string",), True),
        # Different middleware types: whatever comes, they have no field in common.
        ("value > 3.0", "value < 3", ("double", "integer"), True),
    ],
)
def test_other_types(first: str, second: str, types: tuple[str, ...], can_be: bool) -> None:
    assert spins(first, second, *types) is can_be


@pytest.mark.parametrize(
    ("first", "second", "can_be"),
    [
        ("value.x < 1.0", "value.x > 2.0", False),
        ("value.x < 1.0", "value.y > 2.0", True),
        ("value.x < 1.0 and value.y > 1.0", "value.x < 1.0 and value.y < 1.0", False),
        ("value.on_", "!value.on_ and value.x < 1.0", False),
        ("value.name = 'a'", "value.name = 'b'", False),
        ("min(value.part[0..5]) < 1.0", "min(value.part[0..5]) > 2.0", False),
        ("min(value.part[0..5]) < 1.0", "min(value.part[0..6]) > 2.0", True),
        ("value.part[0] < 1.0", "value.part[0] > 2.0", False),
        ("any(e in value.part: e > 1.0)", "!any(e in value.part: e > 1.0)", False),
        ("if value.on_ then value.x < 1.0 else value.y < 1.0", "value.on_ and value.x > 1.0", False),
        ("if value.on_ then value.x < 1.0 else value.y < 1.0", "!value.on_ and value.x > 1.0", True),
    ],
)
def test_properties_of_an_object(first: str, second: str, can_be: bool) -> None:
    assert spins(first, second, "Sample") is can_be


@pytest.mark.parametrize(
    ("field", "types", "can_be"),
    [
        # Beyond 32 bits it is unknown, so that neither rule is true and both enums have their default.
        ("value.n", "Sample", True),
        ("value.w", "Sample", False),
        ("value", "integer", False),
    ],
)
def test_an_integer_that_may_be_too_large(field: str, types: str, can_be: bool) -> None:
    swapped = {"first_yes": "first_no", "first_no": "first_yes", "second_yes": "second_no", "second_no": "second_yes"}
    enums, rest = ROBOT.split("component Eye", 1)
    enums = re.sub("|".join(swapped), lambda found: swapped[found[0]], enums)
    values = {"first": f"{field} < 5", "second": f"{field} >= 5", "first_type": types, "second_type": types}
    text = f"{enums}component Eye{rest}" % {
        **values,
        "topic": "sample",
        "links": "links sample" if types == "Sample" else "",
    }
    model = model_of(
        text.replace("variable a: First", "variable a: First = first_no").replace(
            "variable b: Second", "variable b: Second = second_no"
        )
    )
    added = synthesize(to_automata(model, Deployment.CONTROLLER)).added
    found = check_controller(ExecutableSystem(model, Deployment.CONTROLLER), added, is_nonblocking=True)
    assert found.finite_response == ("failed" if can_be else "passed")


@pytest.mark.parametrize(("limit", "can_be"), [(2, False), (1, True)])
def test_a_field_that_is_taken_as_it_is(limit: int, can_be: bool) -> None:
    """A number goes into a variable, and an enum is made of it."""
    model = model_of(f"""robot R {{
        datatype enum Size from integer(0..3) to {{ value > {limit} -> large default -> small }}
        component Eye {{
            outgoing message n with identifier: "/n", type: integer(0..3)
            outgoing message size with identifier: "/n", type: Size
            behaviour {{
                variable v: integer(0..3)
                variable s: Size
                on response from n do v := value
                on response from size do s := value
                initial marked state there {{ }}
            }}
        }}
        component Spin {{ behaviour {{
            initial marked state p {{ transition if Eye.v = 2 and Eye.s = large goto q }}
            marked state q {{ transition if Eye.v = 2 and Eye.s = large goto p }}
        }} }}
    }}""")
    added = synthesize(to_automata(model, Deployment.CONTROLLER)).added
    found = check_controller(ExecutableSystem(model, Deployment.CONTROLLER), added, is_nonblocking=True)
    assert (found.finite_response == "failed") is can_be
