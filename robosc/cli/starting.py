"""Start of an installed command: Ctrl-C ends it with one line at any time, even while it is imported or closed."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable
from typing import NoReturn

INTERRUPTED = 130
"""Exit status after Ctrl-C, as of a shell."""


def start(program: str, load: Callable[[], Callable[[], int]]) -> NoReturn:
    """Run a command and leave with its exit status.

    Args:
        program: Name of the command.
        load: Function that imports the command and returns its `main`.
    """

    def leave(*_: object) -> NoReturn:
        # Not by an exception: an import that is interrupted may swallow it, and threads of gRPC may wait for ever.
        with contextlib.suppress(OSError):
            os.write(2, f"{program}: interrupted\n".encode())
        os._exit(INTERRUPTED)

    # A shell starts what it runs in the background with SIGINT ignored: that stays.
    is_heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_heard:
        signal.signal(signal.SIGINT, leave)
    main = load()
    try:
        if is_heard:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        status = main()
    except KeyboardInterrupt:
        leave()
    finally:
        if is_heard:
            signal.signal(signal.SIGINT, leave)
    if status == INTERRUPTED:
        # The command has told it.
        with contextlib.suppress(AttributeError, OSError, ValueError):
            sys.stdout.flush()
        os._exit(status)
    sys.exit(status)
