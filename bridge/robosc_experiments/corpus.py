"""Models whose code is counted: those of the corpus, or whatever files and folders are named instead."""

import json
from collections.abc import Sequence
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.errors import RoboscError
from robosc.language import load_bundle, parse
from robosc.language.interfaces import interface_folders
from robosc.source import SourceFile, visible
from robosc_experiments.lines_of_code import CodeSize, model_size, target_sizes

CORPUS = Path(__file__).parents[2] / "tests" / "corpus"
"""Models of the published language, most of which have a recorded run beside them; only the sources have it."""


def models_of(paths: Sequence[Path]) -> dict[str, Path]:
    """Return models by their names in a report: a file's own name, in a folder its path there.

    In a folder, every model counts, and those that have a recording (`NAME.json`) if that has a run; libraries do not.

    Args:
        paths: Files and folders.

    Raises:
        OSError: There is no such file or folder, or it cannot be read.
    """
    found: dict[str, Path] = {}
    for path in paths:
        if path.is_dir():
            files = {
                str(file.relative_to(path).with_suffix("")): file
                for file in sorted(path.rglob("*.rscd"))
                if _is_scenario(file)
            }
        else:
            path.stat()
            files = {path.stem: path}
        for name, file in files.items():
            if file not in found.values():
                # Two files may have one name.
                found[visible(name) if visible(name) not in found else visible(str(file))] = file
    return found


def _is_scenario(file: Path) -> bool:
    try:
        recording = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        text = file.read_text(encoding="utf-8", errors="replace")
        tree = parse(SourceFile(file.name, text)).tree
        return tree is None or not tree.is_library
    except ValueError:
        # Another file that has the name by chance.
        return True
    return not isinstance(recording, dict) or "run" in recording


def scenario_sizes(model: Path) -> tuple[CodeSize, ...]:
    """Return the size of a model and of what every target generates of its controller; or of it alone, and why.

    Libraries are also looked for in the folder `NAME.libraries` beside it.
    """
    libraries = model.with_suffix(".libraries")
    try:
        bundle = load_bundle(model, [libraries] if libraries.is_dir() else [], interface_folders())
    except (RoboscError, OSError) as error:
        return (CodeSize("model", None, why=str(error)),)
    size = model_size(bundle)
    try:
        # The supervisor is not executed: only its code is counted.
        made = make_supervisor(bundle, allow_livelock=True, only_shown=True)
    except RoboscError as error:
        return (CodeSize("model", size.lines, size.files, str(error)),)
    if made.supervisor is None:
        return (CodeSize("model", size.lines, size.files, made.reason or "the model has errors"),)
    return (size, *target_sizes(made.supervisor))
