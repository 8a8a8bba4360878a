"""The language: text to syntax tree, and the files of a run.

The names are imported on use: front ends of other languages share some modules, but not the parser.
"""

from typing import TYPE_CHECKING

from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc.language.bundle import load_bundle
    from robosc.language.parser import Parsed, parse
    from robosc.language.reading import decode_source, read_source

_HOMES = {
    "Parsed": "parser",
    "decode_source": "reading",
    "load_bundle": "bundle",
    "parse": "parser",
    "read_source": "reading",
}

__all__ = ["Parsed", "decode_source", "load_bundle", "parse", "read_source"]

if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)
