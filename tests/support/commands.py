"""Runs commands of `robosc` in this process."""

import json
from typing import Any

import pytest

from robosc.cli.main import main


def run_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    """Return the exit status and the document of a command with `--json`, which prints nothing else."""
    status = main([*arguments, "--json"])
    captured = capsys.readouterr()
    assert captured.err == ""
    document = json.loads(captured.out)
    assert isinstance(document, dict)
    return status, document
