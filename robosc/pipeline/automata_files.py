"""Files of automata (CIF, libFAUDES, Supremica): loading and checking of the systems that `robosc.synthesize` takes."""

from pathlib import Path
from typing import TYPE_CHECKING

from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.automata import CheckedSystem

_CIF = ".cif"

SUFFIXES = frozenset({_CIF, ".gen", ".wmod"})
"""Endings of files of automata."""


def is_automata(path: Path) -> bool:
    """Return True if a file holds automata, by the ending of its name."""
    return path.suffix in SUFFIXES


def load_automata_file(path: Path, text: str | None = None) -> Bundle:
    """Read a file of automata; a CIF model with the files that it imports.

    Args:
        path: The file.
        text: Text of the file; the file then need not exist.

    Raises:
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
    """
    from robosc.cif import load_cif
    from robosc.language.reading import decode_source, read_source
    from robosc.pipeline.files import FileAccessError
    from robosc.source import SourceFile

    try:
        if text is not None:
            # Text that is not UTF-8 is refused, as in a file.
            text = decode_source(text.encode("utf-8", "surrogatepass"), path.name)
        elif path.is_dir():
            raise FileAccessError(f"{path} is a folder, not a model's file")
        elif not path.exists():
            raise FileAccessError(f"there is no file {path}")
        if path.suffix == _CIF:
            return load_cif(path, text)
        return Bundle(SourceFile(path.name, read_source(path, path.name) if text is None else text))
    except FileAccessError:
        raise
    except OSError as error:
        raise FileAccessError(f"cannot read {error.filename or path}: {error.strerror or error}") from error


def check_automata_file(bundle: Bundle) -> "CheckedSystem":
    """Check a file of automata, in the format of its ending."""
    if bundle.main.name.endswith(_CIF):
        from robosc.cif import check_cif

        return check_cif(bundle)
    from robosc.plain_automata import check_automata

    return check_automata(bundle)
