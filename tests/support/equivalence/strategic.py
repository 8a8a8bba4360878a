"""Runs of the porter of the page about goals, for nodes."""

from random import Random

from support.equivalence.random_scenarios import node_settings
from support.equivalence.scenario import Action, Scenario
from support.goal_porter import porter_supervisor

CALL, OPENED, CLOSED = "/call", "/door/opened", "/door/closed"

ERRANDS = (
    # No call comes.
    *((OPENED, ""), (CLOSED, ""), (CLOSED, "")),
    # A call, and another one before the door is open; at last it is shut again.
    *((CALL, "open"), (CLOSED, ""), (CALL, ""), (OPENED, "enter"), (OPENED, "leave"), (CLOSED, "close")),
    *((OPENED, ""), (CLOSED, ""), (CLOSED, "")),
    # A call while the door is being shut: it is answered once that is done.
    *((CALL, "open"), (OPENED, "enter"), (CLOSED, "leave"), (CLOSED, "close"), (CALL, ""), (CLOSED, "open")),
    *((OPENED, "enter"), (CLOSED, "leave"), (OPENED, "close"), (CLOSED, ""), (OPENED, "")),
)
"""Messages that come to the porter, each with what it requests then."""


def porter_run(policy: str | None = None, errands: int = 60) -> Scenario:
    """A run of the porter: the errands, and as many messages by chance; without a policy, under the node's own."""
    settings = node_settings(porter_supervisor().model, policy)
    dice = Random(errands)
    by_chance = (dice.choice((CALL, OPENED, OPENED, CLOSED, CLOSED)) for _ in range(errands))
    topics = (*(topic for topic, _ in ERRANDS), *by_chance)
    return Scenario(tuple(Action("message", topic) for topic in topics), settings)
