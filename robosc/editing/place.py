"""Place of the cursor in a text: the open blocks there, and the words before it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from robosc.language.tokens import Kind, is_open_comment, is_open_string, tokenize_broken

_ITEMS = frozenset(
    """
    component datatype interface constant requirement provide incoming outgoing service action behaviour variable
    initial marked state on transition
    """.split()
)
"""Words that begin an item of a list."""

_ROBOT_ITEMS = frozenset({"goal", "assume", "limit", "mission", "prefer"})
"""Free words that begin an item of a robot, where no name can stand."""

_BEFORE_OPERANDS = frozenset(
    """
    allow always assume constant else eventually goal in mission never not once over prefer then visit while
    """.split()
)
"""Free words that a name follows, unless they are names themselves."""

_SIGNS_BEHIND = frozenset({"{", "}", ")", "]", "true", "false", "value"})
"""Signs and reserved words that end an item, or begin a list."""

_CLOSED = re.compile(r"/\*.*?\*/|//[^\n]*\n", re.DOTALL)
"""Comments that have ended."""

_NAMED = frozenset({Kind.NAME, Kind.WORD})


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a text where a word is being typed.

    Attributes:
        begin: Offset at which the word begins.
        before: The tokens before it.
        open: For each brace that is open, the tokens of the item that it belongs to, the outermost first.
        item: The tokens from the begin of the innermost unfinished item.
    """

    begin: int
    before: Sequence[str]
    open: tuple[tuple[str, ...], ...] = ()
    item: tuple[str, ...] = ()

    def last(self, number: int = 1) -> str:
        """One of the tokens before the place, counted backwards from 1; empty where there are not so many."""
        return self.before[-number] if number <= len(self.before) else ""

    @property
    def component(self) -> str:
        """The component that is open; empty where there is none."""
        return next((name_of(item[1]) for item in self.open if item[:1] == ("component",) and len(item) > 1), "")


def place_at(text: str, offset: int) -> Place | None:
    """The place of a cursor; None inside a comment or a text in quotes, where no word of the language is typed."""
    before = text[:offset]
    texts, kinds, starts = tokenize_broken(before)
    count = kinds.index(Kind.END)
    end = starts[count - 1] + len(texts[count - 1]) if count else 0
    # Closed comments behind the last token do not hold the cursor.
    if "//" in _CLOSED.sub("", before[end:]).rpartition("\n")[2]:
        return None
    if count and kinds[count - 1] == Kind.OTHER:
        token = texts[count - 1]
        # One in quotes holds the cursor to the end of its line.
        if is_open_comment(token) or (is_open_string(token) and end == offset):
            return None
    begin = offset
    # A `^` alone is the begin of a name, too.
    if count and end == offset and (kinds[count - 1] in _NAMED or texts[count - 1] == "^"):
        count -= 1
        begin = starts[count]
    tokens = tuple(texts[:count])
    opened: list[tuple[str, ...]] = []
    item = 0
    for index in range(count):
        match texts[index]:
            case "{":
                opened.append(tokens[item:index])
                item = index + 1
            case "}":
                if opened:
                    opened.pop()
                item = index + 1
            case word if word in _ROBOT_ITEMS:
                if len(opened) == 1 and _ends_item(tokens, kinds, index - 1):
                    item = index
            case word if word in _ITEMS and not (index > item and tokens[index - 1] in ("initial", "marked")):
                item = index
    return Place(begin, tokens, tuple(opened), tokens[item:])


def _ends_item(tokens: Sequence[str], kinds: Sequence[int], index: int) -> bool:
    """Return True if a token can be the last one of an item, or stands before the first."""
    token = tokens[index]
    if kinds[index] == Kind.NAME:
        return token not in _BEFORE_OPERANDS or tokens[index - 1] == "."
    return kinds[index] in (Kind.NUMBER, Kind.STRING) or token in _SIGNS_BEHIND


def name_of(token: str) -> str:
    """The name that a token is, without what keeps it from being a word of the language."""
    return token.removeprefix("^")
