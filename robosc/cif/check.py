"""Check of CIF models: every finding, and the automata of a model without errors."""

import os
import posixpath
from collections import deque
from collections.abc import Callable
from pathlib import Path

from robosc.automata import CheckedSystem, SystemPlaces
from robosc.cif import syntax
from robosc.cif.lowering import Lowering
from robosc.cif.parser import parse
from robosc.cif.scopes import Scopes
from robosc.cif.typing import Typing
from robosc.errors import Diagnostic, LanguageError, Severity, sorted_diagnostics
from robosc.language.reading import read_source
from robosc.model.findings import Findings
from robosc.recursion import allow_depth
from robosc.source import Bundle, Location, SourceFile

SUFFIX = ".cif"
"""Ending of a CIF model's file."""

_LEVELS, _FRAMES = 5_000, 4


def load_cif(path: Path, text: str | None = None) -> Bundle:
    """Read a CIF model, with the files that it imports as far as they are there, named from the model's folder.

    Args:
        path: File of the model.
        text: Text of the model, which then need not be a file.

    Raises:
        LanguageError: A file is too large or not UTF-8.
        OSError: The model cannot be read.
    """
    main = SourceFile(path.name, read_source(path, path.name) if text is None else text)

    known = {_identity(path): main}
    aliases: dict[str, str] = {}

    def read(name: str) -> SourceFile | None:
        try:
            # One file may have many names: by links, and by upper and lower case where the system ignores it.
            identity = _identity(path.parent / name)
            if identity in known:
                aliases[name] = known[identity].name
            else:
                known[identity] = SourceFile(name, read_source(path.parent / name, name))
            return known[identity]
        except OSError:
            # `check_cif` reports the missing file where it is imported.
            return None

    files, _ = _imported(main, read, Findings())
    libraries = sorted((file for file, _ in files[1:]), key=lambda file: file.name)
    return Bundle(main, tuple(libraries), aliases=tuple(sorted(aliases.items())))


def _identity(path: Path) -> object:
    """Return what two names of one file have in common; of a text without a file, its name."""
    try:
        found = path.stat()
    except OSError:
        return path.resolve()
    return found.st_dev, found.st_ino


def check_cif(bundle: Bundle) -> CheckedSystem:
    """Check a CIF model, and make its automata.

    Args:
        bundle: The model, with the files that it imports.
    """
    findings = Findings()
    files, has_all = _imported(bundle.main, bundle.file, findings)
    trees = tuple(tree for _, tree in files if tree is not None)
    system, places = None, SystemPlaces()
    if has_all and not findings.has_errors:
        allow_depth(_LEVELS, _FRAMES)
        try:
            scopes = Scopes(trees, findings)
            system, places = Lowering(scopes, Typing(scopes)).lowered(Path(bundle.main.name).stem)
        except RecursionError:
            message = "expressions, or definitions in definitions, are nested too deeply"
            findings.error("cif-too-large", message, Location(bundle.main.name, 1, 1), "Split them.")
    return CheckedSystem(None if findings.has_errors else system, sorted_diagnostics(findings.diagnostics), places)


_Files = list[tuple[SourceFile, syntax.Specification | None]]


def _imported(main: SourceFile, read: Callable[[str], SourceFile | None], findings: Findings) -> tuple[_Files, bool]:
    """The model and what it imports, breadth first, each file once; and whether all of it was read without errors."""
    found: _Files = []
    has_all = True
    seen = {_same(main.name)}
    waiting = deque([main])
    while waiting:
        file = waiting.popleft()
        try:
            tree = parse(file)
        except LanguageError as error:
            findings.diagnostics.extend(error.diagnostics)
            found.append((file, None))
            has_all = False
            continue
        found.append((file, tree))
        for item in tree.body:
            if not isinstance(item, syntax.Import):
                continue
            name = posixpath.normpath(posixpath.join(posixpath.dirname(file.name), item.file))
            if _same(name) in seen:
                continue
            seen.add(_same(name))
            other = read(name) if "\0" not in name else None
            if other is None:
                findings.diagnostics.append(_missing(item, name))
                has_all = False
            elif other.name == name or _same(other.name) not in seen:
                seen.add(_same(other.name))
                waiting.append(other)
    return found, has_all


def _same(name: str) -> str:
    """A name that two ways to one file have in common."""
    return os.path.normpath(name)


def _missing(item: syntax.Import, name: str) -> Diagnostic:
    message = f"there is no file '{name}' that can be read"
    fix = "Correct the name, which is relative to the file that imports it."
    return Diagnostic(Severity.ERROR, "cif-import", message, item.at, fix)
