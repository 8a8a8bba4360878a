"""Meaning of every diagnostic code, with an example of it and how to fix it."""

from robosc.diagnostics.pages import (
    MARK,
    Block,
    Page,
    Stage,
    UnknownCodeError,
    codes,
    document,
    page,
    pages,
    parse_page,
)

__all__ = ["MARK", "Block", "Page", "Stage", "UnknownCodeError", "codes", "document", "page", "pages", "parse_page"]
