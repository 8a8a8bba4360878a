"""The example robots: nothing to find fault with, a supervisor, and what each of them promises."""

from pathlib import Path

import pytest

from robosc.cli.main import main

EXAMPLES = Path(__file__).parents[2] / "examples"
MODELS = sorted(str(path.relative_to(EXAMPLES)) for path in EXAMPLES.glob("*/*.rscd"))

PROMISES = {
    "ball_pusher/ball_pusher.rscd": (
        "AG (enabled(push.request) => (Camera.goal_at = lined_up and Safety.contact = released))",
        "AG ((Safety.contact = pressed) => !enabled(approach.request))",
        "AG EF Striker.off",
        "reachable Striker.pushes = 3",
    ),
    "object_finder/object_finder.rscd": (
        "AG (EmergencyStop.stopped => (!enabled(approach.request) and enabled(halt.request)))",
        "AG (enabled(approach.request) => (LidarSensor.ahead = free))",
        "AG (enabled(announce.request) => (Camera.view = at_hand))",
        "AG EF Search.waiting",
    ),
    "person_follower/person_follower.rscd": (
        "AG (Button.paused => !(enabled(follow.request) or enabled(back_off.request)))",
        "AG (PersonDetector.lost => enabled(stand.request))",
        "AG (enabled(follow.request) => (LidarSensor.ahead = free and PersonDetector.person = away))",
        "AG EF enabled(follow.request)",
    ),
}


@pytest.mark.parametrize("model", MODELS)
def test_it_is_reported_in_the_list(model: str) -> None:
    assert f"]({model})" in (EXAMPLES / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("model", sorted(PROMISES))
def test_it_has_no_findings(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", str(EXAMPLES / model), "-o", str(tmp_path / "made.rsup")]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for line in ("finite response", "confluence", "safe", "controllable", "nonblocking", "maximally permissive"):
        assert f"    {line:20}  passed" in out


@pytest.mark.parametrize("model", sorted(PROMISES))
def test_it_keeps_its_promises(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    asked = [word for promise in PROMISES[model] for word in ("--property", promise)]
    assert main(["verify", str(EXAMPLES / model), *asked]) == 0, capsys.readouterr().out


@pytest.mark.parametrize("model", sorted(PROMISES))
def test_it_can_be_generated(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", str(EXAMPLES / model), "--target", "all", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "python").is_dir()
    assert (tmp_path / "cif" / "controller.cif").is_file()
