"""Numbers of options that a request can contain."""

from robosc.cli.output import UsageError

_MAXIMUM_SENDABLE = 2**64 - 1


def checked_number(number: int | None, option: str) -> int | None:
    """Return a number of an option, if a request can contain it.

    Raises:
        UsageError: It cannot.
    """
    if number is not None and number > _MAXIMUM_SENDABLE:
        raise UsageError(f"{option} must be at most {_MAXIMUM_SENDABLE}")
    return number
