"""CIF models, loaded: their automata go through the second door, `robosc.synthesize(system)`."""

from pathlib import Path

from robosc.cif import load_cif
from robosc.pipeline.files import FileAccessError
from robosc.source import Bundle


def load_cif_model(path: Path) -> Bundle:
    """Read a CIF model, with the files that it imports.

    Raises:
        FileAccessError: The file is not there or cannot be read.
        LanguageError: A file is too large or not UTF-8.
    """
    try:
        if path.is_dir():
            raise FileAccessError(f"{path} is a folder, not a model's file")
        if not path.exists():
            raise FileAccessError(f"there is no file {path}")
        return load_cif(path)
    except FileAccessError:
        raise
    except OSError as error:
        raise FileAccessError(f"cannot read {error.filename or path}: {error.strerror or error}") from error
