"""Figures of a synthesis, as `robosc synth --statistics` prints them."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from robosc.synthesis import Statistics

_NAMES = {
    "engine": "engine",
    "search": "search",
    "order": "variable order",
    "race": "race",
    "kernel": "kernel",
    "closure": "order of steps",
    "parts": "independent parts",
    "state_bits": "state bits",
    "iterations": "rounds",
    "peak_nodes": "peak nodes",
    "seconds": "seconds",
}


class Figures(msgspec.Struct, frozen=True):
    """Figures of a synthesis.

    Attributes:
        statistics: Figures that synthesis reports itself, or None without a synthesis.
        seconds: Time of the synthesis, and of the certification of its result if there was one.
    """

    statistics: "Statistics | None"
    seconds: float

    def document(self) -> dict[str, object] | None:
        """Return the figures as JSON values; None without a synthesis."""
        if self.statistics is None:
            return None
        # Not at the beginning: `robosc check` loads nothing else that needs this slow module.
        from dataclasses import asdict

        figures = asdict(self.statistics) | {"kernel": self._kernel(), "seconds": round(self.seconds, 3)}
        return {name: figures[name] for name in _NAMES}

    def _kernel(self) -> str:
        """Return the part that the kernel had in work on the diagrams."""
        from robosc.synthesis.connection import left_aside

        if self.statistics is not None and self.statistics.engine != "cudd":
            return "not used: it is for the engine cudd"
        problem = left_aside()
        return f"not used, which is slower: {problem}" if problem else "used"

    def __str__(self) -> str:
        figures, width = self.document() or {}, max(map(len, _NAMES.values()))
        if self.statistics is not None:
            # Each strategy has a line of its own.
            figures["race"] = f"\n{'':{width + 4}}".join(map(str, self.statistics.race))
        return "".join(f"  {_NAMES[name]:<{width}}  {figure}\n" for name, figure in figures.items())


def timed[T](work: Callable[[], T]) -> tuple[T, float]:
    """Return the result of some work, and the seconds that it took."""
    begin = time.monotonic()
    return work(), time.monotonic() - begin
