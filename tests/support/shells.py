"""Interactive shells on a terminal of their own, which complete what is typed."""

import contextlib
import os
import re
import select
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

_COMMANDS = {
    "bash": ["bash", "--noprofile", "--norc", "-i"],
    "zsh": ["zsh", "-f", "-i"],
    "fish": ["fish", "--private", "--interactive"],
}

_PRINT_LINE = {
    "bash": r"""print_line() { printf '<<%s>>' "$READLINE_LINE"; }; bind -x '"\C-t":print_line'""",
    "zsh": "autoload -Uz compinit; compinit -u; print_line() { printf '<<%s>>' $BUFFER }; zle -N print_line; "
    "bindkey '^T' print_line",
    "fish": "bind \\ct 'printf \"<<%s>>\" (commandline)'",
}
"""Commands that make Ctrl-T print the line as it stands."""

_LIMIT_S = 120.0


class Shell:
    """A shell that waits for input.

    Args:
        name: `bash`, `zsh` or `fish`.
        setup: Commands that it begins with.
        folder: Its working directory.
        environment: Its environment.
    """

    def __init__(self, name: str, setup: str, folder: Path, environment: dict[str, str]) -> None:
        self._name = name
        self._mine, other = os.openpty()
        self._process = subprocess.Popen(
            ["setsid", "--ctty", *_COMMANDS[name]],
            stdin=other,
            stdout=other,
            stderr=other,
            cwd=folder,
            env={**environment, "TERM": "dumb", "COLUMNS": "1000"},
        )
        os.close(other)
        # The word is printed, and not shown as it is typed.
        self._type(f"{_PRINT_LINE[name]}; {setup}; echo be''gun\r")
        self._until(r"begun")

    def completed(self, text: str) -> str:
        """Return the line after a text and the Tab key have been typed."""
        self._type(f"{text}\t\x14")
        line = self._until(r"<<(.*?)>>")
        # Ctrl-U empties the line.
        self._type("\x15echo em''ptied\r")
        self._until(r"emptied")
        return line.rstrip()

    def close(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()
        os.close(self._mine)

    def _type(self, text: str) -> None:
        os.write(self._mine, text.encode())

    def _until(self, pattern: str) -> str:
        seen, end_s = "", time.monotonic() + _LIMIT_S
        while not (match := re.search(pattern, seen, re.DOTALL)):
            ready, _, _ = select.select([self._mine], [], [], max(0.0, end_s - time.monotonic()))
            assert ready, f"{self._name} did not print {pattern!r} in {_LIMIT_S:g} s, but {seen!r}"
            seen += os.read(self._mine, 65536).decode("utf-8", "replace")
        return match[match.lastindex or 0]


@contextlib.contextmanager
def shell(name: str, setup: str, folder: Path, environment: dict[str, str]) -> Iterator[Shell]:
    """A shell that is ended after the block."""
    found = Shell(name, setup, folder, environment)
    try:
        yield found
    finally:
        found.close()
