"""The glossary: it defines every word that it is to, and pages link each where it first occurs."""

import re
from pathlib import Path

import pytest

from support.glossary import WORDS, unlinked

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
GLOSSARY = (DOCS / "glossary.md").read_text(encoding="utf-8")

# Those of server and bridge have requests and layers of other kinds.
PAGES = (
    *("tutorial", "concepts", "comparison", "language", "layer", "commands", "explaining", "verification"),
    *("on-your-robot", "troubleshooting", "generating", "c99", "cpp", "ros1", "python", "certificates", "event-logs"),
    *("python-api", "experiments", "strategies", "courier"),
)


@pytest.mark.parametrize("name", WORDS)
def test_each_word_is_defined(name: str) -> None:
    (section,) = re.findall(rf"^### {name}\n\n(.+?)(?=\n#|\Z)", GLOSSARY, re.MULTILINE | re.DOTALL)
    assert len(section.split()) > 10


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *(DOCS / f"{name}.md" for name in PAGES)], ids=lambda page: page.stem
)
def test_each_word_is_linked_where_it_first_occurs(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    places = {name: unlinked(text, name) for name in WORDS}
    assert {name: text[at : at + 60] for name, at in places.items() if at is not None} == {}


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("A request.", 2),
        ("A [request](glossary.md#request), and a request.", None),
        ("Requests, and a [request](glossary.md#request).", 0),
        ("# Requests\n\n`request` of a [request](api.md)\n\n```\nrequest\n```\n\nRequested.", None),
    ],
)
def test_what_counts_as_an_occurrence(text: str, place: int | None) -> None:
    assert unlinked(text, "request") == place
