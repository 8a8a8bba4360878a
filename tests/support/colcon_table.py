"""Table of a colcon workspace: how long each package took to build, and what its tests and linters found."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

LINTERS = ("copyright", "cppcheck", "cpplint", "flake8", "lint_cmake", "mypy", "pep257", "uncrustify", "xmllint")
HEAD = ("package", "kind", "build s", "tests", "errors", "failures", "skipped", "lint tests", "lint findings")

_FINISHED = re.compile(r"^Finished <<< (\S+) \[(?:(\d+)h )?(?:(\d+)min )?([\d.]+)s\]", re.MULTILINE)
_RESULT = re.compile(r"^(.+): (\d+) tests?, (\d+) errors?, (\d+) failures?, (\d+) skipped$", re.MULTILINE)
_FOUND = re.compile(r"Found (\d+) ")
_WORD = re.compile(r"(?:^|[^a-z])(?:" + "|".join(LINTERS) + r")(?:$|[^a-z])")


class Counts(NamedTuple):
    """Tests of a result file or of several, as `colcon test-result` counts them."""

    tests: int = 0
    errors: int = 0
    failures: int = 0
    skipped: int = 0

    def plus(self, other: "Counts") -> "Counts":
        """The counts of both."""
        return Counts(*map(sum, zip(self, other, strict=True)))


@dataclass(frozen=True)
class Row:
    """A package in the table.

    Attributes:
        package: Its name.
        kind: Its kind, in words.
        build_s: Time that its build took, in seconds.
        counts: Counts of its tests.
        lint_tests: Tests of linters among them, in result files that name each test.
        lint_findings: Findings of these.
    """

    package: str
    kind: str
    build_s: float
    counts: Counts
    lint_tests: int
    lint_findings: int


def build_durations(output: str) -> dict[str, float]:
    """Return the time in seconds that each package took, from the output of `colcon build`."""
    return {
        name: int(hours or 0) * 3600.0 + int(minutes or 0) * 60.0 + float(seconds)
        for name, hours, minutes, seconds in _FINISHED.findall(output)
    }


def result_counts(output: str) -> tuple[dict[str, Counts], Counts]:
    """Return the counts of each result file by its path, and of all, from `colcon test-result --all`.

    Raises:
        AssertionError: The output has no summary.
    """
    found = {path: Counts(*map(int, counts)) for path, *counts in _RESULT.findall(output)}
    assert "Summary" in found, output
    summary = found.pop("Summary")
    return found, summary


def rows(workspace: Path, kinds: dict[str, str], built: str, tested: str) -> list[Row]:
    """Return a row for each package.

    Args:
        workspace: Folder of the workspace, which the paths of result files begin at.
        kinds: Kind of each package, by its name.
        built: Output of `colcon build`.
        tested: Output of `colcon test-result --all`.

    Raises:
        AssertionError: A package was not built, or a result is of none of them.
    """
    durations = build_durations(built)
    files, summary = result_counts(tested)
    found = []
    for package, kind in kinds.items():
        assert package in durations, f"colcon built no {package}\n{built}"
        own = [path for path in files if Path(path).parts[:2] == ("build", package)]
        counts = Counts()
        for path in own:
            counts = counts.plus(files[path])
        findings = [number for path in own for number in _findings(workspace / path)]
        found.append(Row(package, kind, durations[package], counts, len(findings), sum(findings)))
    total = Counts()
    for row in found:
        total = total.plus(row.counts)
    assert total == summary, f"results of other packages, too: {sorted(files)}"
    return found


def _findings(file: Path) -> Iterator[int]:
    """Yield the number of findings of each linter's test in a JUnit file; of CTest's own file there is none."""
    root = ElementTree.parse(file).getroot()
    is_of_linter = bool(_WORD.search(file.name))
    for case in root.iter("testcase"):
        if is_of_linter or _WORD.search(f"{case.get('classname')} {case.get('name')}"):
            failures = [*case.iter("failure"), *case.iter("error")]
            texts = [f"{item.get('message')} {item.text}" for item in failures]
            yield sum(int(match[1]) if (match := _FOUND.search(text)) else 1 for text in texts)


def table(found: Sequence[Row]) -> str:
    """Return the rows as a Markdown table with the sums below."""
    total = Counts()
    for row in found:
        total = total.plus(row.counts)
    sums = Row(
        "all", "", sum(row.build_s for row in found), total,
        sum(row.lint_tests for row in found), sum(row.lint_findings for row in found),
    )  # fmt: skip
    lines = [HEAD, ("---",) * len(HEAD)]
    lines += [
        (row.package, row.kind, f"{row.build_s:.1f}", *map(str, (*row.counts, row.lint_tests, row.lint_findings)))
        for row in (*found, sums)
    ]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
