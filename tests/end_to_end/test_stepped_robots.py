"""Every example robot that a planar world carries, driven in the twin on a clock that the test moves.

Each does what it is for, for a while; then its log is checked against its supervisor, and its motion against the scene.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc_simulated import PROFILES, Motion, Obstacle, Scene, load_scene, maze_scene, room
from robosc_simulated.motion_checks import Halt, check_line, check_maze
from support.models import EXAMPLES
from support.stepped_twin import SteppedTwin

pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

Judge = Callable[[Motion], tuple[str, ...]]

BOX, PERSON = "box", "person"


def hall(person_x_m: float) -> Scene:
    """Walls that the LiDAR does not reach, and a person."""
    return Scene("hall", room(12.0, 12.0), obstacles=(Obstacle(PERSON, person_x_m, 0.0, 0.2),))


def get_out(twin: SteppedTwin) -> Judge:
    """The mazes are solved whole."""
    twin.until(lambda: twin.world.reached_s is not None, "the goal", 400.0)
    return lambda motion: check_maze(twin.world.scene, motion)


def follow_the_line(twin: SteppedTwin) -> Judge:
    """A box on the line and the stop button bring it to rest, and it goes on afterwards."""
    halts = []
    twin.drive(0.4, "the robot to drive along the line")
    twin.world.move_obstacle(BOX, twin.place[0] + 0.4, twin.place[1] + 0.05)
    halts.append(Halt(*twin.stand("the robot to stand before the box"), "for the box"))
    twin.world.put_obstacle(BOX, False)
    twin.drive(0.3, "the robot to go on without the box")
    twin.receive("/emergency_stop/stop")
    halts.append(Halt(*twin.stand("the robot to stand after the stop button"), "after the stop button"))
    twin.receive("/emergency_stop/resume")
    twin.drive(0.3, "the robot to go on after the other button")
    return lambda motion: check_line(twin.world.scene, motion, halts, lateral_m=0.025, least_m=1.0)


def follow_the_line_without_care(twin: SteppedTwin) -> Judge:
    """The same, with a follower that never heeds box or button."""
    check = follow_the_line(twin)
    assert twin.held_back > 20
    return check


def follow_the_person(twin: SteppedTwin) -> Judge:
    """Follow: the robot catches up, backs off, faces, pauses by its button, and stands without a person."""

    def gap_m() -> float:
        (person,) = twin.world.obstacles
        return person.x_m - person.radius_m - twin.place[0]

    twin.drive(0.2, "the robot to follow")
    twin.stand("the robot to have caught up")
    assert 1.05 < gap_m() < 1.25
    x_m, y_m = twin.place
    twin.world.move_obstacle(PERSON, x_m + 0.7, y_m)
    twin.drive(0.05, "the robot to back off")
    twin.receive("/button")
    twin.stand("the button to pause it")
    twin.receive("/button")
    twin.drive(0.03, "the robot to back off on")
    twin.stand("the robot to be far enough away")
    # From the LiDAR, which is behind its middle, to the middle of the arc that it sees of the person: 0.8 m; more with
    # noise, since one near sample is enough to back off on.
    assert 0.6 < gap_m() < 0.85
    twin.world.move_obstacle(PERSON, x_m + 1.8, y_m)
    twin.drive(0.2, "the robot to follow again")
    twin.world.put_obstacle(PERSON, False)
    twin.stand("the robot to stand without anybody")
    return lambda motion: ("touched something",) if motion.samples[-1].collisions else ()


def navigate(twin: SteppedTwin) -> Judge:
    """Navigate: the robot waits until no person is near, is calibrated and drives to its goal."""
    twin.go_on(3.0)
    assert twin.place == (0.0, 0.0)
    assert twin.called == ["calibrate"]
    twin.world.move_obstacle(PERSON, -3.0, 0.0)
    twin.until(lambda: twin.place[0] > 1.9, "the robot to come to its goal")
    twin.stand("the robot to stand at its goal")
    assert twin.place == pytest.approx((2.0, 0.5), abs=0.06)
    return lambda motion: ("touched something",) if motion.samples[-1].collisions else ()


def make_a_round(twin: SteppedTwin) -> Judge:
    """Make a round: the courier comes to each room, through the door of one of them."""
    for x_m, y_m in ((1.5, 2.0), (3.5, 0.0), (1.5, -2.0)):
        twin.until(lambda: math.dist(twin.place, (x_m, y_m)) < 0.2, f"the room at {x_m}, {y_m}", 150.0)  # noqa: B023
    return lambda motion: ("touched something",) if motion.samples[-1].collisions else ()


@dataclass(frozen=True)
class Play:
    """Activity of a robot.

    Attributes:
        scene: Function that makes the scene.
        act: Function that lets the robot act; returns the judge of its motion.
        deployment: Deployment of its supervisor.
    """

    scene: Callable[[], Scene]
    act: Callable[[SteppedTwin], Judge]
    deployment: Deployment = Deployment.CONTROLLER


PLAYS = {
    "maze_solver/maze_solver": Play(lambda: load_scene("maze-rooms"), get_out),
    "maze_solver/narrow_maze": Play(lambda: maze_scene(3, 3, cell_m=0.6, seed=2), get_out),
    "line_follower/line_follower": Play(lambda: load_scene("line-oval"), follow_the_line),
    "line_follower/line_follower_layer": Play(
        lambda: load_scene("line-oval"), follow_the_line_without_care, Deployment.LAYER
    ),
    "person_follower/person_follower": Play(lambda: hall(1.9), follow_the_person),
    "courier/courier": Play(lambda: load_scene("rooms"), make_a_round),
    "navigation/navigation": Play(lambda: hall(1.0), navigate),
}
NOT_CARRIED = {"object_finder/object_finder", "ball_pusher/ball_pusher"}
"""The camera has no colours and nothing can be pushed; docs/twin.md tells more."""


@pytest.mark.parametrize(("profile", "seed"), [("ideal", 0), ("typical", 1), ("bad-day", 2), ("bad-day", 3)])
@pytest.mark.parametrize("model", PLAYS)
def test_it_does_what_it_is_for_and_only_what_its_supervisor_allows(
    model: str, profile: str, seed: int, tmp_path: Path
) -> None:
    play = PLAYS[model]
    with SteppedTwin(model, play.scene(), tmp_path, play.deployment, seed, PROFILES[profile]) as twin:
        check = play.act(twin)
        motion, wrong = twin.finish()
    assert wrong == ()
    assert check(motion) == ()


def test_every_example_robot_is_driven_or_told_why_not() -> None:
    models = {str(path.relative_to(EXAMPLES).with_suffix("")) for path in EXAMPLES.glob("*/*.rscd")}
    assert models == {*PLAYS, *NOT_CARRIED}
    page = (EXAMPLES.parent / "docs" / "twin.md").read_text(encoding="utf-8")
    for model in models:
        assert f"`{Path(model).name}`" in page


def test_two_runs_are_the_same(tmp_path: Path) -> None:
    """With slip and noise, by their seed."""
    scene = replace(load_scene("line-curves", 3), name="curves")
    records = []
    for number in (1, 2):
        folder = tmp_path / str(number)
        folder.mkdir()
        with SteppedTwin("line_follower/line_follower", scene, folder, seed=3) as twin:
            twin.go_on(8.0)
            records.append([(each.x_m, each.y_m) for each in twin.finish()[0].samples])
    assert records[0] == records[1]
    assert records[0][-1][0] > 0.8
