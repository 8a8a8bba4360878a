"""Pictures by Graphviz (E. R. Gansner and S. C. North, Software: Practice and Experience 30(11), 2000, pp. 1203-1233).

The program `dot` is no dependency: without it there are no pictures, and a message says how to install it.
"""

import shutil
import subprocess

from robosc.errors import RoboscError

FORMATS = ("svg", "png", "pdf")
"""Formats that `drawn` offers."""

_PROGRAM = "dot"
_TIMEOUT_S = 60


class DrawingUnavailableError(RoboscError, RuntimeError):
    """A picture that cannot be drawn, since Graphviz is not installed or gave up."""


def can_draw() -> bool:
    """Return True if Graphviz is installed."""
    return shutil.which(_PROGRAM) is not None


def drawn(text: str, format_: str) -> bytes:
    """Return the picture of a graph.

    Args:
        text: The graph in Graphviz's language.
        format_: One of `FORMATS`.

    Raises:
        DrawingUnavailableError: Graphviz is not installed, or gave up.
    """
    program = shutil.which(_PROGRAM)
    if program is None:
        raise DrawingUnavailableError(
            "pictures are drawn by Graphviz, whose program 'dot' is not installed: install it "
            "(on Debian and Ubuntu the package graphviz), or write a .dot file"
        )
    command = [program, f"-T{format_}"]
    try:
        done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=_TIMEOUT_S, check=True)  # noqa: S603  # the text is data, not a command
    except subprocess.TimeoutExpired as error:
        raise DrawingUnavailableError(
            f"Graphviz has not drawn this graph within {_TIMEOUT_S} s: it is too large; write a .dot file"
        ) from error
    except (OSError, subprocess.CalledProcessError) as error:
        raise DrawingUnavailableError(f"Graphviz cannot draw this graph: {error}") from error
    return done.stdout
