"""System calls that a worker may make: memory, time, reading files, its connection; all others are refused.

A seccomp filter in classic BPF, for two 64-bit architectures. Every call that is not listed, including those of future
kernels, fails with EPERM: new processes and programs, sockets, signals to and inspection of other processes, creating
or writing files, and gaining rights. Threads are allowed; the address space limits how many there can be.
"""

import ctypes
import errno
import os
import struct
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache

from robosc_server.workers import kernel

_FILTER_MODE = 2

# Instructions: load a word, jump if equal or if bits are set, return.
_LOAD, _EQUAL, _BITS, _RETURN = 0x20, 0x15, 0x45, 0x06

ALLOW = 0x7FFF0000
REFUSE = 0x00050000 | errno.EPERM
UNKNOWN = 0x00050000 | errno.ENOSYS
KILL = 0x80000000

# Places in what the filter looks at: `struct seccomp_data`, words in the order of little-endian machines.
_NUMBER, _ARCHITECTURE, _ARGUMENTS = 0, 4, 16

_MAY_EXECUTE, _MAY_WRITE, _OF_NO_FILE = 0x4, 0x2, 0x20
# Opened to write, made, emptied, or held without its content being read: O_ACCMODE, O_CREAT, O_TRUNC, O_PATH.
_NOT_FOR_READING = 0o3 | 0o100 | 0o1000 | 0o10000000
# F_DUPFD, F_GETFD, F_SETFD, F_GETFL and F_DUPFD_CLOEXEC; others can send signals to any process.
_DESCRIPTOR_COMMANDS = (0, 1, 2, 3, 1030)


_THREAD = 0x3D0F00
"""Flags with which the C library makes a thread (CLONE_VM to CLONE_CHILD_CLEARTID), and never a process.

OxiDD makes two threads for each of its managers. They are confined as the one that makes them.
"""

_PLACEHOLDER_PID = 0x7FFFFFFE
"""Placeholder of the process id: real ids are below 2^22, and no other constant of a filter has this value."""


@dataclass(frozen=True, slots=True)
class Architecture:
    """Architecture of a machine.

    Attributes:
        mark: Number of the kernel for it (AUDIT_ARCH_...).
        numbers: Numbers of the calls that a worker may make, by name.
    """

    mark: int
    numbers: Mapping[str, int]


# Numbers on x86_64 and on aarch64; 0: no such call. `read` has the number 0 on x86_64, and is added below.
_CALLS = {
    # Descriptors that are open already.
    "write": (1, 64),
    "readv": (19, 65),
    "writev": (20, 66),
    "pread64": (17, 67),
    "close": (3, 57),
    "lseek": (8, 62),
    "fstat": (5, 80),
    "dup": (32, 23),
    "fadvise64": (221, 223),
    "recvfrom": (45, 207),
    "poll": (7, 0),
    "ppoll": (271, 73),
    "select": (23, 0),
    "pselect6": (270, 72),
    # Names of files: Python searches for modules.
    "stat": (4, 0),
    "lstat": (6, 0),
    "newfstatat": (262, 79),
    "statx": (332, 291),
    "access": (21, 0),
    "faccessat": (269, 48),
    "faccessat2": (439, 439),
    "readlink": (89, 0),
    "readlinkat": (267, 78),
    "getcwd": (79, 17),
    "getdents64": (217, 61),
    # Memory.
    "munmap": (11, 215),
    "mremap": (25, 216),
    "brk": (12, 214),
    "madvise": (28, 233),
    # Its own signals, time and being.
    "rt_sigaction": (13, 134),
    "rt_sigprocmask": (14, 135),
    "rt_sigreturn": (15, 139),
    "sigaltstack": (131, 132),
    "restart_syscall": (219, 128),
    "futex": (202, 98),
    "sched_yield": (24, 124),
    "sched_getaffinity": (204, 123),
    "set_robust_list": (273, 99),
    "rseq": (334, 293),
    "getcpu": (309, 168),
    "clock_gettime": (228, 113),
    "clock_getres": (229, 114),
    "clock_nanosleep": (230, 115),
    "nanosleep": (35, 101),
    "gettimeofday": (96, 169),
    "time": (201, 0),
    "times": (100, 153),
    "getrusage": (98, 165),
    "getrlimit": (97, 163),
    "setrlimit": (160, 164),
    "getpid": (39, 172),
    "gettid": (186, 178),
    "getppid": (110, 173),
    "getuid": (102, 174),
    "geteuid": (107, 175),
    "getgid": (104, 176),
    "getegid": (108, 177),
    "getrandom": (318, 278),
    "sysinfo": (99, 179),
    "uname": (63, 160),
    "exit": (60, 93),
    "exit_group": (231, 94),
    # Allowed by what they are called with.
    "kill": (62, 129),
    "tkill": (200, 130),
    "tgkill": (234, 131),
    "prlimit64": (302, 261),
    "openat": (257, 56),
    "fcntl": (72, 25),
    "mmap": (9, 222),
    "mprotect": (10, 226),
    "sendto": (44, 206),
    "clone": (56, 220),
    "clone3": (435, 435),
}

