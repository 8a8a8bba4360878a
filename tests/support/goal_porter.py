"""The porter of the page about goals, whose door may not open: a robot with two goals and two assumptions."""

import re
from functools import cache
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from support.models import bundle_of

PAGE = (Path(__file__).parents[2] / "docs" / "strategies.md").read_text(encoding="utf-8")
LOOP, PORTER, *_ = re.findall(r"^```robosc file=\w+.rscd\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


@cache
def porter_supervisor() -> Supervisor:
    """Return the supervisor of the porter, with its strategy."""
    made = make_supervisor(bundle_of(PORTER))
    assert made.supervisor is not None, made.diagnostics
    return made.supervisor
