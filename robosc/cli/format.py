"""`robosc format`: models in one canonical layout."""

import argparse
import codecs
import difflib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from robosc.cli.output import ExitCode, UsageError, print_diagnostics, print_json, write_bytes
from robosc.errors import Diagnostic, LanguageError, Severity
from robosc.json_documents import diagnostics_json
from robosc.pipeline.automata_files import is_automata
from robosc.source import Bundle, Location, SourceFile

type FormatText = Callable[[str, str], str]
"""Text and name to canonical text; raises LanguageError for syntax errors."""

_STANDARD_INPUT = "-"
_STANDARD_INPUT_NAME = "<stdin>"


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "format",
        help="write models in one canonical layout",
        description="Write models and libraries in one canonical layout, in place, and print the names of the files "
        "that it changed. Comments, groups between blank lines, and line ends stay. A file with syntax errors is left "
        "alone; the others are still formatted.",
    )
    parser.add_argument(
        "files",
        nargs="+",
        metavar="FILE",
        help="a model or library; a folder: every .rscd file below it; -: standard input, written to standard output",
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing, list the files that would change, exit with 1 if any would"
    )
    parser.add_argument("--diff", action="store_true", help="write nothing, print what would change as a unified diff")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


class _Status(StrEnum):
    """Kind of outcome for a file."""

    UNCHANGED = "unchanged"
    CHANGED = "changed"
    """Its layout is not canonical; it was written, unless nothing was to be written."""
    BROKEN = "broken"
    """The file has errors and was left alone."""
    INACCESSIBLE = "inaccessible"
    """The file cannot be read or written."""


@dataclass(frozen=True, slots=True)
class _Outcome:
    """Outcome for a file.

    Attributes:
        name: Name of the file as the user wrote it.
        status: Kind of outcome.
        before: Its content, as far as it was read.
        after: Its canonical content, the same where there is none.
        diagnostics: Its errors.
        source: Its text, for showing the errors.
        fault: Reason why it cannot be read or written.
    """

    name: str
    status: _Status
    before: bytes = b""
    after: bytes = b""
    diagnostics: tuple[Diagnostic, ...] = ()
    source: SourceFile | None = None
    fault: str = ""


def run(arguments: argparse.Namespace) -> int:
    """Format the files; 0 if all could be, and with `--check` none would change."""
    from robosc.formatting import format_text

    return run_with(arguments, format_text)


def run_with(arguments: argparse.Namespace, format_text: FormatText) -> int:
    """Format the files by something that formats a text of a name, or raises LanguageError; as `run`."""
    only_looks = arguments.check or arguments.diff
    if _STANDARD_INPUT in arguments.files:
        if len(arguments.files) > 1:
            raise UsageError("- is standard input: it cannot be formatted together with files")
        if arguments.json and not only_looks:
            raise UsageError("with - the text goes to standard output: --json needs --check or --diff then")
        outcomes = [_format_standard_input(format_text, writes=not only_looks)]
    else:
        outcomes = [_format_file(path, format_text, writes=not only_looks) for path in _paths(arguments.files)]
    _report(arguments, outcomes)
    return _exit_status(outcomes, check=arguments.check)


def _exit_status(outcomes: Iterable[_Outcome], *, check: bool) -> ExitCode:
    found = {outcome.status for outcome in outcomes}
    if _Status.INACCESSIBLE in found:
        return ExitCode.USAGE
    return ExitCode.FAILED if _Status.BROKEN in found or (check and _Status.CHANGED in found) else ExitCode.OK


# Files


def _paths(names: Sequence[str]) -> tuple[Path, ...]:
    """The files that are meant, each once, those below folders by name.

    Raises:
        UsageError: A name is none of a file, or of a folder with models.
    """
    found: dict[str, Path] = {}
    for name in names:
        if not name:
            raise UsageError("the name of a file is empty")
        try:
            for path in _files(Path(name)):
                found.setdefault(os.path.realpath(path), path)
        except OSError as error:
            raise UsageError(f"cannot read {_shown(Path(name))}: {error.strerror or error}") from error
    return tuple(found.values())


def _files(path: Path) -> Sequence[Path]:
    """A file, or the models below a folder."""
    from robosc.language.bundle import SUFFIX

    if path.is_dir():
        below = sorted(inner for inner in path.rglob(f"*{SUFFIX}") if inner.is_file())
        if not below:
            raise UsageError(f"there is no {SUFFIX} file in the folder {_shown(path)}")
        return below
    if not path.exists():
        raise UsageError(f"there is no file {_shown(path)}")
    if is_automata(path):
        raise UsageError(f"{_shown(path)} holds automata: only RoboSC's own models can be formatted")
    if not path.is_file():
        raise UsageError(f"{_shown(path)} is not a plain file")
    return [path]


