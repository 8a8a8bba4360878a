"""Text to canonical text: the layout changes, the tokens and comments do not."""

from robosc.errors import InternalError, LanguageError
from robosc.formatting.gaps import find_gaps
from robosc.formatting.layout import lay_out
from robosc.formatting.statements import find_structure
from robosc.language import parse
from robosc.language.tokens import Tokens, tokenize
from robosc.source import SourceFile


def format_text(text: str, name: str = "<text>") -> str:
    """Return the text in the canonical layout.

    The result has the same tokens and comments in the same order. It depends on nothing but these, the author's
    blank lines, and whether a comment stands on a line of its own, at the end of a line or inside one. Its lines end
    like the first line of the text.

    Args:
        text: A robot or library without syntax errors.
        name: Name of the text in findings.

    Raises:
        LanguageError: The text has syntax errors.
    """
    parsed = parse(SourceFile(name, text))
    if parsed.tree is None:
        raise LanguageError(parsed.diagnostics)
    tokens = tokenize(text)
    structure = find_structure(tokens, parsed.tree)
    result = lay_out(tokens.texts, find_gaps(text, tokens), structure, _line_end(text, tokens))
    if tokenize(result).texts != tokens.texts:
        raise InternalError(f"formatting {name} would change more than its layout")
    return result


def _line_end(text: str, tokens: Tokens) -> str:
    """Return the characters that end the first line, texts in quotes aside."""
    end = 0
    for token, start in zip(tokens.texts, tokens.starts, strict=True):
        place = text.find("\n", end, start)
        if place >= 0:
            return "\r\n" if text[place - 1 : place] == "\r" else "\n"
        end = start + len(token)
    return "\n"
