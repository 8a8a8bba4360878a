"""Synthesis with the newest dd of the package index: the kernel works on it, or leaves it alone."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).parents[3]
MODEL = TOP / "examples" / "maze_solver" / "maze_solver.rscd"

VERSION = "from importlib.metadata import version; print(version('dd'))"
SYNTHESIS = "from robosc.cli.main import main; main()"


@pytest.fixture(scope="module")
def newest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the newest dd that is made for this system."""
    folder = tmp_path_factory.mktemp("dd")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--only-binary", ":all:", "--target", str(folder)]
    done = subprocess.run([*pip, *options, "dd"], capture_output=True, text=True, check=False, timeout=300)
    if "No matching distribution" in done.stderr or "Connection" in done.stderr:
        pytest.skip(f"no package index: {done.stderr.strip().splitlines()[-1]}")
    assert done.returncode == 0, done.stderr
    return folder


def run(*words: str, path: Path | None = None, kernel: str = "1") -> str:
    """Return what Python prints, with packages of a folder before the installed ones."""
    environment = {**os.environ, "ROBOSC_KERNEL": kernel, "PYTHONPATH": str(path or "")}
    done = subprocess.run(
        [sys.executable, "-c", *words], env=environment, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_gives_the_same_supervisor(newest: Path, tmp_path: Path) -> None:
    minor = int(run(VERSION, path=newest).split(".")[1])
    files, notes = [], []
    for name, path, kernel in (("locked", None, "0"), ("newest", newest, "1")):
        file = tmp_path / f"{name}.rsup"
        words = ("synth", str(MODEL), "--engine", "cudd", "--statistics", "--json", "-o", str(file))
        found = json.loads(run(SYNTHESIS, *words, path=path, kernel=kernel))
        assert found["status"] == "supervisor"
        notes.append(found["statistics"]["kernel"])
        files.append(file.read_bytes())
    assert files[0] == files[1]
    assert notes[0].startswith("not used, which is slower: ROBOSC_KERNEL is 0")
    # Within the bound of the package the kernel is to work.
    assert notes[1] == "used" or (minor > 6 and notes[1].startswith("not used, which is slower"))
