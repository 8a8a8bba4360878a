"""Lines of code of many scenarios as a reader sees them: a picture, a table, and a summary of each target."""

import io
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from robosc_experiments.lines_of_code import CodeSize

Sizes = Mapping[str, Sequence[CodeSize]]
"""Sizes by the scenario's title, the model first."""

# Tones that colour-blind readers can tell apart, each with a form of its own.
_STYLES = (
    ("#000000", "D"),
    ("#0072B2", "o"),
    ("#E69F00", "s"),
    ("#009E73", "^"),
    ("#CC79A7", "v"),
    ("#D55E00", "P"),
    ("#56B4E9", "X"),
    ("#7F7F7F", "<"),
    ("#A07000", ">"),
)


@dataclass(frozen=True, slots=True)
class Summary:
    """Size of the model, or of what a target generates, over all scenarios that have it.

    Attributes:
        name: `model`, or a target.
        scenarios: Number of the scenarios that have it.
        lines: Median of its lines.
        factors: Least, median and most times the lines of the model.
    """

    name: str
    scenarios: int
    lines: float
    factors: tuple[float, float, float]

    @property
    def is_model(self) -> bool:
        """True if it is the model itself."""
        return self.name == "model"


def names(sizes: Sizes) -> tuple[str, ...]:
    """Return the names of everything that any scenario has, the model first."""
    return tuple(dict.fromkeys(size.name for members in sizes.values() for size in members))


def factor(members: Sequence[CodeSize], size: CodeSize) -> float:
    """Return how many times as long something is as the scenario's model, which comes first."""
    return (size.lines or 0) / (members[0].lines or 1)


def summaries(sizes: Sizes) -> tuple[Summary, ...]:
    """Return the summary of the model and of each target; those that no scenario has are left out."""
    found = []
    for name in names(sizes):
        those = [(members, size) for members in sizes.values() for size in members if size.name == name and size.lines]
        if those:
            factors = [factor(members, size) for members, size in those]
            lines = statistics.median(size.lines or 0 for _, size in those)
            found.append(Summary(name, len(those), lines, (min(factors), statistics.median(factors), max(factors))))
    return tuple(found)


def missing(sizes: Sizes) -> list[tuple[str, str, str]]:
    """Return scenario, targets and reason for everything that there is no code of."""
    found: dict[tuple[str, str], list[str]] = {}
    for title, members in sizes.items():
        for size in members:
            if size.why:
                # Targets begin their reasons with their own names.
                why = size.why.removeprefix(f"target {size.name}: ")
                found.setdefault((title, why), []).append(size.name)
    return [(title, ", ".join(those), why) for (title, why), those in found.items()]


def picture(sizes: Sizes) -> bytes:
    """Return a picture (PNG): a row for each scenario, by the length of its model; lines of code to the right."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    counted = {title: members for title, members in sizes.items() if members[0].lines}
    titles = sorted(counted, key=lambda title: (-(counted[title][0].lines or 0), title))
    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 9}):
        figure = Figure(figsize=(10, 2 + 0.24 * max(len(titles), 4)), layout="constrained", facecolor="white")
        axes = figure.add_subplot()
        for number, summary in enumerate(summaries(counted)):
            color, marker = _STYLES[number % len(_STYLES)]
            places = [
                (size.lines, place)
                for place, title in enumerate(titles)
                for size in counted[title]
                if size.name == summary.name and size.lines
            ]
            label = "model" if summary.is_model else f"{summary.name}: {summary.factors[1]:.1f} times"
            lines, rows = [line for line, _ in places], [row for _, row in places]
            axes.scatter(lines, rows, c=color, marker=marker, s=22, label=label, zorder=3)
        axes.set_yticks(range(len(titles)), titles, parse_math=False)
        axes.set_ylim(-0.7, len(titles) - 0.3)
        axes.set_xscale("log")
        axes.set_xlabel("lines of code (beside a target: the median of how many times as long as the model)")
        axes.grid(axis="both", color="#dddddd", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        # At the "best" place it would cover nothing, but take a slow machine long to find, which matplotlib warns of.
        figure.legend(loc="outside upper center", ncols=5, frameon=False)
        content = io.BytesIO()
        figure.savefig(content, format="png", dpi=130, metadata={"Software": "RoboSC"})
    return content.getvalue()
