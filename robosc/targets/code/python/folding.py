"""Lines of generated Python, broken where they are longer than ament_flake8 allows.

Statements are broken at brackets and operators, comments at words. What cannot be broken, such as a long name of the
model, is marked: `# noqa: E501`.
"""

import ast
import io
import re
import textwrap
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from robosc.errors import InternalError
from robosc.targets.code.python.bundle import WIDTH

_TOKEN = re.compile(
    r"""(?P<string>[A-Za-z]{0,2}'(?:[^'\\]|\\.)*'|[A-Za-z]{0,2}"(?:[^"\\]|\\.)*")|(?P<comment>\#.*)"""
    r"""|(?P<open>[(\[{])|(?P<close>[)\]}])|(?P<text>\w+|\s+|.)"""
)
_STATEMENT = re.compile(r"(?P<head>return |if |elif |while |[\w.]+ = )(?P<value>.*[^:,(\[{])(?P<tail>:?)")
_OPERATORS = frozenset(("if", "else", "and", "or", "for"))
_LONG = ('"""', "'''")
_MARK = "  # noqa: E501"


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    depth: int


def folded(text: str) -> str:
    """The text of a module with lines that are not too long, and the same meaning; docstrings stay as they are.

    Once more, it changes nothing.

    Raises:
        InternalError: The result would have another meaning.
    """
    # Not `splitlines`, which sees more ends of lines than Python does.
    lines = text.removesuffix("\n").split("\n")
    if all(len(line) <= WIDTH for line in lines):
        return text
    ends: dict[int, int] = {}
    depths: dict[int, int] = {}
    depth = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        # Texts of several lines, or that could be: what stands in them is no code, whatever it looks like.
        if token.type == tokenize.STRING and token.string.endswith(_LONG):
            ends.update((row, token.end[0]) for row in range(token.start[0], token.end[0] + 1))
        depths.setdefault(token.start[0], depth)
        if token.type == tokenize.OP:
            depth += (token.string in "([{") - (token.string in ")]}")
    marked = {ends[row] for row, line in enumerate(lines, 1) if row in ends and len(line) > WIDTH}
    marked -= {row for row in marked if lines[row - 1].endswith(_MARK)}
    found: list[str] = []
    for row, line in enumerate(lines, 1):
        if row in ends:
            found.append(line + _MARK if row in marked else line)
        else:
            found += _broken(line, is_inside=depths[row] > 0)
    result = "\n".join(found) + "\n"
    if ast.dump(ast.parse(result)) != ast.dump(ast.parse(text)):
        raise InternalError("a generated module has another meaning with shorter lines")
    return result


def _broken(line: str, is_inside: bool) -> Iterator[str]:
    """A line as several; `is_inside` tells that it stands between brackets."""
    if len(line) <= WIDTH or line.endswith(_MARK):
        yield line
        return
    indent = line[: len(line) - len(line.lstrip())]
    tokens = _tokens(line.strip())
    if tokens[0].kind == "comment":
        start = indent + "# "
        words = textwrap.TextWrapper(
            WIDTH, initial_indent=start, subsequent_indent=start, break_long_words=False, break_on_hyphens=False
        )
        for part in words.wrap(tokens[0].text[2:]):
            yield part if len(part) <= WIDTH else part + _MARK
        return
    if tokens[-1].kind == "comment":
        yield from _broken(indent + tokens[-1].text, is_inside)
        tokens = _tokens(line.rstrip()[: -len(tokens[-1].text)].strip())
    for part in _folded(tokens, indent, is_inside):
        yield part if len(part) <= WIDTH else part + _MARK


def _tokens(text: str) -> list[_Token]:
    """Tokens with the depth of the brackets of the text that they stand in; unmatched ones count for nothing."""
    pairs: dict[int, int] = {}
    opened: list[int] = []
    found = list(_TOKEN.finditer(text))
    for number, item in enumerate(found):
        if item.lastgroup == "open":
            opened.append(number)
        elif item.lastgroup == "close" and opened:
            pairs[opened.pop()] = number
    closing = set(pairs.values())
    depth = 0
    tokens: list[_Token] = []
    for number, item in enumerate(found):
        depth -= number in closing
        tokens.append(_Token(str(item.lastgroup), item[0], depth))
        depth += number in pairs
    return tokens


def _folded(tokens: Sequence[_Token], indent: str, is_inside: bool) -> Iterator[str]:
    text = "".join(token.text for token in tokens).strip()
    if len(indent + text) <= WIDTH:
        yield indent + text
        return
    tokens = _tokens(text)
    if is_inside:
        operators = [
            number for number, token in enumerate(tokens) if number and token.depth == 0 and token.text in _OPERATORS
        ]
        if operators:
            for start, end in zip([0, *operators], [*operators, len(tokens)], strict=True):
                yield from _folded(tokens[start:end], indent, is_inside)
            return
    elif (found := _STATEMENT.fullmatch(text)) is not None and _is_loose(found["value"]):
        yield f"{indent}{found['head']}("
        yield from _folded(_tokens(found["value"]), indent + "    ", True)
        yield f"{indent}){found['tail']}"
        return
    pair = _longest_pair(tokens)
    if pair is None:
        yield indent + text
        return
    opening, closing = pair
    yield from _folded(tokens[: opening + 1], indent, is_inside)
    items = _items(tokens[opening + 1 : closing])
    # One item may be a generator, which has no comma at its end, or stand in brackets that make no tuple.
    for number, item in enumerate(items, 1):
        is_last = number == len(items)
        comma = "" if is_last and len(items) == 1 else ","
        yield from _folded([*item, _Token("text", comma, 0)], indent + "    ", True)
    yield from _folded(tokens[closing:], indent, is_inside)


def _is_loose(text: str) -> bool:
    """Return True if an expression has an operator outside of brackets."""
    return any(token.depth == 0 and token.text in _OPERATORS for token in _tokens(text))


def _longest_pair(tokens: Sequence[_Token]) -> tuple[int, int] | None:
    """The brackets, outside of others, that have most between them."""
    best, size = None, 0
    opening = None
    for number, token in enumerate(tokens):
        if token.depth == 0 and token.kind == "open":
            opening = number
        elif token.depth == 0 and token.kind == "close" and opening is not None:
            length = sum(len(item.text) for item in tokens[opening + 1 : number])
            if length > size:
                best, size = (opening, number), length
            opening = None
    return best


def _items(tokens: Sequence[_Token]) -> list[list[_Token]]:
    """Items between commas; a comma that makes a tuple of one item stays with it."""
    depth = min((token.depth for token in tokens), default=0)
    items: list[list[_Token]] = [[]]
    for token in tokens:
        if token.depth == depth and token.text == ",":
            items.append([])
        else:
            items[-1].append(token)
    if not "".join(token.text for token in items[-1]).strip():
        items.pop()
        if len(items) == 1:
            items[0].append(_Token("text", ",", 0))
    return items
