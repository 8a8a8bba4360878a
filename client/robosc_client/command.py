"""The installed command `robosc-client`: answers Ctrl-C at any moment, also while gRPC is being loaded or closed."""

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
    # gRPC's own threads may wait for ever when they are interrupted twice; there is nothing left to finish.
    sys.stderr.flush()
    os._exit(_INTERRUPTED)


if __name__ == "__main__":
    entry()
