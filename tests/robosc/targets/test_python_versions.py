"""Generated Python packages under other Pythons: the oldest and the newest, and with more effort those between.

Nodes run with rclpy in acceptance/equivalence/test_other_pythons.py.
"""

import json
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import GenerateOptions, StateMessage, generate, write_files
from support import package_check
from support.effort import EFFORT
from support.equivalence.observation import FULL, Observation
from support.equivalence.python_targets import arguments_of, observation, observe, shown
from support.equivalence.random_scenarios import random_scenario
from support.equivalence.recorded import read_recorded
from support.equivalence.scenario import Action, Scenario
from support.equivalence.targets import compare
from support.equivalence.worlds import WORLDS, robot_supervisor
from support.pythons import python_of, variables
from support.random_controllers import random_robot
from support.random_layers import random_layer
from support.random_supervisors import random_supervisor

LIMIT_S = 300.0
MINORS = (8, 10, 12, 13) if EFFORT else (8, 13)
"""The oldest that is promised, those of Humble and of Jazzy, and the newest that RoboSC itself runs on."""
ROBOTS = sorted(WORLDS)
OPTIONS = GenerateOptions(publish_state=True, state_message=StateMessage.BOTH)
SEEDS = range(4)
"""Seeds of random robots, which have no interfaces and so no ROS package."""


class Seen:
    """A run that another Python has done, as a target.

    Args:
        name: Name for messages.
        observations: Observations at the start and after each action.
    """

    sight = FULL

    def __init__(self, name: str, observations: list[Observation]) -> None:
        self.name = name
        self._observations = iter(observations)

    def start(self, scenario: Scenario, awaited: Observation) -> Observation:
        """Begin."""
        return next(self._observations)

    def do(self, action: Action, awaited: Observation) -> Observation:
        """Let one thing happen."""
        return next(self._observations)

    def close(self) -> Observation:
        """Do nothing."""
        return Observation()


@cache
def runs() -> list[tuple[str, Supervisor, Scenario, list[Observation]]]:
    """Name, supervisor, scenario and what the reference does, for each robot."""
    found = [(robot, robot_supervisor(robot), read_recorded(robot)) for robot in ROBOTS]
    for seed in SEEDS:
        controller = msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.CONTROLLER)
        for kind, supervisor in (
            ("any", controller),
            ("robot", random_robot(seed)),
            ("layer", random_layer(Random(seed))),
        ):
            found.append((f"random_{kind}_{seed}", supervisor, random_scenario(supervisor, seed, 60)))
    return [(*item, observe(item[1], item[2])) for item in found]


def packages(folder: Path) -> list[dict[str, Any]]:
    """Write the packages of all robots, and return what the other Python is given of each."""
    found = []
    for name, supervisor, scenario, _ in runs():
        events, servers = shown(supervisor.model)
        run = {
            "is_layer": supervisor.deployment is Deployment.LAYER,
            "settings": scenario.all_settings()._asdict(),
            "events": events,
            "servers": servers,
            "steps": [arguments_of(action) for action in scenario.actions],
        }
        for target in ("python", "ros1", "ros2") if name in ROBOTS else ("python",):
            files = generate(supervisor, target, OPTIONS)
            write_files(files, folder / name / target)
            path = next(path for path in files if path.endswith("supervisor.py") and not path.startswith("test/"))
            module = path.removesuffix(".py").replace("/", ".")
            found.append({"folder": str(folder / name / target), "module": module, "runs": [run]})
    return found


def as_text(item: Observation) -> Observation:
    """Return an observation whose state and progress are as they come out of JSON."""
    return replace(item, state=same_text(item.state), progress=same_text(item.progress))


def same_text(state: Any) -> Any:
    """A state or progress as it comes out of JSON, with numbers in it that equal themselves."""
    return json.loads(json.dumps(state), parse_constant=str)


@pytest.mark.random
@pytest.mark.parametrize("minor", MINORS)
def test_packages_do_the_same_under_another_python(minor: int, tmp_path: Path) -> None:
    python = python_of(minor)
    given = packages(tmp_path)
    done = subprocess.run(
        [str(python), "-I", "-S", "-B", "-W", "error", package_check.__file__],
        input=json.dumps(given),
        env=variables(),
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answers = dict(zip([item["folder"] for item in given], json.loads(done.stdout), strict=True))
    for name, _, scenario, expected in runs():
        awaited = [as_text(item) for item in expected]
        for folder, (seen,) in answers.items():
            if Path(folder).parent.name != name:
                continue
            found = [as_text(observation(item)) for item in seen]
            compare(Seen(f"{name}, {Path(folder).name}, Python 3.{minor}", found), scenario, awaited)
