"""Expressions that are nested too deeply to become code."""

from collections.abc import Iterator
from contextlib import contextmanager

from robosc.errors import UnsupportedModelError


@contextmanager
def shallow(name: str, language: str) -> Iterator[None]:
    """Within the block an expression that is nested too deeply to become code is one that code cannot do.

    Args:
        name: Name of the model.
        language: Language of the code.

    Raises:
        UnsupportedModelError: There is such an expression.
    """
    try:
        yield
    except (RecursionError, MemoryError, SyntaxError) as error:
        if isinstance(error, MemoryError) and not error.args:
            # Memory has run out. Python's parser has words where only its own stack ends.
            raise
        raise UnsupportedModelError(f"{name} has an expression that is nested too deeply for {language}") from error
