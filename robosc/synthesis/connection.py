"""The kernel's connection with the CUDD inside dd, made once."""

from functools import cache
from types import ModuleType

from robosc.dd_modules import load_dd
from robosc.kernel import kernel_module, kernel_problem
from robosc.synthesis.layout import layout_problem


def left_aside() -> str:
    """Return the reason why the kernel leaves diagrams of CUDD to Python; empty if it does not."""
    return connected()[1]


@cache
def connected() -> tuple[ModuleType | None, str]:
    """Return the kernel with the CUDD inside dd; None and the reason where there is none, or another dd."""
    module = kernel_module()
    if module is None:
        return None, kernel_problem()
    try:
        cudd = load_dd("cudd")
        module.connect(cudd.__file__)
    except ImportError as error:
        # It is not there, or this build of dd keeps the functions of CUDD to itself.
        return None, str(error)
    problem = layout_problem(module, cudd)
    return (None, problem) if problem else (module, "")
