"""The page about installing: extras that there are, and no page that says where a wheel comes from but wrongly."""

import re
import tomllib
from pathlib import Path

import pytest

from robosc.doctor import checks

TOP = Path(__file__).parents[2]
PAGE = (TOP / "docs" / "install.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FOR_DEVELOPERS = {"build", "dev", "examples"}
EXTRAS = set(PROJECT["optional-dependencies"]) - FOR_DEVELOPERS
PAGES = [*(TOP / "docs").glob("*.md"), TOP / "README.md", TOP / "bridge" / "README.md"]


def test_every_extra_is_named() -> None:
    (sentence,) = re.findall(r"beyond the core are extras: (.*?)\.\n", PAGE, re.DOTALL)
    assert set(re.findall(r"`(\w+)`", sentence)) == EXTRAS


def test_there_are_wheels_for_extras_that_there_are() -> None:
    (chosen,) = re.findall(r"^DIST_EXTRAS := (.*)$", (TOP / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(chosen.split()) <= EXTRAS


def test_extras_are_examined() -> None:
    assert set(checks._TOLD_EXTRAS) == EXTRAS - {"ros2"}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_extras_are_added_to_what_was_installed(page: Path) -> None:
    """No index has RoboSC: a page that adds an extra by its name says, or links, how it comes there."""
    text = page.read_text(encoding="utf-8")
    if page.name != "install.md" and re.search(r"pip install\b[^\n`]*'robosc\[", text):
        assert "install.md" in text


def test_the_version_is_the_one_that_is_made() -> None:
    version = (TOP / "robosc" / "_version.py").read_text(encoding="utf-8")
    wheels = {
        match for path in PAGES for match in re.findall(r"robosc-(\d[\w.]*)-py3", path.read_text(encoding="utf-8"))
    }
    assert wheels == {PROJECT["version"]}
    assert f'"{PROJECT["version"]}"' in version