ARCHITECTURES = {
    "x86_64": Architecture(0xC000003E, {"read": 0} | {name: here for name, (here, _) in _CALLS.items()}),
    "aarch64": Architecture(0xC00000B7, {"read": 63} | {name: there for name, (_, there) in _CALLS.items() if there}),
}


@dataclass(frozen=True, slots=True)
class _Instruction:
    code: int
    value: int
    if_true: int = 0
    if_false: int = 0

    def packed(self) -> bytes:
        return struct.pack("=HBBI", self.code, self.if_true, self.if_false, self.value)


def filter_program(architecture: Architecture, pid: int) -> bytes:
    """Return the filter of a process: instructions of 8 bytes.

    Args:
        architecture: Architecture of the machine.
        pid: Process id, the only one to which the process may send signals.
    """
    conditions = _conditions(pid)
    program = [
        _Instruction(_LOAD, _ARCHITECTURE),
        # Programs for another architecture have other numbers for the same calls.
        *_unless_equal(architecture.mark, _Instruction(_RETURN, KILL)),
        _Instruction(_LOAD, _NUMBER),
    ]
    for name, number in architecture.numbers.items():
        block = [*conditions.get(name, ()), _Instruction(_RETURN, ALLOW)]
        program += [_Instruction(_EQUAL, number, 0, len(block)), *block]
    program.append(_Instruction(_RETURN, REFUSE))
    return b"".join(instruction.packed() for instruction in program)


def _conditions(pid: int) -> dict[str, list[_Instruction]]:
    """Return the instructions that refuse a call that is allowed with some arguments alone."""
    refused = _Instruction(_RETURN, REFUSE)
    own_process = [_argument(0), *_unless_equal(pid, refused)]
    return {
        "kill": own_process,
        "tgkill": own_process,
        # The first thread has the id of its process.
        "tkill": own_process,
        "prlimit64": [_argument(0), *_unless_equal(0, refused)],
        "openat": [_argument(2), *_if_any_bit(_NOT_FOR_READING, [refused])],
        "fcntl": [_argument(1), *_unless_one_of(_DESCRIPTOR_COMMANDS, refused)],
        # Libraries are mapped from read-only files; writable memory is never executable.
        "mmap": [
            _argument(2),
            *_if_any_bit(
                _MAY_EXECUTE,
                [*_if_any_bit(_MAY_WRITE, [refused]), _argument(3), *_if_any_bit(_OF_NO_FILE, [refused])],
            ),
        ],
        "mprotect": [_argument(2), *_if_any_bit(_MAY_EXECUTE, [refused])],
        "clone": [_argument(0), *_unless_equal(_THREAD, refused)],
        # A filter cannot see these flags: the C library then uses `clone`.
        "clone3": [_Instruction(_RETURN, UNKNOWN)],
        # The target may write to its connection alone, and to no address.
        "sendto": [_argument(4), *_unless_equal(0, refused), _argument(4, 4), *_unless_equal(0, refused)],
    }


def _argument(position: int, byte: int = 0) -> _Instruction:
    """Load the low word of an argument; the high one with `byte` 4."""
    return _Instruction(_LOAD, _ARGUMENTS + 8 * position + byte)


def _unless_equal(value: int, then: _Instruction) -> Iterator[_Instruction]:
    yield _Instruction(_EQUAL, value, 1, 0)
    yield then


def _unless_one_of(values: Iterable[int], then: _Instruction) -> Iterator[_Instruction]:
    wanted = list(values)
    for place, value in enumerate(wanted):
        yield _Instruction(_EQUAL, value, len(wanted) - place, 0)
    yield then


def _if_any_bit(bits: int, then: list[_Instruction]) -> Iterator[_Instruction]:
    yield _Instruction(_BITS, bits, 0, len(then))
    yield from then


@cache
def _placeholder_program(machine: str) -> bytes:
    """Return a filter with a placeholder id, which each fork replaces by its own."""
    return filter_program(ARCHITECTURES[machine], _PLACEHOLDER_PID)


def prepare_filter() -> None:
    """Build the filter for `restrict_system_calls` once for all forks of this process."""
    machine = os.uname().machine
    if machine in ARCHITECTURES:
        _placeholder_program(machine)


def _own_program(machine: str) -> bytes:
    return _placeholder_program(machine).replace(_word(_PLACEHOLDER_PID), _word(os.getpid()))


def _word(value: int) -> bytes:
    return struct.pack("=I", value)


class _Program(ctypes.Structure):
    """`struct sock_fprog`."""

    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p))


def restrict_system_calls() -> None:
    """Restrict this process permanently to the listed system calls.

    Raises:
        OSError: The kernel has no filters, or the machine is of another kind.
    """
    machine = os.uname().machine
    if machine not in ARCHITECTURES or sys.maxsize < 2**32:
        raise OSError(errno.ENOSYS, f"there is no list of system calls for the architecture {machine}")
    instructions = _own_program(machine)
    program = _Program(len(instructions) // 8, instructions)
    kernel.prctl(kernel.SET_NO_NEW_PRIVILEGES, 1)
    kernel.prctl(kernel.SET_SECCOMP, _FILTER_MODE, ctypes.addressof(program))
