"""Time of a control cycle and of an event: every form of a controller, without and with middleware, in one table."""

from execution import attempts, middleware, without
from figures import text_table

_HEADER = ["microseconds", "mean", "min", "max", "s.d.", "median", "paper: mean/min/max/s.d.", "aim (mean)"]


def table() -> str:
    """The table of cycles and events, then nanoseconds of generated C."""
    rows = [*without.rows(), *middleware.rows()]
    return text_table("Execution, 3 x 1000 cycles", _HEADER, rows) + "\n\n" + attempts.table()
