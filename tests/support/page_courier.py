"""The courier of the page about it: rounds, a detour to whoever calls, a battery; each request waits for an answer."""

import re
from functools import cache
from pathlib import Path
from random import Random

from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from support.equivalence.scenario import Action
from support.models import bundle_of

_PAGE = (Path(__file__).parents[2] / "docs" / "courier.md").read_text(encoding="utf-8")
_LOOP, *_ADDED, _MISSION = re.findall(
    r"^```robosc file=\w+.rscd(?: add)?\n(.*?)^```$", _PAGE, flags=re.MULTILINE | re.DOTALL
)


def _text() -> str:
    lines = "".join((_LOOP.rstrip().removesuffix("}"), *_ADDED)).splitlines()
    return "\n".join([*(line for line in lines if "goal" not in line), _MISSION, "}", ""])


PAGE_COURIER = _text()
"""Text of its model, `mission.rscd` of the page."""

TOPICS = ("/door/opened", "/arrived", "/call", "/taken", "/battery/low", "/battery/full")


@cache
def page_courier_supervisor() -> Supervisor:
    """Return its supervisor, with its strategy."""
    made = make_supervisor(bundle_of(PAGE_COURIER))
    assert made.supervisor is not None, made.diagnostics
    return made.supervisor


def messages(seed: int, count: int) -> tuple[Action, ...]:
    """Return messages by chance: mostly those that it waits for."""
    dice = Random(f"page courier {seed}")
    topics = dice.choices(TOPICS, (4, 6, 2, 1, 1, 2), k=count)
    return tuple(Action("message", topic) for topic in topics)
