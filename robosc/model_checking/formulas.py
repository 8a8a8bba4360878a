"""Formulas of computation tree logic over the states of a controlled system.

Syntax: E. M. Clarke, E. A. Emerson and A. P. Sistla, "Automatic verification of finite-state concurrent systems using
temporal logic specifications", ACM TOPLAS 8(2), 1986, pp. 244-263, sec. 2. Atoms are RoboSC conditions, which hold
where they are true (not where they are false or unknown), and whether an event can happen.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from robosc.expressions import Expression
from robosc.expressions.text import expression_text
from robosc.source import Location


@dataclass(frozen=True, slots=True)
class Condition:
    """States where a condition over locations and synthesis variables is true."""

    expression: Expression


@dataclass(frozen=True, slots=True)
class Enabled:
    """States where the controlled system can do an event."""

    event: str


@dataclass(frozen=True, slots=True)
class Not:
    """States where a formula does not hold."""

    operand: "Formula"


Junction = Literal["and", "or"]


@dataclass(frozen=True, slots=True)
class Joined:
    """States where both, or at least one, of two formulas hold."""

    operator: Junction
    left: "Formula"
    right: "Formula"


Quantifier = Literal["A", "E"]
"""Quantifier of runs: A for all runs from here on, E for some run."""


@dataclass(frozen=True, slots=True)
class Next:
    """After the next step."""

    quantifier: Quantifier
    operand: "Formula"


@dataclass(frozen=True, slots=True)
class Finally:
    """Now or some time later."""

    quantifier: Quantifier
    operand: "Formula"


@dataclass(frozen=True, slots=True)
class Globally:
    """Now and ever after."""

    quantifier: Quantifier
    operand: "Formula"


@dataclass(frozen=True, slots=True)
class Until:
    """`left` from now on until `right` holds, which happens."""

    quantifier: Quantifier
    left: "Formula"
    right: "Formula"


Temporal = Next | Finally | Globally | Until

Formula = Condition | Enabled | Not | Joined | Temporal


@dataclass(frozen=True, slots=True)
class Property:
    """Claim about the initial state.

    Attributes:
        name: Name that the author gives it; empty if it has no name.
        text: The formula as written.
        location: Place of the formula.
        formula: The claim.
    """

    name: str
    text: str
    location: Location
    formula: Formula


def formula_text(formula: Formula, components: Collection[str]) -> str:
    """A formula in the language of properties, with parentheses around whatever is no single operand.

    Args:
        formula: The formula.
        components: Names of all components.
    """
    match formula:
        case Condition(expression=expression):
            return expression_text(expression, components)
        case Enabled(event=event):
            return f"enabled({event})"
        case Not(operand=operand):
            return f"!{_operand(operand, components)}"
        case Joined(operator=operator, left=left, right=right):
            return f"{_operand(left, components)} {operator} {_operand(right, components)}"
        case Next(quantifier=quantifier, operand=operand):
            return f"{quantifier}X {_operand(operand, components)}"
        case Finally(quantifier=quantifier, operand=operand):
            return f"{quantifier}F {_operand(operand, components)}"
        case Globally(quantifier=quantifier, operand=operand):
            return f"{quantifier}G {_operand(operand, components)}"
        case Until(quantifier=quantifier, left=left, right=right):
            return f"{quantifier}[{formula_text(left, components)} U {formula_text(right, components)}]"


def _operand(formula: Formula, components: Collection[str]) -> str:
    text = formula_text(formula, components)
    is_single = isinstance(formula, Enabled | Not | Temporal) or (isinstance(formula, Condition) and " " not in text)
    return text if is_single else f"({text})"
