"""The states that steps reach from given ones: by saturation, unless the engine may change its variable order.

Measured on the families of the benchmarks, saturation takes from a thirtieth of the time of chaining (a hundred dining
philosophers) to two thirds of it (cat and mouse), and its time grows more slowly with the size. But it works level by
level of the diagrams, so the variable order must not change.
"""

from collections.abc import Iterable
from typing import Any

from robosc.oxidd_diagrams import OxiddManager
from robosc.synthesis.chaining import Chaining
from robosc.synthesis.compiled import kernel_of
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import Manager
from robosc.synthesis.engines import is_reordering as may_reorder
from robosc.synthesis.image import Image
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.oxidd_saturation import OxiddSaturation
from robosc.synthesis.result import Closure
from robosc.synthesis.saturation import CompiledSaturation, Saturation, saturation
from robosc.synthesis.step import Step


def closure_under(
    encoding: Encoding, steps: Iterable[Step], within: Any, monitor: ProgressMonitor
) -> Chaining | Saturation | CompiledSaturation:
    """Return the closure of sets of states under some steps that suits its manager best.

    Args:
        encoding: The variables.
        steps: The steps.
        within: Predicate that added states have to satisfy.
        monitor: Monitor of the waiting caller.
    """
    levels = {name: level for level, name in enumerate(encoding.order)}
    if may_reorder(encoding.manager):
        return Chaining(levels, tuple(steps), within, monitor)
    manager, steps = encoding.manager, tuple(steps)
    if isinstance(manager, OxiddManager) and all(isinstance(step.add, Image) for step in steps):
        return OxiddSaturation(manager, levels, steps, within, monitor)
    return saturation(manager, levels, steps, within, monitor)


def closure_in(manager: Manager, *, is_reordering: bool) -> Closure:
    """Return the order of steps that `closure_under` chooses for a manager, which may change its order or not."""
    if is_reordering:
        return Closure.CHAINING
    return Closure.SATURATION if kernel_of(manager) is None else Closure.COMPILED_SATURATION
