"""Supervisors of systems of automata, through the whole pipeline."""

import robosc
from robosc.automata import System


def supervised(automata: System) -> robosc.SystemSupervisor:
    """Return the supervisor of a system that has one."""
    supervisor = robosc.synthesize(automata).supervisor
    assert supervisor is not None
    return supervisor
