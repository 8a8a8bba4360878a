"""Lines of code, counted as the paper's Figure 13 compares them: the model, its CIF, and what each target generates.

The counter is our own and small enough to be checked by hand: a line counts if anything but blanks and comments stands
on it. Comments are `//` and `/* */` in RoboSC, CIF, Promela, C and C++, and `#` in Python, where a string that stands
alone as a statement (a docstring) is a comment, too. Only source files count: no descriptions of packages, no
parameters, no pages.
"""

import ast
import io
import tokenize
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath

from robosc.errors import RoboscError
from robosc.source import Bundle
from robosc.supervisor import Supervisor
from robosc.targets import available_targets, generate

COUNTER = "RoboSC's own counter (lines that are neither blank nor comment)"

_PYTHON = (".py",)
_LIKE_C = (".rscd", ".cif", ".pml", ".c", ".h", ".cpp", ".hpp")
_LAYOUT = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)


@dataclass(frozen=True, slots=True)
class CodeSize:
    """Size of something.

    Attributes:
        name: `model`, or a target.
        lines: Its lines of code; None: it does not exist.
        files: Number of source files that they stand in.
        why: Reason why it does not exist.
    """

    name: str
    lines: int | None
    files: int = 0
    why: str = ""


def count_lines(name: str, text: str) -> int | None:
    """Return the lines of code of a file; None if it is no source file, by its name.

    Args:
        name: Its name or path.
        text: Content of the file.
    """
    suffix = PurePosixPath(name).suffix
    is_script = not suffix and text.startswith("#!") and "python" in text.split("\n", 1)[0]
    if suffix in _PYTHON or is_script:
        return _count_python(text)
    if suffix in _LIKE_C:
        return sum(bool(line.strip()) for line in _without_comments(text).split("\n"))
    return None


def model_size(bundle: Bundle) -> CodeSize:
    """A model with its libraries."""
    counts = [count_lines(file.name, file.text) or 0 for file in (bundle.main, *bundle.libraries)]
    return CodeSize("model", sum(counts), len(counts))


def target_sizes(supervisor: Supervisor) -> tuple[CodeSize, ...]:
    """Return the size of the code that every target generates of a supervisor.

    Of CIF, it is the synthesis problem alone, as the paper counts it. A target without code, such as one of messages
    alone, has no size.
    """
    found = []
    for target in available_targets():
        try:
            files: Mapping[str, str] = generate(supervisor, target.name)
        except RoboscError as error:
            found.append(CodeSize(target.name, None, why=str(error)))
            continue
        if target.name == "cif":
            files = {path: text for path, text in files.items() if path == "controller.cif"}
        counts = [count for path, text in files.items() if (count := count_lines(path, text)) is not None]
        if counts:
            found.append(CodeSize(target.name, sum(counts), len(counts)))
    return tuple(found)


def _count_python(text: str) -> int:
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _LAYOUT:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    blank = {number for number, line in enumerate(text.split("\n"), 1) if not line.strip()}
    return len(lines - blank)


def _without_comments(text: str) -> str:
    """The text without comments; what looks like one inside a literal is none."""
    kept: list[str] = []
    place = 0
    while place < len(text):
        char = text[place]
        if text.startswith("//", place):
            end = text.find("\n", place)
            place = len(text) if end < 0 else end
        elif text.startswith("/*", place):
            end = text.find("*/", place + 2)
            end = len(text) if end < 0 else end + 2
            kept.append("\n" * text.count("\n", place, end))
            place = end
        elif char in "\"'":
            end = _literal_end(text, place)
            kept.append(text[place:end])
            place = end
        else:
            kept.append(char)
            place += 1
    return "".join(kept)


def _literal_end(text: str, begin: int) -> int:
    """Return the end of a literal that begins with a quotation mark; one that is not closed ends with its line."""
    place = begin + 1
    while place < len(text) and text[place] != "\n":
        if text[place] == "\\":
            place += 1
        elif text[place] == text[begin]:
            return place + 1
        place += 1
    return min(place, len(text))
