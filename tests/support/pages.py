"""A strict reader of documentation pages: it knows the few forms that a page may have, and refuses all else.

What it reads, it decodes back, so that a test can compare a page with the model.
"""

import html
import re
from dataclasses import dataclass, field

_CODE = re.compile(r"`([^`|\\]+)`|<code>((?:[^<>&`|\\]|&#[0-9]+;)*)</code>")
_WORDS = re.compile(r"(?:[\w .,;:()'“”→⇄/{}-]|&#[0-9]+;)*")
_STATE = re.compile(r'    state "((?:[\w .,()\[\]=!/+-]|#[0-9]+;)+)" as (\w+)')
_STEP = re.compile(r"    (\[\*\]|\w+) --> (\w+)(?: : ((?:[\w .,()\[\]=!/+-]|#[0-9]+;)+))?")
_CLASS = re.compile(r"    class (\w+(?:,\w+)*) (\w+)")
_CLASS_DEFINITION = re.compile(r"    classDef (\w+) [\w-]+:\w+")


@dataclass
class Diagram:
    """A state diagram; states by what the reader sees."""

    initial: str = ""
    states: list[str] = field(default_factory=list)
    marked: set[str] = field(default_factory=set)
    transitions: list[tuple[str, str, str]] = field(default_factory=list)


@dataclass
class Section:
    """Content below a heading, up to the next one of any level."""

    level: int
    title: str
    tables: list[list[list[str]]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    diagrams: list[Diagram] = field(default_factory=list)


def read_page(text: str) -> list[Section]:
    """The sections of a page; AssertionError where it has anything but the forms known here."""
    assert text.endswith("\n") and not text.endswith("\n\n") and "\n\n\n" not in text
    assert all(character == "\n" or character.isprintable() for character in text)
    sections: list[Section] = []
    for block in _blocks(text):
        first = block[0]
        if first.startswith("#"):
            level, _, title = first.partition(" ")
            assert set(level) == {"#"} and len(block) == 1
            sections.append(Section(len(level), read_text(title)))
        elif first == "```mermaid":
            assert block[-1] == "```"
            sections[-1].diagrams.append(read_diagram(block[1:-1]))
        elif first.startswith("| "):
            sections[-1].tables.append(_table(block))
        else:
            sections[-1].lines += [_line(line) for line in block]
    return sections


def _blocks(text: str) -> list[list[str]]:
    """Groups of lines; an empty line stands between them."""
    return [block.split("\n") for block in text.removesuffix("\n").split("\n\n")]


def _table(lines: list[str]) -> list[list[str]]:
    for line in lines:
        assert line.startswith("| ") and line.endswith(" |"), line
    rows = [line[2:-2].split(" | ") for line in lines]
    assert len({len(row) for row in rows}) == 1, lines
    assert set(rows[1]) == {"---"}
    return [[read_text(cell) for cell in row] for row in (rows[0], *rows[2:])]


def _line(line: str) -> str:
    return read_text(re.sub(r"^(?:  )*- ", "", line))


def read_text(text: str) -> str:
    """Return the text that a reader sees of Markdown on one line: plain words and code."""
    found, place = [], 0
    for match in _CODE.finditer(text):
        # Entities are read in HTML; in a code span every character is itself.
        inside = match[1] if match[1] is not None else html.unescape(match[2])
        found += [_words(text[place : match.start()]), inside]
        place = match.end()
    return "".join([*found, _words(text[place:])])


def _words(text: str) -> str:
    assert _WORDS.fullmatch(text), text
    return html.unescape(text)


def read_diagram(lines: list[str]) -> Diagram:
    """A Mermaid state diagram as pages have them: every state declared once, before it is used."""
    assert lines[0] == "stateDiagram-v2"
    found, names, classes = Diagram(), dict[str, str](), set[str]()
    for line in lines[1:]:
        if match := _STATE.fullmatch(line):
            assert match[2] not in names
            names[match[2]] = _seen(match[1])
            found.states.append(_seen(match[1]))
        elif match := _STEP.fullmatch(line):
            if match[1] == "[*]":
                assert not found.initial and match[3] is None
                found.initial = names[match[2]]
            else:
                found.transitions.append((names[match[1]], _seen(match[3]), names[match[2]]))
        elif match := _CLASS_DEFINITION.fullmatch(line):
            classes.add(match[1])
        else:
            match = _CLASS.fullmatch(line)
            assert match and match[2] in classes, line
            if match[2] == "marked":
                found.marked |= {names[place] for place in match[1].split(",")}
    return found


def _seen(label: str) -> str:
    """A label as Mermaid shows it; a word cannot begin or end with a bare underscore: it would be emphasis."""
    assert not re.search(r"(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])", label), label
    return re.sub(r"#([0-9]+);", lambda match: chr(int(match[1])), label)
