"""Files of an editor: open and saved texts, and the analysis of each robot."""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path

from lsprotocol import types as lsp
from pygls.uris import from_fs_path, to_fs_path

from robosc.editing.completion import Surroundings
from robosc.editing.names import Names
from robosc.editing.outline import Part, outline
from robosc.errors import Diagnostic, LanguageError, Severity
from robosc.interfaces import shipped_types
from robosc.language import load_bundle, parse, read_source, syntax
from robosc.language.bundle import SUFFIX, declared_libraries
from robosc.language.interfaces import INTERFACE_KINDS, interface_folders, sourced_distribution
from robosc.language.parser import Parsed
from robosc.model.check import Checked, Inspected, inspect
from robosc.source import Bundle, Location, SourceFile
from robosc_lsp.texts import Text

MAXIMUM_FILES = 1_000
"""Maximum number of files that are searched for uses of a name."""

_IGNORED = "COLCON_IGNORE"
"""File in a folder that colcon has built, which holds copies."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """Analysis of a robot or library as it is in the editor.

    Attributes:
        uri: URI of its file.
        text: Text of its file.
        bundle: All its texts; None if one of them cannot be read.
        inspected: Meaning of the texts.
        names: Meaning of their names.
        whole: The parts of the file; None if no part is valid.
        uris: The URI of each file by its name in the bundle.
    """

    uri: str
    text: Text
    bundle: Bundle | None
    inspected: Inspected
    names: Names
    whole: Part | None
    uris: Mapping[str, str]

    @property
    def file(self) -> str:
        """The file's name in the bundle."""
        return "" if self.bundle is None else self.bundle.main.name

    @property
    def errors(self) -> int:
        """Number of its errors."""
        return sum(item.severity is Severity.ERROR for item in self.inspected.checked.diagnostics)


