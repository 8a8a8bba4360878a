"""Memory that forks share with their parent.

A fork copies each page that it writes, and the kernel copies its table of all pages: for a small task both take longer
than its work. So objects of the parent are made immortal, which need no count of references; its memory is in few
pieces; and each 2 MiB of them are one huge page, one entry of the table.
"""

import gc
import types
from pathlib import Path

from robosc.kernel import kernel_module
from robosc_server.workers import kernel

HUGE_PAGE_BYTES = 2 * 2**20
"""Size of a huge page on the machines that the kernel's rules of confinement know, in bytes."""

_MAPPINGS = Path("/proc/self/maps")
_HEAP = "[heap]"

_RESERVED_BYTES = 24 * 2**20
_BLOCK_BYTES = 512
"""Size of the largest objects that Python takes from its own pieces of memory, the arenas, and not from those of the C
library, in bytes."""

_ARENA_BYTES = 2**20

ENVIRONMENT = {"MALLOC_MMAP_THRESHOLD_": str(32 * 2**20), "MALLOC_TOP_PAD_": str(4 * 2**20)}
"""Environment variables with which the C library of GNU places all memory in one piece (mallopt(3)); others know none
of them."""


_kept_blocks: list[bytes] = []


def reserve_arenas() -> None:
    """Make Python take memory for small objects in one piece, which fills later.

    Otherwise libraries that are loaded meanwhile lie between the arenas.
    """
    blocks = [bytes(_BLOCK_BYTES - b"".__sizeof__()) for _ in range(_RESERVED_BYTES // _BLOCK_BYTES)]
    # An arena with an object in it is kept.
    _kept_blocks.extend(blocks[:: _ARENA_BYTES // _BLOCK_BYTES // 2])


def keep_objects() -> int:
    """Make all objects immortal that the garbage collector knows, and what they refer to.

    They are never freed, and mutable ones may change as before.

    Returns:
        Number of these objects; 0 where there is no compiled kernel: forks take longer then.
    """
    compiled = kernel_module()
    gc.collect()
    return 0 if compiled is None else int(compiled.keep(gc.get_objects(), types.CodeType))


def join_pages() -> int:
    """Make huge pages of the private memory of this process; return their bytes.

    It is less where the kernel has no room for them, and 0 where it does not make any (before Linux 6.1).
    """
    joined = 0
    try:
        mappings = _MAPPINGS.read_text().splitlines()
    except OSError:
        return 0
    for mapping in mappings:
        begin, end = _huge_pages_of(mapping)
        for address in range(begin, end, HUGE_PAGE_BYTES):
            try:
                kernel.collapse(address, HUGE_PAGE_BYTES)
            except OSError:
                continue
            joined += HUGE_PAGE_BYTES
    return joined


def _huge_pages_of(mapping: str) -> tuple[int, int]:
    """Return the addresses of a mapping (proc_pid_maps(5)) between which huge pages fit; equal if there are none."""
    addresses, permissions, _, _, inode, *name = mapping.split(maxsplit=5)
    if permissions != "rw-p" or inode != "0" or name not in ([], [_HEAP]):
        return 0, 0
    begin, end = (int(address, 16) for address in addresses.split("-"))
    begin, end = -(-begin // HUGE_PAGE_BYTES) * HUGE_PAGE_BYTES, end // HUGE_PAGE_BYTES * HUGE_PAGE_BYTES
    return begin, max(begin, end)
