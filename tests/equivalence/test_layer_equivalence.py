"""Supervision layers: every target does what the reference layer does, in the same runs, step by step."""

from collections import Counter
from pathlib import Path
from random import Random

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import UnsupportedModelError
from robosc.model.layers import sharing_requests
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate
from support.c99 import GCC
from support.effort import examples
from support.equivalence.c99_target import C99Layer
from support.equivalence.python_targets import PythonTarget, generated_python, observe
from support.equivalence.random_scenarios import random_scenario
from support.equivalence.targets import compare
from support.generated import example_supervisor, load_module, loaded_file
from support.random_layers import random_layer
from support.random_limits import limited_robot, with_defaults
from support.random_supervisors import random_supervisor

ROBOTS = ("line_follower/line_follower_layer", "maze_solver/maze_solver", "navigation/navigation")
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")


def python_target(supervisor: Supervisor) -> PythonTarget:
    return generated_python(supervisor, loaded_file(generate(supervisor, "python")))


def some_layer(seed: int) -> Supervisor:
    """A random robot, of one kind or another."""
    supervisor = msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.LAYER)
    # Requests that share an identifier there are not distinguished by conditions.
    if seed % 2 or any(len(sharing) > 1 for sharing in sharing_requests(supervisor.model)):
        return random_layer(Random(seed))
    return supervisor


@pytest.mark.parametrize("robot", ROBOTS)
def test_an_example_in_python(robot: str) -> None:
    supervisor = example_supervisor(robot, Deployment.LAYER)
    for seed in range(4):
        scenario = random_scenario(supervisor, seed, 150)
        compare(python_target(supervisor), scenario, observe(supervisor, scenario))


@settings(max_examples=examples(40))
@given(st.integers(0, 2**32 - 1))
def test_random_robots_in_python(seed: int) -> None:
    supervisor = some_layer(seed)
    scenario = random_scenario(supervisor, seed, 60)
    compare(generated_python(supervisor, load_module(supervisor)), scenario, observe(supervisor, scenario))


@needs_gcc
@pytest.mark.parametrize("robot", ROBOTS)
def test_an_example_in_c(robot: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(robot, Deployment.LAYER)
    scenario = random_scenario(supervisor, 7, 250)
    compare(C99Layer(supervisor, tmp_path), scenario, observe(supervisor, scenario))


@needs_gcc
@settings(max_examples=examples(6))
@given(st.integers(0, 2**32 - 1))
def test_random_robots_in_c(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    supervisor = some_layer(seed)
    scenario = random_scenario(supervisor, seed, 120)
    try:
        target = C99Layer(supervisor, tmp_path_factory.mktemp("c"))
    except UnsupportedModelError:
        return  # The random models hold what C cannot keep, too: received texts.
    compare(target, scenario, observe(supervisor, scenario))


def test_the_random_runs_show_everything_that_a_layer_does() -> None:
    seen: Counter[str] = Counter()
    for seed in range(120):
        supervisor = some_layer(seed)
        for item in observe(supervisor, random_scenario(supervisor, seed, 60)):
            seen.update(kind for kind, _, _ in item.issued)
            seen.update(f"log {entry['kind']}" for entry in item.log)
    for kind in ("publish", "default", "call", "goal", "cancel", "pass", "blocked", "answer", "no answer"):
        assert seen[kind] > 5, kind
    for kind in ("accept", "reject", "feedback", "ended", "log release", "log stop", "log fault", "log unexpected"):
        assert seen[kind] > 5, kind


def some_limited_layer(seed: int) -> Supervisor:
    """A random robot with limits, and with messages that are the all-default ones."""
    dice = Random(seed)
    return limited_robot(with_defaults(random_layer(dice), dice), dice)


@settings(max_examples=examples(40))
@given(st.integers(0, 2**32 - 1))
def test_limits_in_python(seed: int) -> None:
    supervisor = some_limited_layer(seed)
    scenario = random_scenario(supervisor, seed, 60)
    compare(generated_python(supervisor, load_module(supervisor)), scenario, observe(supervisor, scenario))


@needs_gcc
@settings(max_examples=examples(6))
@given(st.integers(0, 2**32 - 1))
def test_limits_in_c(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    supervisor = some_limited_layer(seed)
    scenario = random_scenario(supervisor, seed, 120)
    compare(C99Layer(supervisor, tmp_path_factory.mktemp("c")), scenario, observe(supervisor, scenario))


def test_the_random_limits_show_everything_that_they_do() -> None:
    seen: Counter[str] = Counter()
    for seed in range(60):
        supervisor = some_limited_layer(seed)
        for item in observe(supervisor, random_scenario(supervisor, seed, 60)):
            seen.update(entry.get("why", f"log {entry['kind']}") for entry in item.log)
    for kind in ("log limited", "log release", "no number is within all limits"):
        assert seen[kind] > 5, seen
