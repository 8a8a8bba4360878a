"""The kernel: the inner loops of synthesis in C, on the diagrams of CUDD inside dd.

It is there where RoboSC was installed with a C compiler at hand, or from a wheel that was made with one. Everything it
does has a twin in Python, which takes its place where it is not: the same results, later.
"""

import importlib
import os
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from robosc.dd_modules import load_dd
from robosc.synthesis.engines import Manager, is_compiled

UNWANTED = "ROBOSC_KERNEL"
"""Environment variable: at 0 the kernel is left aside, and at the installation it is not made."""

SOURCE = Path(__file__).with_name("kernel.c")

_LAYOUT = (56, 64)
"""Bytes of a manager and of a predicate of dd.cudd as the kernel knows them: those of dd 0.6."""

_NODE_OFFSET = 2
"""The number of a predicate in dd is the address of its node and this; 0 and 1 are its constants."""


def kernel_problem() -> str:
    """Return the reason why there is no kernel; empty if there is one."""
    return _found()[1]


def kernel_of(manager: Manager) -> "Kernel | None":
    """Return the kernel for a manager, or None where only Python can work with it."""
    module = _found()[0] if is_compiled(manager) else None
    return None if module is None else Kernel(module, manager)


@cache
def _found() -> tuple[ModuleType | None, str]:
    if os.environ.get(UNWANTED) == "0":
        return None, f"{UNWANTED} is 0"
    try:
        module = importlib.import_module("robosc.synthesis.kernel._kernel")
    except ImportError:
        return None, "it was not made: there was no C compiler"
    if zlib.crc32(SOURCE.read_bytes()) != module.SOURCE_CHECKSUM:
        return None, "it was made from another kernel.c"
    try:
        cudd = load_dd("cudd")
        if (cudd.BDD.__basicsize__, cudd.Function.__basicsize__) != _LAYOUT:
            return None, "this version of dd is not known to it"
        module.connect(cudd.__file__)
    except ImportError as error:
        return None, str(error)
    return module, ""


class Kernel:
    """The kernel at work on one manager.

    Args:
        module: The module in C.
        manager: A manager of dd.cudd.
    """

    def __init__(self, module: ModuleType, manager: Manager) -> None:
        self._module = module
        self._manager = manager

    @staticmethod
    def address(predicate: Any) -> int:
        """Return the address of a predicate's node; 0 for None. It stays that while the predicate is there."""
        return 0 if predicate is None else int(predicate) - _NODE_OFFSET

    def predicate(self, address: int) -> Any:
        """Return the predicate of a node."""
        return self._manager._add_int(address + _NODE_OFFSET)  # type: ignore[attr-defined]

    def restrict(self, predicate: Any, care: Any) -> Any:
        """Return what `nodes.restrict` does."""
        return self._returned(self._module.restrict(self._manager, self.address(predicate), self.address(care)))

    def closure(
        self,
        states: Any,
        within: Any,
        groups: tuple[Any, ...],
        until: Any,
        pause: Callable[[], None],
        tell: Callable[[int, int], None],
    ) -> Any:
        """Return a set of states closed under some steps.

        Args:
            states: The states to begin with.
            within: Predicate that added states satisfy.
            groups: Steps as `saturation` has them for the kernel.
            until: States once all of which are found the rest is not; or None.
            pause: Called again and again; what it raises ends the work.
            tell: Called with the number of the round and the address of the states that are found then.
        """
        begin, inside, enough = self.address(states), self.address(within), self.address(until)
        return self._returned(self._module.closure(self._manager, begin, inside, groups, enough, pause, tell))

    def _returned(self, address: int) -> Any:
        found = self.predicate(address)
        self._module.release(self._manager, address)
        return found
