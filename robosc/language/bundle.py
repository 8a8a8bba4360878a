"""Finds the files of a run: the model, and the libraries that it imports from.

Libraries of a text are found without reading it by the grammar, so of broken texts, too.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import msgspec

from robosc.errors import LanguageError
from robosc.language.interfaces import find_interfaces, nearby_folders
from robosc.language.reading import MAXIMUM_BYTES, decode_source, read_source
from robosc.language.tokens import Kind, is_open_comment, tokenize_broken
from robosc.source import Bundle, SourceFile

SUFFIX = ".rscd"


def load_bundle(
    model: Path,
    library_paths: Sequence[Path] = (),
    interface_paths: Sequence[Path] = (),
    unsaved: Mapping[str, str] = MappingProxyType({}),
    distribution: str = "",
) -> Bundle:
    """Read a model and the libraries that it needs.

    Libraries are looked for in the model's folder, its sibling `../shared` and `library_paths`. Only files
    that declare a library which is imported, directly or by another library, become part of the bundle: a
    broken library without an importer is no error. Definitions of middleware types are also looked for in the
    packages around the model.

    Args:
        model: The model's file.
        library_paths: More folders to look in.
        interface_paths: Folders with ROS packages whose definitions of middleware types are looked up.
        unsaved: Texts that an editor has of files, by their real path; they are taken instead of what is saved.
        distribution: ROS distribution against whose interfaces they are checked; empty: none is chosen.

    Raises:
        LanguageError: The model, or a library that it needs, is too large or not UTF-8.
        OSError: The model's file cannot be read.
    """
    name = _printable(model.name)
    main_text = unsaved.get(os.path.realpath(model))
    main = SourceFile(name, read_source(model, name) if main_text is None else main_text)
    folders = _folders(model, library_paths)
    wanted, seen = list(imported_libraries(main.text)), set[str]()
    found = _candidates(model, folders, unsaved) if wanted else ()
    chosen: dict[str, SourceFile] = {}
    while wanted:
        name = wanted.pop(0)
        if name in seen:
            continue
        seen.add(name)
        declaring = [candidate for candidate in found if name in candidate.declared]
        readable = [candidate.file for candidate in declaring if candidate.fault is None]
        for candidate in declaring:
            if candidate.fault is not None and not readable:
                raise candidate.fault
        for file in readable:
            chosen[file.name] = file
            wanted.extend(imported_libraries(file.text))
    libraries = tuple(chosen[name] for name in sorted(chosen))
    packages = (*interface_paths, *nearby_folders(model))
    return Bundle(
        main=main,
        libraries=libraries,
        interfaces=find_interfaces((file.text for file in (main, *libraries)), packages),
        searched=tuple(_relative_name(folder, model) for folder in folders),
        distribution=distribution,
    )


def _folders(model: Path, library_paths: Iterable[Path]) -> tuple[Path, ...]:
    """The folders to look in, each once however it is reached."""
    folder = Path(os.path.realpath(model)).parent
    places = [folder, folder.parent / "shared", *(Path(os.path.realpath(path)) for path in library_paths)]
    return tuple(dict.fromkeys(place for place in places if place.is_dir()))


class _Candidate(msgspec.Struct, frozen=True):
    """A file that may hold a library.

    Attributes:
        file: Its text, as far as it could be read.
        declared: The libraries that it declares.
        fault: Reason why it cannot be used, or None; an error only of who asks for one of its libraries.
    """

    file: SourceFile
    declared: frozenset[str]
    fault: LanguageError | None = None


def _candidates(model: Path, folders: Iterable[Path], unsaved: Mapping[str, str]) -> tuple[_Candidate, ...]:
    """Every other model file of the folders, by name; one that cannot be opened is none."""
    files: dict[str, _Candidate] = {}
    for folder in folders:
        here = Path(os.path.realpath(folder))
        # New files of an editor are not saved yet.
        new = (folder / path.name for path in map(Path, unsaved) if path.parent == here)
        for path in sorted({*folder.iterdir(), *new}):
            real = os.path.realpath(path)
            if path.suffix != SUFFIX or real == os.path.realpath(model) or real in files:
                continue
            try:
                if real in unsaved:
                    text = unsaved[real]
                    files[real] = _Candidate(SourceFile(_relative_name(path, model), text), declared_libraries(text))
                elif path.is_file():
                    files[real] = _candidate(path, _relative_name(path, model))
            except OSError:
                continue
    return tuple(sorted(files.values(), key=lambda candidate: candidate.file.name))


def _candidate(path: Path, name: str) -> _Candidate:
    with path.open("rb") as file:
        content = file.read(MAXIMUM_BYTES + 1)
    try:
        text, fault = decode_source(content, name), None
    except LanguageError as error:
        text, fault = content.decode("utf-8", errors="replace"), error
    return _Candidate(SourceFile(name, text), declared_libraries(text), fault)


def _relative_name(path: Path, model: Path) -> str:
    """A path as seen from the model's folder: names must not depend on where the project lies."""
    return _printable(Path(os.path.relpath(path, Path(os.path.realpath(model)).parent)).as_posix())


def _printable(name: str) -> str:
    r"""A file's name as text; bytes of it that are no UTF-8 are shown as `\xNN`."""
    return os.fsencode(name).decode("utf-8", errors="backslashreplace")


def declared_libraries(text: str) -> frozenset[str]:
    """The libraries that a text declares, be it sound or broken."""
    return frozenset(name for word, name, _ in _triples(text, "library") if word)


def imported_libraries(text: str) -> tuple[str, ...]:
    """The libraries that a text imports from, in the order of the text."""
    return tuple(dict.fromkeys(name for word, name, following in _triples(text, "from") if following == "import"))


def _triples(text: str, word: str) -> Iterator[tuple[str, str, str]]:
    """Every use of `word` with a name behind it, and what follows."""
    if word not in text:
        return
    texts, kinds, _ = tokenize_broken(text)
    for index, token in enumerate(texts):
        if token == word and kinds[index + 1] in (Kind.NAME, Kind.WORD):
            yield token, texts[index + 1].removeprefix("^"), texts[index + 2]
        elif kinds[index] == Kind.OTHER and is_open_comment(token):
            # The text has no end of a comment, so it has no begin of one either.
            yield from _triples(token.replace("/*", "  "), word)
