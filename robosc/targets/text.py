"""Text of generated files: lines of any language, and parts of a model as a user writes them."""

from collections.abc import Sequence

from robosc.expressions.text import expression_text
from robosc.model.structure import Bound, Invariant, Limit, Model, ObjectValue, Provide, ProvidedValue, Requirement


def indent(lines: list[str], levels: int = 1) -> list[str]:
    """The lines, further right; empty ones stay empty."""
    return [f"{'    ' * levels}{line}" if line else "" for line in lines]


def ascii_line(text: str) -> str:
    """A text as one line of printable ASCII; everything else stands as an escape of Python."""
    return "".join(char if " " <= char <= "~" else char.encode("unicode_escape").decode("ascii") for char in text)


def printable(text: str) -> str:
    """A text for a comment or a docstring of generated code: one line, ASCII, no quotes that could end it."""
    return ascii_line(text).replace("\\", "\\\\").replace('"""', "'''")


def requirement_texts(model: Model) -> list[str]:
    """Every requirement of a model as a user writes it: on requests first, then what always or never holds."""
    return [*map(requirement_text, model.requirements), *map(_invariant_text, model.invariants)]


def requirements_chapter(model: Model) -> str:
    """The requirements as a chapter of a Markdown page, with an empty line behind it; empty where there are none."""
    texts = [printable(text) for text in requirement_texts(model)]
    return "\n".join(["## Requirements of the model", "", "```", *texts, "```", "", ""]) if texts else ""


def requirement_text(requirement: Requirement) -> str:
    """A requirement as a user writes it."""
    names = ", ".join(requirement.communications)
    group = f"{{{names}}}" if len(requirement.communications) != 1 else names
    words = expression_text(requirement.expression)
    return (
        f"requirement {group} needs {words}" if requirement.form == "needs" else f"requirement {words} disables {group}"
    )


def _invariant_text(invariant: Invariant) -> str:
    return f"requirement {'never' if invariant.is_never else 'always'} {expression_text(invariant.expression)}"


def provide_text(statement: Provide) -> str:
    """A provide statement as a user writes it."""
    condition = f" if {expression_text(statement.condition)}" if statement.condition is not None else ""
    return f"provide {statement.communication} with {_value_text(statement.value)}{condition}"


def limit_text(statement: Limit) -> str:
    """A limit as a user writes it."""
    condition = f" if {expression_text(statement.condition)}" if statement.condition is not None else ""
    return f"limit {statement.communication} to {_bounds_text(statement.bounds)}{condition}"


def _bounds_text(bounds: Sequence[Bound], depth: int = 0) -> str:
    """Return the ranges of the properties below the first ones of their paths."""
    if any(len(bound.path) == depth for bound in bounds):
        return f"{bounds[0].low}..{bounds[0].high}"
    parts: dict[str, list[Bound]] = {}
    for bound in bounds:
        parts.setdefault(bound.path[depth], []).append(bound)
    return "{ " + ", ".join(f"{name}: {_bounds_text(part, depth + 1)}" for name, part in parts.items()) + " }"


def _value_text(provided: ProvidedValue) -> str:
    if isinstance(provided, ObjectValue):
        return "{ " + ", ".join(f"{name}: {_value_text(item)}" for name, item in provided.properties) + " }"
    return expression_text(provided)
