"""The file for those who cite."""

import tomllib
from pathlib import Path

from support.checkers import checked

TOP = Path(__file__).parents[2]


def test_it_is_valid() -> None:
    checked("check-jsonschema", "--builtin-schema", "vendor.citation-file-format", TOP / "CITATION.cff")


def test_it_names_this_version() -> None:
    project = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))["project"]
    assert f"\nversion: {project['version']}\n" in (TOP / "CITATION.cff").read_text("utf-8")
