"""Entry point of the command `robosc-server`; the frequent `health` command does not import the server."""

import sys
from collections.abc import Callable
from typing import NoReturn

from robosc.cli.starting import start


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    start("robosc-server", _load, "server")


def _load() -> Callable[[], int]:
    if sys.argv[1:2] == ["health"]:
        from robosc.cli.running import guarded
        from robosc_server.operations import health_check

        return lambda: guarded("robosc-server", lambda: health_check.main(sys.argv[2:]))
    from robosc_server.main import main

    return main


if __name__ == "__main__":
    entry()
