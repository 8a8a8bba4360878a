"""Errors of a database."""

from robosc_server.failures import RefusedError
from robosc_server.tasks.task import Reason

_RETRY_S = 2.0


class StoreError(Exception):
    """The database cannot be opened; one sentence for the operator."""


class StoreUnavailableError(RefusedError):
    """The database is away, full or too slow now; what was asked for may be tried again.

    Whether a change that was under way is kept is not known then.
    """

    def __init__(self) -> None:
        super().__init__(
            Reason.STORE_UNAVAILABLE, "the database is unavailable; try again later", retry_after_s=_RETRY_S
        )
