"""Checking of models."""

from robosc.pipeline.automata_files import check_automata_file
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata, ModelLike, loaded


def check(model: ModelLike) -> Findings:
    """Return everything that is wrong with a model, library or automata, sorted by place.

    Args:
        model: The model, as `load` returns it, or the path of its file.

    Raises:
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
    """
    from robosc.model.check import check as check_bundle

    bundle = loaded(model)
    if isinstance(bundle, LoadedAutomata):
        return Findings(check_automata_file(bundle).diagnostics, bundle)
    found = check_bundle(bundle)
    return Findings(found.diagnostics, bundle, found.accepted)
