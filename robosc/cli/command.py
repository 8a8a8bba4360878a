"""Entry point of the command `robosc`."""

import gc
import sys
from collections.abc import Callable
from typing import NoReturn

from robosc.cli.starting import start

_OBJECTS = 200_000
"""Objects that are made before Python looks for unused cycles of them: more than small models need."""


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    # A command lives shortly and makes much that stays: to look for cycles after every 700 objects takes a tenth of it.
    gc.set_threshold(_OBJECTS)
    start("robosc", _load)


def _load() -> Callable[[], int]:
    _load_msgspec()
    from robosc.cli.main import main

    # Modules stay: no search for cycles is to look at them.
    gc.freeze()
    return lambda: _at_its_end(main)


def _load_msgspec() -> None:
    """Load msgspec without typing_extensions, which it would take hints of types from that Python itself has by now.

    That package and what it needs take half as long as Python's own start.
    """
    is_hidden = "typing_extensions" not in sys.modules
    if is_hidden:
        # None makes Python take the module for missing.
        sys.modules["typing_extensions"] = None  # type: ignore[assignment]
    try:
        import msgspec  # noqa: F401
    finally:
        if is_hidden:
            del sys.modules["typing_extensions"]


def _at_its_end(main: Callable[[], int]) -> int:
    """Return the status of a command; at its end Python looks for no cycles: the system takes back all memory."""
    try:
        return main()
    finally:
        gc.freeze()


if __name__ == "__main__":
    entry()
