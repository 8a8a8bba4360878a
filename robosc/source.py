"""Source texts and places in them, to which every diagnostic refers."""

from functools import lru_cache

import msgspec


def _sha256(text: str) -> str:
    import hashlib  # loads OpenSSL, which is not needed to read a text

    return hashlib.sha256(text.encode("utf-8")).hexdigest()


class SourceFile(msgspec.Struct, frozen=True):
    """One text of a bundle.

    Attributes:
        name: The name a user knows the file by; never opened again once the text is here.
        text: The decoded text.
    """

    name: str
    text: str

    @property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the text's UTF-8 bytes."""
        return _sha256(self.text)

    def line(self, number: int) -> str:
        """The text of line `number` (from 1) without its line end; empty past the end."""
        lines = _lines(self.text)
        return lines[number - 1].rstrip("\r") if 0 < number <= len(lines) else ""


def visible(text: str) -> str:
    r"""A text on one line of a terminal: what would move the cursor or forge a line is shown as `\xNN`."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode("ascii") for char in text)


@lru_cache(maxsize=4)
def _lines(text: str) -> list[str]:
    """The lines of a text, kept for the next finding in it."""
    return text.split("\n")


class Location(msgspec.Struct, frozen=True, order=True, gc=False):
    """A stretch of text on one line of one file.

    Attributes:
        file: Name of the source file.
        line: Line, from 1.
        column: Column in characters (code points), from 1.
        length: Characters covered, at least 1.
    """

    file: str
    line: int
    column: int
    length: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


class Bundle(msgspec.Struct, frozen=True):
    """All texts of one run: the model and the libraries it may import from.

    Attributes:
        main: The file with the robot (or the library that is being checked).
        libraries: Other files, sorted by name.
        searched: Places where libraries were looked for, in words for an error message; empty where nothing was looked
            for, definitions neither.
        interfaces: Definitions of middleware types that the files use, named like `std_msgs/msg/Bool.msg`, as far as
            they were found, with all that they are made of, and the types of a package that lacks one, named like
            `std_msgs/types.txt`; they are checked against but are no part of the model.
        aliases: Other names of files, such as that of a link, with the name that the file has here.
        distribution: ROS distribution against whose interfaces the files are checked, e.g. `jazzy`; empty: none was
            chosen, so that whatever fits one of them is right, and what does not fit Jazzy is noted.
    """

    main: SourceFile
    libraries: tuple[SourceFile, ...] = ()
    searched: tuple[str, ...] = ()
    interfaces: tuple[SourceFile, ...] = ()
    aliases: tuple[tuple[str, str], ...] = ()
    distribution: str = ""

    @property
    def files(self) -> tuple[SourceFile, ...]:
        """Every file, the main one first."""
        return (self.main, *self.libraries)

    def file(self, name: str) -> SourceFile | None:
        """The file called `name`, or None."""
        name = dict(self.aliases).get(name, name)
        return next((file for file in self.files if file.name == name), None)

    @property
    def digest(self) -> str:
        """SHA-256 over the sorted list of `name`, NUL, file SHA-256, newline of every file."""
        listing = "".join(f"{file.name}\0{file.sha256}\n" for file in sorted(self.files, key=lambda f: f.name))
        return _sha256(listing)
