"""Programs of the npm registry for tests: see package.json in tests/node, acceptance/vscode and editors/vscode."""

import shutil
from pathlib import Path

import pytest

_TESTS = Path(__file__).parents[1]
NODE_FOLDER = _TESTS / "node"
PACKAGES = NODE_FOLDER / "node_modules"
EXTENSION_FOLDER = _TESTS.parent / "editors" / "vscode"
VSCODE_FOLDER = _TESTS.parent / "acceptance" / "vscode"

_MISSING = "the npm packages of tests/node are not installed: npm ci --prefix tests/node"


def node_tool(name: str, folder: Path = NODE_FOLDER) -> Path:
    """A program of one of a folder's packages, for Node; the test is skipped where it is not installed."""
    tool = folder / "node_modules" / ".bin" / name
    if shutil.which("node") is None:
        pytest.skip("Node is not installed")
    if not tool.exists():
        where = folder.relative_to(_TESTS.parent)
        pytest.skip(f"the npm packages of {where} are not installed: npm ci --prefix {where}")
    return tool


def buf() -> Path:
    """The checker of interfaces, for this kind of machine; the test is skipped where it is not installed."""
    return _native("@bufbuild/buf-*/bin/buf")


def tsc() -> Path:
    """The compiler of TypeScript, for this kind of machine; the test is skipped where it is not installed."""
    return _native("@typescript/typescript-*/lib/tsc")


def _native(pattern: str) -> Path:
    found = sorted(PACKAGES.glob(pattern))
    if not found:
        pytest.skip(_MISSING)
    return found[0]
