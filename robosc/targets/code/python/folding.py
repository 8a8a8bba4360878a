"""Lines of generated Python, broken if they are longer than ament_flake8 allows.

Statements are broken at brackets and operators, comments between words. A line that cannot be broken, such as one with
a long name of the model, is marked: `# noqa: E501`.
"""

import ast
import io
import textwrap
import tokenize
from collections.abc import Iterable, Iterator, Sequence
from token import COMMENT, DEDENT, ENDMARKER, FSTRING_END, FSTRING_START, INDENT, NEWLINE, NL, OP, STRING
from typing import NamedTuple

from robosc.errors import InternalError
from robosc.targets.code.python.bundle import WIDTH

_LAYOUT = frozenset((DEDENT, ENDMARKER, INDENT, NEWLINE, NL))
_HEADS = frozenset(("return", "if", "elif", "while"))
_OPERATORS = frozenset(("if", "else", "and", "or", "for"))
_OPEN, _CLOSE = frozenset("([{"), frozenset(")]}")
_LONG = ('"""', "'''")
_MARK = "  # noqa: E501"

_INDENT = "    "
_HEAD = "class _:\n"
_WITHIN = frozenset(("", " ", "\t", ")", "]", "}", "#"))
"""Beginnings of lines that no statement has."""

_GOING_ON = ("elif", "else", "except", "finally")
"""Beginnings of lines with which the statement before goes on."""

_LARGE, _PIECE = 200_000, 2_000
"""Characters from which a module is folded piece by piece, and characters that a piece has at least."""


class _Token(NamedTuple):
    """Part of a line: a token of Python, or the blanks between two.

    Attributes:
        kind: Its kind, as in `token`; of blanks it is that of an indentation.
        text: Its characters.
        depth: Number of the line's brackets, or of a part's of the line, that it stands in.
    """

    kind: int
    text: str
    depth: int = 0

    @property
    def opens(self) -> bool:
        """Return True if it is an opening bracket."""
        return self.kind == OP and self.text in _OPEN

    @property
    def closes(self) -> bool:
        """Return True if it is a closing bracket."""
        return self.kind == OP and self.text in _CLOSE


_COMMA = _Token(OP, ",")


def folded(text: str) -> str:
    """The text of a module with lines that are not too long, and the same meaning; docstrings stay as they are.

    Once more, it changes nothing.

    Raises:
        InternalError: The result would have another meaning.
    """
    if len(text) <= _LARGE:
        return _folded_whole(text)
    # The syntax tree of a large module takes a hundred times the memory of its text.
    return "".join(_folded_whole(head + piece)[len(head) :] for head, piece in _pieces(text))


def _pieces(text: str) -> Iterator[tuple[str, str]]:
    """Pieces of a module, each of whole statements, after the head of a class that they are to stand in, or nothing."""
    for piece in _cut(text.removesuffix("\n").split("\n"), ""):
        header, _, inner = piece.partition("\n")
        if len(piece) > _LARGE and header.startswith("class ") and header.endswith(":") and len(header) <= WIDTH:
            yield "", header + "\n"
            yield from ((_HEAD, part) for part in _cut(inner.removesuffix("\n").split("\n"), _HEAD))
        else:
            yield "", piece


def _cut(lines: Iterable[str], head: str) -> Iterator[str]:
    """Texts of whole statements, of which each but the last is long enough or stands before a class."""
    indent = len(_INDENT) * bool(head)
    found: list[str] = []
    size = 0
    for line in lines:
        may_begin = not line[:indent].strip() and line[indent : indent + 1] not in _WITHIN
        may_begin = may_begin and not line[indent:].startswith(_GOING_ON)
        is_due = size >= _PIECE or (not head and line.startswith("class "))
        if found and may_begin and is_due and _is_whole(head + "".join(found)):
            yield "".join(found)
            found, size = [], 0
        found.append(line + "\n")
        size += len(line) + 1
    yield "".join(found)


