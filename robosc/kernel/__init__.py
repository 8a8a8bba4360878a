"""The kernel: the inner loops of synthesis and of the search for formulas, in C.

The kernel is available if RoboSC was installed with a C compiler, or from a wheel that was built with one. Every
function has a twin in Python, which replaces it otherwise, with the same results but more slowly.
"""

import importlib
import os
import zlib
from functools import cache
from pathlib import Path
from types import ModuleType

UNWANTED = "ROBOSC_KERNEL"
"""Environment variable: at 0 the kernel is left aside, and at the installation it is not made."""

FOLDER = Path(__file__).parent


def kernel_module() -> ModuleType | None:
    """Return the module in C, or None where there is none."""
    return _found()[0]


def kernel_problem() -> str:
    """Return the reason why there is no kernel; empty if there is one."""
    return _found()[1]


@cache
def _found() -> tuple[ModuleType | None, str]:
    if os.environ.get(UNWANTED) == "0":
        return None, f"{UNWANTED} is 0"
    try:
        module = importlib.import_module("robosc.kernel._kernel")
    except ImportError:
        return None, "it was not made: there was no C compiler"
    if checksum(FOLDER) != module.SOURCE_CHECKSUM:
        return None, "it was made from other sources"
    return module, ""


def checksum(folder: Path) -> int:
    """Return the checksum of the sources in a folder, with which a module says what it was made from."""
    found = 0
    for path in sorted(folder.glob("*.[ch]")):
        found = zlib.crc32(path.read_bytes(), found)
    return found
