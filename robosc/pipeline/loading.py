"""Loading of models: from files, which are found in the same way as on the command line, or from a text."""

import os
from collections.abc import Sequence
from pathlib import Path

from robosc.pipeline.automata_files import is_automata, load_automata_file
from robosc.pipeline.files import FileAccessError, FileName, given_path
from robosc.source import Bundle, SourceFile

TEXT_NAME = "model.rscd"
"""Name of a model that is given as a text, in findings about it."""


class LoadedModel(Bundle, frozen=True):
    """Texts of a model and of the libraries that it imports: read, not yet checked.

    It is a `robosc.source.Bundle`, so every function that takes the texts of a model takes it.
    """

    @property
    def name(self) -> str:
        """Name of the model's file."""
        return self.main.name

    def __repr__(self) -> str:
        lines = len(self.main.text.splitlines())
        parts = [f"{lines} line{'s' if lines != 1 else ''}"]
        if self.libraries:
            parts.append(f"libraries {', '.join(file.name for file in self.libraries)}")
        return f"<model {self.main.name}: {', '.join(parts)}>"

    def __str__(self) -> str:
        return self.main.text

    def _repr_markdown_(self) -> str:
        """Return the page that `robosc doc` writes, or the text itself if it holds no robot or has errors."""
        from robosc.documentation import page
        from robosc.model.check import check

        checked = check(self)
        if checked.model is None:
            return f"```robosc\n{self.main.text.rstrip()}\n```\n"
        return page(checked.model, checked.diagnostics)


class LoadedAutomata(LoadedModel, frozen=True):
    """Text of automata (CIF, libFAUDES, Supremica), with the files that it imports.

    `load` returns it for such a file; its synthesis is a `SystemSynthesis`.
    """

    def _repr_markdown_(self) -> str:
        return f"```\n{self.main.text.rstrip()}\n```\n"


type ModelLike = Bundle | FileName
"""Argument for a model: a loaded model, or the name of its file."""


def load(
    path: FileName | None = None,
    *,
    text: str | None = None,
    name: str = TEXT_NAME,
    library_paths: Sequence[FileName] = (),
    interface_paths: Sequence[FileName] = (),
    distribution: str | None = None,
) -> LoadedModel:
    """Load a model, library or automata, with all imported files; `check` reports what is wrong with it.

    Libraries are looked for in the model's folder, in its sibling `../shared` and in `library_paths`. A text without a
    file counts as a file of the current folder. A name that ends in `.cif`, `.gen` or `.wmod` names automata, which
    become a `LoadedAutomata`. Files that a CIF model imports are found from the folder of the importing file.

    Args:
        path: File of the model.
        text: Text of the model, instead of a file.
        name: Name of that text in findings.
        library_paths: More folders with libraries, as `-L` of the command line.
        interface_paths: Folders with ROS packages whose .msg, .srv and .action files the model is checked against, as
            `-I` of the command line; those of an installed ROS and around the model are always searched.
        distribution: ROS distribution against whose interfaces the model is checked, as `--distribution` of the command
            line; None: the one that was sourced, if any; empty: none is chosen.

    Raises:
        ValueError: The distribution is unknown.
        TypeError: Neither a file nor a text is given, or both are; or libraries or ROS packages are given for automata.
        FileAccessError: A file or folder does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
    """
    if (path is None) == (text is None):
        raise TypeError("load takes either the path of a model or text=..., the model itself")
    libraries, interfaces = ([given_path(item) for item in paths] for paths in (library_paths, interface_paths))
    file = given_path(name) if path is None else _model_path(path)
    if not is_automata(file):
        return _loaded(read_model(file, libraries, interfaces, text, distribution))
    if libraries or interfaces or distribution:
        raise TypeError(
            "library_paths, interface_paths and distribution are for RoboSC models: automata have no libraries or types"
        )
    return _loaded(load_automata_file(file, text))


