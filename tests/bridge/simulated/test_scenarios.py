"""The example robots that the bridge carries, on ideal, typical and bad days: whole bridges on virtual time."""

import math
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc_bridge.daemon.programs.items import (
    Attached,
    CallMade,
    CancelMade,
    FeedbackGiven,
    GoalAccepted,
    GoalEnded,
    GoalMade,
    MessageReceived,
    MessageSent,
    Program,
    Replied,
    ToProgram,
)
from robosc_examples.house import House
from robosc_examples.house import Settings as HouseSettings
from robosc_examples.persons import Person
from robosc_experiments.maze import CHANNELS, MODEL
from robosc_experiments.serial import Setting, configuration
from robosc_simulated import Obstacle, Scene, load_scene, maze_scene, room
from support.models import EXAMPLES
from support.scenario_runs import Companion, ScenarioRun, maze_run, scenario_run

DAYS = [("ideal", 0), ("typical", 1), ("bad-day", 2), ("bad-day", 3)]
BOX, PERSON = "box", "person"
LINE = """skills: {emergency_stop: {stop_buttons: [button_1], resume_buttons: [button_2]}}
channels:
  /scan: {channel: scanner}
  /line/correction: {channel: line}
  /line/lost: {channel: line_lost}
  /emergency_stop/stop: {channel: emergency_stop, event: stop}
  /emergency_stop/resume: {channel: emergency_stop, event: resume}
  /cmd_vel: {channel: drive}
"""
PERSONS = """remote: {grpc_address: "127.0.0.1:0"}
safety: {stops_when_blind: false}
channels: {/person: {channel: grpc}, /scan: {channel: scanner}, /button: {channel: button, name: button_1},
  /cmd_vel: {channel: drive}}
"""
GOALS = """remote: {grpc_address: "127.0.0.1:0"}
channels: {/calibrate: {channel: grpc}, /person/distance: {channel: grpc}, /navigate_to_pose: {channel: grpc},
  /button: {channel: button, name: button_1}}
"""
FACTOR = 4.0
"""Speed of the world of a courier, whose rounds are long, as a multiple of the bridge's clock."""

_PAGE = (EXAMPLES / "courier" / "README.md").read_text(encoding="utf-8")
HOUSE = _PAGE.partition("```yaml\n")[2].partition("```")[0].replace(":50061", ":0")
"""Remote endpoint and channels of the courier, as its page shows them."""


def hall(person_x_m: float, width_m: float) -> Scene:
    """A person in a hall, which an LDS-01 does not see from 12 m on: noise makes far walls look like several things."""
    return Scene("hall", room(width_m, width_m), obstacles=(Obstacle(PERSON, person_x_m, 0.0, 0.2),))


# The mazes of the package are solved in acceptance/: they are long.
@pytest.mark.parametrize("model", ["maze_solver", "narrow_maze"])
@pytest.mark.parametrize(("profile", "seed"), DAYS)
def test_a_maze_is_solved(model: str, profile: str, seed: int) -> None:
    base, lidar = ("opencr", "lds01") if seed % 2 else ("dynamixel", "lds02")
    with maze_run(maze_scene(2, 1), profile=profile, base=base, lidar=lidar, seed=seed, model=model) as run:
        run.until_reached(100.0)


@pytest.mark.parametrize(("profile", "speed"), [("bad-day", 10.0), ("typical", 20.0)])
def test_a_maze_is_solved_in_a_fast_world(profile: str, speed: float, tmp_path: Path) -> None:
    """With the settings that scenarios have at such a speed: what fails in real time is short of computing time."""
    scene = maze_scene(2, 2, seed=1)
    setting = Setting(tmp_path, MODEL, Deployment.CONTROLLER, scene, "", 1, speed, "lds02", CHANNELS, {})
    text = configuration(setting, "DRIVE", "SCANNER", None).partition("\nexecution:")[2]
    settings = f"execution:{text}"
    with scenario_run(
        "maze_solver/narrow_maze", scene, settings, profile=profile, lidar="lds02", seed=1, factor=speed
    ) as run:
        run.until_reached(60.0)


