"""Texts of the language server: positions and edits agree with the obvious way, in every encoding."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsprotocol import types as lsp

from robosc.source import Location
from robosc_lsp.texts import Text
from support.editor import line_begins, offset_of, position_of

ENCODINGS = ("utf-8", "utf-16", "utf-32")
CHARACTERS = st.sampled_from(["a", "{", "é", "→", "😀", "\U0010ffff", "\n", "\r", "\r\n", " "])
TEXTS = st.lists(CHARACTERS, max_size=30).map("".join)


def is_between_lines(text: str, offset: int) -> bool:
    """Return True if an offset is that between the two characters of a line's end."""
    return text[offset - 1 : offset + 1] == "\r\n" and offset > 0


@given(TEXTS, st.sampled_from(ENCODINGS))
def test_positions_are_those_of_the_protocol(text: str, encoding: str) -> None:
    made = Text(text, lsp.PositionEncodingKind(encoding))
    for offset in range(len(text) + 1):
        if not is_between_lines(text, offset):
            position = position_of(text, offset, encoding)
            assert made.position(offset) == position
            assert made.offset(position) == offset == offset_of(text, position, encoding)


@given(TEXTS, st.integers(0, 40), st.integers(0, 80))
def test_a_position_that_is_nowhere_is_taken_for_the_nearest_before(text: str, line: int, character: int) -> None:
    offset = Text(text).offset(lsp.Position(line, character))
    begins = line_begins(text)
    if line >= len(begins):
        assert offset == len(text)
    else:
        end = begins[line + 1] if line + 1 < len(begins) else len(text)
        assert begins[line] <= offset <= begins[line] + len(text[begins[line] : end].rstrip("\r\n"))


@given(TEXTS)
def test_findings_count_characters_in_lines_that_end_at_newlines(text: str) -> None:
    made = Text(text)
    for offset in range(len(text) + 1):
        line, column = made.line_and_column(offset)
        assert (line, column) == (text[:offset].count("\n") + 1, offset - text.rfind("\n", 0, offset))
        assert made.begin_of(Location("", line, column, 0)) == offset


def test_a_place_that_is_not_there_any_more_is_the_end() -> None:
    assert Text("a\n").begin_of(Location("", 7, 3, 2)) == 2
    assert Text("a\n").range_of(Location("", 1, 9, 4)) == lsp.Range(lsp.Position(1, 0), lsp.Position(1, 0))


@pytest.mark.parametrize("encoding", ENCODINGS)
@given(TEXTS, st.lists(st.tuples(st.integers(0, 99), st.integers(0, 99), TEXTS), max_size=8))
def test_edits_are_made_one_after_the_other(encoding: str, text: str, edits: list[tuple[int, int, str]]) -> None:
    changes: list[lsp.TextDocumentContentChangeEvent] = []
    plain = text
    for first, second, new in edits:
        begin, end = sorted((first % (len(plain) + 1), second % (len(plain) + 1)))
        if is_between_lines(plain, begin) or is_between_lines(plain, end):
            continue
        where = lsp.Range(position_of(plain, begin, encoding), position_of(plain, end, encoding))
        changes.append(lsp.TextDocumentContentChangePartial(text=new, range=where))
        plain = plain[:begin] + new + plain[end:]
    assert Text(text, lsp.PositionEncodingKind(encoding)).edited(changes).text == plain
    whole = lsp.TextDocumentContentChangeWholeDocument("anew")
    assert Text(text, lsp.PositionEncodingKind(encoding)).edited([*changes, whole]).text == "anew"
