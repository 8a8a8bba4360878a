"""What tests have of the npm registry: see tests/node/package.json."""

import shutil
from pathlib import Path

import pytest

NODE_FOLDER = Path(__file__).parents[1] / "node"
PACKAGES = NODE_FOLDER / "node_modules"

_MISSING = "the npm packages of tests/node are not installed: npm ci --prefix tests/node"


def node_tool(name: str) -> Path:
    """A program of one of the packages, for Node; the test is skipped where it is not installed."""
    tool = PACKAGES / ".bin" / name
    if shutil.which("node") is None:
        pytest.skip("Node is not installed")
    if not tool.exists():
        pytest.skip(_MISSING)
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
