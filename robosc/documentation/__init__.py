"""A Markdown page about a checked robot: its parts as diagrams and tables, its requirements as sentences."""

from robosc.documentation.page import page

__all__ = ["page"]
