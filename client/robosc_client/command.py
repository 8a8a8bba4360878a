"""Entry point of the command `robosc-client`."""

from collections.abc import Callable
from typing import NoReturn

from robosc.cli.starting import start


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    start("robosc-client", _load, "client")


def _load() -> Callable[[], int]:
    from robosc_client.main import main

    return main


if __name__ == "__main__":
    entry()
