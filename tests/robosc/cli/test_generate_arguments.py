"""`generate`: what it may be asked, what it refuses, and the list of what can be generated."""

import json
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main
from robosc.targets import ALL, available_targets
from robosc_client.main import main as client_main
from support.models import EXAMPLES

LINE_FOLLOWER = str(EXAMPLES / "line_follower" / "line_follower.rscd")
PROGRAMS = pytest.mark.parametrize("run", [main, client_main], ids=["robosc", "robosc-client"])


def refused(capsys: pytest.CaptureFixture[str], run: Any, *words: str) -> str:
    """Return the error message for wrong use."""
    try:
        status = run(list(words))
    except SystemExit as raised:
        status = raised.code
    captured = capsys.readouterr()
    assert (status, captured.out) == (2, "")
    return captured.err.splitlines()[-1]


@PROGRAMS
def test_the_list_of_targets(run: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["generate", "--list-targets"]) == 0
    lines = capsys.readouterr().out.splitlines()
    names = [*(target.name for target in available_targets()), ALL]
    assert [line.split()[0] for line in lines] == names
    for words in (["--list-targets", "--json"], ["--json", "--list-targets"]):
        assert run(["generate", *words]) == 0
        document = json.loads(capsys.readouterr().out)
        assert [f"{item['name']:10} {item['description']}" for item in document["targets"]] == lines
    assert "--nonsense" in refused(capsys, run, "generate", "--list-targets", "--nonsense")


@PROGRAMS
def test_without_the_list_a_model_and_a_target_are_needed(run: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--target" in refused(capsys, run, "generate", LINE_FOLLOWER)
    assert "MODEL" in refused(capsys, run, "generate", "--target", "c99")


@PROGRAMS
def test_there_is_one_target(run: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = tmp_path / "out"
    words = ["generate", LINE_FOLLOWER, "--target", "python", "--target", "c99", "-o", str(folder)]
    assert "may be given once" in refused(capsys, run, *words)
    assert not folder.exists()


@PROGRAMS
def test_an_empty_folder_is_not_this_one(
    run: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert "is empty" in refused(capsys, run, "generate", LINE_FOLLOWER, "--target", "ros2", "-o", "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ["check", ""],
        ["synth", LINE_FOLLOWER, "-o", ""],
        ["synth", LINE_FOLLOWER, "-L", ""],
        ["check", LINE_FOLLOWER, "-I", ""],
        ["doc", LINE_FOLLOWER, "-o", ""],
        ["plot", "log.jsonl", "-o", ""],
        ["check-log", "", "--model", LINE_FOLLOWER],
        ["check-log", "log.jsonl", "--model", ""],
        ["new", "Robot", "--folder", ""],
        ["key", ""],
        ["sign", "robot.rsup", "--key", ""],
        ["verify", LINE_FOLLOWER, "--properties", ""],
        ["verify", "robot.rsup", "--signed-by", ""],
    ],
)
def test_an_empty_name_of_a_file_is_wrong_use(
    words: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert "the name of a file or folder is empty" in refused(capsys, main, *words)
    assert list(tmp_path.iterdir()) == []


@PROGRAMS
@pytest.mark.parametrize("target", ["python", "ros2", "promela", ALL])
@pytest.mark.parametrize("name", ["9 bad", "../beside", "class", ""])
def test_a_package_that_cannot_be_called_so(
    run: Any, target: str, name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    words = ["generate", LINE_FOLLOWER, "--target", target, "-o", str(folder), "--package", name]
    if run is client_main:
        words += ["--server", "127.0.0.1:1"]
    assert f"'{name}' is not a name for a package" in refused(capsys, run, *words)
    assert list(tmp_path.iterdir()) == []


def test_the_help_explains_changed_files(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["generate", LINE_FOLLOWER, "--target", "python", "-o", str(tmp_path)]
    assert main(words) == 0
    next(tmp_path.glob("*.py")).write_text("changed")
    assert main(words) == 1
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(["generate", "--help"])
    help_text = " ".join(capsys.readouterr().out.partition("exit status:")[2].split())
    assert "1 nothing is written: " in help_text
    assert "files were changed since they were generated" in help_text


POSE = """robot Pose {
    interface pose use Pose2D from geometry_msgs
    datatype object Pose { theta: double }
    component C {
        outgoing message pose with identifier: "/pose", type: Pose links pose
        incoming message go with identifier: "/go", type: none
        behaviour { variable theta: double = 0.0 on response from pose do theta := value.theta
            initial marked state s { on request to go } }
    }
}
"""


def pose_words(tmp_path: Path, target: str) -> list[str]:
    model = tmp_path / "pose.rscd"
    model.write_text(POSE, encoding="utf-8")
    words = ["generate", str(model), "--target", target, "-o", str(tmp_path / f"out_{target}")]
    return [*words, "--maintainer", "Jane Doe <jane@example.org>"]


@pytest.mark.parametrize(
    ("distribution", "status"), [("jazzy", 0), ("kilted", 0), ("humble", 0), ("lyrical", 1), ("", 0), ("sourced", 1)]
)
def test_a_package_is_refused_for_a_distribution_that_lacks_something(
    distribution: str, status: int, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DISTRO", "lyrical" if distribution == "sourced" else "")
    chosen = ["--distribution", distribution] if distribution not in ("", "sourced") else []
    assert main([*pose_words(tmp_path, "ros2"), *chosen]) == status
    captured = capsys.readouterr()
    text = "geometry_msgs of ROS 2 Lyrical has no message 'Pose2D'; it fits ROS 2 Humble, Jazzy and Kilted"
    assert (text in captured.out + captured.err) is (status == 1)


def test_a_distribution_of_the_other_ros_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for target, distribution in (("ros1", "jazzy"), ("ros2-cpp", "noetic")):
        error = refused(capsys, main, *pose_words(tmp_path, target), "--distribution", distribution)
        assert f"--distribution {distribution} is of ROS" in error
    assert "rolling" in refused(capsys, main, *pose_words(tmp_path, "ros2"), "--distribution", "rolling")


def test_a_sourced_distribution_of_the_other_ros_is_left_aside(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DISTRO", "lyrical")
    assert main(pose_words(tmp_path, "ros1")) == 0
    monkeypatch.setenv("ROS_DISTRO", "noetic")
    assert main(pose_words(tmp_path, "ros2")) == 0
    capsys.readouterr()
