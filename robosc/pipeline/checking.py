"""Checking of models."""

from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import ModelLike, loaded


def check(model: ModelLike) -> Findings:
    """Return everything that is wrong with a model or library, sorted by place.

    Args:
        model: The model, as `load` returns it, or the path of one.

    Raises:
        FileAccessError: The file is not there or cannot be read.
        LanguageError: A file is too large or not UTF-8.
    """
    from robosc.model.check import check as check_bundle

    bundle = loaded(model)
    return Findings(check_bundle(bundle).diagnostics, bundle)
