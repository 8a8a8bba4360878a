"""Tests of a scenario's refusals before anything is started, and of its reports while it runs."""

from pathlib import Path

import pytest

from robosc.language import load_bundle
from robosc.model.check import check
from robosc.model.structure import Deployment
from robosc_bridge.assembly import check_settings
from robosc_bridge.configuration import map_channels, parse
from robosc_experiments import line, maze
from robosc_experiments.maze import run_maze
from robosc_experiments.scenario import ScenarioError
from robosc_experiments.serial import FASTEST, SLOWEST, Setting, configuration, scene_of
from robosc_experiments.tail import LineCount, latest


def quiet(text: str) -> None:
    """Drop progress."""


@pytest.mark.parametrize("speed", [SLOWEST, 1.0, 5.0, 20.0, FASTEST])
@pytest.mark.parametrize("name", ["maze", "line"])
def test_the_configuration_is_one_that_the_bridge_takes(name: str, speed: float, tmp_path: Path) -> None:
    scenario, deployment, camera = {
        "maze": (maze, Deployment.CONTROLLER, None),
        "line": (line, Deployment.LAYER, "/tmp/camera"),
    }[name]
    scene = scene_of(scenario.SCENES[0], 0)
    skills = line.SKILLS if name == "line" else {}
    setting = Setting(
        tmp_path, scenario.MODEL, deployment, scene, scenario.SCENES[0], 0, speed, "lds01", scenario.CHANNELS, skills
    )
    text = configuration(setting, "/dev/base", "/dev/scanner", camera)
    loaded = parse(text.encode(), "bridge.yaml")
    model = check(load_bundle(scenario.MODEL)).model
    assert model is not None
    mapping = map_channels(model, loaded.configuration, loaded.document)
    check_settings(loaded.configuration, mapping, deployment)


def test_a_scene_without_a_goal_is_no_maze(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="the scene room has no goal"):
        run_maze(tmp_path / "run", "room", speed=5, say=quiet)


def test_a_scene_without_a_line_is_none_to_follow(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="the scene room needs a line"):
        line.run_line(tmp_path / "run", "room", speed=5, say=quiet)


@pytest.mark.parametrize("speed", [0.0, -1.0, 1000.0, float("nan")])
def test_a_speed_that_cannot_be_is_refused(speed: float, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="the speed must be from"):
        run_maze(tmp_path / "run", "maze-rooms", speed=speed, say=quiet)
    assert not (tmp_path / "run").exists()


def test_a_folder_with_something_in_it_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("")
    with pytest.raises(ScenarioError, match="is not empty"):
        run_maze(tmp_path, "maze-rooms", speed=5, say=quiet)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


def test_the_latest_sample_is_the_last_whole_one(tmp_path: Path) -> None:
    motion = tmp_path / "motion.jsonl"
    assert latest(motion).world_s == 0.0
    sample = (
        '{"time":1.0,"world_s":%s,"x_m":2.0,"y_m":3.0,"heading_rad":0,'
        '"linear_m_s":0.1,"angular_rad_s":0,"collisions":1}'
    )
    event = '{"time":1.0,"world_s":7.0,"happening":"collision","x_m":2.0,"y_m":3.0}'
    motion.write_text("\n".join([sample % 5.0, sample % 6.0, event, (sample % 8.0)[:40]]))
    now = latest(motion)
    assert (now.world_s, now.x_m, now.y_m, now.collisions, now.is_standing) == (6.0, 2.0, 3.0, 1, False)


def test_lines_are_counted_as_they_come(tmp_path: Path) -> None:
    file = tmp_path / "log"
    count = LineCount(file)
    assert count.poll() == 0
    file.write_text("a\nb\nc")
    assert count.poll() == 2
    with file.open("a") as stream:
        stream.write("\nd\n")
    assert count.poll() == 4
