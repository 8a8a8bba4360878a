"""Small simulated surroundings of the example robots: each decides what comes before the next period.

Nothing in them is random, and every number is one that a float of 32 bits holds.
"""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from typing import Any

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.equivalence.observation import Issued, Observation
from support.equivalence.python_targets import reference
from support.equivalence.random_scenarios import node_settings
from support.equivalence.scenario import Action, Scenario
from support.generated import example_supervisor

Run = Generator[list[Action], Sequence[Issued], None]
"""Takes what was issued since the last period, gives what comes before the next one."""
_BEAMS = 360


def _message(topic: str, data: Any = None) -> Action:
    return Action("message", topic, data)


def _scan(far: float, **near: float) -> Action:
    """A scan of `far` all around, but for sectors of 41 beams around front, left, back, right and back_right."""
    ranges = [far] * _BEAMS
    middles = {"front": 0, "left": 90, "back": 180, "back_right": 225, "right": 270}
    for name, distance in near.items():
        for offset in range(-20, 21):
            ranges[(middles[name] + offset) % _BEAMS] = distance
    return _message("/scan", {"ranges": ranges})


def _velocity(issued: Sequence[Issued], before: tuple[float, float]) -> tuple[float, float]:
    """Speed and turn that were commanded last."""
    for kind, name, data in issued:
        if kind == "default" or (kind == "publish" and not name.startswith(("rotate", "push"))):
            before = (data.get("linear.x", 0.0), data.get("angular.z", 0.0))
    return before


def _line_follower() -> Run:
    """Follows a line that lies askew; loses it; a person stands in the way, then presses the button."""
    offset, heading, velocity = 0.5, 0.0, (0.0, 0.0)
    issued = yield []
    for step in range(60):
        velocity = _velocity(issued, velocity)
        heading += velocity[1] * 0.125
        offset += velocity[0] * heading * 0.125
        coming = []
        if step % 2 == 0:
            coming.append(_scan(3.0, front=0.25) if 32 <= step < 40 else _scan(3.0))
        if step in (20, 21):
            coming.append(_message("/line/lost"))
        elif step > 2 and step not in range(20, 27):
            coming.append(_message("/line/correction", round(-4 * (offset + heading)) / 8))
        if step in (44, 50):
            coming.append(_message("/emergency_stop/stop" if step == 44 else "/emergency_stop/resume"))
        issued = yield coming


def _supervised_line_follower() -> Run:
    """The same line, followed by a controller that heeds nothing else; it sends nonsense for a while, and dies."""
    correction = 0.0
    world = _line_follower()
    coming = next(world)
    issued = yield coming
    for step in range(60):
        for kind, name, data in issued:
            if (kind, name) == ("pass", "/line/correction"):
                correction = data[""]
        coming = world.send([item for item in issued if item[0] in ("publish", "default")])
        turn = math.nan if step in (10, 11) else correction
        if step < 48:
            coming.append(Action("ask", "/cmd_vel", {"linear": {"x": 0.25}, "angular": {"z": turn}}))
        issued = yield coming


_MAZE = ("#######", "#...#.#", "#.#...#", "#.###.#", "#.....#", "#######")
_DIRECTIONS = ((0, -1), (-1, 0), (0, 1), (1, 0))  # Front, left, back, right of a robot that looks up.


def _maze_solver() -> Run:
    """Keeps a wall to its right; a cell is one metre, and a turn takes three periods."""
    x, y, heading, turning, turn, moved = 1, 1, 2, 0, 0, 0
    issued = yield []

    def distance(side: int) -> float:
        dx, dy = _DIRECTIONS[(heading + side) % 4]
        free = 0
        while _MAZE[y + dy * (free + 1)][x + dx * (free + 1)] != "#":
            free += 1
        return free + 0.25

    for _ in range(90):
        coming = []
        for kind, name, _ in issued:
            if kind == "publish" and name.startswith("rotate"):
                turning, turn = 3, 1 if name == "rotate_left" else 3
            elif kind == "publish":
                moved += 1
        if turning:
            turning -= 1
            if not turning:
                heading = (heading + turn) % 4
                coming.append(_message("/rotate_done"))
        if moved == 2:
            moved = 0
            dx, dy = _DIRECTIONS[heading]
            if _MAZE[y + dy][x + dx] != "#":
                x, y = x + dx, y + dy
        (bx, by), (rx, ry) = _DIRECTIONS[(heading + 2) % 4], _DIRECTIONS[(heading + 3) % 4]
        back_right = 0.52 if _MAZE[y + by + ry][x + bx + rx] == "#" else 2.0
        right, left = distance(3), distance(1)
        coming.append(_scan(2.0, left=left, back=2.0, back_right=back_right, right=right, front=distance(0)))
        issued = yield coming


