"""The installed command `robosc-bridge`; remote commands such as `stop` start without loading the daemon."""

import sys
from collections.abc import Callable
from typing import NoReturn

from robosc.cli.starting import start


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    start("robosc-bridge", _load, "bridge")


def _load() -> Callable[[], int]:
    from robosc_bridge.terminal import commands

    if sys.argv[1:2] and sys.argv[1] in commands.NAMES:
        return commands.main
    if sys.argv[1:2] == ["ros2"]:
        from robosc_bridge.ros2 import command

        return command.main
    if sys.argv[1:2] == ["health"]:
        # Asked again and again beside a robot that is driving.
        from robosc_bridge import health_check

        return health_check.main
    from robosc_bridge.main import main

    return main


if __name__ == "__main__":
    entry()
