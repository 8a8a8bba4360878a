import ast
import builtins
import io
import itertools
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from robosc.targets import generate, write_files
from support.ament_lint import EXAMPLE_ROBOTS, MAZE, PACKAGES, example_packages
from support.generated import example_supervisor

# Rules of ament_flake8 and ament_pep257 that ruff has, too; the linters themselves run in acceptance/.
SELECTED = "A001,A002,C4,D,E,F,Q,W"
IGNORED = "D100,D101,D102,D103,D104,D105,D106,D107,D203,D212,D404"


@pytest.mark.parametrize("name", PACKAGES)
def test_nothing_is_found_in_a_generated_package(name: str, tmp_path: Path) -> None:
    write_files(PACKAGES[name](), tmp_path)
    require_nothing_found(tmp_path)


def require_nothing_found(folder: Path) -> None:
    """Fail if the linters find anything in a folder."""
    (folder / "ruff.toml").write_text('lint.flake8-quotes.inline-quotes = "single"\nline-length = 99\n')
    options = ["--config", str(folder / "ruff.toml"), "--select", SELECTED, "--ignore", IGNORED]
    ruff = [sys.executable, "-m", "ruff", "check", "--no-cache", "--target-version", "py38", *options, "."]
    done = subprocess.run(ruff, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("name", EXAMPLE_ROBOTS)
def test_nothing_is_found_in_any_package_of_an_example(name: str, tmp_path: Path) -> None:
    for kind, files in example_packages(name).items():
        write_files(files, tmp_path / kind)
    require_nothing_found(tmp_path)


def colons_after_blanks(text: str) -> Iterator[int]:
    """Yield the lines with a blank before a colon (E203), which ruff's own layout writes in slices: `items[a.b :]`."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    for before, token in itertools.pairwise(tokens):
        if token.string == ":" and before.end != token.start and before.end[0] == token.start[0]:
            yield token.start[0]


def hidden_builtins(text: str) -> Iterator[int]:
    """Yield the lines of attributes of classes that are called like a builtin (A003), used there or not."""
    for item in ast.walk(ast.parse(text)):
        for child in item.body if isinstance(item, ast.ClassDef) else ():
            names = [child.name] if isinstance(child, ast.FunctionDef) else []
            targets = child.targets if isinstance(child, ast.Assign) else [getattr(child, "target", None)]
            names += [target.id for target in targets if isinstance(target, ast.Name)]
            if any(hasattr(builtins, name) and not name.startswith("__") for name in names):
                yield child.lineno


def test_what_ruff_does_not_find_is_found() -> None:
    assert list(colons_after_blanks("a[b :]\na[: b]\na[b:]\na[b.c : d]\nif a:\n    a = {b: c}\n")) == [1, 4]
    text = "class A:\n    round: int\n    max = 1\n    other: int\n    def id(self):\n        round = 1\n"
    assert list(hidden_builtins(text)) == [2, 3, 5]


@pytest.mark.parametrize("name", PACKAGES)
def test_nothing_that_ruff_does_not_find_is_in_a_generated_package(name: str) -> None:
    for path, text in PACKAGES[name]().items():
        if path.endswith(".py"):
            assert not [*colons_after_blanks(text), *hidden_builtins(text)], path


def test_only_long_names_need_a_mark() -> None:
    for name, package in PACKAGES.items():
        if not name.endswith("-long"):
            for path, text in package().items():
                assert path.endswith("supervisor.py") or "noqa: E501" not in text, (name, path)


def test_a_package_in_python_has_tests_of_the_linters() -> None:
    files = generate(example_supervisor(MAZE), "ros2")
    needed = {item.text for item in ElementTree.fromstring(files["package.xml"]).iterfind("test_depend")}
    linters = ("copyright", "flake8", "pep257", "xmllint")
    assert needed == {"python3-pytest", *(f"ament_{linter}" for linter in linters)}
    for linter in linters:
        assert f"pytest.importorskip('ament_{linter}.main')" in files[f"test/test_{linter}.py"]


def test_a_package_in_cpp_can_have_all_common_linters() -> None:
    text = generate(example_supervisor(MAZE), "ros2-cpp")["CMakeLists.txt"]
    before, _, _ = text.partition("ament_lint_auto_find_test_dependencies()")
    assert "find_package(ament_lint_auto QUIET)" in before
    for linter in ("cpplint", "uncrustify"):
        assert f"set(ament_cmake_{linter}_FOUND TRUE)" in before
    # The longest line that lint_cmake takes.
    assert max(map(len, text.splitlines())) <= 140
