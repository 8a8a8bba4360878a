"""The report of an evaluation, made of recorded runs: nothing is driven, nothing is waited for."""

import csv
from pathlib import Path

import pytest

from robosc_experiments.cycles.times import CycleTimes
from robosc_experiments.evaluate import reported
from robosc_experiments.lines_of_code import CodeSize
from robosc_experiments.report import FailedRun, Report, ReportedRun, machine_facts, write_report
from robosc_experiments.scenario import ScenarioError
from support.recorded_runs import recorded

NAMES = ("report.html", "report.md", "scenarios.csv", "figures.csv", "cycles.csv", "lines_of_code.csv")


def report_of(*runs: ReportedRun, failures: tuple[FailedRun, ...] = ()) -> Report:
    return Report(
        runs,
        failures,
        (
            CycleTimes("maze", "generated C, gcc -O2", False, (0.05, 0.04, 0.4, 0.01), 3000, median_us=0.04),
            CycleTimes("maze", "generated Python, rclpy", True, None, why="rclpy is not installed"),
        ),
        {
            "maze": (CodeSize("model", 80, 1), CodeSize("cif", 120, 1), CodeSize("ros1-cpp", None, why="no layers")),
            "robots/arm_$1": (CodeSize("model", 50, 2), CodeSize("cif", 125, 1), CodeSize("ros1-cpp", 1000, 9)),
            "broken": (CodeSize("model", None, why="it is <not> there"),),
        },
        machine_facts("2030-01-02"),
    )


def rows(file: Path) -> list[list[str]]:
    with file.open(newline="", encoding="utf-8") as stream:
        return list(csv.reader(stream))


def test_a_report_of_a_recorded_run_is_complete(tmp_path: Path) -> None:
    run = reported(recorded(tmp_path / "maze-serial-1"), tmp_path)
    assert (run.check.violations, run.check.events, run.check.requests) == ((), 10, 3)
    report = report_of(run)
    assert report.has_passed
    files = write_report(report, tmp_path)
    assert [file.name for file in files] == [*NAMES, "lines_of_code.png"]
    for name in ("maze-serial-1/sequence.png", "maze-serial-1/map.png", "lines_of_code.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG"), name
        assert f'src="{name}"' in (tmp_path / "report.html").read_text(encoding="utf-8")
        assert f"]({name})" in (tmp_path / "report.md").read_text(encoding="utf-8")
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "Nothing was wrong in 1 scenario." in text
    assert "| Maze solver | serial | maze-rooms | 10 | 3 | 0 | no violation | as required |" in text
    assert "| Maze solver | with | generated Python, rclpy | not measured: rclpy is not installed |" in text
    assert "| Maze solver | with | the paper's | 40 | 9 | 660 | 40 | – | – | 3000 |" in text
    assert "| Maze solver | without | generated C, gcc -O2 | 0.05 | 0.04 | 0.40 | 0.01 | 0.04 | – | 3000 |" in text
    assert "| Maze solver | without | the paper's | 2 | 0 | 139 | 7 | – | – | 3000 |" in text
    assert "| scenario | model | cif | ros1-cpp |" in text
    assert "| Maze solver | 80 | 120 (1.5) | – |" in text
    assert "| robots/arm\\_$1 | 50 | 125 (2.5) | 1000 (20.0) |" in text
    assert "| broken | – | – | – |" in text
    assert "| model | 2 | 65 |  | |  |" in text
    assert "| cif | 2 | 122.5 | 1.5 | 2.0 | 2.5 |" in text
    assert "| ros1-cpp | 1 | 1000 | 20.0 | 20.0 | 20.0 |" in text
    assert "- Maze solver, ros1-cpp: no layers\n- broken, model: it is \\<not\\> there\n" in text
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '<td>robots/arm_$1</td><td class="number">50</td><td class="number">125 (2.5)</td>' in page
    assert "<li>broken, model: it is &lt;not&gt; there</li>" in page
    assert "RoboSC's own counter" in text
    # Every table of Markdown stands alone, between blank lines.
    blocks = text.split("\n\n")
    assert all(len({line.startswith("|") for line in block.strip().split("\n")}) == 1 for block in blocks)
    assert rows(tmp_path / "scenarios.csv")[1] == ["maze", "serial", "maze-rooms", "10", "3", "0", "0", "0"]
    assert rows(tmp_path / "figures.csv")[1:] == [
        ["maze", "serial", "world_s", "0.95"], ["maze", "serial", "way_m", "0.19"],
    ]  # fmt: skip
    heads = "experiment what middleware mean_us min_us max_us sd_us median_us publish_median_us cycles by".split()
    assert rows(tmp_path / "cycles.csv")[0] == heads
    assert [row[-1] for row in rows(tmp_path / "cycles.csv")[1:]] == ["here", "the paper", "here", "the paper"]
    assert rows(tmp_path / "lines_of_code.csv")[1:] == [
        ["maze", "model", "80", "1", ""], ["maze", "cif", "120", "1", ""], ["maze", "ros1-cpp", "", "0", "no layers"],
        ["robots/arm_$1", "model", "50", "2", ""], ["robots/arm_$1", "cif", "125", "1", ""],
        ["robots/arm_$1", "ros1-cpp", "1000", "9", ""], ["broken", "model", "", "0", "it is <not> there"],
    ]  # fmt: skip


def test_what_was_wrong_is_reported_and_is_no_markup(tmp_path: Path) -> None:
    outcome = recorded(tmp_path / "maze-serial-1", faults=("it came to a <wall> | twice",))
    text = outcome.event_log.read_text(encoding="utf-8")
    outcome.event_log.write_text(text.replace('"rotate_left.request"', '"move.request"', 1), encoding="utf-8")
    run = reported(outcome, tmp_path)
    report = report_of(run, failures=(FailedRun("line", "ros1", "ROS 1 is <b>not</b> installed"),))
    assert not report.has_passed
    write_report(report, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Something was wrong in 2 of 2 scenarios." in page
    assert "it came to a &lt;wall&gt; | twice" in page
    assert "ROS 1 is &lt;b&gt;not&lt;/b&gt; installed" in page
    assert "Line 4 of the log: move.request was not allowed" in page
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "it came to a \\<wall\\> \\| twice" in text
    assert rows(tmp_path / "scenarios.csv")[2][2] == "not run: ROS 1 is <b>not</b> installed"


def test_a_run_whose_log_cannot_be_read_is_one_that_failed(tmp_path: Path) -> None:
    outcome = recorded(tmp_path / "maze-serial-1")
    outcome.event_log.write_text("{}\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match="line 1: its 'time' is not a number of seconds"):
        reported(outcome, tmp_path)
