"""Hooks of MkDocs for the site of the documentation: mkdocs.yml names them, `make docs` runs them.

The pages of docs/ are written to be read in the repository, too. The site differs in three things: links to files
outside of docs/, the words behind the language of a code block (for the tests that play a page), and colours of models.
"""

import logging
import posixpath
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from pygments.lexer import RegexLexer, words
from pygments.lexers import LEXERS
from pygments.token import Comment, Keyword, Name, Number, Operator, String, Text

TOP = Path(__file__).parents[1]
_OUTSIDE = "repository"
"""Folder of the site that holds the pages from outside of docs/."""

_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)#:\s]+)(#[^)\s]*)?\)")
_INFO = re.compile(r"^```(\w+) (.*)$", re.MULTILINE)
_LOADED = re.compile(r"<(?:script|img|iframe)\b[^>]*\bsrc=\"?https?:|<link\b[^>]*\bhref=\"?https?:", re.IGNORECASE)

(_RESERVED,) = re.findall(r"\*\*Reserved words\*\*: `([^`]*)`", (TOP / "docs" / "language.md").read_text("utf-8"))
"""Reserved words, as the language reference lists them; the language itself needs packages that are not here."""

_log = logging.getLogger("mkdocs.hooks.site")


class RoboscLexer(RegexLexer):  # type: ignore[misc]  # Pygments has no types
    """Lexer of models, for their colours."""

    name = "RoboSC"
    aliases = ("robosc",)
    tokens: ClassVar = {
        "root": [
            (r"//.*", Comment.Single),
            (r"/\*(?s:.)*?\*/", Comment.Multiline),
            (r"\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'", String),
            (r"\^\w+", Name),
            (words(("true", "false"), r"\b", r"\b"), Keyword.Constant),
            (words(("boolean", "integer", "double", "string", "none", "array"), r"\b", r"\b"), Keyword.Type),
            (words(_RESERVED.split(), r"\b", r"\b"), Keyword),
            (r"[A-Za-z_]\w*", Name),
            (r"\d+(?:\.\d+)?", Number),
            (r"[-+*/=!<>:]+|\.\.", Operator),
            (r"\s+|.", Text),
        ]
    }


# Pygments imports a lexer by the name of its module, which is known because MkDocs has loaded this one.
LEXERS["RoboscLexer"] = (__name__, RoboscLexer.name, RoboscLexer.aliases, (), ())
__all__ = ["RoboscLexer"]


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of the repository that the site has besides those of docs/."""
    for place in config.extra["repository_pages"]:
        files.append(File.generated(config, f"{_OUTSIDE}/{place}", content=(TOP / place).read_text("utf-8")))
    return files


def on_page_markdown(markdown: str, page: Page, config: Any, files: Files) -> str:
    """Return the text of a page as the site needs it."""
    return _INFO.sub(_title, outside_of_fences(markdown, lambda text: _LINK.sub(_Links(page, files).replaced, text)))


def on_post_page(output: str, page: Page, config: Any) -> None:
    """Find what a browser would load from elsewhere: a robot's laboratory need not be connected."""
    for found in _LOADED.findall(output):
        _log.warning("%s loads something from another server: %s", page.file.src_uri, found)


def outside_of_fences(text: str, change: Callable[[str], str]) -> str:
    """Return a text that was changed everywhere but in its code blocks."""
    parts, end = [], 0
    for fence in _FENCE.finditer(text):
        parts += [change(text[end : fence.start()]), fence[0]]
        end = fence.end()
    return "".join([*parts, change(text[end:])])


def _title(match: re.Match[str]) -> str:
    """The first line of a code block, with the name of the file that it is about as its title."""
    file = re.search(r"\bfile=(\S+)", match[2])
    return f'```{match[1]} title="{file[1]}"' if file else f"```{match[1]}"


class _Links:
    """Links of one page, led to where their targets are on the site.

    Args:
        page: The page.
        files: Everything that is on the site.
    """

    def __init__(self, page: Page, files: Files) -> None:
        self._place = page.file.src_uri
        self._files = files
        inside = self._place.removeprefix(f"{_OUTSIDE}/")
        self._source = inside if inside != self._place else f"docs/{self._place}"

    def replaced(self, match: re.Match[str]) -> str:
        """Return a link that leads to a page of the site, or the path of a file that is not there."""
        text, target, section = match[1], match[2], match[3] or ""
        source = posixpath.normpath(posixpath.join(posixpath.dirname(self._source), target))
        place = source.removeprefix("docs/") if source.startswith("docs/") else f"{_OUTSIDE}/{source}"
        # MkDocs itself reports a page that is missing in docs/.
        if source.startswith("docs/") or self._files.get_file_from_path(place):
            return f"[{text}]({posixpath.relpath(place, posixpath.dirname(self._place))}{section})"
        if not (TOP / source).exists():
            _log.warning("%s: there is no %s", self._source, source)
        return text if source in text else f"{text} (`{source}`)"
