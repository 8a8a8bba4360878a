"""Runs the tests that generated packages bring with them, for a user who has nothing but pytest."""

import os
import subprocess
import sys
from pathlib import Path

PYTEST = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "test")
"""Command that a package's page says to run its tests with."""


def own_tests(folder: Path, command: tuple[str, ...] = PYTEST) -> "subprocess.CompletedProcess[str]":
    """Run a generated package's own tests and return the outcome.

    Args:
        folder: The package.
        command: Arguments of Python.
    """
    # They need none of our plug-ins, whose import takes longer than the tests.
    variables = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=variables, capture_output=True, text=True, check=False
    )
