"""Events with their data, written by a person, one a line, or recorded in an event log.

A line is the name of an event, and then nothing, data in JSON, or properties: `scan.response`, `level.response 3`,
`scan.response {"front": 0.7}`, `scan.response front=0.7 word="two words"`. A word that is no JSON is a text, so that
the value of an enum needs no quotes. Empty lines and lines that begin with `#` are ignored.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import BinaryIO

from robosc.errors import RoboscError
from robosc.event_logs import LogError
from robosc.event_logs.data import MISFIT, NOT_TOLD, Received, path_text
from robosc.event_logs.reading import read_log_stream
from robosc.expressions import PathStep
from robosc.model.received import converted_paths
from robosc.model.structure import Model
from robosc.pipeline.received_data import MAXIMUM_ELEMENTS, NO_DATA

MAXIMUM_BYTES = 1 << 24
"""Maximum size of a file of events; event logs may be larger."""

_PROPERTY = re.compile(r"([A-Za-z_]\w*)=")
_WORD = re.compile(r"\S+")


class ScriptError(RoboscError, ValueError):
    """Text that names no event; the message says why."""


@dataclass(frozen=True, slots=True)
class ScriptedEvent:
    """An event that is to happen.

    Attributes:
        line: Number of its line, from 1.
        event: Its name; empty if the model begins again.
        data: Data of the event; NO_DATA if none is given.
        target: Parts of the state that the event leads to, as they are written; only for automata.
    """

    line: int
    event: str
    data: object
    target: str = ""


def read_script(stream: BinaryIO, name: str, model: Model | None) -> tuple[ScriptedEvent, ...]:
    """Read events, one a line, or an event log (JSON Lines).

    Args:
        stream: The file, at its beginning.
        name: Name of the file, for messages.
        model: Model of the events. None for automata: they have no logs, and the state that an event leads to may
            follow its name and data.

    Raises:
        ScriptError: A line names no event, or the script is too large; the message begins with the place.
        OSError: It cannot be read.
    """
    content = stream.read(MAXIMUM_BYTES + 1)
    if content.lstrip().startswith(b"{"):
        if model is None:
            raise ScriptError(f"{name}: an event log is of a robot's model, and this is run without one")
        return tuple(_logged(_Joined(content, stream), name, model))
    if len(content) > MAXIMUM_BYTES:
        raise ScriptError(f"{name}: more than {MAXIMUM_BYTES} bytes, which is too long for a file of events")
    try:
        lines = content.decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise ScriptError(f"{name}: no text in UTF-8 ({error.reason} at byte {error.start})") from None
    found = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if text and not text.startswith("#"):
            try:
                line, target = target_split(text) if model is None else (text, "")
                found.append(ScriptedEvent(number, *parse_event(line), target))
            except ScriptError as error:
                raise ScriptError(f"{name}:{number}: {error}") from None
    return tuple(found)


def target_split(text: str) -> tuple[str, str]:
    """An event of automata, and the parts of the state that it leads to: `take -> Buffer = full`."""
    event, _, target = text.partition("->")
    return event.strip(), target.strip()


def parse_event(text: str) -> tuple[str, object]:
    """Return the name of an event and its data, or NO_DATA if there is none.

    Raises:
        ScriptError: The rest of the line is no data.
    """
    name, *words = text.strip().split(None, 1)
    rest = words[0] if words else ""
    if not rest:
        return name, NO_DATA
    if _PROPERTY.match(rest):
        return name, _properties(rest)
    value, end = _value(rest, 0)
    if end < len(rest):
        raise ScriptError(f"what follows {name} is neither JSON nor name=value: {rest[:100]}")
    return name, value


def _properties(text: str) -> dict[str, object]:
    found: dict[str, object] = {}
    place = 0
    while place < len(text):
        match = _PROPERTY.match(text, place)
        if match is None:
            raise ScriptError(f"name=value is expected at: {text[place : place + 100]}")
        if match[1] in found:
            raise ScriptError(f"'{match[1]}' is given twice")
        found[match[1]], place = _value(text, match.end())
        place += len(text[place:]) - len(text[place:].lstrip())
    return found


def _value(text: str, place: int) -> tuple[object, int]:
    """The value at a place, JSON or else a word, and the place of its end.

    Raises:
        ScriptError: There is no value.
    """
    try:
        value, end = json.JSONDecoder().raw_decode(text, place)
        if end == len(text) or text[end].isspace():
            return value, end
    except (ValueError, RecursionError):
        pass
    word = _WORD.match(text, place)
    if word is None:
        raise ScriptError(f"there is no value after: {text[:place][-100:]}")
    if word[0][0] in '{["':
        raise ScriptError(f"this is no JSON: {text[place : place + 100]}")
    return word[0], word.end()


class _Joined:
    """A stream whose beginning was read already."""

    def __init__(self, content: bytes, rest: BinaryIO) -> None:
        self._content = content
        self._place = 0
        self._rest = rest

    def readline(self, most: int, /) -> bytes:
        """Return the next line, or its first part if a limit is given."""
        end = self._content.find(b"\n", self._place) + 1 or len(self._content)
        line = self._content[self._place : min(end, self._place + most)]
        self._place += len(line)
        if line.endswith(b"\n") or len(line) == most:
            return line
        return line + self._rest.readline(most - len(line))


def _logged(stream: _Joined, name: str, model: Model) -> Iterator[ScriptedEvent]:
    """Yield the events of an event log.

    Raises:
        ScriptError: The file is no event log, or not one of this model.
    """
    try:
        run = read_log_stream(stream, name)
    except LogError as error:
        raise ScriptError(str(error)) from None
    received = Received(model)
    known = {event for item in model.communications for event in item.events} | set(model.taus)
    for entry in run.entries:
        if entry.kind == "restart":
            yield ScriptedEvent(entry.line, "", NO_DATA)
        elif entry.kind == "event":
            if entry.event not in known:
                raise ScriptError(f"{name}:{entry.line}: {entry.event} is not an event of {model.name}")
            paths = () if entry.is_controllable else converted_paths(model, entry.event)
            given = {path: received.value(entry.event, entry.data, path) for path in paths}
            if MISFIT in given.values():
                wrong = path_text(next(path for path, value in given.items() if value is MISFIT))
                raise ScriptError(f"{name}:{entry.line}: {entry.event} carries no {wrong} of the declared type")
            yield ScriptedEvent(entry.line, entry.event, _joined(given))


def _joined(given: Mapping[tuple[PathStep, ...], object]) -> object:
    """Data that consists of these parts; all other parts are unknown."""
    known = {path: value for path, value in given.items() if value is not None and value is not NOT_TOLD}
    if () in known:
        return known[()]
    below: dict[PathStep, dict[tuple[PathStep, ...], object]] = {}
    for (step, *rest), value in known.items():
        below.setdefault(step, {})[tuple(rest)] = value
    parts = {step: _joined(item) for step, item in below.items()}
    places = [step for step in parts if isinstance(step, int) and step < MAXIMUM_ELEMENTS]
    if places:
        return [parts.get(place) for place in range(max(places) + 1)]
    return {name: value for name, value in parts.items() if isinstance(name, str)} or NO_DATA
