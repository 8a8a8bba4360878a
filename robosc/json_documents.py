"""JSON documents for machines: the command line and the service write the same text."""

import json
from collections.abc import Iterator, Mapping, Sequence

from robosc.errors import Diagnostic, Severity

_INDENT = 2


def json_pieces(document: Mapping[str, object], *, is_ascii: bool = False) -> Iterator[str]:
    """Yield the text of a document in pieces, keys in the order given.

    Args:
        document: JSON values.
        is_ascii: True if other characters are escaped.
    """
    yield from json.JSONEncoder(indent=_INDENT, ensure_ascii=is_ascii, allow_nan=False).iterencode(document)
    yield "\n"


def json_text(document: Mapping[str, object], *, is_ascii: bool = False) -> str:
    """The text of a document, as `json_pieces` cuts it."""
    return "".join(json_pieces(document, is_ascii=is_ascii))


def counts(diagnostics: Sequence[Diagnostic]) -> dict[str, int]:
    """Return the numbers of errors, warnings and notes."""
    return {f"{severity}s": sum(diagnostic.severity is severity for diagnostic in diagnostics) for severity in Severity}


def counts_text(diagnostics: Sequence[Diagnostic]) -> str:
    """For instance `2 errors, 1 warning`."""
    parts = [f"{count} {name if count != 1 else name[:-1]}" for name, count in counts(diagnostics).items() if count]
    return ", ".join(parts) or "no findings"


def diagnostics_json(diagnostics: Sequence[Diagnostic]) -> dict[str, object]:
    """The findings and their counts as JSON values."""
    return {**counts(diagnostics), "diagnostics": [diagnostic.to_json() for diagnostic in diagnostics]}


def accepted_json(accepted: Sequence[Diagnostic]) -> dict[str, object]:
    """The findings that a model accepts as JSON values; nothing where it accepts none."""
    return {"accepted": [diagnostic.to_json() for diagnostic in accepted]} if accepted else {}
