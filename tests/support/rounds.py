"""A robot with rounds that it makes while it is asked to, and a detour to whoever calls."""

from functools import cache

from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from support.models import bundle_of

_PLACES = ("kitchen", "office", "hall")

ROUNDS = "\n".join(
    [
        "robot Rounds {",
        "    component Base {",
        *(f'        incoming message to_{place} with identifier: "/to_{place}", type: none' for place in _PLACES),
        "        behaviour {",
        *(
            f"            {'initial ' * (here == 'dock')}marked state {here} {{ "
            + " ".join(f"on request to to_{place} goto {place}" for place in _PLACES if place != here)
            + " }"
            for here in ("dock", *_PLACES)
        ),
        "        }",
        "    }",
        """    component Caller {
        outgoing message call with identifier: "/call", type: none
        behaviour {
            initial marked state quiet { on response from call goto waiting }
            marked state waiting { on request to to_hall goto quiet }
        }
    }
    component Operator {
        outgoing message begin with identifier: "/begin", type: none
        outgoing message end with identifier: "/end", type: none
        behaviour {
            initial marked state idle { on response from begin goto working }
            marked state working { on response from end goto idle }
        }
    }
    mission rounds while Operator.working {
        visit Base.kitchen then Base.office
        on Caller.waiting from anywhere visit Base.hall
    }
}
""",
    ]
)
"""Its text: each place is reached by one request, which is taken at once."""


_LONG_DETOUR = ROUNDS.replace("visit Base.hall", "visit Base.hall then Base.kitchen")


def _supervisor_of(text: str) -> Supervisor:
    made = make_supervisor(bundle_of(text))
    assert made.supervisor is not None, made.diagnostics
    return made.supervisor


@cache
def rounds_supervisor() -> Supervisor:
    """Return its supervisor, with its strategy."""
    return _supervisor_of(ROUNDS)


@cache
def long_detour_supervisor() -> Supervisor:
    """Return the supervisor of a robot whose detour has two visits."""
    return _supervisor_of(_LONG_DETOUR)