def _is_whole(text: str) -> bool:
    """Return True if a text is a module by itself: then what follows it has the same meaning without it."""
    try:
        ast.parse(text)
    except SyntaxError:
        return False
    return True


def _folded_whole(text: str) -> str:
    # Not `splitlines`, which sees more ends of lines than Python does.
    lines = text.removesuffix("\n").split("\n")
    if all(len(line) <= WIDTH or line.endswith(_MARK) for line in lines):
        return text
    ends: dict[int, int] = {}
    depths: dict[int, int] = {}
    tokens: dict[int, list[_Token]] = {}
    depth, place = 0, (0, 0)
    long = {row for row, line in enumerate(lines, 1) if len(line) > WIDTH}
    for token in _read(text, lines):
        row, column = token.start
        # Texts of several lines, or that could be: what stands in them is no code, whatever it looks like.
        if token.type == STRING and token.string.endswith(_LONG):
            ends.update((inner, token.end[0]) for inner in range(row, token.end[0] + 1))
        depths.setdefault(row, depth)
        if token.type == OP:
            depth += (token.string in _OPEN) - (token.string in _CLOSE)
        if row in long and token.type not in _LAYOUT:
            before = lines[row - 1][place[1] : column] if row in tokens and place[0] == row else ""
            blanks = [_Token(INDENT, before)] if before else []
            tokens.setdefault(row, []).extend([*blanks, _Token(token.type, token.string)])
            place = token.end
    marked = {ends[row] for row, line in enumerate(lines, 1) if row in ends and row in long}
    marked -= {row for row in marked if lines[row - 1].endswith(_MARK)}
    found: list[str] = []
    for row, line in enumerate(lines, 1):
        if row in ends:
            found.append(line + _MARK if row in marked else line)
        elif row not in long or line.endswith(_MARK):
            found.append(line)
        else:
            found += _broken(line, tokens.get(row, []), is_inside=depths[row] > 0)
    result = "\n".join(found) + "\n"
    if not _is_same(ast.parse(result), ast.parse(text)):
        raise InternalError("a generated module has another meaning with shorter lines")
    return result


def _is_same(first: object, second: object) -> bool:
    """Return True if two syntax trees differ at most in places."""
    to_do = [(first, second)]
    while to_do:
        one, other = to_do.pop()
        if type(one) is not type(other):
            return False
        if isinstance(one, ast.AST):
            to_do += ((getattr(one, name, None), getattr(other, name, None)) for name in one._fields)
        elif isinstance(one, list) and isinstance(other, list):
            if len(one) != len(other):
                return False
            to_do += zip(one, other, strict=True)
        elif one is not other and repr(one) != repr(other):
            return False
    return True


def _read(text: str, lines: Sequence[str]) -> Iterator[tokenize.TokenInfo]:
    """Tokens of a module; a formatted string is one of them, with all that stands in its braces."""
    start, inside = (0, 0), 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == FSTRING_START:
            start = start if inside else token.start
            inside += 1
        if not inside:
            yield token
        if token.type == FSTRING_END:
            inside -= 1
            if not inside:
                whole = [*lines[start[0] - 1 : token.end[0]]]
                whole[-1] = whole[-1][: token.end[1]]
                whole[0] = whole[0][start[1] :]
                yield token._replace(type=STRING, string="\n".join(whole), start=start)


def _broken(line: str, tokens: Sequence[_Token], is_inside: bool) -> Iterator[str]:
    """A line that is too long as several; `is_inside` is true if it stands between brackets."""
    indent = line[: len(line) - len(line.lstrip())]
    if tokens[-1].kind == COMMENT:
        yield from _comment(indent, tokens[-1].text)
    code = _stripped([token for token in tokens if token.kind != COMMENT])
    if code:
        for part in _folded(code, indent, is_inside):
            yield part if len(part) <= WIDTH else part + _MARK


