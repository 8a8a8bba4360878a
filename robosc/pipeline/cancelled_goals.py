"""Goals in a manual run that an executor would have asked to be cancelled, and that have not ended.

The executor asks when a requirement that held in a stable state since the request holds no longer. That ends nothing:
the goal ends as its server ends it, as cancelled or otherwise.
"""

from collections.abc import Mapping

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.falling_conditions import have_fallen, held_ever
from robosc.model.structure import CommunicationKind, Model

WatchedGoals = Mapping[str, tuple[tuple[bool, ...], bool]]
"""For each action that executes a goal: which of its requirements held in a stable state since the request, and True if
the cancel was asked for."""

NONE: WatchedGoals = {}


class GoalWatch:
    """Watch on the goals of a system.

    Args:
        system: The system.
        model: Its model.
    """

    def __init__(self, system: InterpretedSystem, model: Model) -> None:
        self._system = system
        self._requirements = {
            item.name: len(model.requirements_on(item.name))
            for item in model.communications
            if item.kind is CommunicationKind.ACTION
        }

    def after(self, before: WatchedGoals) -> WatchedGoals:
        """Return what is known of the goals in the system's state.

        Args:
            before: Knowledge in the state before it.
        """
        is_stable = self._system.enabled_silent() is None
        found = {}
        for name, count in self._requirements.items():
            if count and self._system.location(name) == "executing":
                held, is_asked = before.get(name, ((False,) * count, False))
                holds = self._system.requirements(name)
                is_asked = is_asked or have_fallen(held, holds)
                found[name] = (held_ever(held, holds) if is_stable else held, is_asked)
        return found


def cancelling(goals: WatchedGoals) -> tuple[str, ...]:
    """Return the actions whose goal is being cancelled, in the model's order."""
    return tuple(name for name, (_, is_asked) in goals.items() if is_asked)
