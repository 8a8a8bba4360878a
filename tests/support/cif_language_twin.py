"""A second reader of CIF: textX with the grammar `cif_language.tx` decides whether a text is one of the language."""

import sys
from functools import cache
from pathlib import Path
from typing import Any

from textx import metamodel_from_file
from textx.exceptions import TextXSyntaxError

GRAMMAR = Path(__file__).with_name("cif_language.tx")


@cache
def _grammar() -> Any:
    # The grammar goes back over nested braces again and again without its memory.
    return metamodel_from_file(GRAMMAR, memoization=True)


def accepts(text: str) -> bool:
    """Return True if the grammar reads the text."""
    sys.setrecursionlimit(max(sys.getrecursionlimit(), 20_000))
    try:
        _grammar().model_from_str(text)
    except TextXSyntaxError:
        return False
    return True
