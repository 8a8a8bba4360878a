"""Models in files that several tests of commands need."""

from pathlib import Path

import pytest

from support.models import EMPTY


@pytest.fixture
def empty(tmp_path: Path) -> str:
    """Return the path of a model that has no supervisor."""
    path = tmp_path / "empty.rscd"
    path.write_text(EMPTY, encoding="utf-8")
    return str(path)
