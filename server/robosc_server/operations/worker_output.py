"""Filter of the output of workers: only some of it may be logged.

A worker has processed an untrusted model, and its output is not trusted either: an apparent traceback may quote the
model or be invented. Above the level debug, only the exit description in its fixed form, names of existing exceptions
and places in RoboSC's own code are logged.
"""

import builtins
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

from robosc_server.workers.exit_reasons import EXIT_DESCRIPTION

_PLACES = 12
_LINES = 500
_LINE_CHARACTERS = 1000
_WORDS = 20_000
_PACKAGES = ("robosc", "robosc_api", "robosc_server")
_PLACE = re.compile(r' {2}File "(?:[^"]*/)?((?:robosc|robosc_api|robosc_server)/[a-z0-9_/]+\.py)", line (\d{1,6}), in ')
_KIND = re.compile(r"([A-Za-z_][A-Za-z0-9_.]{0,100})(?::.*)?")


def loggable_fields(words: str) -> dict[str, object]:
    """Return the parts of a worker's output that contain nothing of a model, as fields of a log line.

    Args:
        words: Output of a worker, such as a traceback, or an exit description of `workers.exit_reasons`.
    """
    lines = [line[:_LINE_CHARACTERS] for line in words.split("\n")]
    fields: dict[str, object] = {}
    if EXIT_DESCRIPTION.fullmatch(lines[0]):
        fields["ending"] = lines[0]
    lines = lines[-_LINES:]
    kinds = [match[1] for line in lines if (match := _KIND.fullmatch(line)) and _is_exception(match[1])]
    if kinds:
        fields["error"] = kinds[-1]
    found = [match for line in lines if (match := _PLACE.match(line))][-_PLACES:]
    places = [f"{match[1]}:{match[2]}" for match in found if _is_module_file(match[1])]
    if places:
        fields["places"] = places
    return fields


def last_part(words: str) -> str:
    """Return the end of a worker's output, where a traceback has the error; for the level debug."""
    return words if len(words) <= _WORDS else f"[...]{words[-_WORDS:]}"


def _is_exception(name: str) -> bool:
    module, _, kind = name.rpartition(".")
    if not module:
        found: Any = getattr(builtins, kind, None)
    else:
        found = getattr(sys.modules.get(module), kind, None) if module.partition(".")[0] in _PACKAGES else None
    return isinstance(found, type) and issubclass(found, BaseException)


@cache
def _folder(package: str) -> Path:
    return Path(str(sys.modules[package].__file__)).parent


def _is_module_file(file: str) -> bool:
    package, _, rest = file.partition("/")
    return package in sys.modules and (_folder(package) / rest).is_file()
