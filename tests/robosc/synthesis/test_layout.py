"""A dd that lays out its objects otherwise than the kernel knows is found out, and left to Python without a crash."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from robosc import kernel
from robosc.dd_modules import load_dd
from robosc.synthesis.connection import left_aside
from robosc.synthesis.layout import layout_problem

if kernel.kernel_module() is None or left_aside():
    pytest.skip("there is no kernel", allow_module_level=True)

CUDD: Any = load_dd("cudd")


def found_with(**functions: Callable[..., Any]) -> str:
    """Return the problem with the kernel, some of whose functions are replaced."""
    module = kernel.kernel_module()
    replaced: Any = SimpleNamespace(**{**vars(module), **functions})
    return layout_problem(replaced, CUDD)


def function(name: str) -> Callable[..., Any]:
    return getattr(kernel.kernel_module(), name)  # type: ignore[no-any-return]


class Made:
    """Stands for the class of managers of another dd.

    Args:
        kind: Class of the managers that it makes.
        size: Bytes of a manager.
    """

    def __init__(self, kind: type = CUDD.BDD, size: int = CUDD.BDD.__basicsize__) -> None:
        self._kind = kind
        self.__basicsize__ = size

    def __call__(self, **options: Any) -> Any:
        return self._kind(**options)


def found_of(made: Made) -> str:
    """Return the problem with another dd."""
    other: Any = SimpleNamespace(BDD=made, Function=CUDD.Function)
    module = kernel.kernel_module()
    assert module is not None
    return layout_problem(module, other)


def test_that_of_the_installed_dd_is_known() -> None:
    assert (found_with(), found_of(Made())) == ("", "")


def test_other_sizes() -> None:
    assert found_of(Made(size=64)) == "the objects of this dd have another size"


@pytest.mark.parametrize("address", [0, 1, 8, 2**47, 2**63, 2**64 - 8], ids=hex)
def test_a_manager_at_an_address_without_memory(address: int) -> None:
    assert found_with(manager=lambda bdd: address) == "this dd keeps CUDD's manager elsewhere"


@pytest.mark.parametrize(
    "other", [id, lambda bdd: id(bdd.vars), lambda bdd: int(bdd.true), lambda bdd: function("manager")(bdd) + 8]
)
def test_something_else_in_place_of_the_manager(other: Callable[[Any], int]) -> None:
    assert found_with(manager=other) == "this dd keeps CUDD's manager elsewhere"


def changed(place: int, change: Callable[[int], int]) -> Callable[..., Any]:
    """A `look` of which one figure is changed."""

    def look(bdd: Any, address: int) -> tuple[int, ...]:
        found = list(function("look")(bdd, address))
        found[place] = change(found[place])
        return tuple(found)

    return look


def swapped(bdd: Any, address: int) -> tuple[int, int, int]:
    level, low, high = function("look")(bdd, address)
    return level, high, low


@pytest.mark.parametrize(
    "look",
    [
        changed(0, lambda level: 1 - level),
        changed(1, lambda low: low ^ 1),
        changed(2, lambda high: high ^ 1),
        changed(2, lambda high: high + 8),
        swapped,
    ],
)
def test_nodes_that_are_laid_out_otherwise(look: Callable[..., Any]) -> None:
    assert found_with(look=look) == "the nodes of this dd are laid out otherwise"


def test_references_that_are_not_given_back() -> None:
    kept: list[tuple[Any, int]] = []
    release = function("release")
    assert found_with(release=lambda *of: kept.append(of)) == "this dd counts references otherwise"
    # A manager that ends with a reference complains.
    for bdd, address in kept:
        release(bdd, address)


class OtherNumbers(CUDD.BDD):  # type: ignore[misc]
    """Manager whose predicates have other numbers than their addresses say."""

    def _add_int(self, number: int) -> Any:
        return self.true


def test_other_numbers() -> None:
    assert found_of(Made(OtherNumbers)) == "this dd numbers its predicates otherwise"


class WithoutNumbers(CUDD.BDD):  # type: ignore[misc]
    """Manager that gives no predicate by its number."""

    _add_int = None


def test_another_interface() -> None:
    assert found_of(Made(WithoutNumbers)).startswith("this dd has another interface: ")


def test_a_machine_that_does_not_let_it_look() -> None:
    def refused(address: int, size: int) -> bytes:
        raise OSError(24, "Too many open files")

    assert "Too many open files" in found_with(bytes_at=refused)


def test_the_bytes_at_an_address() -> None:
    bytes_at = function("bytes_at")
    text = bytes(range(256)) * 2
    offset = bytes.__basicsize__ - 1
    assert bytes_at(id(text) + offset, 512) == text
    assert bytes_at(0, 1) is None
    for size in (-1, 513):
        with pytest.raises(ValueError, match="there can be 0 to 512"):
            bytes_at(id(text), size)


SYNTHESIS = """
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from robosc import kernel

name, folder = "robosc.kernel._kernel", Path(sys.argv[1])
spec = spec_from_file_location(name, folder / sys.argv[2])
sys.modules[name] = module_from_spec(spec)
spec.loader.exec_module(sys.modules[name])
kernel.FOLDER = folder

from robosc.synthesis import EngineOptions, synthesize
from robosc.synthesis.connection import left_aside
from support.families import FAMILIES

found = synthesize(FAMILIES["token ring"](3), engine=EngineOptions("cudd"))
assert kernel.kernel_problem() == ""
print(left_aside(), found.statistics.closure, found.statistics.states, sep=chr(10))
"""


def test_a_kernel_made_for_another_layout_leaves_synthesis_to_python(build: ModuleType, tmp_path: Path) -> None:
    """The manager's place is one word further: a dictionary of dd is there."""
    for path in kernel.FOLDER.glob("*.[ch]"):
        shutil.copy(path, tmp_path)
    source = tmp_path / "diagrams.c"
    text = source.read_text("utf-8")
    moved = text.replace("    void *methods;\n", "    void *methods, *other;\n")
    assert moved != text
    source.write_text(moved, "utf-8")
    assert build.make_kernel(tmp_path, tmp_path / build.MODULE) == ""
    tests = str(Path(__file__).parents[2])
    command = [sys.executable, "-c", SYNTHESIS, str(tmp_path), build.MODULE]
    done = subprocess.run(command, env={"PYTHONPATH": tests}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    said, closure, states = done.stdout.splitlines()
    assert (said, closure) == ("this dd keeps CUDD's manager elsewhere", "saturation")
    assert int(states) > 0
