"""The tutorial, played as a reader plays it: its files are written, its commands typed, their output compared."""

import os
import re
from pathlib import Path

import pytest

from support.tutorial import (
    Chapter,
    Command,
    FileBlock,
    Mode,
    Shell,
    TutorialError,
    edited,
    matches,
    play,
    read_chapters,
)

ROOT = Path(__file__).parents[1]

DOCS = ROOT / "docs"


def new_shell(folder: Path, start: Path) -> Shell:
    """A shell of a user with an empty home and a plain environment."""
    variables = {name: os.environ[name] for name in ("PATH", "TMPDIR") if name in os.environ}
    return Shell(folder / "home", start, {**variables, "LANG": "C.UTF-8"})


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (DOCS / link).exists()] == []


def test_the_index_has_every_page() -> None:
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    assert [page.name for page in DOCS.glob("*.md") if page.name != "README.md" and f"({page.name})" not in index] == []


@pytest.mark.parametrize(
    ("expected", "output", "same"),
    [
        ("a\nb", "a\nb\n", True),
        ("a\nb", "a  \nb\n", True),
        ("a\nb", "a\n", False),
        ("a", "a\nb\n", False),
        ("", "", True),
        ("", "a\n", False),
        ("...", "", True),
        ("a\n...\nd", "a\nb\nc\nd\n", True),
        ("a\n...\nd", "a\nd\n", True),
        ("a\n...\nd", "a\nb\nc\n", False),
        ("a\n...\na", "a\n", False),
        ("...\na\n...\nb\n...", "b\na\nc\nb\n", True),
        ("...\na\n...\nb\n...", "b\na\nc\n", False),
        ("...\na\nb", "b\n", False),
        ("after ... ms", "after 130 ms\n", True),
        ("after ... ms", "after 130 s\nms\n", False),
        ("a.c", "abc\n", False),
    ],
)
def test_output_is_compared_but_for_what_is_elided(expected: str, output: str, same: bool) -> None:
    assert matches(expected, output) is same


@pytest.mark.parametrize(
    ("output", "same"),
    [
        ("  10.25  at 127.0.0.1:9   end\n", True),
        ("  2.50  at 127.0.0.1:37315  end\n", True),
        ("  2.50  at 127.0.0.1:37315  other\n", False),
        ("  x  at 127.0.0.1:37315  end\n", False),
        ("  2.50at 127.0.0.1:37315  end\n", False),
    ],
)
def test_numbers_may_vary_where_the_document_says_so(output: str, same: bool) -> None:
    expected = "  2.48  at 127.0.0.1:1  end"
    assert matches(expected, output, numbers_vary=True) is same
    assert not matches(expected, output)


CONSOLE = "## T\n\n```console{}\n{}\n```\n"


@pytest.mark.parametrize(
    ("options", "body", "complaint"),
    [
        ("", "$ echo one\none\n$ echo two\ntwo", None),
        ("", "$ cd / && export A=1\n$ pwd; echo $A\n/\n1", None),
        ("", "$ echo wrong >&2\nwrong", None),
        (" status=3", "$ true\n$ exit 3", None),
        ("", "$ echo one\nother", "line 4: `echo one` printed\none\n\ninstead of\nother"),
        ("", "$ false\n$ true", "line 4: `false` ended with 1 instead of 0"),
        (" status=1", "$ false\n$ false", "line 4: `false` ended with 1 instead of 0"),
        (" status=1", "$ true", "line 4: `true` ended with 0 instead of 1"),
    ],
)
def test_commands_are_typed_in_one_shell(options: str, body: str, complaint: str | None, tmp_path: Path) -> None:
    (chapter,) = read_chapters(CONSOLE.format(options, body))
    shell = new_shell(tmp_path, tmp_path)
    said = None
    try:
        for step in chapter.steps:
            play(step, shell)
    except TutorialError as error:
        said = str(error)
    assert (said is None) == (complaint is None), said
    assert complaint is None or complaint in str(said)


ROBOT = "robot R {\n    component A {\n        x {\n        }\n    }\n    requirement m needs A.x\n}\n"


@pytest.mark.parametrize(
    ("mode", "text", "after"),
    [
        (Mode.ADD, "    new\n", ROBOT.removesuffix("}\n") + "\n    new\n}\n"),
        (
            Mode.REPLACE,
            "    component A from L\n",
            "robot R {\n    component A from L\n    requirement m needs A.x\n}\n",
        ),
        (Mode.REPLACE, "    requirement m needs A.y\n", ROBOT.replace("A.x", "A.y")),
    ],
)
def test_files_are_edited_where_the_block_says(mode: Mode, text: str, after: str) -> None:
    assert edited(ROBOT, FileBlock(1, "r.rscd", mode, text)) == after


@pytest.mark.parametrize(
    ("before", "mode", "complaint"),
    [("", Mode.ADD, "no last line"), (ROBOT, Mode.REPLACE, "0 definitions component B")],
)
def test_an_edit_without_its_place_is_refused(before: str, mode: Mode, complaint: str) -> None:
    with pytest.raises(TutorialError, match=complaint):
        edited(before, FileBlock(1, "r.rscd", mode, "component B {\n}\n"))


@pytest.mark.parametrize(
    ("document", "complaint"),
    [
        ("## T\n\n```robosc\nx\n```\n", "no info string"),
        ("## T\n\n```\nx\n```\n", "no info string"),
        ("## T\n\nWrite `b.rscd`:\n\n```robosc file=a.rscd\nx\n```\n", "does not name `a.rscd`"),
        ("## T\n\n`a.rscd`\n\nThen:\n\n```robosc file=a.rscd\nx\n```\n", "does not name `a.rscd`"),
        ("## T\n\n```console status=x\n$ true\n```\n", "no option"),
        ("## T\n\n```console\noutput\n```\n", "begins with"),
        ("## T\n\n```console\n$ true\n", "not closed"),
        ("```console\n$ true\n```\n", "before the first chapter"),
    ],
)
def test_a_block_that_nobody_would_try_out_is_refused(document: str, complaint: str) -> None:
    with pytest.raises(TutorialError, match=complaint):
        read_chapters(document)


def test_chapters_have_their_blocks_in_order() -> None:
    document = "# Title\n\n## One\n\nIn `a`:\n\n```python file=a\nx\n```\n\n```console\n$ true\n```\n\n## Two\n"
    write = FileBlock(7, "a", Mode.WHOLE, "x\n")
    assert read_chapters(document) == (Chapter("One", (write, Command(12, "true", "", 0))), Chapter("Two", ()))
