"""The word `not` at the beginning of an operand: a name if a token that can follow a name comes next, else an operator.

So a model that uses `not` as a name keeps its meaning; `^not` is always a name.
"""

from collections.abc import Sequence

from robosc.language.tokens import Kind

NOT = "not"

_NAME, _NUMBER, _STRING = int(Kind.NAME), int(Kind.NUMBER), int(Kind.STRING)
_BEGIN_OPERANDS = frozenset({"(", "!", "true", "false", "value"})
_CONVERSIONS = frozenset({"integer", "double"})
_BEHIND_OPERANDS = frozenset({"then", "else", "in"})
_ITEMS = frozenset({"goal", "assume", "limit", "mission", "prefer"})
"""Free words that begin an item without a sign that tells."""

_BETWEEN = frozenset({",", ":", "..", "in"})
"""Tokens between arguments, bounds of slices and parts of quantifiers."""
_BINARY = frozenset({"or", "and", "=", "!=", ">", ">=", "<", "<=", "+", "*", "/", "=>"})


def is_negation(texts: Sequence[str], kinds: Sequence[int], index: int, word: str = NOT) -> bool:
    """Return True if the word `not`, at a token where an operand begins, is the operator.

    Args:
        texts: The tokens, as written, with ends behind the last.
        kinds: Their kinds.
        index: The token.
        word: Word that stands there, if it is the operator.
    """
    if texts[index] != word:
        return False
    following, kind = texts[index + 1], kinds[index + 1]
    if kind == _NAME:
        return not (_is_behind_operand(texts, kinds, index + 1) or _begins_item(texts, kinds, index + 1))
    if following == "if":
        return _is_conditional(texts, kinds, index + 1)
    if following in _CONVERSIONS:
        return texts[index + 2] == "("
    return kind in (_NUMBER, _STRING) or following in _BEGIN_OPERANDS


def _is_behind_operand(texts: Sequence[str], kinds: Sequence[int], index: int) -> bool:
    """Return True if the free word at a token can stand behind an operand."""
    word = texts[index]
    # The constant of the next item: `constant A: E = not constant B: E = red`.
    begins_constant = word == "constant" and kinds[index + 1] == _NAME and texts[index + 2] == ":"
    return word in _BEHIND_OPERANDS or begins_constant or (word == "leads" and texts[index + 1] == "to")


def _begins_item(texts: Sequence[str], kinds: Sequence[int], index: int) -> bool:
    """Return True if the free word at a token begins a goal, an assumption, a limit, a mission or a preference.

    Of a name that could be such a word itself, as in `not mission goal while ...`, only the sign behind it decides.
    """
    word, following, behind = texts[index : index + 3]
    if word == "prefer" and following == "{":
        # Behind the condition of a mission that is called so, too, a brace opens.
        return behind == "}" or texts[index + 3] in (",", "}")
    if kinds[index + 1] != _NAME:
        return False
    if word in ("goal", "assume"):
        # The goal of the next item: `goal once not goal always eventually red`.
        return not _is_behind_operand(texts, kinds, index + 1)
    if (word, behind) in (("mission", "{"), ("limit", "to")):
        return True
    is_head = (word, behind) in (("mission", "while"), ("prefer", "over"))
    return is_head and following not in _ITEMS and not _is_behind_operand(texts, kinds, index + 1)


def _is_conditional(texts: Sequence[str], kinds: Sequence[int], index: int) -> bool:
    """Return True if the `if` at a token has a `then`; if not, it is the condition of a provide statement.

    Operands and operators alternate, which distinguishes the keyword `then` from a name.
    """
    conditions = depth = 0
    is_operand_next = True
    while True:
        token, kind = texts[index], kinds[index]
        if is_operand_next:
            if token == "if":
                conditions += 1
            elif token in ("(", "["):
                depth += 1
            elif token == ")" and texts[index - 1] == "(":
                # A call without arguments.
                depth -= 1
                is_operand_next = False
            elif token == NOT and kind == _NAME:
                is_operand_next = texts[index + 1] == "if" or is_negation(texts, kinds, index)
            elif token in _CONVERSIONS or kind in (_NAME, _NUMBER, _STRING) or token in ("true", "false", "value"):
                is_operand_next = False
            elif token not in ("!", "-"):
                return False
        elif token == "then":
            conditions -= 1
            if not conditions:
                return True
            is_operand_next = True
        elif token in _BINARY or token in ("-", ".", "else") or (depth and token in _BETWEEN):
            is_operand_next = True
        elif token in ("(", "["):
            depth += 1
            is_operand_next = True
        elif token in (")", "]") and depth:
            depth -= 1
        else:
            return False
        index += 1


__all__ = ["NOT", "is_negation"]
