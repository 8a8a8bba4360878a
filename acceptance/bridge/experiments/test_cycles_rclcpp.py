"""The program that is measured with rclcpp, built by CMake on a stand-in for it: no figure of it goes into a report."""

import shutil
import sys
from pathlib import Path

import pytest

from robosc_experiments.cycles import driving
from robosc_experiments.cycles.driving import measured_driving
from robosc_experiments.cycles.rclcpp import rclcpp_prefix
from support.generated import example_supervisor
from support.rclcpp_nodes import STAND_IN, missing

pytestmark = pytest.mark.skipif(
    bool(missing("geometry_msgs")) or shutil.which("cmake") is None,
    reason=missing("geometry_msgs") or "cmake is not installed",
)

_PACKAGE = """if(NOT TARGET {name}::{name})
  add_library({name}::{name} INTERFACE IMPORTED)
  set_target_properties({name}::{name} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "{folders}")
  set({name}_TARGETS {name}::{name})
endif()
"""


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which the stand-in is installed, as CMake finds it."""
    headers = [path for path in sorted((Path(sys.prefix) / "include").iterdir()) if path.is_dir()]
    for name, folders in (("rclcpp", [STAND_IN, *headers]), ("geometry_msgs", headers)):
        place = tmp_path / "stand in" / "share" / name / "cmake"
        place.mkdir(parents=True)
        text = _PACKAGE.format(name=name, folders=";".join(map(str, folders)))
        (place / f"{name}Config.cmake").write_text(text, encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "stand in"))
    return tmp_path / "stand in"


@pytest.mark.parametrize(
    ("experiment", "model"), [("maze", "maze_solver/narrow_maze"), ("line", "line_follower/line_follower_layer")]
)
def test_the_program_drives(experiment: str, model: str, stand_in: Path) -> None:
    assert rclcpp_prefix() == stand_in
    found = measured_driving("rclcpp", experiment, example_supervisor(model), 2, 5)
    assert not isinstance(found, str), found
    assert {name: len(samples) for name, samples in found.items()} == {"cycle": 10, "publish": 10}
    assert all(sample > 0 for samples in found.values() for sample in samples)


@pytest.mark.usefixtures("stand_in")
def test_what_does_not_build_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driving, "_FLAGS", ("--not-a-flag",))
    found = measured_driving("rclcpp", "maze", example_supervisor("maze_solver/narrow_maze"), 1, 1)
    assert isinstance(found, str)
    assert found.startswith("it failed: ")
