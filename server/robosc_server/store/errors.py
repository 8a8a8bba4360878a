"""Errors of a database."""

from robosc_server.tasks.task import Reason, RefusedError

_RETRY_S = 2.0


class StoreError(Exception):
    """The database cannot be opened; one sentence for the operator."""


class StoreUnavailableError(RefusedError):
    """The database is unavailable, full or too slow; the operation may be retried.

    It is unknown whether a change that was running has been stored.
    """

    def __init__(self) -> None:
        super().__init__(
            Reason.STORE_UNAVAILABLE, "the database is unavailable; try again later", retry_after_s=_RETRY_S
        )
