"""Random texts straight from the grammar `robosc.tx`, and random damage to texts.

A walk over the rules that textX has read takes any alternative and any number of repetitions, so what comes out is
right as far as one rule can see; the names mean nothing. Written without blanks, or with names that are words
elsewhere, some of it is another text than the walk meant, which is as good.
"""

from collections.abc import Sequence
from functools import cache
from random import Random
from typing import Any

from arpeggio import EndOfFile, Not, OneOrMore, Optional, OrderedChoice, RegExMatch, StrMatch, ZeroOrMore

from support.textx_parser import metamodel

WORDS = tuple(
    """
    a b x far always never any all in then else min max length abs clamp qos depth max_age stamped when constant
    not identifier type reliable sensor latched until _x9 Value order androids ifs ^a ^state ^always ^value ^in ^then x1
    goal assume eventually leads once allow ^once ^allow mission while visit anywhere prefer over ^then limit ^limit
    """.split()
)
"""Free names; most of them are words of part B, or nearly a word."""

_NUMBERS = ("0", "1", "2", "10", "007", "2147483647", "2147483648")
_DOUBLES = ("0.05", "1.5", "2.0", "00.10")
_STRINGS = ('""', "'a'", '"it\'s"', r"'it\'s'", r'"a\"\\\n\tb"', '"// no comment"', "'/* none'", '"two\nlines"', "'é'")

_SAMPLES: dict[str, tuple[str, ...]] = {
    "NameToken": WORDS,
    "RootToken": (*WORDS, "value"),
    "FunctionToken": tuple("integer double min max any all always never once f length then".split()),
    "DoubleToken": _DOUBLES,
    "IntegerToken": _NUMBERS,
    "StringToken": _STRINGS,
    "Minus": ("-",),
    "Slash": ("/",),
    "NotSign": ("!",),
    "NotWord": ("not",),
    "Equals": ("=",),
    "Colon": (":",),
    "Dot": (".",),
}

_REPEATED = {"ImplicationRest": 0.02, "Option": 0.25, "Step": 0.3}
"""Probability that a rule is repeated once more, where it is not the usual one."""

_EXPRESSION = 8
"""Tokens beyond which an expression comes to its end: else the first one would be the whole text."""

_SIGNED = ("Not", "Negation")
"""Rules that could go on with signs."""

_SIGNS = tuple("{ } ( ) [ ] . .. , : := = != => -> < <= > >= + - * / ! ^ & ; é ? // /* */ \" '".split())
_BLANKS = (" ", " ", " ", "\n", "\t", "\r\n", "  ")
_COMMENTS = ("/**/", "/* a } b */", "/* two\n * lines **/", "// to the end\n", "//\n", "/*/ not yet */")


def grammar_tokens(random: Random, size: int) -> list[str]:
    """The tokens of a text: about `size` of them, and what it takes to end what they have begun."""
    found: list[str] = []
    _walk(metamodel()._parser_blueprint.parser_model, random, size, found)
    return found


def joined(tokens: Sequence[str], random: Random) -> str:
    """A text of tokens: with blanks, with comments, or with as little as possible between them."""
    (style,) = random.choices(("blanks", "comments", "tight", "glued"), (4, 3, 4, 1))
    text, before = _between(style, random), ""
    for token in tokens:
        text += (" " if style == "tight" and _would_merge(before, token) else "") + token + _between(style, random)
        before = token
    return text


def _between(style: str, random: Random) -> str:
    match style:
        case "blanks":
            return random.choice(_BLANKS)
        case "comments":
            return "".join(random.choices(_COMMENTS + _BLANKS, k=random.randint(1, 3)))
        case "glued":
            return random.choice(("", "", " "))
        case _:
            return ""


def damaged_tokens(tokens: Sequence[str], random: Random) -> list[str]:
    """The tokens with one of them lost, doubled, exchanged or added, or with a stretch of them lost or doubled."""
    found = list(tokens)
    at = random.randrange(len(found))
    other = random.randrange(len(found))
    match random.randrange(6):
        case 0:
            del found[at]
        case 1:
            found.insert(at, found[other])
        case 2:
            found[at], found[other] = found[other], found[at]
        case 3:
            found[at] = _any_token(random)
        case 4:
            found.insert(at, _any_token(random))
        case _:
            stretch = found[at : at + random.randint(1, 8)]
            found[other:other] = stretch
            if random.random() < 0.5:
                del found[at : at + len(stretch)]
    return found


