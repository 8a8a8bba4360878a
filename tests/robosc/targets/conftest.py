"""Fixtures that several tests of targets begin with."""

from pathlib import Path

import pytest

from robosc.targets import GeneratedFiles, registry, write_files


@pytest.fixture
def own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the test register targets that no other test sees."""
    monkeypatch.setattr(registry, "_registered", {})


@pytest.fixture
def folder(files: GeneratedFiles, tmp_path: Path) -> Path:
    """Return a folder with the files of the module's fixture `files`."""
    write_files(files, tmp_path)
    return tmp_path
