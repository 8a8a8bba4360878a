"""Damages texts as careless and hostile authors would."""

from collections.abc import Sequence
from random import Random

from robosc.language.tokens import tokenize
from robosc.language.words import RESERVED_WORDS

WORDS = (*sorted(RESERVED_WORDS), "constant", "always", "never", "then", "else", "in", "qos", "depth", "max_age")
GOALS = (
    "goal",
    "assume",
    "eventually",
    "leads",
    "once",
    "mission",
    "while",
    "visit",
    "anywhere",
    "prefer",
    "over",
    "limit",
)
PIECES = (
    *("{", "}", "(", ")", "[", "]", '"', "'", "/*", "*/", "//", "->", "..", ":=", "=>", "!=", "<=", "-", "!", ",", ":"),
    *("min(", "any(x in value: ", "if ", "array(", "integer(", "{a: ", "value", "value.x[0..3]", "^", "\\", ";", "&&"),
    *(
        "0",
        "1",
        "2147483647",
        "2147483648",
        "-2147483649",
        "9" * 400,
        "0.5",
        "1e9",
        "1." + "0" * 400,
        "é",
        "→",
        "\u2028",
    ),
    *("\0", "\ufeff", "\r", "\t", "\n", "😀", "x" * 300),
)
DEPTHS = (1, 10, 150, 199, 201, 1000, 20_000)


def mutated(text: str, others: Sequence[str], dice: Random) -> str:
    """Return a text with one to four random damages.

    Args:
        text: Text to damage.
        others: Texts that pieces may be taken from.
        dice: Source of chance that decides everything.
    """
    for _ in range(dice.choice((1, 1, 2, 4))):
        text = dice.choice(_DAMAGES)(text, others, dice)
    return text


def _tokens(text: str, dice: Random) -> tuple[list[int], int]:
    """Return the starts of the tokens, and the number of one of them."""
    starts = tokenize(text).starts
    return starts, dice.randrange(len(starts))


def _delete_token(text: str, others: Sequence[str], dice: Random) -> str:
    starts, at = _tokens(text, dice)
    end = starts[min(at + dice.choice((1, 1, 2, 8)), len(starts) - 1)]
    return text[: starts[at]] + text[end:]


def _double_token(text: str, others: Sequence[str], dice: Random) -> str:
    starts, at = _tokens(text, dice)
    end = starts[min(at + dice.choice((1, 1, 3, 20)), len(starts) - 1)]
    return text[:end] + " " + text[starts[at] :]


def _swap_tokens(text: str, others: Sequence[str], dice: Random) -> str:
    tokens = tokenize(text).texts
    first, second = dice.randrange(len(tokens)), dice.randrange(len(tokens))
    tokens[first], tokens[second] = tokens[second], tokens[first]
    return " ".join(tokens)


def _insert(text: str, others: Sequence[str], dice: Random) -> str:
    starts, at = _tokens(text, dice)
    return f"{text[: starts[at]]} {dice.choice((*WORDS, *GOALS, *PIECES))} {text[starts[at] :]}"


def _insert_anywhere(text: str, others: Sequence[str], dice: Random) -> str:
    at = dice.randint(0, len(text))
    return text[:at] + dice.choice(PIECES) + text[at:]


def _replace_token(text: str, others: Sequence[str], dice: Random) -> str:
    tokens = tokenize(text)
    at = dice.randrange(len(tokens.texts))
    donor = tokenize(dice.choice(others)).texts if others and dice.random() < 0.5 else [*WORDS, *GOALS, *PIECES]
    start = tokens.starts[at]
    return text[:start] + dice.choice(donor) + text[start + len(tokens.texts[at]) :]


def _cut(text: str, others: Sequence[str], dice: Random) -> str:
    at = dice.randint(0, len(text))
    return text[:at] if dice.random() < 0.7 else text[at:]


def _delete_lines(text: str, others: Sequence[str], dice: Random) -> str:
    lines = text.split("\n")
    at = dice.randrange(len(lines))
    del lines[at : at + dice.choice((1, 1, 3))]
    return "\n".join(lines)


def _splice(text: str, others: Sequence[str], dice: Random) -> str:
    if not others:
        return text
    other = dice.choice(others)
    starts, at = _tokens(other, dice)
    end = starts[min(at + dice.choice((3, 10, 60)), len(starts) - 1)]
    place = dice.randint(0, len(text))
    return text[:place] + other[starts[at] : end] + text[place:]


def _nest(text: str, others: Sequence[str], dice: Random) -> str:
    opening, closing = dice.choice(
        (("(", ")"), ("{a: ", "}"), ("[", "]"), ("array(", ")"), ("min(", ")"), ("!", ""), ("-", ""))
    )
    depth = dice.choice(DEPTHS)
    starts, at = _tokens(text, dice)
    end = starts[min(at + 1, len(starts) - 1)]
    nested = opening * depth + text[starts[at] : end] + (closing * depth if dice.random() < 0.7 else "")
    return text[: starts[at]] + nested + text[end:]


def _repeat(text: str, others: Sequence[str], dice: Random) -> str:
    starts, at = _tokens(text, dice)
    end = starts[min(at + dice.choice((1, 4, 30)), len(starts) - 1)]
    piece = text[starts[at] : end]
    count = min(dice.choice((2, 30, 500)), 20_000 // max(1, len(piece)))
    return text[:end] + piece * count + text[end:]


def _noise(text: str, others: Sequence[str], dice: Random) -> str:
    at = dice.randint(0, len(text))
    noise = "".join(chr(dice.choice((dice.randrange(128), dice.randrange(0xD800)))) for _ in range(dice.randint(1, 40)))
    return text[:at] + noise + text[at:]


_DAMAGES = (
    *(_delete_token, _double_token, _swap_tokens, _insert, _insert, _insert_anywhere, _replace_token, _replace_token),
    *(_cut, _delete_lines, _splice, _nest, _repeat, _noise),
)
