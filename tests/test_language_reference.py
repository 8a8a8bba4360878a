"""The language reference shows sound models, and names what there is."""

import re
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.expressions import ARGUMENTS
from robosc.language.words import RESERVED_WORDS
from support.models import bundle_of, checked

PAGE = (Path(__file__).parents[1] / "docs" / "language.md").read_text(encoding="utf-8")
MODELS = re.findall(r"^```robosc\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("text", MODELS, ids=[re.findall(r"robot (\w+)", text)[0] for text in MODELS])
def test_models_are_sound_and_have_a_supervisor(text: str) -> None:
    assert checked(text).diagnostics == ()
    assert make_supervisor(bundle_of(text)).supervisor is not None


def test_there_are_models() -> None:
    assert len(MODELS) >= 5


def test_every_reserved_word_and_function_is_told() -> None:
    listed = re.findall(r"\*\*Reserved words\*\*: `([^`]*)`", PAGE)[0].split()
    assert set(listed) == RESERVED_WORDS
    assert all(f"`{function}(" in PAGE for function in (*ARGUMENTS, "length", "any", "all"))


def test_every_link_to_a_section_leads_somewhere() -> None:
    anchors = {
        re.sub(r"[^a-z0-9 -]", "", head.lower()).replace(" ", "-") for head in re.findall(r"^## (.*)$", PAGE, re.M)
    }
    assert set(re.findall(r"\]\(#([^)]*)\)", PAGE)) <= anchors
