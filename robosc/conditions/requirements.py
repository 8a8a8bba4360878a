"""Requirements as the language writes them."""

from collections.abc import Collection

from robosc.expressions.text import expression_text
from robosc.model.structure import Invariant, Requirement, RequirementForm


def requirement_text(item: Requirement, components: Collection[str]) -> str:
    """A requirement on requests, as the language writes it.

    Args:
        item: The requirement.
        components: Names of all components.
    """
    names = item.communications
    shown = names[0] if len(names) == 1 else f"{{{', '.join(names)}}}"
    expression = expression_text(item.expression, components)
    if item.form is RequirementForm.NEEDS:
        return f"requirement {shown} needs {expression}"
    return f"requirement {expression} disables {shown}"


def invariant_text(item: Invariant, components: Collection[str]) -> str:
    """A requirement that must always (or never) hold, as the language writes it; arguments as of `requirement_text`."""
    return f"requirement {'never' if item.is_never else 'always'} {expression_text(item.expression, components)}"
