"""Entry point of the command `robosc-server`; the frequent `health` command does not import the server."""

import sys
from typing import NoReturn


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    if sys.argv[1:2] == ["health"]:
        from robosc.cli.running import guarded
        from robosc_server import health_check

        sys.exit(guarded("robosc-server", lambda: health_check.main(sys.argv[2:])))
    from robosc_server.main import main

    sys.exit(main())


if __name__ == "__main__":
    entry()