def _navigation() -> Run:
    """Calibrates at the second try; drives, meets a person, fails three times, is asked to go on, and struggles.

    After a cancel it brakes for some periods, in which it still drives.
    """
    goals = calls = braking = 0
    since_goal: int | None = None
    issued = yield []
    for step in range(90):
        coming = []
        if step == 1:
            coming.append(_message("/person/distance", 3.0))
        for kind, name, _ in issued:
            if kind == "call":
                calls += 1
                failed = Action("fail", name)
                coming.append(failed if calls == 1 else Action("reply", name, {"success": calls > 2}))
            elif kind == "goal":
                goals += 1
                since_goal = 0
                coming.append(Action("accept", name))
            elif kind == "cancel":
                since_goal, braking = None, 3
        if braking:
            braking -= 1
            if braking:
                progress = {"distance_remaining": 1.0, "number_of_recoveries": 4 if goals == 6 else 0}
                coming.append(Action("feedback", "navigate", progress))
            else:
                coming.append(Action("end", "navigate", how="cancelled"))
        elif since_goal is not None:
            since_goal += 1
            recoveries = 4 if goals == 6 and since_goal == 3 else 0
            if since_goal == 6:
                since_goal = None
                if goals == 1:
                    coming.append(Action("end", "navigate", {"error_code": 0}, how="succeeded"))
                else:
                    coming.append(Action("end", "navigate", how="rejected" if goals == 4 else "aborted"))
            elif since_goal > 1:
                progress = {"distance_remaining": 2.0 - since_goal / 4, "number_of_recoveries": recoveries}
                coming.append(Action("feedback", "navigate", progress))
        if goals == 3 and since_goal == 4:
            coming.append(_message("/person/distance", 0.5))
        if step % 10 == 9:
            coming.append(_message("/person/distance", 2.5))
        if step == 70:
            coming.append(_message("/button"))
        issued = yield coming


