"""Program that tries generated Python packages under the Python that runs it: 3.8 or later, and nothing else.

It reads a JSON array of packages from standard input: each has `folder`, `module` (its supervisor) and `runs`. Of each
it compiles every file, imports every module, calls setup.py and the launch files, runs its own tests and drives its
supervisor through the runs. It writes a JSON array with the observations of each package's runs.

Whatever is not in the standard library and not in the package, such as rclpy, is a stand-in that accepts everything.
Start it with `-I -S -B -W error`, so that no installed package takes its place and no warning is overlooked.
"""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import json
import os
import runpy
import sys
import warnings
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from support.equivalence.portable import Driver


class Accepting(type):
    """Type of classes whose missing members are such classes, too."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Accepting(name, (Thing,), {})


class Thing(metaclass=Accepting):
    """Object that a stand-in's functions and classes give."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        pass

    def __call__(self, *positional: Any, **named: Any) -> Thing:
        return self

    def keys(self) -> list[str]:
        """Return no names: it has no keyword arguments."""
        return []

    def __getitem__(self, key: str) -> Any:
        raise KeyError(key)


class StandIn(ModuleType):
    """A module that has everything."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Accepting(name, (Thing,), {})


class StandIns(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds a stand-in for each module that no other finder has.

    A folder without a module in it is none: that with the launch files of a package is called like what they import.

    Args:
        finders: The other finders.
    """

    def __init__(self, finders: list[Any]) -> None:
        self._finders = finders

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        for finder in self._finders:
            spec = finder.find_spec(name, path, target)
            if spec is not None and spec.origin is not None:
                return spec
        return importlib.machinery.ModuleSpec(name, self, is_package=True)

    def create_module(self, spec: Any) -> ModuleType:
        return StandIn(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        if module.__name__ == "ament_index_python.packages":
            module.get_package_share_directory = lambda package: "share"  # type: ignore[attr-defined]


def python_files(folder: Path) -> list[Path]:
    """Return the Python files of a package, with programs that have no suffix."""
    programs = [
        path for path in sorted(folder.glob("scripts/*")) if path.read_bytes().startswith(b"#!/usr/bin/python3")
    ]
    return [*sorted(folder.rglob("*.py")), *programs]


def module_names(folder: Path) -> list[str]:
    """Return the names of the modules below a package's folder."""
    beside = {path.stem for path in folder.glob("*.py") if path.stem != "setup"}
    inside = {
        ".".join(path.relative_to(folder).with_suffix("").parts).replace(".__init__", "")
        for init in folder.glob("*/__init__.py")
        for path in init.parent.rglob("*.py")
    }
    return sorted(beside | inside)


def own_modules(names: list[str]) -> None:
    """Fail if a package's module was replaced by a stand-in."""
    replaced = [name for name in names if isinstance(sys.modules[name], StandIn)]
    assert not replaced, replaced


def check_files(folder: Path) -> None:
    """Compile everything, and execute what is not imported."""
    for path in python_files(folder):
        compile(path.read_text(encoding="utf-8"), str(path), "exec", dont_inherit=True)
    names = module_names(folder)
    for name in names:
        importlib.import_module(name)
    own_modules(names)
    if (folder / "setup.py").is_file():
        with warnings.catch_warnings():
            # Python 3.10 warns of distutils, which is what catkin knows.
            warnings.filterwarnings("ignore", ".*distutils", DeprecationWarning)
            importlib.import_module("distutils.core").setup = Thing  # type: ignore[attr-defined]
            runpy.run_path(str(folder / "setup.py"), run_name="__main__")
    for path in sorted(folder.glob("launch/*.launch.py")):
        assert runpy.run_path(str(path))["generate_launch_description"]() is not None
    files = sorted(folder.glob("test/test_*.py"))
    items = [item for path in files for name, item in runpy.run_path(str(path)).items() if name.startswith("test_")]
    # A function that a stand-in decorates is none any more: a linter's test, which needs the linter.
    tests = [item for item in items if isinstance(item, FunctionType)]
    assert tests or not files, files
    for test in tests:
        test()


def drive(module: Any, run: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what is seen of a supervisor at the start of a run and after each of its steps."""
    driver = Driver(module.Supervisor(), module, is_layer=run["is_layer"])
    seen = []

    def look() -> None:
        found = driver.seen(run["events"], run["servers"])
        found["log"] = [module.plain(item) for item in found["log"]]
        seen.append(found)

    driver.start(run["settings"])
    look()
    for step in run["steps"]:
        driver.do(*step)
        look()
    return seen


def check(package: dict[str, Any]) -> list[list[dict[str, Any]]]:
    """Return what is seen in a package's runs, once everything else in it has been tried."""
    folder = Path(package["folder"])
    before = set(sys.modules)
    sys.path.insert(0, str(folder))
    os.chdir(str(folder))
    try:
        check_files(folder)
        module = importlib.import_module(package["module"])
        return [drive(module, run) for run in package["runs"]]
    except BaseException:
        sys.stderr.write("In the package {}:\n".format(package["folder"]))
        raise
    finally:
        sys.path.remove(str(folder))
        importlib.invalidate_caches()
        for name in set(sys.modules) - before:
            del sys.modules[name]


if __name__ == "__main__":
    sys.meta_path[:] = [StandIns(list(sys.meta_path))]
    json.dump([check(package) for package in json.load(sys.stdin)], sys.stdout)
