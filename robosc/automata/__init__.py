"""Extended finite automata of a model and their explicit meaning.

Between the checked model and synthesis: `to_automata` lowers a model, `Semantics` says what the result
means, one state at a time.
"""

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
    System,
)

__all__ = [
    "Assignment",
    "Automaton",
    "DiscreteVariable",
    "Edge",
    "Event",
    "EventCondition",
    "InputVariable",
    "Semantics",
    "System",
    "to_automata",
]
