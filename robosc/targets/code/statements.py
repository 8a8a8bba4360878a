"""Statements of generated code: values that contain typed expressions, printed for each language in its own way.

A generator builds statements, asks them which variables they read, and prints them at the end, as with expressions.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from robosc.targets.code.expressions import Code


class Comment(NamedTuple):
    """Words for a reader of the code; empty ones are left out."""

    words: str


class Let(NamedTuple):
    """Declaration of a local variable.

    Attributes:
        place: The variable.
        value: Its value.
        type: Its type, for a language that declares types, if the sort of the value does not determine it.
    """

    place: Code
    value: Code
    type: str = ""


class Assign(NamedTuple):
    """Assignment to a place; with an operator such as `+`, of what the place holds and the value."""

    place: Code
    value: Code
    operator: str = ""


class Do(NamedTuple):
    """An expression that is worked out for its effect."""

    code: Code


class Return(NamedTuple):
    """End of the function, with its result."""

    value: Code


class If(NamedTuple):
    """The statements of the first branch whose condition holds, else the others."""

    branches: Sequence[tuple[Code, "Block"]]
    otherwise: "Block" = ()


Statement = Comment | Let | Assign | Do | Return | If
Block = Sequence[Statement]


def when(condition: Code, *body: Statement) -> If:
    """Statements that are executed where a condition holds."""
    return If([(condition, body)])


def codes(block: Block) -> Iterator[Code]:
    """All expressions of statements, and the places that they write."""
    for item in block:
        match item:
            case Comment():
                pass
            case Let(place, value) | Assign(place, value):
                yield from (place, value)
            case Do(code) | Return(code):
                yield code
            case If(branches, otherwise):
                for condition, body in branches:
                    yield condition
                    yield from codes(body)
                yield from codes(otherwise)
