"""Interface that the equivalence suite asks of a target, and the run that compares a target with another.

Each target has one adapter class.
"""

from collections.abc import Iterator
from typing import Protocol

from support.equivalence.observation import Observation, Sight, difference
from support.equivalence.scenario import Action, Scenario


class Target(Protocol):
    """A controller of one robot, however it is made; a context manager around a run would end what it started.

    Attributes:
        name: Name for messages.
        sight: Extent of what it shows.
    """

    name: str
    sight: Sight

    def start(self, scenario: Scenario, awaited: Observation) -> Observation:
        """Begin in the initial state.

        Args:
            scenario: Scenario that has the settings.
            awaited: Observation of the reference: only for a target that must wait until so much has come.
        """

    def do(self, action: Action, awaited: Observation) -> Observation:
        """Let one thing happen; what it brought about."""

    def close(self) -> Observation:
        """End it; what it still said: a safe stop, if it makes one by itself, is left out."""


def compare(target: Target, scenario: Scenario, expected: list[Observation]) -> None:
    """Drive a target through a scenario, step by step.

    Args:
        target: Target to drive; it is closed at the end.
        scenario: Scenario that happens.
        expected: Observations of the reference: one for the start and one for each action.

    Raises:
        AssertionError: It differs; says which target, in which step, and what differs.
    """
    is_closed = False
    try:
        for number, (what, found, awaited) in enumerate(_run(target, scenario, expected)):
            found_difference = difference(target.name, number, what, awaited, found, target.sight)
            assert not found_difference, found_difference
        is_closed = True
        rest = target.close()
        left_over = difference(target.name, len(expected), "the end", Observation(), rest, target.sight)
        assert not left_over, left_over
    finally:
        if not is_closed:
            target.close()


def _run(
    target: Target, scenario: Scenario, expected: list[Observation]
) -> Iterator[tuple[str, Observation, Observation]]:
    yield "the start", target.start(scenario, expected[0]), expected[0]
    for action, awaited in zip(scenario.actions, expected[1:], strict=True):
        yield str(action), target.do(action, awaited), awaited
