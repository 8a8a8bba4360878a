"""Plays a Markdown document whose fenced blocks are files to write and commands to type, and compares the output.

Info strings and what they mean:

- ```` ```robosc file=PATH ````: the whole contents of a file (also `python`). The path counts from the folder the
  commands run in at that point; the paragraph above the block names it in back quotes, because a reader sees no info
  string.
- with `add` behind it: the block goes before the last line of the file, which closes its robot or library.
- with `replace`: the definition that begins with the block's first two words (`component Platform`) is exchanged.
- ```` ```console ````: lines that begin with `$ ` are typed, one after the other, in one shell; what follows is the
  expected output, standard error included. A line of `...` stands for any lines, `...` in a line for any text.
  With `status=N` the last command ends with that exit status, otherwise every one with 0. With `numbers-vary` every
  number stands for any number, and blanks for any blanks.

Any other block is refused, so that nothing stands in the document that is not tried out.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

ORDERLY_END_S = 10.0

_FENCE = re.compile(r"^```(?P<info>.*)$")


class Mode(Enum):
    """Effect of a block on its file."""

    WHOLE = "whole"
    ADD = "add"
    REPLACE = "replace"


@dataclass(frozen=True)
class FileBlock:
    """Text for a file.

    Attributes:
        line: Line of the document that the block begins in.
        path: Path from the current folder.
        mode: Effect of the text on the file.
        text: The text, with its last line break.
    """

    line: int
    path: str
    mode: Mode
    text: str


@dataclass(frozen=True)
class Command:
    """A line to type.

    Attributes:
        line: Line of the document that it stands in.
        text: Text that is typed.
        expected: Expected output, in which `...` is elided text.
        status: Expected exit status.
        numbers_vary: True if numbers of the output may differ.
    """

    line: int
    text: str
    expected: str
    status: int
    numbers_vary: bool = False


Step = FileBlock | Command


@dataclass(frozen=True)
class Chapter:
    """A section of the document with its steps in order."""

    title: str
    steps: tuple[Step, ...]


class TutorialError(Exception):
    """Fault of the document, or place where it does not say what happens."""


def read_chapters(document: str) -> tuple[Chapter, ...]:
    """The chapters (second headings) of a document; what stands before the first one has no steps.

    Raises:
        TutorialError: A block without a known info string, outside a chapter, or not closed.
    """
    chapters: list[tuple[str, list[Step]]] = []
    paragraph: list[str] = []
    lines = document.splitlines()
    number = 0
    while number < len(lines):
        line = lines[number]
        number += 1
        fence = _FENCE.match(line)
        if fence:
            if not chapters:
                raise TutorialError(f"line {number}: a block before the first chapter")
            begin, body = number, []
            while number < len(lines) and lines[number] != "```":
                body.append(lines[number])
                number += 1
            if number == len(lines):
                raise TutorialError(f"line {begin}: the block is not closed")
            number += 1
            chapters[-1][1].extend(_steps(fence["info"], body, begin, " ".join(paragraph)))
        elif line.startswith("## "):
            chapters.append((line.removeprefix("## "), []))
        if line.strip():
            paragraph.append(line)
        else:
            # A block directly below its paragraph, or one blank line away, belongs to it.
            paragraph = paragraph if number < len(lines) and _FENCE.match(lines[number]) else []
    return tuple(Chapter(title, tuple(steps)) for title, steps in chapters)


def _steps(info: str, body: list[str], line: int, paragraph: str) -> list[Step]:
    """The steps of one block."""
    language, _, rest = info.partition(" ")
    if language == "console":
        found = re.fullmatch(r"(?:status=([0-9]+)|(numbers-vary))?", rest)
        if not found:
            raise TutorialError(f"line {line}: {rest!r} is no option of a console block")
        return list(_commands(body, line, int(found[1] or 0), numbers_vary=bool(found[2])))
    option = re.fullmatch(r"file=(\S+)(?: (add|replace))?", rest)
    if language not in ("robosc", "python") or not option:
        raise TutorialError(f"line {line}: {info!r} is no info string that a test understands")
    if f"`{option[1]}`" not in paragraph:
        raise TutorialError(f"line {line}: the paragraph above the block does not name `{option[1]}`")
    return [FileBlock(line, option[1], Mode(option[2] or "whole"), "\n".join(body) + "\n")]


def _commands(body: list[str], line: int, status: int, *, numbers_vary: bool) -> list[Command]:
    """The commands of a console block."""
    if not body or not body[0].startswith("$ "):
        raise TutorialError(f"line {line}: a console block begins with `$ ` and a command")
    begins = [number for number, text in enumerate(body) if text.startswith("$ ")]
    ends = [*begins[1:], len(body)]
    return [
        Command(
            line + begin + 1,
            body[begin].removeprefix("$ "),
            "\n".join(body[begin + 1 : end]),
            status if end == len(body) else 0,
            numbers_vary,
        )
        for begin, end in zip(begins, ends, strict=True)
    ]


def matches(expected: str, output: str, *, numbers_vary: bool = False) -> bool:
    """Return True if output is as expected, blanks at line ends apart.

    A line of `...` is any lines, `...` any text in one.
    """
    # Stretches of lines between elided lines. Each is as long as its expected lines, so the first fit is good enough.
    stretches: list[list[re.Pattern[str]]] = [[]]
    for line in map(str.rstrip, expected.splitlines()):
        if line.strip() == "...":
            stretches.append([])
        else:
            stretches[-1].append(re.compile(".*".join(_pattern(part, numbers_vary) for part in line.split("..."))))
    lines = [line.rstrip() for line in output.splitlines()]
    if len(stretches) == 1:
        return len(lines) == len(stretches[0]) and _fits(stretches[0], lines, 0)
    first, *middle, last = stretches
    end = len(lines) - len(last)
    if not _fits(first, lines, 0) or not _fits(last, lines, end):
        return False
    begin = len(first)
    for stretch in middle:
        found = next((place for place in range(begin, end + 1) if _fits(stretch, lines, place)), None)
        if found is None:
            return False
        begin = found + len(stretch)
    return begin <= end


def _fits(stretch: list[re.Pattern[str]], lines: list[str], place: int) -> bool:
    """Return True if lines from a place on are those of a stretch."""
    there = lines[place : place + len(stretch)] if place >= 0 else []
    return len(there) == len(stretch) and all(
        pattern.fullmatch(line) for pattern, line in zip(stretch, there, strict=True)
    )


def _pattern(text: str, numbers_vary: bool) -> str:
    """A regular expression for a piece of a line."""
    if not numbers_vary:
        return re.escape(text)
    pieces = re.split(r"([0-9]+(?:\.[0-9]+)*| +)", text)
    anything = (r" +" if piece.startswith(" ") else r"[0-9]+(?:\.[0-9]+)*" for piece in pieces[1::2])
    return "".join(re.escape(piece) + more for piece, more in zip(pieces[::2], [*anything, ""], strict=True))


def edited(before: str, block: FileBlock) -> str:
    """The text of a file after an `add` or `replace` block.

    Raises:
        TutorialError: There is nothing to add to or to replace.
    """
    lines = before.splitlines(keepends=True)
    if block.mode is Mode.ADD:
        if not lines or lines[-1] != "}\n":
            raise TutorialError(f"line {block.line}: `{block.path}` has no last line `}}` to add before")
        return "".join([*lines[:-1], "\n", block.text, lines[-1]])
    words = block.text.split()[:2]
    begins = [number for number, line in enumerate(lines) if line.split()[:2] == words]
    if len(begins) != 1:
        raise TutorialError(f"line {block.line}: `{block.path}` has {len(begins)} definitions {' '.join(words)}")
    begin = end = begins[0]
    if lines[begin].rstrip().endswith("{"):
        indent = lines[begin][: -len(lines[begin].lstrip())]
        end = lines.index(indent + "}\n", begin)
    return "".join([*lines[:begin], block.text, *lines[end + 1 :]])


class Shell:
    """A shell whose folder and exported variables last from one command to the next.

    Args:
        home: Home folder, made if it is not there.
        folder: Folder that it starts in.
        variables: All variables of its environment but `HOME`.
    """

    def __init__(self, home: Path, folder: Path, variables: Mapping[str, str]) -> None:
        home.mkdir(parents=True, exist_ok=True)
        self._variables = {**variables, "HOME": str(home)}
        self._state = home.parent / "shell-state"
        self._state.write_text(f"cd {shlex.quote(str(folder))}\n", encoding="utf-8")
        self._folder_file = home.parent / "shell-folder"
        self._folder_file.write_text(str(folder), encoding="utf-8")

    @property
    def folder(self) -> Path:
        """The current folder."""
        return Path(self._folder_file.read_text(encoding="utf-8"))

    def run(self, command: str, limit_s: float) -> tuple[int, str]:
        """Type a command: (exit status, output with standard error in it).

        Raises:
            TutorialError: It did not end in time.
        """
        state, folder = shlex.quote(str(self._state)), shlex.quote(str(self._folder_file))
        script = (
            f". {state}\n{command}\nstatus=$?\n"
            f'{{ export -p; printf \'cd %q\\n\' "$PWD"; }} > {state}\nprintf %s "$PWD" > {folder}\nexit $status\n'
        )
        process = subprocess.Popen(
            ["bash", "--norc", "--noprofile", "-c", script],
            env=self._variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            encoding="utf-8",
        )
        try:
            output, _ = process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            raise TutorialError(f"`{command}` did not end within {limit_s:.0f} s") from None
        finally:
            _end(process)
        return process.returncode, output


def _end(process: "subprocess.Popen[str]") -> None:
    """End a shell that still runs, and what it runs: politely first, so that this can end its own children."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGTERM)
        try:
            process.communicate(timeout=ORDERLY_END_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()


def play_page(page: str, folder: Path) -> int:
    """Do what all steps of a page say, as a user with an empty home, and return their number.

    Raises:
        TutorialError: As `play`.
    """
    robots = folder / "robots"
    robots.mkdir()
    inherited = {name: os.environ[name] for name in ("PYTHONPATH", "TMPDIR") if name in os.environ}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    shell = Shell(folder / "home", robots, {**inherited, "PATH": path, "LANG": "C.UTF-8"})
    steps = [step for chapter in read_chapters(page) for step in chapter.steps]
    for step in steps:
        play(step, shell)
    return len(steps)


def play(step: Step, shell: Shell, limit_s: float = 60.0) -> None:
    """Do what a step says.

    Raises:
        TutorialError: Output or exit status differ from what the document says; shows both.
    """
    if isinstance(step, FileBlock):
        path = shell.folder / step.path
        text = step.text if step.mode is Mode.WHOLE else edited(path.read_text(encoding="utf-8"), step)
        path.write_text(text, encoding="utf-8")
        return
    status, output = shell.run(step.text, limit_s)
    where = f"line {step.line}: `{step.text}`"
    if status != step.status:
        raise TutorialError(f"{where} ended with {status} instead of {step.status}:\n{output}")
    if not matches(step.expected, output, numbers_vary=step.numbers_vary):
        raise TutorialError(f"{where} printed\n{output}\ninstead of\n{step.expected}")
