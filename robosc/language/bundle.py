"""Finds the files of a run: the model, and the libraries that it imports from (language A.4)."""

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from robosc.errors import Diagnostic, LanguageError, Severity
from robosc.source import Bundle, Location, SourceFile

MAXIMUM_BYTES = 16 * 1024 * 1024
"""A larger file is refused."""

SUFFIX = ".rscd"

_SKIPPED = re.compile(r"""//[^\n]*|/\*(?:[^*]|\*(?!/))*\*/|"(?:\\[\s\S]|[^"\\])*"|'(?:\\[\s\S]|[^'\\])*'""")
_LIBRARY = re.compile(r"(?<![A-Za-z_0-9^])library\s+\^?([A-Za-z_][A-Za-z_0-9]*)\s*\{")
_IMPORT = re.compile(r"(?<![A-Za-z_0-9^])from\s+\^?([A-Za-z_][A-Za-z_0-9]*)\s+import(?![A-Za-z_0-9])")


def load_bundle(model: Path, library_paths: Sequence[Path] = ()) -> Bundle:
    """Read a model and the libraries that it needs.

    Libraries are looked for in the model's folder, its sibling `../shared` and `library_paths`. Only files
    that declare a library which is imported, directly or by another library, become part of the bundle: a
    broken library that nothing imports is nobody's error.

    Args:
        model: The model's file.
        library_paths: More folders to look in.

    Raises:
        LanguageError: A file is too large, empty, not UTF-8, or contains NUL.
        OSError: The model's file cannot be read.
    """
    main = SourceFile(model.name, _read(model, model.name))
    folders = _folders(model, library_paths)
    found = _candidates(model, folders)
    chosen: dict[str, SourceFile] = {}
    wanted, seen = _imports(main.text), set[str]()
    while wanted:
        name = wanted.pop(0)
        if name in seen:
            continue
        seen.add(name)
        for file in (file for file in found if name in _libraries(file.text)):
            chosen[file.name] = file
            wanted.extend(_imports(file.text))
    return Bundle(
        main=main,
        libraries=tuple(chosen[name] for name in sorted(chosen)),
        searched=tuple(_shown(folder, model) for folder in folders),
    )


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


def _refused(code: str, name: str, message: str, mend: str, *, line: int = 1, column: int = 1) -> LanguageError:
    return LanguageError([Diagnostic(Severity.ERROR, code, message, Location(name, line, column), mend)])


def _read(path: Path, name: str) -> str:
    with path.open("rb") as file:
        return decode_source(file.read(MAXIMUM_BYTES + 1), name)


def _folders(model: Path, library_paths: Iterable[Path]) -> tuple[Path, ...]:
    """The folders to look in, each once however it is reached."""
    folder = model.resolve().parent
    places = [folder, folder.parent / "shared", *(path.resolve() for path in library_paths)]
    return tuple(dict.fromkeys(place for place in places if place.is_dir()))


def _candidates(model: Path, folders: Iterable[Path]) -> tuple[SourceFile, ...]:
    """Every other readable model file of the folders, by name; one that cannot be read is nobody's yet."""
    files: dict[Path, SourceFile] = {}
    for folder in folders:
        for path in sorted(folder.iterdir()):
            real = path.resolve()
            if path.suffix != SUFFIX or real == model.resolve() or real in files or not path.is_file():
                continue
            name = _shown(path, model)
            try:
                files[real] = SourceFile(name, _read(path, name))
            except (LanguageError, OSError):
                # Unreadable as text, so it declares no library that could be asked for by name.
                continue
    return tuple(sorted(files.values(), key=lambda file: file.name))


def _shown(path: Path, model: Path) -> str:
    """A path as seen from the model's folder: names must not depend on where the project lies."""
    return Path(os.path.relpath(path, model.resolve().parent)).as_posix()


def _plain(text: str) -> str:
    return _SKIPPED.sub(" ", text)


def _libraries(text: str) -> frozenset[str]:
    return frozenset(_LIBRARY.findall(_plain(text)))


def _imports(text: str) -> list[str]:
    return list(dict.fromkeys(_IMPORT.findall(_plain(text))))