def loaded(model: ModelLike) -> LoadedModel:
    """The model of an argument, which is loaded if it is the name of a file.

    Raises:
        TypeError: The argument is no model and no name.
        FileAccessError, LanguageError: As `load`.
    """
    if isinstance(model, LoadedModel):
        return model
    if isinstance(model, Bundle):
        return _loaded(model)
    if isinstance(model, str | os.PathLike):
        return load(model)
    from robosc.automata import System
    from robosc.pipeline.systems import SystemSupervisor

    if isinstance(model, System | SystemSupervisor):
        raise TypeError(
            f"this takes a RoboSC model, not automata ({model.name if isinstance(model, System) else repr(model)}), "
            "which have no text to find faults in, and no messages or ROS interfaces: write the robot as a model, or "
            "use synthesize, explain, verify, explore, simulate or generate"
        )
    raise TypeError(
        f"a model is the path of a file or what robosc.load returns, not {type(model).__name__}: {model!r:.80}"
    )


def read_model(
    model: Path,
    library_paths: Sequence[Path],
    interface_paths: Sequence[Path],
    text: str | None = None,
    distribution: str | None = None,
) -> Bundle:
    """Read a model and its libraries, with the definitions of an installed ROS.

    Args:
        model: File of the model.
        library_paths: More folders with libraries.
        interface_paths: More folders with ROS packages.
        text: Text of the model; the file then need not exist.
        distribution: ROS distribution against whose interfaces it is checked; None: the sourced one, if any; empty:
            none is chosen.

    Raises:
        ValueError: The distribution is unknown.
        FileAccessError: The file or a folder does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
    """
    from robosc.interfaces import CODENAMES
    from robosc.language import decode_source, load_bundle
    from robosc.language.interfaces import interface_folders, sourced_distribution

    if distribution and distribution not in CODENAMES:
        raise ValueError(f"there is no ROS distribution {distribution!r} here, but {', '.join(CODENAMES)}")
    if distribution is None:
        distribution = sourced_distribution()
    if is_automata(model):
        raise FileAccessError(
            f"{model} holds automata, which check, synth, explain-synthesis, explore, verify, simulate and generate "
            "take; this is for RoboSC's own models"
        )
    try:
        if text is None:
            if model.is_dir():
                raise FileAccessError(f"{model} is a folder, not a model's file")
            if not model.exists():
                raise FileAccessError(f"there is no file {model}")
        for what, folders in (("library", library_paths), ("interface", interface_paths)):
            for folder in folders:
                if not folder.is_dir():
                    raise FileAccessError(f"there is no {what} folder {folder}")
        unsaved = {}
        if text is not None:
            # Text that is not UTF-8 is refused, as in a file.
            unsaved[os.path.realpath(model)] = decode_source(text.encode("utf-8", "surrogatepass"), model.name)
        folders = (*interface_paths, *interface_folders(distribution))
        return load_bundle(model, library_paths, folders, unsaved, distribution)
    except FileAccessError:
        raise
    except OSError as error:
        raise FileAccessError(f"cannot read {error.filename or model}: {error.strerror or error}") from error


def _model_path(path: FileName) -> Path:
    """The path of a model.

    Raises:
        FileAccessError: The path is empty, or is the text of a model.
    """
    if isinstance(path, str) and ("{" in path or "\n" in path) and not Path(path).exists():
        raise FileAccessError("this is the text of a model, not the path of one: load it with robosc.load(text=...)")
    return given_path(path)


def _loaded(bundle: Bundle) -> LoadedModel:
    kind = LoadedAutomata if is_automata(Path(bundle.main.name)) else LoadedModel
    return kind(bundle.main, bundle.libraries, bundle.searched, bundle.interfaces, distribution=bundle.distribution)


def property_file(file: FileName | SourceFile) -> SourceFile:
    """A file of properties, which is read unless it was read already.

    Raises:
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: The file is no text.
    """
    from robosc.language import read_source

    if isinstance(file, SourceFile):
        return file
    path = given_path(file)
    try:
        return SourceFile(str(path), read_source(path, str(path)))
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
