"""Plain automata of a system, and the graph of a controlled system as one plain automaton."""

from robosc.automata import System
from robosc.errors import UnsupportedModelError
from robosc.expressions import TRUE


def require_plain(system: System) -> None:
    """Do nothing if a system consists of automata without variables, guards and conditions.

    Raises:
        UnsupportedModelError: It does not.
    """
    has_more = (
        system.inputs or system.conditions or system.invariants or system.plant_conditions or system.plant_invariants
    )
    if has_more or (system.initial, system.marker) != (TRUE, TRUE):
        raise UnsupportedModelError(f"{system.name} has conditions beside its automata, which no plain automata have")
    for automaton in system.automata:
        has_guards = any(edge.guard != TRUE or edge.updates for edge in automaton.edges)
        if automaton.variables or automaton.monitors or has_guards:
            raise UnsupportedModelError(
                f"{automaton.name} has variables, guards or monitors, and is not a plain automaton"
            )
