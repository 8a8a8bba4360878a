"""An element that lies outside its array is unknown, whatever its type; one that is there is converted by its rules."""

from typing import Any

import pytest

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import ControlledSystem
from support.execution import unsupervised
from support.generated import load_system

MODEL = """
robot R {
    interface i use T from p
    datatype enum Width from double to { value < 0.5 -> narrow default -> wide }
    datatype enum Word from string to { value = "x" -> danger true -> safe default -> odd }
    datatype enum Overall from Sample to { value.widths[5] = wide -> clear default -> unsure }
    datatype object Item { width: Width }
    datatype object Sample { widths: array(Width) words: array(Word) items: array(Item) flag: double }
    component S {
        outgoing message m with type: Sample links i
        outgoing message n with type: Overall links i
        behaviour {
            variable width: Width = narrow
            variable word: Word = danger
            variable inner: Width = narrow
            variable chosen: Width = narrow
            variable overall: Overall = unsure
            on response from m do
                width := value.widths[2],
                word := value.words[1],
                inner := value.items[1].width,
                chosen := if value.flag > 0.0 then wide else narrow
            on response from n do overall := value
            initial marked state s { }
        }
    }
}
"""


@pytest.fixture(params=["interpreted", "generated"])
def system(request: pytest.FixtureRequest) -> ControlledSystem:
    supervisor = unsupervised(MODEL)
    return InterpretedSystem(supervisor) if request.param == "interpreted" else load_system(supervisor)


def received(system: ControlledSystem, event: str, data: Any) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the updates that an event skips, and the variables after it."""
    skipped = system.step(event, system.read(event, data))
    assert skipped is not None
    return skipped, system.state()["S"]["variables"]


SAMPLE = {"widths": [0.1, 0.2, 0.9], "words": ["x", "y"], "items": [{"width": 0.1}, {"width": 0.9}], "flag": 1.0}
ALL = {"width": "wide", "word": "safe", "inner": "wide", "chosen": "wide"}


def test_elements_that_are_there(system: ControlledSystem) -> None:
    skipped, variables = received(system, "m.response", SAMPLE)
    assert skipped == ()
    assert variables == ALL | {"overall": "unsure"}


@pytest.mark.parametrize(
    ("change", "unknown"),
    [
        ({"widths": [0.1, 0.2]}, "width"),
        ({"widths": None}, "width"),
        ({"words": ["x"]}, "word"),
        ({"items": [{"width": 0.9}]}, "inner"),
        ({"flag": float("nan")}, "chosen"),
    ],
)
def test_what_is_unknown_leaves_its_variable(system: ControlledSystem, change: dict[str, Any], unknown: str) -> None:
    before = {"width": "narrow", "word": "danger", "inner": "narrow", "chosen": "narrow"}[unknown]
    skipped, variables = received(system, "m.response", SAMPLE | change)
    assert skipped == (f"S.{unknown}",)
    assert variables == ALL | {unknown: before, "overall": "unsure"}


def test_an_element_that_is_there_but_does_not_fit_is_converted(system: ControlledSystem) -> None:
    skipped, variables = received(system, "m.response", SAMPLE | {"widths": [0.1, 0.2, "what"], "words": ["x", None]})
    assert skipped == ()
    assert (variables["width"], variables["word"]) == ("wide", "safe")


@pytest.mark.parametrize(("widths", "value"), [([], "unsure"), ([0.9] * 6, "clear"), ([0.1] * 6, "unsure")])
def test_a_rule_about_an_absent_element_does_not_fire(
    system: ControlledSystem, widths: list[float], value: str
) -> None:
    reading = system.read("n.response", {"widths": widths})
    assert reading.enum_unknown == (not widths)
    assert received(system, "n.response", {"widths": widths})[1]["overall"] == value
