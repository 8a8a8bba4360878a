"""Generated packages carry copies of the executor's modules: old Python, nothing but the standard library."""

import ast
import sys
from pathlib import Path

import pytest

import robosc.execution.runtime

MODULES = sorted(
    path for path in Path(robosc.execution.runtime.__file__).parent.glob("*.py") if path.name != "__init__.py"
)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_a_module_is_python_3_8(path: Path) -> None:
    ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8))
    assert "from __future__ import annotations" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_a_module_imports_only_its_neighbours_and_the_standard_library(path: Path) -> None:
    siblings = {f"robosc.execution.runtime.{item.stem}" for item in MODULES}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert all(alias.name in sys.stdlib_module_names for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0 and node.module is not None
            assert node.module in siblings or node.module.partition(".")[0] in sys.stdlib_module_names


def test_there_are_modules() -> None:
    assert {"executor", "protocol", "settings", "clock", "event_log"} <= {path.stem for path in MODULES}
