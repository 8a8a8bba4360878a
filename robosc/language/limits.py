"""Limits on the size of a text of the language."""

MAXIMUM_NESTING = 200
"""Brackets in brackets, and levels of an expression, beyond which a text is refused."""

FRAMES_PER_LEVEL = 16
"""Python frames that a recursive walk over a tree may have open for each of its levels."""

MAXIMUM_NAME = 255
"""Characters that a name may have."""

MAXIMUM_SYNTAX_ERRORS = 100
"""Syntax errors of one text that are reported; what follows them is left unread."""
