"""Entry point of the command `robosc`."""

import gc
from collections.abc import Callable
from typing import NoReturn

from robosc.cli.starting import start

_OBJECTS = 50_000
"""Objects that are made before Python looks for unused cycles of them."""


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    # A command lives shortly and makes much that stays: to look for cycles after every 700 objects takes a tenth of it.
    gc.set_threshold(_OBJECTS)
    start("robosc", _load)


def _load() -> Callable[[], int]:
    from robosc.cli.main import main

    return main


if __name__ == "__main__":
    entry()