def _comment(indent: str, text: str) -> Iterator[str]:
    """The lines of a comment, which has a line of its own."""
    if len(indent + text) <= WIDTH:
        yield indent + text
        return
    start = indent + "# "
    words = textwrap.TextWrapper(
        WIDTH, initial_indent=start, subsequent_indent=start, break_long_words=False, break_on_hyphens=False
    )
    for part in words.wrap(text[2:]):
        yield part if len(part) <= WIDTH else part + _MARK


def _stripped(tokens: Sequence[_Token]) -> list[_Token]:
    """Tokens without blanks around, with their depths among each other; unmatched brackets count for nothing."""
    solid = [number for number, token in enumerate(tokens) if token.text.strip()]
    kept = tokens[solid[0] : solid[-1] + 1] if solid else []
    pairs: dict[int, int] = {}
    opened: list[int] = []
    for number, (kind, text, _) in enumerate(kept):
        if kind == OP:
            if text in _OPEN:
                opened.append(number)
            elif text in _CLOSE and opened:
                pairs[opened.pop()] = number
    closing = set(pairs.values())
    depth = 0
    found: list[_Token] = []
    for number, token in enumerate(kept):
        if number in closing:
            depth -= 1
        found.append(token if token[2] == depth else _Token(token[0], token[1], depth))
        if number in pairs:
            depth += 1
    return found


def _folded(tokens: Sequence[_Token], indent: str, is_inside: bool) -> Iterator[str]:
    tokens = _stripped(tokens)
    text = _text(tokens)
    if len(indent + text) <= WIDTH:
        yield indent + text
        return
    if is_inside:
        operators = [number for number, token in enumerate(tokens) if number and _is_loose(token)]
        if operators:
            for start, end in zip([0, *operators], [*operators, len(tokens)], strict=True):
                yield from _folded(tokens[start:end], indent, is_inside)
            return
    elif (statement := _statement(tokens)) is not None and any(map(_is_loose, _stripped(statement[1]))):
        head, value, tail = statement
        yield f"{indent}{_text(head)} ("
        yield from _folded(value, indent + "    ", True)
        yield f"{indent}){_text(tail)}"
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
        comma = [] if is_last and len(items) == 1 else [_COMMA]
        yield from _folded([*item, *comma], indent + "    ", True)
    yield from _folded(tokens[closing:], indent, is_inside)


def _text(tokens: Sequence[_Token]) -> str:
    return "".join(token.text for token in tokens)


def _is_loose(token: _Token) -> bool:
    """Return True if a token is an operator outside of brackets."""
    return token.depth == 0 and token.text in _OPERATORS


def _statement(tokens: Sequence[_Token]) -> tuple[Sequence[_Token], Sequence[_Token], Sequence[_Token]] | None:
    """The parts of a whole statement: all that stands before its value, the value, and the colon after it."""
    solid = [number for number, token in enumerate(tokens) if token.text.strip()]
    if tokens[0].text in _HEADS:
        start = 1
    else:
        # The names of a target, the dots between them, and `=` after a blank.
        names = [number for number in solid if not (tokens[number].text.isidentifier() or tokens[number].text == ".")]
        if not names or tokens[names[0]].text != "=" or not tokens[names[0] - 1].text.isspace():
            return None
        start = names[0] + 1
    end = len(tokens) - (tokens[-1].text == ":")
    if start >= end or not tokens[start].text.isspace() or tokens[end - 1].text in {":", ",", *_OPEN}:
        return None
    return tokens[:start], tokens[start:end], tokens[end:]


def _longest_pair(tokens: Sequence[_Token]) -> tuple[int, int] | None:
    """The brackets, outside of others, that have most between them."""
    best, size = None, 0
    opening = None
    for number, token in enumerate(tokens):
        if token.depth == 0 and token.opens:
            opening = number
        elif token.depth == 0 and token.closes and opening is not None:
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
    if not _text(items[-1]).strip():
        items.pop()
        if len(items) == 1:
            items[0].append(_COMMA)
    return items
