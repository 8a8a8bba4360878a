"""Linux system calls that Python does not offer, with Python's own errors."""

import ctypes
import os
import struct
import sys
from functools import cache
from pathlib import Path

SET_PARENT_DEATH_SIGNAL = 1
SET_DUMPABLE = 4
SET_SECCOMP = 22
SET_NO_NEW_PRIVILEGES = 38

_COLLAPSE = 25

_CAPABILITIES_VERSION = 0x20080522  # Three: 64 bits for each set.

# Built once here, not in each forked process.
_CAPABILITIES_HEADER = struct.pack("=Ii", _CAPABILITIES_VERSION, 0)
_NO_CAPABILITIES = bytes(24)
_LIBRARY = ctypes.CDLL(None, use_errno=True) if sys.platform == "linux" else None
if _LIBRARY is not None:
    _LIBRARY.syscall.restype = ctypes.c_long
    _LIBRARY.prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    _LIBRARY.capset.argtypes = [ctypes.c_char_p, ctypes.c_char_p]
    _LIBRARY.madvise.argtypes = [ctypes.c_size_t, ctypes.c_size_t, ctypes.c_int]


def prctl(option: int, *values: int) -> None:
    """Call `prctl(2)`.

    Raises:
        OSError: The kernel refuses it, or is not Linux.
    """
    library = _library()
    if library.prctl(option, *values, *[0] * (4 - len(values))):
        raise _error()


def system_call(number: int, *arguments: int | bytes | None) -> int:
    """Make a system call by its number; bytes are passed by their address.

    Raises:
        OSError: The kernel refuses it, or is not Linux.
    """
    library = _library()
    given = [ctypes.c_long(argument) if isinstance(argument, int) else argument for argument in arguments]
    result = int(library.syscall(ctypes.c_long(number), *given))
    if result < 0:
        raise _error()
    return result


def drop_capabilities() -> None:
    """Drop all capabilities of the superuser.

    Raises:
        OSError: The kernel refuses it, or is not Linux.
    """
    library = _library()
    if not any(capabilities()):
        return  # A sandbox around the server may forbid the call.
    # The kernel writes to the header only where it does not know the version.
    if library.capset(_CAPABILITIES_HEADER, _NO_CAPABILITIES):
        raise _error()


def collapse(address: int, size: int) -> None:
    """`madvise(2)` with `MADV_COLLAPSE`: make huge pages of memory that begins and ends at the border of one.

    Raises:
        OSError: The kernel refuses it, does not know it, or is not Linux.
    """
    if _library().madvise(address, size, _COLLAPSE):
        raise _error()


@cache
def capabilities() -> list[int]:
    """Return the sets of capabilities that this process had at the first call.

    Forks of the process have the same, and need not read them again.
    """
    lines = Path("/proc/self/status").read_text().splitlines()
    return [int(line.split()[1], 16) for line in lines if line.startswith(("CapInh", "CapPrm", "CapEff", "CapAmb"))]


def keep_memory_private() -> None:
    """Forbid other processes of the same user to inspect or trace this one, and disable its core dumps.

    Its memory, environment and descriptors in `/proc` are then the superuser's. Where the kernel is not Linux this does
    nothing.
    """
    if _LIBRARY is not None:
        prctl(SET_DUMPABLE, 0)


def _library() -> ctypes.CDLL:
    if _LIBRARY is None:
        raise OSError(0, "this system is not Linux")
    return _LIBRARY


def _error() -> OSError:
    number = ctypes.get_errno()
    return OSError(number, os.strerror(number))
