"""A YAML text as plain values with the line of each, within bounds.

Only the parser of PyYAML (libyaml's, where it is built in) is used: its events are put together here, with a limit for
every dimension, without aliases, anchors and tags, and with each key once. Scalars without quotes are what the core
schema of YAML 1.2 says (YAML 1.2.2, section 10.3.2), except that infinity and not-a-number stay words: PyYAML follows
YAML 1.1, where `on` is true, `1:30` is ninety and `1e-3` is a word.
"""

import math
import os
import re
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import yaml

from robosc_bridge.configuration.problems import ConfigurationError, Path, Problem, value_text

MAXIMUM_BYTES = 256 * 1024
MAXIMUM_DEPTH = 12
MAXIMUM_ENTRIES = 1000
"""Maximum number of entries of one list or mapping."""

MAXIMUM_SCALAR = 4096
"""Characters of one scalar."""

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_NULL = re.compile(r"(?:~|null|Null|NULL)?\Z")
_BOOLEANS = {word: word.lower() == "true" for word in ("true", "True", "TRUE", "false", "False", "FALSE")}
_INTEGER = re.compile(r"[-+]?[0-9]{1,19}\Z", re.ASCII)
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?\Z", re.ASCII)


@dataclass(frozen=True, slots=True)
class Document:
    """A YAML document.

    Attributes:
        name: Of its file.
        value: Mappings, lists, texts, numbers, truth values, None.
        lines: The line, counted from 1, of every key and list entry.
    """

    name: str
    value: object
    lines: Mapping[Path, int]

    def line(self, path: Path) -> int | None:
        """The line of a place, or of the nearest one around it that is written down."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path)


def read_file(path: FilePath) -> bytes:
    """The bytes of a configuration file.

    Raises:
        ConfigurationError: There is none, it is not a regular file, it is too large, or it cannot be read.
    """
    try:
        # Not blocking: opening a pipe without a writer would wait for ever.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise ConfigurationError(str(path), [Problem("is not a regular file")])
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                return file.read(MAXIMUM_BYTES + 1)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise ConfigurationError(str(path), [Problem(f"cannot be read: {error.strerror}")]) from error


def parse_document(data: bytes, name: str) -> Document:
    """A YAML text as plain values.

    Args:
        data: UTF-8.
        name: Of its file, for messages.

    Raises:
        ConfigurationError: It is not YAML, too large in some dimension, or uses what is not allowed here.
    """
    if len(data) > MAXIMUM_BYTES:
        raise ConfigurationError(name, [Problem(f"is larger than {MAXIMUM_BYTES} bytes")])
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ConfigurationError(name, [Problem("is not UTF-8", line=line)]) from error
    builder = _Builder()
    try:
        value = builder.document(iter(yaml.parse(text, Loader=_LOADER)))
    except _Stop as stop:
        builder.problems.append(stop.problem)
        raise ConfigurationError(name, builder.problems) from None
    except yaml.YAMLError as error:
        builder.problems.append(_syntax_problem(error))
        raise ConfigurationError(name, builder.problems) from error
    if builder.problems:
        raise ConfigurationError(name, builder.problems)
    return Document(name, value, builder.lines)


class _Stop(Exception):
    """The text cannot be read any further."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.message)
        self.problem = problem


class _Builder:
    def __init__(self) -> None:
        self.problems: list[Problem] = []
        self.lines: dict[Path, int] = {}

    def document(self, events: Iterator[Any]) -> object:
        """The one document of a stream; None: there is none."""
        value: object = None
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if () in self.lines:
                    raise _Stop(Problem("a second document begins here; only one is allowed", line=_line(event)))
                self.lines[()] = _line(event)
                value = self._value(next(events), events, ())
        return value

    def _value(self, event: Any, events: Iterator[Any], path: Path) -> object:
        line = _line(event)
        self.lines.setdefault(path, line)
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            self.problems.append(Problem("aliases and anchors are not allowed; write the value out", path, line))
        if isinstance(event, yaml.AliasEvent):
            return None
        if event.tag is not None:
            self.problems.append(Problem("tags are not allowed", path, line))
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, path)
        if len(path) >= MAXIMUM_DEPTH:
            raise _Stop(Problem(f"is nested deeper than {MAXIMUM_DEPTH} levels", path, line))
        if isinstance(event, yaml.SequenceStartEvent):
            return self._list(events, path)
        return self._mapping(events, path)

    def _list(self, events: Iterator[Any], path: Path) -> list[object]:
        found: list[object] = []
        for event in events:
            if isinstance(event, yaml.SequenceEndEvent):
                break
            self._bound(len(found), path, event)
            found.append(self._value(event, events, (*path, len(found))))
        return found

    def _mapping(self, events: Iterator[Any], path: Path) -> dict[str, object]:
        found: dict[str, object] = {}
        for event in events:
            if isinstance(event, yaml.MappingEndEvent):
                break
            self._bound(len(found), path, event)
            if not isinstance(event, yaml.ScalarEvent):
                raise _Stop(Problem("a key must be a word", path, _line(event)))
            key = event.value
            if event.anchor is not None or event.tag is not None:
                self.problems.append(Problem("a key must not have an anchor or a tag", path, _line(event)))
            place = (*path, key)
            if len(key) > MAXIMUM_SCALAR:
                raise _Stop(Problem(f"a key is longer than {MAXIMUM_SCALAR} characters", path, _line(event)))
            if key in found:
                first = self.lines[place]
                self.problems.append(Problem(f"is repeated here; it is already in line {first}", place, _line(event)))
            self.lines.setdefault(place, _line(event))
            found[key] = self._value(next(events), events, place)
        return found

    def _bound(self, count: int, path: Path, event: Any) -> None:
        if count >= MAXIMUM_ENTRIES:
            raise _Stop(Problem(f"has more than {MAXIMUM_ENTRIES} entries", path, _line(event)))

    def _scalar(self, event: Any, path: Path) -> object:
        text: str = event.value
        if len(text) > MAXIMUM_SCALAR:
            self.problems.append(Problem(f"is longer than {MAXIMUM_SCALAR} characters", path, _line(event)))
            return None
        if event.style:  # Quoted, or a block: text as it stands.
            return text
        if _NULL.match(text):
            return None
        if text in _BOOLEANS:
            return _BOOLEANS[text]
        if _INTEGER.match(text):
            return int(text)
        if _FLOAT.match(text):
            number = float(text)
            if not math.isfinite(number):
                self.problems.append(Problem(f"{value_text(text)} is too large a number", path, _line(event)))
            return number
        return text


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1


def _syntax_problem(error: Any) -> Problem:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    words = getattr(error, "problem", None) or getattr(error, "reason", None) or "cannot be read"
    return Problem(f"is not YAML: {words}", line=None if mark is None else mark.line + 1)