def _format_file(path: Path, format_text: FormatText, *, writes: bool) -> _Outcome:
    from robosc.language.reading import MAXIMUM_BYTES

    name = _shown(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAXIMUM_BYTES + 1)
    except OSError as error:
        return _Outcome(name, _Status.INACCESSIBLE, fault=f"cannot read {name}: {error.strerror or error}")
    outcome = _formatted(content, name, format_text)
    if writes and outcome.status is _Status.CHANGED:
        try:
            write_bytes(path, outcome.after)
        except UsageError as error:
            return _Outcome(name, _Status.INACCESSIBLE, fault=str(error))
    return outcome


def _format_standard_input(format_text: FormatText, *, writes: bool) -> _Outcome:
    from robosc.language.reading import MAXIMUM_BYTES

    if sys.stdin is None:
        raise UsageError("standard input is closed")
    outcome = _formatted(sys.stdin.buffer.read(MAXIMUM_BYTES + 1), _STANDARD_INPUT_NAME, format_text)
    if writes and outcome.status is not _Status.BROKEN:
        _print_bytes(outcome.after)
    return outcome


def _formatted(content: bytes, name: str, format_text: FormatText) -> _Outcome:
    """The canonical content of a file; a byte order mark stays."""
    from robosc.language import decode_source
    from robosc.language.reading import MAXIMUM_BYTES

    source = None
    try:
        text = decode_source(content, name)
        source = SourceFile(name, text)
        after = format_text(text, name).encode("utf-8")
        if content.startswith(codecs.BOM_UTF8):
            after = codecs.BOM_UTF8 + after
        if len(after) > MAXIMUM_BYTES:
            message = f"formatted, the file would have more than {MAXIMUM_BYTES} bytes"
            raise LanguageError(
                [Diagnostic(Severity.ERROR, "file-too-large", message, Location(name, 1, 1), "Split it.")]
            )
    except LanguageError as error:
        return _Outcome(name, _Status.BROKEN, content, content, error.diagnostics, source)
    return _Outcome(name, _Status.UNCHANGED if after == content else _Status.CHANGED, content, after)


def _shown(path: Path) -> str:
    r"""A file's name as text; bytes of it that are no UTF-8 are shown as `\xNN`."""
    return os.fsencode(path).decode("utf-8", errors="backslashreplace")


# Output


def _report(arguments: argparse.Namespace, outcomes: Sequence[_Outcome]) -> None:
    if arguments.json:
        print_json(_document(outcomes, with_diffs=arguments.diff))
        return
    # Otherwise standard output is the formatted text.
    lists_files = arguments.check or _STANDARD_INPUT not in arguments.files
    for outcome in outcomes:
        if outcome.status is _Status.BROKEN:
            print_diagnostics(outcome.diagnostics, Bundle(outcome.source) if outcome.source else None)
        elif outcome.status is _Status.INACCESSIBLE:
            sys.stderr.write(f"robosc: {outcome.fault}\n")
        elif outcome.status is _Status.CHANGED and arguments.diff:
            _print_bytes("".join(_diff(outcome)).encode("utf-8"))
        elif outcome.status is _Status.CHANGED and lists_files:
            sys.stdout.write(f"{outcome.name}\n")


def _document(outcomes: Sequence[_Outcome], *, with_diffs: bool) -> dict[str, object]:
    files: list[dict[str, object]] = []
    for outcome in outcomes:
        described: dict[str, object] = {"file": outcome.name, "status": str(outcome.status)}
        if outcome.fault:
            described["reason"] = outcome.fault
        if with_diffs:
            described["diff"] = "".join(_diff(outcome))
        files.append(described)
    return {"files": files, **diagnostics_json([item for outcome in outcomes for item in outcome.diagnostics])}


def _diff(outcome: _Outcome) -> Iterator[str]:
    """The lines of a unified diff; none where nothing changes."""
    if outcome.before == outcome.after:
        return
    before, after = (_lines(content) for content in (outcome.before, outcome.after))
    for line in difflib.unified_diff(before, after, outcome.name, outcome.name):
        yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"


def _lines(content: bytes) -> list[str]:
    """The lines of a text with their ends; only a newline ends one."""
    *whole, rest = content.decode("utf-8").split("\n")
    return [f"{line}\n" for line in whole] + [rest] * bool(rest)


def _print_bytes(content: bytes) -> None:
    """Print a text as it is, whatever the locale."""
    sys.stdout.flush()
    sys.stdout.buffer.write(content)
