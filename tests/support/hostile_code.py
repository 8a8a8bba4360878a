"""Attempts of a program that has got hold of a worker; each answers `done`, or the name of the error that it got.

read A              reads the file A
list A              lists the folder A
write A             writes to the file A
remove A            removes the file A
environment         reads its parent's environment
memory A            looks into the memory of process A
signal A            asks whether it may signal the process A, which does no harm where it may
signal everybody    the same for every process that there is
interrupt A         has the kernel send a signal to process A when something comes on a pipe
trace A             traces the process A
limit A             changes the limits of process A
fork                starts a process
thread              makes a socket in a thread
program             becomes another program
stay                asks not to be ended with its parent
session             leaves its session
socket A            makes a socket of the kind A: inet, inet6, unix, netlink
send A              sends from its connection to the address of a socket without a file
code                executes what it has written
rights              asks for what the superuser may
descriptors         answers the kinds of what it has open, standard input, output and error left out
dumpable            answers whether others may look into the process that it was forked from
"""

import contextlib
import ctypes
import errno
import mmap
import os
import resource
import socket
import stat
import threading
from collections.abc import Callable
from pathlib import Path

_LIBRARY = ctypes.CDLL(None, use_errno=True)
_GET_DUMPABLE, _SET_PARENT_DEATH_SIGNAL = 3, 1
_ATTACH = 16
_SET_OWNER = 8
_SET_USER_NAMESPACE = 0x10000000

_SEEN: list[int] = []


def warm_up() -> None:
    """Look at the process that workers are forked from; called there."""
    _SEEN.append(_LIBRARY.prctl(_GET_DUMPABLE, 0, 0, 0, 0))


def tried(line: str) -> str:
    """Do what a line says, and report how it went."""
    what, _, rest = line.partition(" ")
    if what == "descriptors":
        return " ".join(_descriptors())
    if what == "dumpable":
        return str(_SEEN)
    try:
        _WAYS[what](rest)
    except OSError as error:
        return errno.errorcode.get(error.errno or 0, str(error))
    return "done"


def _descriptors() -> list[str]:
    kinds = []
    for number in range(3, 1024):
        with contextlib.suppress(OSError):
            mode = os.fstat(number).st_mode
            kinds.append("socket" if stat.S_ISSOCK(mode) else "pipe" if stat.S_ISFIFO(mode) else f"{mode:o}")
    return kinds


def _called(result: int) -> None:
    if result < 0:
        raise OSError(ctypes.get_errno(), "refused")


def _peek(pid: str) -> None:
    own = ctypes.create_string_buffer(8)
    address = ctypes.addressof(own)
    # A fork has the same things in the same places as the process that it comes from.
    here, there = ((ctypes.c_void_p * 2)(address, 8) for _ in range(2))
    _called(_LIBRARY.process_vm_readv(int(pid), here, ctypes.c_ulong(1), there, ctypes.c_ulong(1), ctypes.c_ulong(0)))


def _fork(_: str) -> None:
    if os.fork() == 0:
        os._exit(0)


def _thread(_: str) -> None:
    errors: list[OSError] = []

    def work() -> None:
        try:
            _socket("inet")
        except OSError as error:
            errors.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    if errors:
        raise errors[0]


def _interrupt(pid: str) -> None:
    # The descriptor is that of its connection: it has no other.
    for number in range(3, 64):
        with contextlib.suppress(OSError):
            if stat.S_ISSOCK(os.fstat(number).st_mode):
                break
    _called(_LIBRARY.fcntl(number, _SET_OWNER, ctypes.c_long(int(pid))))


def _signal(pid: str) -> None:
    os.kill(-1 if pid == "everybody" else int(pid), 0)


def _socket(kind: str) -> None:
    families = {
        "inet": socket.AF_INET,
        "inet6": socket.AF_INET6,
        "unix": socket.AF_UNIX,
        "netlink": socket.AF_NETLINK,
    }
    socket.socket(families[kind], socket.SOCK_DGRAM).close()


def _send(_: str) -> None:
    address = b"\x01\x00\x00nobody-listens-here"
    _called(_LIBRARY.sendto(3, b"x", ctypes.c_size_t(1), 0, address, ctypes.c_uint(len(address))))


def _write(name: str) -> None:
    Path(name).write_text("written by a worker\n")


def _code(_: str) -> None:
    mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC).close()


_WAYS: dict[str, Callable[[str], object]] = {
    "read": lambda name: Path(name).read_bytes(),
    "list": os.listdir,
    "write": _write,
    "remove": os.unlink,
    "environment": lambda _: Path(f"/proc/{os.getppid()}/environ").read_bytes(),
    "memory": _peek,
    "signal": _signal,
    "interrupt": _interrupt,
    "trace": lambda pid: _called(_LIBRARY.ptrace(_ATTACH, int(pid), None, None)),
    "limit": lambda pid: resource.prlimit(int(pid), resource.RLIMIT_NOFILE, (0, 0)),
    "fork": _fork,
    "thread": _thread,
    "program": lambda _: os.execv("/bin/true", ["true"]),
    "stay": lambda _: _called(_LIBRARY.prctl(_SET_PARENT_DEATH_SIGNAL, 0, 0, 0, 0)),
    "session": lambda _: os.setsid(),
    "socket": _socket,
    "send": _send,
    "code": _code,
    "rights": lambda _: _called(_LIBRARY.unshare(_SET_USER_NAMESPACE)),
}