def _point(x: float, y: float, z: float = 1.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _object_finder() -> Run:
    """Turns until it sees the object, goes there past a person, reports it at the second try."""
    angle, way, velocity = -3.0, 0.0, (0.0, 0.0)
    calls = 0
    issued = yield []
    for step in range(80):
        coming = []
        velocity = _velocity(issued, velocity)
        angle += velocity[1] * 0.5
        way += velocity[0]
        if step == 2:
            coming.append(_message("/search"))
        if step < 65:  # Then its plug falls out: the sensor is stale.
            coming.append(_scan(2.0, front=0.125) if 24 <= step < 28 else _scan(2.0))
            is_seen = abs(angle) < 1.0
            seen = _point(round(-8 * angle) / 8, min(round(8 * way) / 8, 0.5)) if is_seen else _point(0.0, 0.0, 0.0)
            coming.append(_message("/camera/detection", seen))
        if step == 20:
            angle = 0.5  # It is moved.
        if step in (34, 37):
            coming.append(_message("/emergency_stop/stop" if step == 34 else "/emergency_stop/resume"))
        for kind, name, _ in issued:
            if kind == "call":
                calls += 1
                coming.append(Action("fail", name) if calls == 1 else Action("reply", name, {"success": True}))
        issued = yield coming


def _ball_pusher() -> Run:
    """Looks for the ball, comes up to it, circles it until the goal lies behind it, pushes it; is bumped once."""
    turned, way, circled = 0.0, 0.0, 0.0
    pushes = 0
    issued = yield []
    for step in range(80):
        coming = []
        for kind, name, data in issued:
            if kind != "publish":
                continue
            turned += data.get("angular.z", 0.0) if name == "seek" else 0.0
            way += max(data.get("linear.x", 0.0), -0.05)
            circled += data.get("linear.y", 0.0)
            if name == "push":
                pushes += 1
                way, circled = 0.5, 0.0
                coming.append(_message("/pushed"))
        if step == 1:
            coming.append(_message("/kick_off"))
        ball = _point(max(round(8 * (1.5 - way)) / 8, 0.125), 0.0) if turned > 1.0 else _point(0.0, 0.0, 0.0)
        goal = _point(2.0, round(8 * (1.0 - circled)) / 8)
        coming += [_message("/ball", ball), _message("/goal", goal)]
        if step in (12, 15):
            coming.append(_message("/bumper", step == 12))
        if pushes == 3 and step > 70:
            coming.append(_message("/scored"))
        issued = yield coming


def _person_follower() -> Run:
    """A person walks off, waits, comes close, goes round a corner; another crosses; the button is pressed twice."""
    away, velocity = 1.0, (0.0, 0.0)
    issued = yield []
    for step in range(70):
        coming = []
        velocity = _velocity(issued, velocity)
        away += (0.25 if 5 <= step < 20 else -0.5 if 40 <= step < 44 else 0.0) - velocity[0]
        seen = 45 <= step < 50 or step < 2
        side = 0.25 if step % 8 < 4 else -1.0
        position = _point(0.0, 0.0, 0.0) if seen else _point(round(8 * max(away, 0.25)) / 8, side)
        coming.append(_message("/person", position))
        coming.append(_scan(2.0, front=0.25) if 24 <= step < 28 else _scan(2.0))
        if step in (30, 34):
            coming.append(_message("/button"))
        issued = yield coming


def _odometry(at: tuple[float, float], heading: int, speed: float, turn: float) -> Action:
    # Sine and cosine of half the angle, as far as short binary fractions are these.
    z, w = ((0.0, 1.0), (0.75, 0.75), (1.0, 0.0), (-0.75, 0.75))[heading]
    pose = {"position": {"x": at[0], "y": at[1]}, "orientation": {"z": z, "w": w}}
    twist = {"linear": {"x": speed}, "angular": {"z": turn}}
    return _message("/odom", {"pose": {"pose": pose}, "twist": {"twist": twist}})


def _courier() -> Run:
    """Makes rounds through a house; is called before, during and after a visit; a door opens late; the battery drains.

    Whatever it asks for takes some periods. Once nothing happens for so long that an assumption counts as owed.
    """
    at, heading, velocity = (0.0, 0.0), 0, (0.0, 0.0)
    turning, turn = 0, 0
    due: dict[str, int] = {}
    doors = 0
    orders = {5: "attic", 6: "office", 40: "kitchen", 46: "lab", 150: "lab", 156: "kitchen"}
    voltage, docked = 12.0, 0
    issued = yield []
    for step in range(COURIER_PERIODS):
        coming = []
        velocity = _velocity([item for item in issued if item[1] in ("forward", "/cmd_vel")], velocity)
        for kind, name, _ in issued:
            if kind != "publish":
                continue
            if name.startswith("turn"):
                turning, turn = 3, {"turn_left": 1, "turn_right": 3, "turn_around": 2}[name]
            elif name == "open_door":
                doors += 1
                due["/door/opened"] = 14 if doors == 2 else 4
            elif name == "unlock":
                due["/tray/closed"] = 5
        if velocity[0]:
            dx, dy = ((0.5, 0.0), (0.0, 0.5), (-0.5, 0.0), (0.0, -0.5))[heading]
            at = (at[0] + dx, at[1] + dy)
        elif turning:
            turning -= 1
            if not turning:
                heading = (heading + turn) % 4
                coming.append(_message("/rotate_done"))
        for topic in list(due):
            due[topic] -= 1
            if not due[topic]:
                del due[topic]
                coming.append(_message(topic))
        docked = docked + 1 if at == (0.0, 0.0) else 0
        if step in (90, 91):
            voltage = 11.0
        elif voltage < 12.0 and docked > 12:
            voltage = 12.5
        if step % 10 == 1:
            coming.append(_message("/battery_state", {"voltage": voltage}))
        if velocity[0] or turning or step % 4 == 0:
            coming.append(_odometry(at, heading, velocity[0], 0.25 if turning else 0.0))
        if step in orders:
            coming.append(_message("/order", orders[step]))
        if doors == 2 and due.get("/door/opened") == 7:
            coming.append(Action("wait", seconds=40.0))
        issued = yield coming


COURIER_PERIODS = 250
"""Periods of the courier: some rounds, with a way to the dock in between."""


WORLDS: dict[str, Callable[[], Run]] = {
    "ball_pusher": _ball_pusher,
    "courier": _courier,
    "line_follower": _line_follower,
    "line_follower_layer": _supervised_line_follower,
    "maze_solver": _maze_solver,
    "navigation": _navigation,
    "object_finder": _object_finder,
    "person_follower": _person_follower,
}


_LAYERS = {"line_follower_layer": "line_follower"}
"""Folder of each robot that only makes sense behind a supervision layer."""


def robot_supervisor(robot: str) -> Supervisor:
    """The supervisor of an example robot, for the deployment that its recorded run has."""
    if robot in _LAYERS:
        return example_supervisor(f"{_LAYERS[robot]}/{robot}", Deployment.LAYER)
    return example_supervisor(f"{robot}/{robot}")


def live(robot: str) -> tuple[Scenario, list[Observation]]:
    """Let an example robot live in its surroundings, a decision each period: what came, and what the reference did."""
    target = reference(robot_supervisor(robot))
    world = WORLDS[robot]()
    next(world)
    seen = [target.start(Scenario(()))]
    actions: list[Action] = []
    issued: list[Issued] = []
    while True:
        try:
            coming = world.send(issued)
        except StopIteration:
            return Scenario(tuple(actions)), seen
        issued = []
        for action in (*coming, Action("tick")):
            actions.append(action)
            seen.append(target.do(action))
            issued += seen[-1].issued


def live_by_messages(robot: str) -> Scenario:
    """Let an example robot without services and actions live whose node decides by itself whenever a message comes."""
    supervisor = robot_supervisor(robot)
    target = reference(supervisor)
    scenario = Scenario((), node_settings(supervisor.model, None))
    world = WORLDS[robot]()
    next(world)
    actions: list[Action] = []
    issued = target.start(scenario).issued
    while True:
        try:
            coming = [action for action in world.send(issued) if action.do == "message"]
        except StopIteration:
            return replace(scenario, actions=tuple(actions))
        actions += coming
        issued = tuple(item for action in coming for item in target.do(action).issued)
