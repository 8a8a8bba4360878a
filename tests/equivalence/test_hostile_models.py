"""Names and texts chosen to break generated code: every target's files are well formed, run, and do what is meant."""

from pathlib import Path

import pytest

from robosc.targets import generate
from support.c99 import GCC
from support.equivalence.c99_target import C99Target
from support.equivalence.python_targets import generated_python, observe
from support.equivalence.random_scenarios import random_scenario
from support.equivalence.targets import compare
from support.generated import loaded_file
from support.hostile import hostile_supervisor

SEEDS = range(8)

needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")


@pytest.mark.parametrize("seed", SEEDS)
def test_python_does_what_the_model_says(seed: int, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    supervisor = hostile_supervisor(seed, canary, is_on_ros=False)
    scenario = random_scenario(supervisor, seed, 150)
    seen = observe(supervisor, scenario)
    assert sum(len(item.log) for item in seen) > 30
    compare(generated_python(supervisor, loaded_file(generate(supervisor, "python"))), scenario, seen)
    assert not canary.exists()


@needs_gcc
@pytest.mark.parametrize("seed", SEEDS)
def test_c_does_what_the_model_says(seed: int, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    supervisor = hostile_supervisor(seed, canary, is_on_ros=False)
    scenario = random_scenario(supervisor, seed, 150)
    # Some with sanitizers, which take the compiler three times as long.
    options = () if seed % 4 == 0 else ("-O0",)
    compare(C99Target(supervisor, tmp_path / "c", *options), scenario, observe(supervisor, scenario))
    assert not canary.exists()
