"""Loads generated Python packages, and compares what they do with the interpreter."""

import ast
import importlib
import itertools
import math
import re
import subprocess
import sys
import types
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import GeneratedFiles, generate, write_files
from robosc.targets.code.python.bundle import bundle
from robosc.targets.code.python.generate import RUNTIME, model_part

_numbers = itertools.count()


@cache
def example_supervisor(name: str, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    """The supervisor of an example robot, such as `maze_solver/maze_solver`, through the whole pipeline."""
    from robosc.certification import make_supervisor  # Only this needs the synthesizer.
    from support.models import example_bundle

    made = make_supervisor(example_bundle(name), deployment=deployment)
    assert made.supervisor is not None, made.reason
    return made.supervisor


def require_sound_python(folder: Path, rules: str = "F,E4,E7,E9,B,PLE") -> None:
    """Assert that Python files of a folder parse on 3.8, import nothing of RoboSC, and break none of ruff's rules."""
    for path in folder.rglob("*.py"):
        text = path.read_text()
        ast.parse(text, filename=str(path), feature_version=(3, 8))
        assert not re.search(r"^\s*(from|import) robosc", text, re.MULTILINE), path
    ruff = [
        sys.executable,
        "-m",
        "ruff",
        "check",
        "--isolated",
        "--target-version",
        "py38",
        "--select",
        rules,
        str(folder),
    ]
    result = subprocess.run(ruff, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout


@contextmanager
def imported(files: GeneratedFiles, folder: Path, module: str) -> Iterator[Any]:
    """A module of generated files, written to a folder and imported from there; forgotten at the end."""
    write_files(files, folder)
    package = module.partition(".")[0]
    sys.path.insert(0, str(folder))
    try:
        yield importlib.import_module(module)
    finally:
        sys.path.remove(str(folder))
        importlib.invalidate_caches()
        for name in [name for name in sys.modules if name == package or name.startswith(f"{package}.")]:
            del sys.modules[name]


@cache
def _runtime_code(deployment: Deployment) -> types.CodeType:
    """Return the code that every generated module of a deployment begins with, compiled once."""
    runtime = bundle(RUNTIME[deployment])
    lines = ["from __future__ import annotations", *runtime.imports, "", runtime.text()]
    return compile("\n".join(lines), "runtime", "exec", dont_inherit=True)


def load_module(supervisor: Supervisor) -> types.ModuleType:
    """The generated module, in memory."""
    module = types.ModuleType(f"generated_{next(_numbers)}")
    # Python looks a module up by its name when it makes named tuples and protocols.
    sys.modules[module.__name__] = module
    try:
        exec(_runtime_code(supervisor.deployment), module.__dict__)
        exec(compile(model_part(supervisor), "supervisor.py", "exec", dont_inherit=True), module.__dict__)
    finally:
        del sys.modules[module.__name__]
    return module


def load_system(supervisor: Supervisor) -> Any:
    """An instance of the generated class, in memory."""
    return load_module(supervisor).Supervisor()


def loaded_file(files: GeneratedFiles) -> types.ModuleType:
    """The generated module as a whole, from its file's text."""
    ((path, text),) = files.items()
    module = types.ModuleType(f"generated_{next(_numbers)}")
    sys.modules[module.__name__] = module
    try:
        exec(compile(text, path, "exec", dont_inherit=True), module.__dict__)
    finally:
        del sys.modules[module.__name__]
    return module


def python_text(supervisor: Supervisor) -> str:
    """The generated module."""
    (text,) = generate(supervisor, "python").values()
    return text


def same(left: Any, right: Any) -> bool:
    """Equality of plain values in which NaN equals NaN, and 1, 1.0 and True differ."""
    if isinstance(left, dict) and isinstance(right, dict):
        return left.keys() == right.keys() and all(same(left[key], right[key]) for key in left)
    if isinstance(left, (list, tuple)) and isinstance(right, (list, tuple)):
        return len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, float) and isinstance(right, float):
        return left == right or (math.isnan(left) and math.isnan(right))
    return type(left) is type(right) and left == right
