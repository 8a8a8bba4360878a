"""Figures of repeated measurements, and tables of them."""

import statistics
from collections.abc import Sequence


def micro(samples_s: Sequence[float]) -> list[str]:
    """Mean, minimum, maximum and standard deviation in microseconds, as the paper's Table I gives them, and the median.

    The median says what a machine does that has nothing else to do: others' work makes the mean and the maximum.
    """
    us = [sample * 1e6 for sample in samples_s]
    figures = (statistics.fmean(us), min(us), max(us), statistics.pstdev(us), statistics.median(us))
    return [f"{figure:.2f}" for figure in figures]


def text_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A title and aligned columns, numbers to the right."""
    widths = [max(len(str(row[column])) for row in [header, *rows]) for column in range(len(header))]

    def line(row: Sequence[str]) -> str:
        first, *rest = row
        return "  ".join(
            [first.ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True))]
        )

    return "\n".join([title, line(header), "  ".join("-" * width for width in widths), *(line(row) for row in rows)])
