"""The kernel: the inner loops of synthesis and of the search for formulas, in C.

It is there where RoboSC was installed with a C compiler at hand, or from a wheel that was made with one. Everything it
does has a twin in Python, which takes its place where it is not: the same results, later.
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
