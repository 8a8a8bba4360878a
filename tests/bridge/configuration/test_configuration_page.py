"""The page of the documentation is that of the structures, and its examples are valid."""

import re
from pathlib import Path

import pytest

from robosc.language import load_bundle
from robosc.model.check import check
from robosc_bridge.configuration import map_channels, parse, reference
from robosc_bridge.configuration.document import MAXIMUM_BYTES, MAXIMUM_DEPTH, MAXIMUM_ENTRIES, MAXIMUM_SCALAR

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "bridge-configuration.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"\[model\]\(([^)]+)\):\n\n```yaml\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("table", reference().strip().split("\n\n"), ids=["keys", "channels", "options", "data"])
def test_the_tables_are_those_of_the_structures(table: str) -> None:
    assert f"\n\n{table}\n" in PAGE, "write what reference() returns into it"


def test_the_tables_are_all_that_there_is() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("|")]
    assert rows == [row for table in _in_page_order() for row in table.splitlines()]


def _in_page_order() -> list[str]:
    return sorted(reference().strip().split("\n\n"), key=PAGE.index)


def test_there_is_an_example_for_each_robot() -> None:
    robots = [re.findall(r"^robot: (\w+)$", text, re.MULTILINE) for _, text in EXAMPLES]
    assert robots == [["burger"], ["waffle"], ["waffle_pi"]]
    assert PAGE.count("```yaml") == len(EXAMPLES)


@pytest.mark.parametrize(("model", "text"), EXAMPLES)
def test_the_examples_can_be_tied(model: str, text: str) -> None:
    checked = check(load_bundle(DOCS / model)).model
    assert checked is not None
    loaded = parse(text.encode(), "page.yaml")
    mapping = map_channels(checked, loaded.configuration, loaded.document)
    assert mapping.settings(loaded.configuration.execution).release_identifiers == ("/cmd_vel",)


def test_the_limits_are_those_of_the_reader() -> None:
    assert f"at most {MAXIMUM_BYTES // 1024} KiB" in PAGE
    assert f"at most {MAXIMUM_DEPTH} levels, {MAXIMUM_ENTRIES} entries each and {MAXIMUM_SCALAR} characters" in PAGE


def test_the_page_is_listed() -> None:
    assert "(bridge-configuration.md)" in (DOCS / "README.md").read_text(encoding="utf-8")
