"""Entry point of the command `robosc-client`, which handles Ctrl-C even while gRPC is loaded or closed."""

import os
import sys
from typing import NoReturn

_INTERRUPTED = 130


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    try:
        from robosc_client.main import main

        status = main()
        if status != _INTERRUPTED:
            sys.exit(status)
    except KeyboardInterrupt:
        sys.stderr.write("robosc-client: interrupted\n")
    # Threads of gRPC may wait for ever after a second interrupt; nothing else is left to do.
    sys.stderr.flush()
    os._exit(_INTERRUPTED)


if __name__ == "__main__":
    entry()
