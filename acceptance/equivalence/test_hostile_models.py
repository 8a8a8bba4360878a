"""Names and texts chosen to break generated code: every target's files are well formed, run, and do what is meant."""

import ast
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import GeneratedFiles, available_targets, generate, write_files
from support.c99 import GCC
from support.cif_system import CifSystem
from support.equivalence.c99_target import C99Target
from support.equivalence.python_targets import generated_python, observe
from support.equivalence.random_scenarios import random_scenario
from support.equivalence.targets import compare
from support.generated import loaded_file
from support.hostile import hostile_supervisor, payloads, quoted
from support.models import model_of
from support.random_supervisors import CERTIFICATE
from support.spin import IS_INSTALLED as HAS_SPIN

TARGETS = [info.name for info in available_targets()]

SEEDS = range(8)

MAXIMUM_IDENTIFIER = 255

needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")


def check_files(files: GeneratedFiles, folder: Path) -> None:
    """Check that every reader of each kind of file accepts it."""
    write_files(files, folder)
    for path, text in files.items():
        match Path(path).suffix:
            case ".py":
                ast.parse(text, filename=path, feature_version=(3, 8))
                compile(text, path, "exec")
            case ".xml" | ".launch":
                ElementTree.fromstring(text)
            case ".yaml":
                pytest.importorskip("yaml", reason="PyYAML is not installed").safe_load(text)
            case ".cif":
                CifSystem(text)
            case ".pml" if HAS_SPIN:
                done = subprocess.run(["spin", "-a", path], cwd=folder, capture_output=True, text=True, check=False)
                assert done.returncode == 0, done.stdout + done.stderr


def run_own_tests(files: GeneratedFiles, folder: Path) -> None:
    """Run everything that a user would run of a Python package of ROS."""
    if "setup.py" in files:
        if "CMakeLists.txt" not in files:  # That of a catkin package needs catkin.
            subprocess.run([sys.executable, "setup.py", "--name"], cwd=folder, check=True, capture_output=True)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("target", TARGETS)
def test_every_file_is_well_formed_and_nothing_is_executed(target: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    for seed in SEEDS:
        folder = tmp_path / str(seed)
        folder.mkdir()
        files = generate(hostile_supervisor(seed, canary), target)
        check_files(files, folder)
        if seed < 2:
            run_own_tests(files, folder)
        assert not canary.exists(), seed


@needs_gcc
@pytest.mark.skipif(shutil.which("cmake") is None, reason="cmake is not installed")
def test_the_files_of_c_are_built_as_their_reader_builds_them(tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    for seed in (0, 1):
        write_files(generate(hostile_supervisor(seed, canary), "c99"), tmp_path / str(seed))
        for command in (["cmake", "-S", ".", "-B", "build"], ["cmake", "--build", "build"]):
            done = subprocess.run(command, cwd=tmp_path / str(seed), capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout + done.stderr
    assert not canary.exists()


def _listening_on(topics: list[str]) -> Supervisor:
    """A robot with a message in and one out for each topic."""
    messages = "".join(
        f"outgoing message m{number} with identifier: {quoted(topic)}, type: double\n"
        f"incoming message n{number} with identifier: {quoted(topic + '2')}, type: string\n"
        for number, topic in enumerate(topics)
    )
    reactions = "".join(
        f"on response from m{number} do v := value\non request to n{number}\n" for number in range(len(topics))
    )
    behaviour = f"behaviour {{ variable v: double  initial marked state s {{ {reactions} }} }}"
    model = model_of(f"robot R {{ component C {{ {messages} {behaviour} }} }}")
    return Supervisor(model, Deployment.CONTROLLER, (), CERTIFICATE)


@pytest.mark.parametrize("target", TARGETS)
def test_a_topic_may_be_called_anything_or_is_refused_in_one_line(target: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    # A name with characters that cannot be seen is refused before any target; what such a text does is tried without.
    seen = ("".join(char if char.isprintable() else " " for char in text).strip() for text in payloads(canary))
    topics = [text for text in seen if 0 < len(text) < MAXIMUM_IDENTIFIER]
    try:
        files = generate(_listening_on(topics), target)
    except UnsupportedModelError:
        # Names of ROS: each one is refused for itself.
        assert target not in ("python", "c99", "cif", "promela")
        for topic in topics:
            with pytest.raises(UnsupportedModelError) as raised:
                generate(_listening_on([topic]), target)
            assert str(raised.value).isprintable()
        return
    check_files(files, tmp_path / target)
    supervisor = _listening_on(topics)
    scenario = random_scenario(supervisor, 1, 100)
    if target == "python":
        python = generated_python(supervisor, loaded_file(files))
        compare(python, scenario, observe(supervisor, scenario))
    if target == "c99" and GCC:
        compare(C99Target(supervisor, tmp_path / "c"), scenario, observe(supervisor, scenario))
    assert not canary.exists()
