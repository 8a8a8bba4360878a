"""The installed command `robosc-bridge`; remote commands such as `stop` start without loading the daemon."""

import sys
from typing import NoReturn


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    from robosc_bridge.terminal import commands

    if sys.argv[1:2] and sys.argv[1] in commands.NAMES:
        sys.exit(commands.main())
    if sys.argv[1:2] == ["health"]:
        # Asked again and again beside a robot that is driving.
        from robosc_bridge import health_check

        sys.exit(health_check.main())
    from robosc_bridge.main import main

    sys.exit(main())


if __name__ == "__main__":
    entry()
