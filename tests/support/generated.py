"""Loads generated Python packages, and compares what they do with the interpreter."""

import importlib
import importlib.abc
import importlib.machinery
import itertools
import math
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from robosc.model.structure import Deployment
from robosc.supervisor.structure import Supervisor
from robosc.targets import GeneratedFiles, generate, write_files
from robosc.targets.python.package import python_files

_numbers = itertools.count()


@cache
def example_supervisor(name: str, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    """The supervisor of an example robot, such as `maze_solver/maze_solver`, through the whole pipeline."""
    from robosc.supervisor import make_supervisor  # Only this needs the synthesizer.
    from support.models import example_bundle

    made = make_supervisor(example_bundle(name), deployment=deployment)
    assert made.supervisor is not None, made.reason
    return made.supervisor


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


def load_system(supervisor: Supervisor) -> Any:
    """An instance of the generated class, in memory.

    The runtime modules are executed from their generated texts as well, in a package of their own name.
    """
    package = f"generated_{next(_numbers)}"
    root = types.ModuleType(package)
    root.__path__ = []
    sys.modules[package] = root
    runtime = types.ModuleType(f"{package}.runtime")
    runtime.__path__ = []
    sys.modules[runtime.__name__] = runtime
    texts = python_files(supervisor)
    try:
        for name in ("values", "reading", "protocol"):
            module = types.ModuleType(f"{package}.runtime.{name}")
            module.__package__ = runtime.__name__
            sys.modules[module.__name__] = module
            setattr(runtime, name, module)
            exec(compile(texts[f"runtime/{name}.py"], f"{name}.py", "exec"), module.__dict__)
        module = types.ModuleType(f"{package}.supervisor")
        module.__package__ = package
        exec(compile(texts["supervisor.py"], "supervisor.py", "exec"), module.__dict__)
    finally:
        for name in [name for name in sys.modules if name == package or name.startswith(f"{package}.")]:
            del sys.modules[name]
    return module.Supervisor()


def loaded_package(files: GeneratedFiles) -> Callable[[str], Any]:
    """A function that imports the modules of a generated Python package, by their name in it, out of memory.

    All of them are executed once, from their generated texts, in a package of their own name that nothing else knows.
    """
    package = f"generated_{next(_numbers)}"
    texts = {path.partition("/")[2].removesuffix(".py").replace("/", "."): text for path, text in files.items()}
    modules: dict[str, Any] = {}

    class Finder(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
        def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> Any:
            name = fullname.removeprefix(f"{package}").lstrip(".")
            if fullname.partition(".")[0] != package or not {name, f"{name}.__init__".lstrip(".")} & texts.keys():
                return None
            return importlib.machinery.ModuleSpec(fullname, self, is_package=name not in texts)

        def get_source(self, fullname: str) -> str:
            name = fullname.removeprefix(f"{package}").lstrip(".")
            return texts[name if name in texts else f"{name}.__init__".lstrip(".")]

    finder = Finder()
    sys.meta_path.insert(0, finder)
    try:
        for name in texts:
            modules[name] = importlib.import_module(f"{package}.{name}".removesuffix(".__init__"))
    finally:
        sys.meta_path.remove(finder)
        for name in [name for name in sys.modules if name.partition(".")[0] == package]:
            del sys.modules[name]
    return modules.__getitem__


def python_text(supervisor: Supervisor) -> str:
    """The generated `supervisor.py`."""
    files = generate(supervisor, "python")
    return files[next(path for path in files if path.endswith("/supervisor.py"))]


def same(left: Any, right: Any) -> bool:
    """Equality of plain values in which NaN equals NaN, and 1, 1.0 and True differ."""
    if isinstance(left, dict) and isinstance(right, dict):
        return left.keys() == right.keys() and all(same(left[key], right[key]) for key in left)
    if isinstance(left, (list, tuple)) and isinstance(right, (list, tuple)):
        return len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, float) and isinstance(right, float):
        return left == right or (math.isnan(left) and math.isnan(right))
    return type(left) is type(right) and left == right
