"""The report of an evaluation: a page, the same as Markdown, pictures, and tables for other programs (CSV)."""

import csv
import io
import os
import platform
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

from robosc._version import __version__
from robosc.event_logs import LogCheck
from robosc_experiments.cycles.rclcpp import rclcpp_version
from robosc_experiments.cycles.times import CycleTimes
from robosc_experiments.lines_of_code import COUNTER, CodeSize
from robosc_experiments.size_tables import factor, missing, names, picture, summaries

TITLES: Mapping[str, str] = {"maze": "Maze solver", "line": "Line follower"}

_TEMPLATES = Path(__file__).parent / "templates"
_SIZES_PICTURE = "lines_of_code.png"
_LIMIT_S = 10.0


@dataclass(frozen=True)
class ReportedRun:
    """A scenario that was run.

    Attributes:
        experiment: `maze` or `line`.
        connection: Connection by which the supervisor reached the robot.
        scene: Name of its world.
        check: Check of its log against its supervisor.
        faults: Faults of the motion or anything else, in sentences.
        figures: Measured figures, by name.
        sequence: Picture of the sequence of events, from the report's folder.
        page: The same as a page.
        map: Picture of the robot's way; empty: there is none.
    """

    experiment: str
    connection: str
    scene: str
    check: LogCheck
    faults: tuple[str, ...]
    figures: tuple[tuple[str, str], ...]
    sequence: str
    page: str
    map: str = ""

    @property
    def title(self) -> str:
        """The scenario's name for readers."""
        return TITLES.get(self.experiment, self.experiment)

    @property
    def has_passed(self) -> bool:
        """True if nothing was wrong."""
        return self.check.has_passed and not self.faults

    @property
    def log_verdict(self) -> str:
        """The log check in a word."""
        return "no violation" if self.check.has_passed else f"{self.check.violation_count} violations"

    @property
    def motion_verdict(self) -> str:
        """Verdict on the motion, in one word."""
        return "as required" if not self.faults else f"{len(self.faults)} faults"


@dataclass(frozen=True)
class FailedRun:
    """A scenario that could not be run to its end.

    Attributes:
        experiment: `maze` or `line`.
        connection: Connection by which the supervisor was to reach the robot.
        why: Reason why not, in one sentence.
    """

    experiment: str
    connection: str
    why: str

    @property
    def title(self) -> str:
        """The scenario's name for readers."""
        return TITLES.get(self.experiment, self.experiment)


@dataclass(frozen=True)
class Report:
    """Contents of a report.

    Attributes:
        runs: Scenarios that were run.
        failures: Those that could not be.
        cycles: Times of control cycles.
        sizes: Lines of code by experiment or name of a model, each with the model first.
        machine: Machine that it was run on: facts by name.
    """

    runs: tuple[ReportedRun, ...]
    failures: tuple[FailedRun, ...]
    cycles: tuple[CycleTimes, ...]
    sizes: Mapping[str, tuple[CodeSize, ...]]
    machine: Mapping[str, str]

    @property
    def has_passed(self) -> bool:
        """True if every scenario was run, and nothing was wrong in any."""
        return not self.failures and all(run.has_passed for run in self.runs)

    @property
    def verdict(self) -> str:
        """All of it in one sentence."""
        wrong = len(self.failures) + sum(not run.has_passed for run in self.runs)
        count = len(self.runs) + len(self.failures)
        if not count:
            return "No scenario was run."
        if not wrong:
            return f"Nothing was wrong in {count} scenario{'s' * (count != 1)}."
        return f"Something was wrong in {wrong} of {count} scenarios."


