"""One generated function of C does for many that are alike, as each of them did; others keep their own."""

import re
from collections import Counter
from pathlib import Path
from random import Random

import pytest

from robosc.targets import generate
from robosc.targets.code.c.alike import MANY, Sharing
from robosc.targets.code.c.layout import make_layout
from support.c99 import GCC, SANITIZERS, compare, compiled
from support.execution import unsupervised

_PART = """
    component C{0} {{
        incoming message go{0} with identifier: "/go{0}", type: double
        service ask{0} with identifier: "/ask{0}", request: none, response: integer links ask
        action move{0} with identifier: "/move{0}", request: none, response: none, feedback: double links move
        outgoing message seen{0} with identifier: "/seen{0}", type: double
        outgoing message level{0} with identifier: "/level{0}", type: Level
        behaviour {{
            variable count: integer(0..{1}) = {2}
            variable total: integer
            variable speed: double = {3}
            variable level: Level = low
            variable was_high: boolean
            on response from seen{0} do speed := value, count := if count < {1} then count + 1 else 0
            on response from level{0} do level := value, was_high := level = high
            on feedback from move{0} do speed := value + {3}
            initial marked state idle {{
                on request to go{0} goto busy
                on request to ask{0}
                on response from ask{0} do total := value - {2} goto busy
                on error from ask{0} goto idle
                on request to move{0} goto busy
            }}
            state busy {{
                transition if level = high or C{4}.count > {2} goto idle
                on request to go{0}
                on response from move{0} goto idle
                on error from move{0} do count := {2} goto idle
                on cancel to move{0} goto idle
            }}
        }}
    }}
    requirement go{0} needs C{4}.count <= {2} + 1 and not C{4}.busy
    requirement move{0} needs C{4}.level != high
    provide go{0} with C{0}.speed
"""

PARTS = MANY + 2
ODD = PARTS - 1
"""A part with another number that is no integer: whatever is alike is so apart from integers and places."""


def _text() -> str:
    parts = (
        _PART.format(number, 5 + number % 5, number % 3, 0.5, (number + 1) % PARTS)
        if number != ODD
        else _PART.format(number, 5, 1, 1.25, 0)
        for number in range(PARTS)
    )
    return (
        "robot Alike { interface ask use Ask from some_msgs interface move use Move from some_msgs "
        "datatype enum Level from double to { value > 1.0 -> high default -> low }" + "".join(parts) + "}"
    )


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
@pytest.mark.parametrize("options", [[*SANITIZERS], ["-O2"]], ids=["sanitizers", "optimized"])
def test_parts_that_are_alike_behave_as_the_reference(options: list[str], tmp_path: Path) -> None:
    supervisor = unsupervised(_text())
    lines = compare(supervisor, compiled(supervisor, tmp_path, *options), Random(2), 20, 150)
    seen = Counter(line.split()[0] if line[:3] != "log" else " ".join(line.split()[:2]) for line in lines)
    for what, count in {"log event": 500, "publish": 50, "call": 20, "goal": 20, "cancel": 2}.items():
        assert seen[what] > count, seen


def test_nearly_all_functions_of_equal_parts_are_shared() -> None:
    texts = generate(unsupervised(_text()), "c99")
    (source,) = (text for path, text in texts.items() if path.endswith("_supervisor.c"))
    shared = re.findall(r"^static \w+ (alike_\d+)\(", source, re.MULTILINE)
    own = re.findall(r"^static \w+ \w+_(?:takes|allows)_\w+\(", source, re.MULTILINE)
    assert len(shared) == len(set(shared)) > 10
    # Those of the odd part that have numbers which are no integers.
    assert 0 < len(own) < 8, own
    assert f"Does for {PARTS} events that are alike; what stands here are the words of go0.request." in source


def _functions(bodies: list[str]) -> dict[str, list[str]]:
    return {f"event{number}": [f"static int f{number}(int a)", "{", body, "}"] for number, body in enumerate(bodies)}


@pytest.mark.parametrize(
    "body",
    [
        '    return strcmp(s->text, "{n}");',
        "    return {n}.5 < a;",
        "    return 1e-{n} < a;",
        "    return UINT32_C(0x{n});",
        "    return UINT64_C({n});",
        "    return node_{n}(s);",
        "    return {n}0000000000 < a;",
    ],
)
def test_what_is_no_place_and_no_integer_of_32_bits_is_not_shared(body: str) -> None:
    functions = _functions([body.replace("{n}", str(10 + number)) for number in range(MANY)])
    assert Sharing(make_layout(unsupervised(_text()))).family(functions).rows == {}


def test_whoever_hands_the_old_state_over_is_not_shared() -> None:
    functions = _functions([f"    return any_1(&old) + old.at_C{number};" for number in range(MANY)])
    assert Sharing(make_layout(unsupervised(_text()))).family(functions).rows == {}


def test_fewer_than_many_are_not_shared() -> None:
    sharing = Sharing(make_layout(unsupervised(_text())))
    for count in (MANY - 1, MANY):
        family = sharing.family(_functions([f"    return {number};" for number in range(count)]))
        assert len(family.rows) == (count if count == MANY else 0)
        assert len(family.blocks) == (1 if count == MANY else count)


def test_functions_that_do_the_same_need_no_table() -> None:
    family = Sharing(make_layout(unsupervised(_text()))).family(_functions(["    return 0;"] * MANY))
    assert family.call("event3", "f3") == ("alike_1", ())
    assert [line for line in family.blocks[0] if "ALIKE" in line or "like)" in line] == []
