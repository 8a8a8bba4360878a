"""Runs the tests that generated packages bring with them, for a user who has nothing but pytest."""

import os
import subprocess
import sys
from pathlib import Path

PYTEST = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "test")
"""Command that a package's page says to run its tests with."""


def own_tests(
    folder: Path, command: tuple[str, ...] = PYTEST, python: str = sys.executable
) -> "subprocess.CompletedProcess[str]":
    """Run a generated package's own tests and return the outcome.

    Args:
        folder: The package.
        command: Arguments of Python.
        python: The Python, which may have other packages than this one.
    """
    # They need none of our plug-ins, whose import takes longer than the tests.
    variables = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    if python != sys.executable:
        # A Python with ROS 2 hands these variables down to one that has its own.
        for name in ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"):
            variables.pop(name, None)
    return subprocess.run([python, *command], cwd=folder, env=variables, capture_output=True, text=True, check=False)