def write_report(report: Report, folder: Path) -> tuple[Path, ...]:
    """Write a report; pictures of its runs must be in its folder already. Return the files, the page first.

    Args:
        report: Report to write.
        folder: Folder to write to; files of an earlier report there are replaced.

    Raises:
        OSError: A file cannot be written.
        PlottingUnavailableError: The extra `robosc[plot]` is not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    values = _values(report)
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=select_autoescape(["html.j2"]),
        undefined=StrictUndefined,
    )
    environment.filters["cell"] = _cell
    files: dict[str, bytes] = {}
    for name in ("report.html", "report.md"):
        files[name] = environment.get_template(f"{name}.j2").render(values).encode("utf-8")
    files["scenarios.csv"] = _csv(
        ("experiment", "connection", "scene", "events", "requests", "blocked", "violations", "faults"),
        _run_rows(report),
    )
    files["figures.csv"] = _csv(
        ("experiment", "connection", "figure", "value"),
        ((run.experiment, run.connection, name, value) for run in report.runs for name, value in run.figures),
    )
    if report.cycles:
        files["cycles.csv"] = _csv(
            (
                "experiment",
                "what",
                "middleware",
                "mean_us",
                "min_us",
                "max_us",
                "sd_us",
                "median_us",
                "publish_median_us",
                "cycles",
                "by",
            ),
            _cycle_rows(report.cycles),
        )
    if report.sizes:
        files["lines_of_code.csv"] = _csv(("experiment", "what", "lines", "files", "why_not"), _size_rows(report.sizes))
        files[_SIZES_PICTURE] = picture(_titled(report.sizes))
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return tuple(folder / name for name in files)


def machine_facts(date: str) -> dict[str, str]:
    """Return the facts about the machine that the evaluation runs on.

    Args:
        date: The day.
    """
    facts = {
        "date": date,
        "RoboSC": __version__,
        "system": f"{platform.system()} {platform.release()} ({platform.machine()})",
        "processor": _processor(),
        "cores": str(os.cpu_count() or "unknown"),
        "Python": platform.python_version(),
    }
    gcc = shutil.which("gcc")
    if gcc is not None:
        try:
            version = subprocess.check_output([gcc, "--version"], text=True, timeout=_LIMIT_S)  # noqa: S603
        except (OSError, subprocess.SubprocessError):
            version = "unknown\n"
        facts["gcc"] = version.splitlines()[0]
    if (rclcpp := rclcpp_version()) is not None:
        facts["rclcpp"] = rclcpp
    return facts


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, "") or platform.processor() or "unknown"


def _values(report: Report) -> dict[str, Any]:
    """Return the values that the templates show."""
    counts = {times.count for times in report.cycles if times.count}
    return {
        "runs": report.runs,
        "failures": report.failures,
        "verdict": report.verdict,
        "machine": report.machine,
        "cycles": _shown_cycles(report.cycles),
        "cycles_note": f"here {max(counts)} cycles in 3 runs." if counts else "nothing could be measured here.",
        "sizes": _shown_sizes(report.sizes),
        "size_names": names(report.sizes),
        "size_summaries": summaries(report.sizes),
        "size_missing": missing(_titled(report.sizes)),
        "sizes_picture": _SIZES_PICTURE,
        "counter": COUNTER,
    }


def _shown_cycles(cycles: Iterable[CycleTimes]) -> list[dict[str, Any]]:
    """Rows of Table I: ours, and the paper's where its scenario and kind end."""
    found: list[dict[str, Any]] = []
    groups: dict[tuple[bool, str], list[CycleTimes]] = {}
    for times in cycles:
        groups.setdefault((not times.has_middleware, times.experiment), []).append(times)
    for (is_without, experiment), members in sorted(groups.items()):
        title, middleware = TITLES[experiment], "without" if is_without else "with"
        for times in members:
            measured = () if times.microseconds is None else (*times.microseconds, times.median_us, times.publish_us)
            figures = ["–" if figure is None else f"{figure:.2f}" for figure in measured]
            found.append({
                "title": title, "middleware": middleware, "what": times.what, "figures": figures,
                "count": times.count, "why": f"not measured: {times.why}", "is_paper": False,
            })  # fmt: skip
        paper = [*(f"{figure:g}" for figure in members[0].paper), "–", "–"]
        found.append({
            "title": title, "middleware": middleware, "what": "the paper's", "figures": paper, "count": 3000,
            "why": "", "is_paper": True,
        })  # fmt: skip
    return found


def _titled(sizes: Mapping[str, Sequence[CodeSize]]) -> dict[str, Sequence[CodeSize]]:
    return {TITLES.get(name, name): members for name, members in sizes.items()}


def _shown_sizes(sizes: Mapping[str, Sequence[CodeSize]]) -> list[tuple[str, list[str]]]:
    """Rows of Figure 13: a scenario, and for everything its lines and how many times the model's these are."""
    found = []
    columns = names(sizes)
    for title, members in _titled(sizes).items():
        cells = {
            size.name: str(size.lines) if size is members[0] else f"{size.lines} ({factor(members, size):.1f})"
            for size in members
            if size.lines is not None
        }
        found.append((title, [cells.get(name, "–") for name in columns]))
    return found


def _run_rows(report: Report) -> Iterable[tuple[object, ...]]:
    for run in report.runs:
        check = run.check
        counts = (check.events, check.requests, check.blocked, check.violation_count, len(run.faults))
        yield run.experiment, run.connection, run.scene, *counts
    for failed in report.failures:
        yield failed.experiment, failed.connection, f"not run: {failed.why}", "", "", "", "", ""


def _cycle_rows(cycles: Iterable[CycleTimes]) -> Iterable[tuple[object, ...]]:
    seen = set[tuple[str, bool]]()
    for times in cycles:
        middleware = "with" if times.has_middleware else "without"
        figures = [""] * 6
        if times.microseconds is not None:
            measured = (*times.microseconds, times.median_us, times.publish_us)
            figures = ["" if us is None else f"{us:.3f}" for us in measured]
        yield times.experiment, times.what, middleware, *figures, times.count, "here"
        if (times.experiment, times.has_middleware) not in seen:
            seen.add((times.experiment, times.has_middleware))
            yield times.experiment, "generated C, ROS", middleware, *times.paper, "", "", 3000, "the paper"


def _size_rows(sizes: Mapping[str, Sequence[CodeSize]]) -> Iterable[tuple[object, ...]]:
    for experiment, members in sizes.items():
        for size in members:
            yield experiment, size.name, "" if size.lines is None else size.lines, size.files, size.why


def _csv(header: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue().encode("utf-8")


def _cell(text: object) -> str:
    """A text for a cell of a Markdown table, none of which is markup."""
    kept = " ".join(str(text).split())
    for char in "\\|`*_[]<>":
        kept = kept.replace(char, f"\\{char}")
    return kept
