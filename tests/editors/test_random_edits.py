"""Edits at random places end in the same state as opening the text that they lead to."""

from collections.abc import Iterator

import hypothesis
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsprotocol import types as lsp

from support.editor import Editor
from support.editor_models import LIBRARY, ROBOT

PIECES = st.one_of(
    st.sampled_from(["", "{", "}", "\r\n", "\n", "😀", "/* ", "*/", "// é", "on_", ".", " goto ", "'", "^", "\r"]),
    st.tuples(st.integers(0, len(ROBOT)), st.integers(0, 60)).map(lambda cut: ROBOT[cut[0] : cut[0] + cut[1]]),
)
EDITS = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 40), PIECES), min_size=1, max_size=12)


@pytest.fixture(scope="module")
def editor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Editor]:
    with Editor(tmp_path_factory.mktemp("folder"), "--synthesis-seconds", "0") as editor:
        editor.open("parts.rscd", LIBRARY)
        yield editor


def state_of(editor: Editor, name: str) -> tuple[object, ...]:
    """Return all that the server knows of a file; places and words, without the file's own name."""
    document, client = editor.document(name), editor.client
    findings = editor.findings(name)
    end = editor.position(editor.texts[name], len(editor.texts[name]))
    offered = editor.run(client.text_document_completion_async(lsp.CompletionParams(document, end)))
    answers = (
        editor.run(client.text_document_document_symbol_async(lsp.DocumentSymbolParams(document))),
        editor.run(client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(document))),
        editor.run(client.text_document_folding_range_async(lsp.FoldingRangeParams(document))),
        offered,
    )
    return tuple(repr(item).replace(editor.uri(name), "URI").replace(name, "NAME") for item in (findings, *answers))


@hypothesis.settings(max_examples=60)
@given(EDITS, st.integers(1, 4))
def test_edits_end_in_the_state_of_the_final_text(
    editor: Editor, edits: list[tuple[float, int, str]], together: int
) -> None:
    text = ROBOT
    editor.open("edited.rscd", text)
    changes: list[tuple[int, int, str]] = []
    for place, length, piece in edits:
        begin = round(place * len(text))
        end = min(begin + length, len(text))
        if any(text[at - 1 : at + 1] == "\r\n" for at in (begin, end) if at):
            continue  # No position of the protocol is between the two.
        changes.append((begin, end, piece))
        text = text[:begin] + piece + text[end:]
    for first in range(0, len(changes), together):
        editor.edit("edited.rscd", *changes[first : first + together])
        if first % 2:
            editor.findings("edited.rscd")
    assert editor.texts["edited.rscd"] == text
    edited = state_of(editor, "edited.rscd")
    editor.close("edited.rscd")
    editor.open("opened.rscd", text)
    opened = state_of(editor, "opened.rscd")
    editor.close("opened.rscd")
    assert edited == opened
