"""Extended finite automata of a model and their explicit meaning.

Between the checked model and synthesis: `to_automata` lowers a model, `Semantics` says what the result
means, one state at a time.
"""

from robosc.automata.check import CheckedSystem, SystemPlaces, check_system
from robosc.automata.environment import EnvironmentVariable, environment_variable
from robosc.automata.executable import ExecutableSystem
from robosc.automata.lowering import to_automata
from robosc.automata.semantics import Semantics
from robosc.automata.structure import (
    Assignment,
    Automaton,
    DiscreteVariable,
    Edge,
    Event,
    EventCondition,
    InputVariable,
    Role,
    System,
    as_controlled,
    composed,
    disables,
)

__all__ = [
    "Assignment",
    "Automaton",
    "CheckedSystem",
    "DiscreteVariable",
    "Edge",
    "EnvironmentVariable",
    "Event",
    "EventCondition",
    "ExecutableSystem",
    "InputVariable",
    "Role",
    "Semantics",
    "System",
    "SystemPlaces",
    "as_controlled",
    "check_system",
    "composed",
    "disables",
    "environment_variable",
    "to_automata",
]
