"""The language: text to syntax tree, and the files of a run."""

from robosc.language.bundle import decode_source, load_bundle, read_source
from robosc.language.parser import Parsed, parse

__all__ = ["Parsed", "decode_source", "load_bundle", "parse", "read_source"]
