"""Random formulas of computation tree logic over a system."""

from random import Random

from robosc.automata import System
from robosc.automata.state import subject_domain, subject_type, subjects
from robosc.expressions import (
    Binary,
    BooleanType,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.model_checking.formulas import (
    Condition,
    Enabled,
    Finally,
    Formula,
    Globally,
    Joined,
    Next,
    Not,
    Quantifier,
    Until,
)


def random_formula(system: System, random: Random, depth: int = 3) -> Formula:
    """A formula with operators nested up to `depth` deep; every operator occurs."""
    if depth == 0 or random.random() < 0.1:
        return Condition(_atom(system, random)) if random.random() < 0.8 else _enabled(system, random)

    def inner() -> Formula:
        return random_formula(system, random, depth - 1)

    quantifier: Quantifier = random.choice(("A", "E"))
    shape = random.randrange(8)
    if shape < 2:
        return Finally(quantifier, inner())
    if shape < 4:
        return Globally(quantifier, inner())
    if shape == 4:
        return Next(quantifier, inner())
    if shape == 5:
        return Until(quantifier, inner(), inner())
    return Not(inner()) if shape == 6 else Joined(random.choice(("and", "or")), inner(), inner())


def _enabled(system: System, random: Random) -> Formula:
    return Enabled(random.choice(system.events).name)


def _atom(system: System, random: Random) -> Expression:
    subject = random.choice(subjects(system))
    value = random.choice(tuple(subject_domain(system, subject)))
    if subject.variable is None:
        inside = StateTest(subject.automaton, str(value))
        return inside if random.random() < 0.6 else Unary("not", inside)
    read = VariableRead(subject.automaton, subject.variable)
    match subject_type(system, subject):
        case BooleanType():
            return read
        case EnumType(name=name):
            return Binary(random.choice(("=", "!=")), read, EnumValue(name, str(value)))
        case IntegerType():
            # Unknown where the variable is 0: such an atom does not hold there, nor does its negation.
            side = Binary("/", Constant(1), read) if random.random() < 0.3 else read
            return Binary(random.choice(("=", "<", ">=")), side, Constant(value))
    raise AssertionError(subject)
