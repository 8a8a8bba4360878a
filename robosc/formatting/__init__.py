"""The canonical layout of a model's text."""

from robosc.formatting.formatter import format_text

__all__ = ["format_text"]