@pytest.mark.parametrize(("profile", "seed"), DAYS)
def test_a_line_is_followed_and_box_and_button_stop_the_robot(profile: str, seed: int) -> None:
    scene = load_scene("line-oval", seed)
    with scenario_run("line_follower/line_follower", scene, LINE, profile=profile, seed=seed) as run:
        run.drive(0.5, "the robot to drive along the line")
        world = run.robot.world
        aside_m = [scene.line.distance_m(*world.pose[:2])] if scene.line is not None else []
        x_m, y_m, heading_rad = world.pose
        world.move_obstacle(BOX, x_m + 0.45 * math.cos(heading_rad), y_m + 0.45 * math.sin(heading_rad))
        run.stand("the robot to stand before the box")
        world.put_obstacle(BOX, False)
        run.drive(0.3, "the robot to go on without the box")
        run.press("button_1")
        run.stand("the robot to stand after the stop button")
        run.press("button_2")
        run.drive(0.3, "the robot to go on after the other button")
        assert scene.line is not None
        aside_m.append(scene.line.distance_m(*world.pose[:2]))
        assert max(aside_m) < 0.03


@pytest.mark.parametrize(("profile", "seed"), DAYS)
def test_a_person_is_followed_and_left_alone(profile: str, seed: int) -> None:
    with scenario_run("person_follower/person_follower", hall(1.9, 12.0), PERSONS, profile=profile, seed=seed) as run:
        Companion(run, "/person", _place, frozenset())
        run.drive(0.2, "the robot to follow")
        # A range with noise is near the threshold for a while.
        run.stand("the robot to have caught up", within_m=0.06)
        x_m = run.robot.world.pose[0]
        assert 0.95 < 1.7 - x_m < 1.35
        run.robot.world.move_obstacle(PERSON, x_m + 0.7, 0.0)
        run.drive(0.05, "the robot to back off")
        run.press("button_1")
        run.stand("the button to pause it")
        run.press("button_1")
        run.stand("the robot to be far enough away", within_m=0.06)
        run.robot.world.move_obstacle(PERSON, 2.9, 0.0)
        run.drive(0.2, "the robot to follow again")
        run.robot.world.put_obstacle(PERSON, False)
        run.stand("the robot to stand without anybody")


def _place(person: Person | None) -> object:
    if person is None:
        return {"x": 0.0, "y": 0.0, "z": 0.0}
    return {"x": person.ahead_m, "y": person.left_m, "z": person.confidence}


class Navigator(Companion):
    """Program that answers the action and the service of the navigation robot, and finds persons.

    The robot stands meanwhile: nothing of that model reaches the wheels through the bridge.
    """

    def __init__(self, run: ScenarioRun) -> None:
        super().__init__(run, "/person/distance", lambda person: person.distance_m if person else 3.5, SERVED)
        self.calls = 0

    def take[Kind](self, kind: type[Kind]) -> Kind | None:
        """Return the oldest item of a kind, which is done with then."""
        for item in self.received:
            if isinstance(item, kind):
                self.received.remove(item)
                return item
        return None

    def await_one[Kind](self, run: ScenarioRun, kind: type[Kind]) -> Kind:
        """Wait for an item of a kind."""
        found: list[Kind] = []

        def has_come() -> bool:
            item = self.take(kind)
            if item is not None:
                found.append(item)
            return bool(found)

        run.until(has_come, kind.__name__)
        return found[0]


SERVED = frozenset({"calibrate", "navigate"})


