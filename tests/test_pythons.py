"""Other Pythons are found by starting them: what does not start is passed over."""

import os
from pathlib import Path

import pytest

from support.pythons import python_of


def program(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True)
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


def test_a_shim_that_does_not_start_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shim = program(tmp_path / "shims" / "python3.99", "exit 127")
    real = program(tmp_path / "pyenv" / "versions" / "3.99.1" / "bin" / "python3.99", "echo 3 99")
    monkeypatch.setenv("PATH", f"{shim.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path / "pyenv"))
    assert python_of(99) == real


def test_another_version_than_its_name_says_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = program(tmp_path / "bin" / "python3.98", "echo 3 97")
    monkeypatch.setenv("PATH", f"{other.parent}{os.pathsep}{os.environ['PATH']}")
    with pytest.raises(pytest.skip.Exception, match=r"no Python 3\.98 starts here"):
        python_of(98)
