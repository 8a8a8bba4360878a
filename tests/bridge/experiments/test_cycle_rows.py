"""Rows of Table I, with what a machine has or lacks: nothing is compiled or measured."""

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from robosc.supervisor import Supervisor
from robosc_experiments.cycles import driving, measure
from robosc_experiments.cycles.driving import measured_driving
from robosc_experiments.cycles.rclcpp import rclcpp_prefix
from robosc_experiments.report import machine_facts
from support.generated import example_supervisor

NOT_INSTALLED = "rclcpp is not installed: no folder of AMENT_PREFIX_PATH or CMAKE_PREFIX_PATH has it"


@pytest.fixture
def supervisor() -> Supervisor:
    return example_supervisor("maze_solver/narrow_maze")


@pytest.fixture(autouse=True)
def _without_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "python"))


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of AMENT_PREFIX_PATH, the second one, in which CMake would find rclcpp."""
    found = tmp_path / "ros"
    (found / "share" / "rclcpp" / "cmake").mkdir(parents=True)
    (found / "share" / "rclcpp" / "cmake" / "rclcppConfig.cmake").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path / 'mine'}:{found}")
    return found


def test_a_table_has_a_row_for_each_language_and_middleware(
    supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch
) -> None:
    def alone(experiment: str, given: Supervisor, runs: int, cycles: int) -> list[float]:
        return [1e-6] * (runs * cycles)

    def drive(middleware: str, experiment: str, given: Supervisor, runs: int, cycles: int) -> Any:
        if middleware == "rclcpp":
            return NOT_INSTALLED
        return {"cycle": [len(middleware) * 1e-6] * (runs * cycles), "publish": [1e-6]}

    monkeypatch.setattr(measure, "measured_c", alone)
    monkeypatch.setattr(measure, "measured_python", alone)
    monkeypatch.setattr(measure, "measured_driving", drive)
    found = measure.measure("maze", supervisor, 2, 3)
    assert [(row.what, row.has_middleware, row.count, row.why) for row in found] == [
        ("generated C, gcc -O2", False, 6, ""),
        ("generated Python", False, 6, ""),
        ("generated C, roscpp", True, 6, ""),
        ("generated C, rclcpp", True, 0, NOT_INSTALLED),
        ("generated Python, rclpy", True, 6, ""),
        ("generated Python, rospy", True, 6, ""),
    ]
    assert (found[2].median_us, found[4].median_us) == pytest.approx((6, 5))


def test_a_report_names_the_version_of_rclcpp(prefix: Path) -> None:
    assert machine_facts("2030-01-02")["rclcpp"] == f"unknown version in {prefix}"
    text = "<package><name>rclcpp</name><version>28.1.6</version></package>"
    (prefix / "share" / "rclcpp" / "package.xml").write_text(text, encoding="utf-8")
    assert machine_facts("2030-01-02")["rclcpp"] == f"28.1.6 in {prefix}"


def test_a_machine_without_rclcpp_has_no_row_of_it(supervisor: Supervisor) -> None:
    assert rclcpp_prefix() is None
    assert "rclcpp" not in machine_facts("2030-01-02")
    assert measured_driving("rclcpp", "maze", supervisor, 1, 1) == NOT_INSTALLED


@pytest.mark.usefixtures("prefix")
def test_a_machine_without_a_compiler_has_no_row_of_rclcpp(
    supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert measured_driving("rclcpp", "maze", supervisor, 1, 1) == "cmake, gcc or g++ is not installed"


def test_a_program_is_built_with_the_rclcpp_that_is_installed(
    supervisor: Supervisor, prefix: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[list[str], dict[str, str]]] = []

    def run(command: Sequence[str], *, cwd: Path, **_: Any) -> None:
        calls.append((list(command), {file.name: file.read_text("utf-8") for file in cwd.iterdir() if file.is_file()}))

    def ran(ros: Any, command: Sequence[str], folder: Path) -> Any:
        calls.append((list(command), {}))
        return {"cycle": [1.0], "publish": [1.0]}

    monkeypatch.setattr("shutil.which", lambda name: f"/bin/{name}")
    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(driving, "_run", ran)
    assert measured_driving("rclcpp", "maze", supervisor, 2, 7) == {"cycle": [1.0], "publish": [1.0]}
    (configure, files), (build, _), (program, _) = calls
    assert f"-DCMAKE_PREFIX_PATH={prefix.parent / 'mine'};{prefix};{sys.prefix}" in configure
    assert (configure[0], build) == ("/bin/cmake", ["/bin/cmake", "--build", "build"])
    assert "find_package(rclcpp REQUIRED)" in files["CMakeLists.txt"]
    assert "driving.cpp narrow_maze_supervisor.c" in files["CMakeLists.txt"]
    # Its own libraries come before those of wheels.
    assert program[:2] == ["/usr/bin/env", f"LD_LIBRARY_PATH={prefix / 'lib'}"]
    assert program[-2:] == ["2", "7"]
    # No place is left to fill in.
    assert not re.findall(r"@\w+@", files["CMakeLists.txt"] + files["driving.cpp"])


@pytest.mark.usefixtures("prefix")
@pytest.mark.parametrize(
    ("errors", "reason"),
    [
        ("a.cpp:1:2: error: no such thing\ngmake: *** [all] Error 2\n", "a.cpp:1:2: error: no such thing"),
        (
            "CMake Error at CMakeLists.txt:9 (find_package):\n\nmore\n",
            "CMake Error at CMakeLists.txt:9 (find_package):",
        ),
        ("Traceback\nValueError: no\n", "ValueError: no"),
        ("", "without a word"),
    ],
)
def test_a_reason_is_the_first_error(
    errors: str, reason: str, supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(command: Sequence[str], **_: Any) -> None:
        raise subprocess.CalledProcessError(2, list(command), stderr=errors)

    monkeypatch.setattr("shutil.which", lambda name: f"/bin/{name}")
    monkeypatch.setattr(subprocess, "run", fail)
    assert measured_driving("rclcpp", "maze", supervisor, 1, 1) == f"it failed: {reason}"
