"""Output of the commands, and the exit codes: shared by `robosc` and `robosc-client`.

Results go to standard output, findings and progress to standard error. With `--json`, one JSON document goes to
standard output and also holds the findings. If a command fails, the document is `{"error": ...}`, and the message goes
to standard error as well.
"""

import argparse
import codecs
import io
import os
import sys
from collections.abc import Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from types import MappingProxyType
from typing import TextIO

from robosc.errors import Diagnostic, Severity
from robosc.json_documents import accepted_json, counts_text, diagnostics_json, json_text
from robosc.pipeline.files import FileAccessError, write_whole
from robosc.source import Bundle


class ExitCode(IntEnum):
    """Meaning of a command's exit status."""

    OK = 0
    FAILED = 1
    """The model has errors, or no supervisor exists."""
    USAGE = 2
    """Wrong use: unknown options, a file that cannot be read or written."""
    SERVICE = 3
    """The server is not there, refused, or did not answer in time."""
    INTERRUPTED = 130


class CommandError(Exception):
    """Error that ends a command with a message.

    Attributes:
        status: Exit status of the command.
    """

    def __init__(self, message: str, status: ExitCode) -> None:
        super().__init__(message)
        self.status = status


class UsageError(CommandError):
    """Wrong use of a command that the argument parser cannot see, such as a folder that cannot be written."""

    def __init__(self, message: str) -> None:
        super().__init__(message, ExitCode.USAGE)


def prepare_streams() -> None:
    """Make standard output and error take any text: one that is closed swallows it, and no character is too foreign."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115  # as long as the process
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


ESCAPED = {code: f"\\u{code:04x}" for code in (*range(0x7F, 0xA0), 0x200E, 0x200F, *range(0x202A, 0x202F))}
"""Characters that JSON allows in its strings, but that would move a terminal's cursor or turn its text round."""


def print_json(document: Mapping[str, object]) -> None:
    """One JSON document on standard output, keys in the order given."""
    # Characters that cannot be encoded are escaped, and in JSON by JSON's own rules.
    sys.stdout.write(json_text(document, is_ascii=not has_unicode_output()).translate(ESCAPED))


def has_unicode_output() -> bool:
    """Return True if standard output takes every character."""
    return codecs.lookup(sys.stdout.encoding or "ascii").name.startswith("utf")


def print_diagnostics(diagnostics: Sequence[Diagnostic], bundle: Bundle | None) -> None:
    """Print findings with source line and caret on standard error, and a last line that counts them.

    On a terminal the last line also says where to read more.
    """
    for diagnostic in diagnostics:
        sys.stderr.write(diagnostic.render(bundle) + "\n")
    if diagnostics:
        hint = " (more about a code: robosc explain CODE)" if sys.stderr.isatty() else ""
        sys.stderr.write(f"{counts_text(diagnostics)}{hint}\n")


def has_errors(diagnostics: Sequence[Diagnostic], *, strict: bool = False) -> bool:
    """Return True if any finding is an error; with `strict`, if any is an error or a warning."""
    grave = {Severity.ERROR, Severity.WARNING} if strict else {Severity.ERROR}
    return any(diagnostic.severity in grave for diagnostic in diagnostics)


def report_check(
    arguments: argparse.Namespace,
    diagnostics: tuple[Diagnostic, ...],
    bundle: Bundle | None,
    summary: Mapping[str, object] = MappingProxyType({}),
    accepted: tuple[Diagnostic, ...] = (),
) -> ExitCode:
    """Print the findings, in JSON with what else is reported, and return the exit status.

    Args:
        arguments: Of the command.
        diagnostics: The findings.
        bundle: The texts, or None where they could not be read.
        summary: Other things that are reported in JSON.
        accepted: Findings that the text accepts and that are to be shown, which change no status.
    """
    if arguments.json:
        shown = {**diagnostics_json(diagnostics), **accepted_json(accepted)}
        print_json({"file": str(arguments.model), **summary, **shown})
    else:
        for item in accepted:
            sys.stderr.write(f"{item.render(bundle)}\n")
        if diagnostics:
            print_diagnostics(diagnostics, bundle)
        else:
            sys.stdout.write(f"{arguments.model}: {counts_text(diagnostics)}\n")
    return ExitCode.FAILED if has_errors(diagnostics, strict=arguments.strict) else ExitCode.OK


def require_other_file(output: Path | None, model: Path) -> None:
    """Do nothing if what is written does not replace the model.

    Raises:
        UsageError: It would.
    """
    if output is not None and output.exists() and model.exists() and output.samefile(model):
        raise UsageError(f"{output} is the model itself: write to another file")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a result file whole or not at all; what is no plain file (a device, a pipe) is written to as it is.

    Raises:
        UsageError: The place cannot be written.
    """
    try:
        write_whole(path, content)
    except FileAccessError as error:
        raise UsageError(str(error)) from error


class ProgressLine:
    """A line on a terminal that long work overwrites; silent where the stream is no terminal."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._is_shown = self._stream.isatty()
        self._width = 0

    def show(self, text: str) -> None:
        """Replace the line."""
        if self._is_shown:
            self._stream.write("\r" + text[:100].ljust(self._width))
            self._stream.flush()
            self._width = len(text[:100])

    def clear(self) -> None:
        """Remove the line."""
        if self._is_shown and self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._stream.flush()
            self._width = 0
