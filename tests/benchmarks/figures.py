"""Figures of repeated measurements, and tables of them."""

import statistics
from collections.abc import Sequence


def micro(samples_s: Sequence[float]) -> list[str]:
    """Mean, minimum, maximum and standard deviation in microseconds, as the paper's Table I gives them."""
    us = [sample * 1e6 for sample in samples_s]
    return [f"{figure:.2f}" for figure in (statistics.fmean(us), min(us), max(us), statistics.pstdev(us))]


def text_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A title and aligned columns, numbers to the right."""
    widths = [max(len(str(row[column])) for row in [header, *rows]) for column in range(len(header))]

    def line(row: Sequence[str]) -> str:
        first, *rest = row
        return "  ".join(
            [first.ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True))]
        )

    return "\n".join([title, line(header), "  ".join("-" * width for width in widths), *(line(row) for row in rows)])
