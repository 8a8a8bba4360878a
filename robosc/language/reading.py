"""Reader of one text, of this language or of another one."""

from pathlib import Path

from robosc.errors import Diagnostic, LanguageError, Severity
from robosc.source import Location

MAXIMUM_BYTES = 16 * 1024 * 1024
"""A larger file is refused."""


def decode_source(content: bytes, name: str) -> str:
    """The text of a file.

    Raises:
        LanguageError: It is too large or not UTF-8.
    """
    if len(content) > MAXIMUM_BYTES:
        raise _refused("file-too-large", name, f"the file has more than {MAXIMUM_BYTES} bytes", "Split it.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        column = error.start - content.rfind(b"\n", 0, error.start)
        raise _refused(
            "not-utf8", name, "the file is not UTF-8 text", "Save it as UTF-8.", line=line, column=column
        ) from error


def _refused(code: str, name: str, message: str, fix: str, *, line: int = 1, column: int = 1) -> LanguageError:
    return LanguageError([Diagnostic(Severity.ERROR, code, message, Location(name, line, column), fix)])


def read_source(path: Path, name: str) -> str:
    """The text of a file, of which no more is read than it may have.

    Raises:
        LanguageError: As `decode_source`.
        OSError: It cannot be read.
    """
    with path.open("rb") as file:
        return decode_source(file.read(MAXIMUM_BYTES + 1), name)
