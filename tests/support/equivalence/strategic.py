"""Robot of the page about goals: a porter that opens its door only if somebody calls, and runs of it for nodes."""

import re
from functools import cache
from pathlib import Path
from random import Random

from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from support.equivalence.random_scenarios import node_settings
from support.equivalence.scenario import Action, Scenario
from support.models import bundle_of

PAGE = (Path(__file__).parents[3] / "docs" / "strategies.md").read_text(encoding="utf-8")
LOOP, PORTER = re.findall(r"^```robosc file=\w+.rscd\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)

CALL, OPENED, CLOSED = "/call", "/door/opened", "/door/closed"

ERRANDS = (
    # Nobody calls.
    *((OPENED, ""), (CLOSED, ""), (CLOSED, "")),
    # A call, and another one before the door is open; at last it is shut again.
    *((CALL, "open"), (CLOSED, ""), (CALL, ""), (OPENED, "enter"), (OPENED, "leave"), (CLOSED, "close")),
    *((OPENED, ""), (CLOSED, ""), (CLOSED, "")),
    # A call while the door is being shut: it is answered once that is done.
    *((CALL, "open"), (OPENED, "enter"), (CLOSED, "leave"), (CLOSED, "close"), (CALL, ""), (CLOSED, "open")),
    *((OPENED, "enter"), (CLOSED, "leave"), (OPENED, "close"), (CLOSED, ""), (OPENED, "")),
)
"""Messages that come to the porter, each with what it requests then."""


@cache
def porter() -> Supervisor:
    """The porter's supervisor."""
    made = make_supervisor(bundle_of(PORTER))
    assert made.supervisor is not None and made.supervisor.strategy is not None, made.reason
    return made.supervisor


def porter_run(policy: str | None = None, errands: int = 60) -> Scenario:
    """A run of the porter: the errands, and as many messages by chance; without a policy, under the node's own."""
    settings = node_settings(porter().model, policy)
    dice = Random(errands)
    by_chance = (dice.choice((CALL, OPENED, OPENED, CLOSED, CLOSED)) for _ in range(errands))
    topics = (*(topic for topic, _ in ERRANDS), *by_chance)
    return Scenario(tuple(Action("message", topic) for topic in topics), settings)
