"""Entry point of the command `robosc`."""

from collections.abc import Callable
from typing import NoReturn

from robosc.cli.starting import start


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    start("robosc", _load)


def _load() -> Callable[[], int]:
    from robosc.cli.main import main

    return main


if __name__ == "__main__":
    entry()