def damaged_text(text: str, random: Random) -> str:
    """The text with one character lost, doubled or added, or cut off."""
    at = random.randrange(len(text))
    match random.randrange(4):
        case 0:
            return text[:at] + text[at + 1 :]
        case 1:
            return text[:at] + text[at] + text[at:]
        case 2:
            return text[:at] + random.choice("^._-=<>!/*()[]{}:,0a\"'\\ \n") + text[at:]
        case _:
            return text[:at]


def _would_merge(token: str, following: str) -> bool:
    """Return True if two tokens without a blank between them are read as one; `0and` is two, `x1and` is not."""
    if not token or not (following[0].isalnum() or following[0] == "_"):
        return False
    if token[0].isdigit():
        return following[0].isdigit()
    return token[-1].isalnum() or token[-1] == "_"


@cache
def _keywords() -> tuple[str, ...]:
    """The words of the grammar, those of part B too."""
    found: dict[str, None] = {}
    for node in _nodes():
        if isinstance(node, RegExMatch | StrMatch) and node.to_match.isidentifier():
            found[node.to_match] = None
    return tuple(sorted(found))


def _any_token(random: Random) -> str:
    return random.choice(random.choice((_keywords(), WORDS, _SIGNS, _NUMBERS, _DOUBLES, _STRINGS)))


def _walk(node: Any, random: Random, size: int, found: list[str]) -> None:
    if isinstance(node, RegExMatch):
        found.append(random.choice(_SAMPLES[node.rule_name]) if node.rule_name in _SAMPLES else node.to_match)
    elif isinstance(node, EndOfFile | Not):
        return
    elif isinstance(node, StrMatch):
        found.append(node.to_match)
    elif isinstance(node, OrderedChoice):
        ends = len(found) >= size or (node.rule_name in _SIGNED and random.random() < 0.8)
        _walk(min(node.nodes, key=_height) if ends else random.choice(node.nodes), random, size, found)
    else:
        if node.rule_name == "Expression":
            size = min(size, len(found) + _EXPRESSION)
        while _goes_on(node, random, size, found):
            for part in node.nodes:
                _walk(part, random, size, found)
            if not isinstance(node, ZeroOrMore | OneOrMore):
                break


def _goes_on(node: Any, random: Random, size: int, found: list[str]) -> bool:
    """Return True if the parts of a node are taken, or taken once more."""
    if isinstance(node, Optional):
        return len(found) < size and random.random() < 0.5
    if not isinstance(node, ZeroOrMore | OneOrMore):
        return True
    inner = _rule_names(node, 3)
    usual = 0.15 if any(name.endswith("Rest") for name in inner) else 0.85
    chance = next((_REPEATED[name] for name in inner if name in _REPEATED), usual)
    return len(found) < size and random.random() < chance


def _rule_names(node: Any, levels: int) -> list[str]:
    """The names of the rules at most so many levels below a node."""
    if not levels:
        return []
    return [name for part in node.nodes for name in (part.rule_name, *_rule_names(part, levels - 1))]


@cache
def _nodes() -> tuple[Any, ...]:
    """Every node of the grammar once."""
    found: dict[int, Any] = {}
    stack = [metamodel()._parser_blueprint.parser_model]
    while stack:
        node = stack.pop()
        if id(node) not in found:
            found[id(node)] = node
            stack.extend(node.nodes)
    return tuple(found.values())


@cache
def _heights() -> dict[int, float]:
    """For every node the fewest levels below it: the way out of a rule that contains itself."""
    found = {id(node): float("inf") for node in _nodes()}
    changed = True
    while changed:
        changed = False
        for node in _nodes():
            heights = [found[id(part)] for part in node.nodes]
            if isinstance(node, Optional | ZeroOrMore | Not) or not heights:
                height = 0.0
            else:
                height = 1 + (min(heights) if isinstance(node, OrderedChoice) else max(heights))
            if height < found[id(node)]:
                found[id(node)], changed = height, True
    return found


def _height(node: Any) -> float:
    return _heights()[id(node)]