@pytest.mark.parametrize(("profile", "seed"), DAYS)
def test_a_goal_is_given_up_for_a_person_and_taken_up_again(profile: str, seed: int) -> None:
    with scenario_run("navigation/navigation", hall(1.0, 6.0), GOALS, profile=profile, lidar="lds02", seed=seed) as run:
        server = Navigator(run)
        call = server.await_one(run, CallMade)
        server.say(Replied(server.program, call.number, {"success": True}))
        run.live(3.0)
        assert server.take(GoalMade) is None
        run.robot.world.put_obstacle(PERSON, False)
        goal = server.await_one(run, GoalMade)
        server.say(GoalAccepted(server.program, goal.number))
        server.say(FeedbackGiven(server.program, goal.number, {"distance_remaining": 2.0, "number_of_recoveries": 0}))
        # Noise, lost beams and a LiDAR that stalls are no person.
        run.live(10.0)
        assert server.take(CancelMade) is None
        run.robot.world.put_obstacle(PERSON, True)
        assert server.await_one(run, CancelMade).number == goal.number
        server.say(GoalEnded(server.program, goal.number, "cancelled", None))
        run.live(2.0)
        assert server.take(GoalMade) is None
        run.robot.world.put_obstacle(PERSON, False)
        for _ in range(3):
            goal = server.await_one(run, GoalMade)
            server.say(GoalEnded(server.program, goal.number, "aborted", None))
        # After three failures, until the button is pressed.
        run.live(3.0)
        assert server.take(GoalMade) is None
        run.press("button_1")
        goal = server.await_one(run, GoalMade)
        server.say(GoalEnded(server.program, goal.number, "succeeded", {"error_code": 0}))
        assert run.is_standing


class Keeper:
    """Program that is door, tray and battery of the courier, and the persons who order it.

    Args:
        run: Scenario that it belongs to.
        settings: Settings of door, tray and battery.
    """

    def __init__(self, run: ScenarioRun, settings: HouseSettings) -> None:
        self.house = House(settings)
        self.received: list[str] = []
        self._run = run
        self._new: list[ToProgram] = []
        self._program = Program("keeper", self._new.append, frozenset())
        run.machine.operations.post(Attached(self._program))
        run.host.thread(self._work, "keeper").start()

    def say(self, identifier: str, data: object = None) -> None:
        """Send the courier a message."""
        self._run.machine.operations.post(MessageReceived(self._program, identifier, data))

    def _work(self) -> None:
        robot = self._run.robot
        while self._run.thread.is_alive():
            while self._new:
                item = self._new.pop(0)
                if isinstance(item, MessageSent):
                    self.received.append(item.identifier)
                    self.house.receive(item.identifier)
            x_m, y_m, _ = robot.world.pose
            reported = self.house.advance(robot.world.time.world_s(), x_m, y_m)
            robot.world.put_obstacle("door", not self.house.is_door_open)
            assert robot.opencr is not None
            robot.opencr.set_battery(self.house.battery_v)
            for identifier in reported:
                self.say(identifier)
            self._run.host.sleep(0.05)


def test_a_courier_makes_its_rounds_answers_and_charges() -> None:
    with scenario_run("courier/courier", load_scene("rooms"), HOUSE, profile="typical", seed=1, factor=FACTOR) as run:
        keeper = Keeper(run, HouseSettings(opens_after_s=10.0, drain_v_s=0.006))

        def is_near(x_m: float, y_m: float) -> bool:
            return math.dist(run.robot.world.pose[:2], (x_m, y_m)) < 0.25

        run.until(lambda: is_near(1.5, 2.0), "the kitchen", 60.0)
        keeper.say("/order", "office")
        run.until(lambda: "/tray/unlock" in keeper.received, "the tray to be unlocked", 300.0)
        assert is_near(3.5, 0.0)
        assert run.is_standing
        run.until(lambda: "/tray/lock" in keeper.received, "the tray to be locked")
        run.until(lambda: keeper.house.battery_v < 11.4, "a low battery", 300.0)
        assert "/door/open" in keeper.received
        run.until(lambda: is_near(0.0, 0.0) and run.is_standing, "the dock", 300.0)
        run.until(lambda: keeper.house.battery_v > 12.3, "a full battery", 60.0)
        run.until(lambda: not is_near(0.0, 0.0), "the robot to go on")


def test_a_courier_waits_safely_before_a_door_that_never_opens() -> None:
    with scenario_run("courier/courier", load_scene("rooms"), HOUSE, factor=FACTOR) as run:
        keeper = Keeper(run, HouseSettings(opens_after_s=math.inf, drain_v_s=0.0))
        run.until(lambda: "/door/open" in keeper.received, "the door to receive it", 300.0)
        run.live(3.0)
        run.stand("the robot to wait")
        place = run.robot.world.pose
        run.live(20.0)
        assert run.robot.world.pose == place
