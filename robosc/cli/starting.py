"""Start of an installed command: Ctrl-C ends it with one line at any time, even during imports or at its end.

A missing package and a Python that is too old end it with one line, too: each command but `robosc` needs an extra.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from typing import NoReturn

from robosc.python_versions import FIX, OLDEST, unsupported

INTERRUPTED = 130
"""Exit status after Ctrl-C, as of a shell."""

_WRONG_USE = 2


@contextlib.contextmanager
def interrupts_as_such() -> Iterator[None]:
    """Within the block an error that an interrupt has caused is a `KeyboardInterrupt`.

    `threading.Condition.wait`, for one, which gRPC waits with, gives up its lock before it is ready for an interrupt;
    one just then comes out as `RuntimeError: cannot release un-acquired lock`.
    """
    try:
        yield
    except Exception as error:
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__context__
        if cause is not None:
            raise KeyboardInterrupt from error
        raise


def start(program: str, load: Callable[[], Callable[[], int]], extra: str | None = None) -> NoReturn:
    """Run a command and leave with its exit status.

    Args:
        program: Name of the command.
        load: Function that imports the command and returns its `main`.
        extra: Extra of the distribution that has what the command needs; None: it needs none.
    """
    if sys.version_info[:2] < OLDEST:
        # The rest cannot even be read.
        message = f"Python {unsupported(sys.version_info[:3])} ({sys.executable}); {FIX}"
        sys.stderr.write(f"{program}: {message}\n")
        sys.exit(_WRONG_USE)

    def leave(*_: object) -> NoReturn:
        # Not by an exception: an import that is interrupted may swallow it, and threads of gRPC may wait for ever.
        with contextlib.suppress(OSError):
            os.write(2, f"{program}: interrupted\n".encode())
        os._exit(INTERRUPTED)

    # A shell starts what it runs in the background with SIGINT ignored: that stays.
    is_heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_heard:
        signal.signal(signal.SIGINT, leave)
    try:
        main = load()
        if is_heard:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        status = main()
    except KeyboardInterrupt:
        leave()
    except ModuleNotFoundError as error:
        package = (error.name or str(error)).partition(".")[0]
        if extra is None or package.startswith("robosc"):
            raise
        fix = f"the extra {extra} has it: pip install 'robosc[{extra}]'"
        sys.stderr.write(f"{program}: the package {package} is not installed; {fix}\n")
        status = _WRONG_USE
    finally:
        if is_heard:
            signal.signal(signal.SIGINT, leave)
    if status == INTERRUPTED:
        # The command has already reported the interrupt.
        with contextlib.suppress(AttributeError, OSError, ValueError):
            sys.stdout.flush()
        os._exit(status)
    sys.exit(status)
