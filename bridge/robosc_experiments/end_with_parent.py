"""Runs a program that receives a signal when its parent dies, even by SIGKILL; run as a file.

    python -I -S end_with_parent.py PARENT PROGRAM [ARGUMENTS ...]

A process asks for this by itself: between fork and exec, a parent with threads can run next to nothing safely.
"""

import ctypes
import os
import signal
import sys

# prctl(2): the signal that a process gets when the thread that started it dies; exec(2) keeps it.
_SET_PARENT_DEATH_SIGNAL = 1
_CANNOT_BE_RUN = 127


def main() -> None:
    """Ask for the signal, and become the program.

    Raises:
        SystemExit: Its parent is gone already, or there is no such program.
    """
    parent, *command = sys.argv[1:]
    # Elsewhere than on Linux there is no such thing: who kills the parent must end the program, too.
    if hasattr(found := ctypes.CDLL(None), "prctl"):
        found.prctl(_SET_PARENT_DEATH_SIGNAL, int(signal.SIGTERM), 0, 0, 0)
    # It may have died before that.
    if os.getppid() != int(parent):
        sys.exit(f"who started {command[0]} has ended")
    try:
        os.execvp(command[0], command)  # noqa: S606 (that is what it is for)
    except OSError as error:
        sys.stderr.write(f"{command[0]} cannot be run: {error.strerror}\n")
        sys.exit(_CANNOT_BE_RUN)


if __name__ == "__main__":
    main()
