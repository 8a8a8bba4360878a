"""Sentences of other languages: the first message names the strange word and shows the line that says it here.

The corpus is `tests/support/mistakes/sentences.txt`; `make mistakes` prints its shares, too.
"""

import re

import pytest

from robosc.language.parser import parse
from robosc.source import SourceFile
from support.mistakes import Mistake, by_hand, first_error, judge, obeyed

WANTED = 0.95
"""Share of sentences whose first advice is right."""

SENTENCES = tuple(mistake for mistake in by_hand() if mistake.meant)

NAMES = {
    "Door": "Hatch",
    "open": "unlock",
    "close": "lock",
    "shut": "tight",
    "ajar": "wide",
    "Base": "Wheels",
    "drive": "roll",
    "arrived": "there",
    "idle": "parked",
    "moving": "rolling",
    "L": "Rangefinder",
    "scan": "sweep",
    "bumper": "skirt",
    "near": "touched",
    "distance": "gap",
    "Gripper": "Claw",
    "grip": "grasp",
    "empty": "bare",
    "holding": "full",
    "Nav": "Pilot",
    "navigate": "travel",
    "waiting": "parked_here",
    "going": "travelling",
    "failed": "lost",
}


def renamed(mistake: Mistake) -> Mistake:
    """The same mistake in a model with other names; its place is the line."""

    def other(text: str) -> str:
        return re.sub(r"[A-Za-z_]\w*", lambda match: NAMES.get(match[0], match[0]), text)

    line = mistake.text.count("\n", 0, mistake.begin)
    text = other(mistake.text)
    begin = sum(len(each) + 1 for each in text.split("\n")[:line])
    return Mistake(
        mistake.category, text, begin, begin + len(text.split("\n")[line]), tuple(other(each) for each in mistake.meant)
    )


def share(mistakes: list[Mistake]) -> float:
    return sum(judge(mistake).is_good for mistake in mistakes) / len(mistakes)


def test_there_are_enough_of_each_kind() -> None:
    counts = {kind: sum(item.category == kind for item in SENTENCES) for kind in {item.category for item in SENTENCES}}
    assert len(counts) == 9
    assert min(counts.values()) >= 14
    assert sum(counts.values()) >= 110


def test_the_first_advice_is_right() -> None:
    assert share(list(SENTENCES)) >= WANTED, "make mistakes MISTAKES=--long"


def test_the_first_advice_is_right_where_the_rules_had_not_seen_the_sentence() -> None:
    """Each fourth sentence was left out while the rules were written."""
    assert share(list(SENTENCES[3::4])) >= WANTED


def test_no_name_of_the_corpus_is_in_the_rules() -> None:
    assert share([renamed(mistake) for mistake in SENTENCES]) >= 0.9


def test_the_message_names_what_is_strange() -> None:
    named = 0
    for mistake in SENTENCES:
        found = first_error(mistake.text)
        assert found is not None
        words = re.findall(r"\w+", mistake.text[mistake.begin : mistake.end])
        named += any(word.casefold() in found.message.casefold() for word in words)
    assert named / len(SENTENCES) >= WANTED


def test_a_sentence_among_others_has_one_finding() -> None:
    sentence = next(item for item in SENTENCES if "requirement open then drive" in item.text)
    text = sentence.text.replace("requirement open then drive", "requirement open then drive\n    rule close needs 1")
    found = parse(SourceFile("model.rscd", text)).diagnostics
    assert [item.location.line for item in found if item.location is not None] == [9, 10]


@pytest.mark.parametrize(
    "sentence",
    [
        "requirement open then",
        "requirement then",
        "requirement if",
        "requirement if then else",
        "if if if if",
        "requirement L.near enables",
        "requirement within 5 seconds",
        "every 2 s",
        "goal then then",
        "mission m { visit else }",
        "mission m { else else else }",
        "prefer drive else",
        "interface use",
        "import a.b.c",
        "requirement ( ( ( if",
        "requirement not not not",
        "requirement cancel",
        "requirement " + "then drive " * 200,
        "requirement " + "if L.near " * 200,
        "requirement 1e9 s after 2 hz within 0 hz",
        "requirement scan within 0 hz",
    ],
)
def test_what_no_rule_knows_has_a_finding_all_the_same(sentence: str) -> None:
    text = SENTENCES[0].text.replace("requirement open then drive", sentence)
    assert text != SENTENCES[0].text
    assert first_error(text) is not None


def test_a_line_that_is_shown_says_how_old_a_message_may_be() -> None:
    text = SENTENCES[0].text.replace("requirement open then drive", "requirement drive needs scan within 250 ms")
    found = first_error(text)
    assert found is not None
    assert (
        found.fix
        == "Write 'max_age: 0.25' in the 'with' list of 'scan' instead of 'requirement drive needs scan within 250 ms'."
    )
    changed = obeyed(text, found)
    assert changed is not None
    assert first_error(changed) is None


def test_where_the_robot_is_to_stop_nothing_that_moves_is_requested() -> None:
    text = SENTENCES[0].text.replace("requirement open then drive", "requirement when L.near then stop")
    found = first_error(text)
    assert found is not None
    assert found.fix.startswith("Write 'requirement { drive, navigate } needs !L.near' instead of")