class Project:
    """Texts of a project, in which open texts replace saved ones.

    Args:
        encoding: Encoding in which the editor counts columns.
        folders: Workspace folders.
    """

    def __init__(self, encoding: str, folders: Iterable[Path] = ()) -> None:
        self.encoding = encoding
        self.folders = list(folders)
        self.library_paths: tuple[Path, ...] = ()
        self.distribution = sourced_distribution()
        self.interface_paths = interface_folders(self.distribution)
        self._open: dict[str, Text] = {}
        self._by_path: dict[str, str] = {}
        self._known: dict[str, Analysis] = {}
        self._packages: dict[str, tuple[str, ...]] | None = None

    @property
    def open_uris(self) -> tuple[str, ...]:
        """URIs of the open files."""
        return tuple(self._open)

    def open(self, uri: str, text: str) -> None:
        """Open a file, or replace its text."""
        self._open[uri] = Text(text, self.encoding)
        self._find_paths()
        self.forget()

    def edit(self, uri: str, changes: Iterable[lsp.TextDocumentContentChangeEvent]) -> None:
        """Edit an open file; dependent analyses are dropped, or all of them if its library has changed."""
        before = self._open.get(uri, Text("", self.encoding))
        self._open[uri] = before.edited(changes)
        if declared_libraries(before.text) != declared_libraries(self._open[uri].text):
            self.forget()
        for other, analysis in list(self._known.items()):
            if uri == other or uri in analysis.uris.values():
                del self._known[other]

    def close(self, uri: str) -> None:
        """Close a file; its saved text is used again."""
        self._open.pop(uri, None)
        self._find_paths()
        self.forget()

    def _find_paths(self) -> None:
        # Two URIs may name one file; the text that was opened last is used.
        paths = ((path, uri) for uri in self._open if (path := _path(uri)) is not None)
        self._by_path = {os.path.realpath(path): uri for path, uri in paths}

    def with_edits(self, changes: Mapping[str, Iterable[lsp.TextEdit]]) -> "Project":
        """Return the project after some edits of existing files, which must not overlap."""
        changed = Project(self.encoding, self.folders)
        changed.library_paths, changed.interface_paths = self.library_paths, self.interface_paths
        changed.distribution = self.distribution
        changed._open = dict(self._open)
        changed._find_paths()
        for uri, edits in changes.items():
            text = self.text(uri)
            if text is not None:
                # From the end, so that earlier offsets stay valid.
                last_first = sorted(edits, key=lambda edit: text.offset(edit.range.start), reverse=True)
                changed.open(
                    uri,
                    text.edited(
                        lsp.TextDocumentContentChangePartial(text=edit.new_text, range=edit.range)
                        for edit in last_first
                    ).text,
                )
        return changed

    def forget(self) -> None:
        """Drop all analyses, which are made again on demand."""
        self._known.clear()

    def reread(self) -> None:
        """Drop everything that was read from saved files, which other programs may have changed."""
        self.forget()
        self._packages = None

    def text(self, uri: str) -> Text | None:
        """Return an open or saved text; None if there is none."""
        if uri in self._open:
            return self._open[uri]
        path = _path(uri)
        try:
            # Reading a special file, such as a pipe, might never end.
            return Text(read_source(path, path.name), self.encoding) if path is not None and path.is_file() else None
        except (OSError, LanguageError):
            return None

    def analysis(self, uri: str) -> Analysis | None:
        """Return the analysis of a file; None if there is no such file."""
        if uri not in self._known:
            text = self.text(uri)
            if text is None:
                return None
            self._known[uri] = self._analysed(uri, text)
        return self._known[uri]

    def analyses(self) -> Iterator[Analysis]:
        """Yield the analyses of all open files and of all files in the folders."""
        seen = set[str]()
        for uri in (*self._open, *self._saved()):
            if uri not in seen:
                seen.add(uri)
                found = self.analysis(uri)
                if found is not None:
                    yield found

    def surroundings(self, uri: str) -> Surroundings:
        """Return what can be imported, and which ROS types there are."""
        path = _path(uri)
        libraries: dict[str, tuple[str, ...]] = {}
        folders = () if path is None else (path.parent, path.parent.parent / "shared", *self.library_paths)
        for folder in folders:
            for file in self._models_in(folder):
                text = self.text(self._uri(file))
                for name, components in _libraries("" if text is None else text.text):
                    libraries.setdefault(name, components)
        return Surroundings(libraries, self._interfaces())

    def unreadable(self) -> Iterator[Path]:
        """Yield the files of the folders that cannot be read as texts."""
        for uri in self._saved():
            path = _path(uri)
            if path is not None and uri not in self._open and path.is_file() and self.text(uri) is None:
                yield path

    def _models_in(self, folder: Path) -> list[Path]:
        """The models and libraries of a folder, saved or open."""
        here = Path(os.path.realpath(folder))
        found = {path for path in map(Path, self._by_path) if path.parent == here}
        if folder.is_dir():
            found |= {Path(os.path.realpath(file)) for file in folder.glob(f"*{SUFFIX}")}
        return sorted(found)

    def _interfaces(self) -> Mapping[str, tuple[str, ...]]:
        """Return the types of each ROS package that is installed or comes with RoboSC."""
        if self._packages is None:
            self._packages = {}
            for folder in self.interface_paths:
                for kind in INTERFACE_KINDS:
                    for file in sorted(folder.glob(f"*/{kind}/*.{kind}")):
                        package = file.parent.parent.name
                        self._packages[package] = (*self._packages.get(package, ()), file.stem)
            # Those that come with RoboSC, of packages that are not installed.
            for package, types in shipped_types().items():
                self._packages.setdefault(package, types)
        return self._packages

    def _analysed(self, uri: str, text: Text) -> Analysis:
        bundle, uris, faults = self._bundle(uri, text)
        unread = Inspected(Checked(None, faults), Parsed(None, faults))
        inspected = unread if bundle is None else inspect(bundle)
        return Analysis(uri, text, bundle, inspected, Names(inspected), outline(inspected.parsed, text.text), uris)

    def _bundle(self, uri: str, text: Text) -> tuple[Bundle | None, dict[str, str], tuple[Diagnostic, ...]]:
        path = _path(uri)
        if path is None:
            main = SourceFile(uri.rpartition("/")[2] or "untitled", text.text)
            return Bundle(main, distribution=self.distribution), {main.name: uri}, ()
        unsaved = {real: self._open[other].text for real, other in self._by_path.items()}
        if uri in self._open:
            unsaved[os.path.realpath(path)] = text.text
        try:
            bundle = load_bundle(path, self.library_paths, self.interface_paths, unsaved, self.distribution)
        except LanguageError as error:
            return None, {}, error.diagnostics
        except OSError:
            return Bundle(SourceFile(path.name, text.text), distribution=self.distribution), {path.name: uri}, ()
        folder = Path(os.path.realpath(path)).parent
        uris = {file.name: self._uri(folder / file.name) for file in bundle.libraries}
        return bundle, {**uris, bundle.main.name: uri}, ()

    def _uri(self, path: Path) -> str:
        """Return the URI of a file, as the editor spells it if the file is open."""
        real = os.path.realpath(path)
        return self._by_path.get(real) or from_fs_path(real) or ""

    def has_too_many_files(self) -> bool:
        """Return True if the folders hold more files than are searched."""
        return next(islice(self._files(), MAXIMUM_FILES, None), None) is not None

    def _saved(self) -> Iterator[str]:
        for file in islice(self._files(), MAXIMUM_FILES):
            yield self._uri(file)

    def _files(self) -> Iterator[Path]:
        """Yield the models of all folders: those of the editor with all below them, of open files, of libraries."""
        folders = list(self.folders)
        for uri in self._open:
            path = _path(uri)
            if path is not None:
                folders += [path.parent, path.parent.parent / "shared"]
        for folder in dict.fromkeys((*folders, *self.library_paths)):
            if folder in self.folders:
                for here, below, names in folder.walk():
                    if _IGNORED in names:
                        below.clear()
                        continue
                    below[:] = sorted(name for name in below if name[0] != "." and name != "node_modules")
                    yield from (here / name for name in sorted(names) if name.endswith(SUFFIX))
            else:
                yield from sorted(folder.glob(f"*{SUFFIX}"))


@lru_cache(maxsize=256)
def _libraries(text: str) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """The library that a text is, if it is one, with the names of its components."""
    tree = parse(SourceFile("", text)).sound if declared_libraries(text) else None
    if tree is None or not tree.is_library:
        return ()
    return ((tree.name.text, tuple(item.name.text for item in tree.items if isinstance(item, syntax.Component))),)


def _path(uri: str) -> Path | None:
    """Return the path of a URI; None if it is no file."""
    if not uri.startswith("file:"):
        return None
    found = to_fs_path(uri)
    return Path(found) if found and "\0" not in found else None


def place_of(analysis: Analysis, project: Project, location: Location) -> lsp.Location | None:
    """Convert a location for the editor; None if its file is not available."""
    uri = analysis.uris.get(location.file)
    text = None if uri is None else project.text(uri)
    return None if uri is None or text is None else lsp.Location(uri, text.range_of(location))
