"""Parts of a model as a user writes them, for comments in generated code."""

from robosc.expressions.text import expression_text
from robosc.model.structure import ObjectValue, Provide, ProvidedValue, Requirement


def requirement_text(requirement: Requirement) -> str:
    """A requirement as a user writes it."""
    names = ", ".join(requirement.communications)
    group = f"{{{names}}}" if len(requirement.communications) != 1 else names
    words = expression_text(requirement.expression)
    return (
        f"requirement {group} needs {words}" if requirement.form == "needs" else f"requirement {words} disables {group}"
    )


def provide_text(statement: Provide) -> str:
    """A provide statement as a user writes it."""
    condition = f" if {expression_text(statement.condition)}" if statement.condition is not None else ""
    return f"provide {statement.communication} with {_value_text(statement.value)}{condition}"


def _value_text(provided: ProvidedValue) -> str:
    if isinstance(provided, ObjectValue):
        return "{ " + ", ".join(f"{name}: {_value_text(item)}" for name, item in provided.properties) + " }"
    return expression_text(provided)
