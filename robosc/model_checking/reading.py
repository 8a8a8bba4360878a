"""Properties as text: expressions of the language with temporal operators among their operands.

A temporal operator becomes a call with a name that no text can contain, so that the language's own parser and its check
of depth treat it like any other operand. A word is an operator only where no name can be: a name of the model with the
same spelling is followed by `.`, or escaped by `^`.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.language import syntax
from robosc.language.cursor import Fault, TooManyFaults
from robosc.language.expression_parser import ExpressionParser
from robosc.language.limits import FRAMES_PER_LEVEL, MAXIMUM_NESTING, MAXIMUM_SYNTAX_ERRORS
from robosc.language.negation import NOT
from robosc.language.tokens import Kind, Places, Tokens, tokenize
from robosc.recursion import allow_depth
from robosc.source import Location, SourceFile

_NAME, _WORD, _OTHER, _END = int(Kind.NAME), int(Kind.WORD), int(Kind.OTHER), int(Kind.END)
_BINARY = frozenset({"and", "or", "=>", "=", "!=", "<", "<=", ">", ">=", "+", "*", "/"})
"""Signs that stand behind an operand only."""

UNARY_OPERATORS = ("AG", "AF", "AX", "EG", "EF", "EX")
CLAIMS = {"invariant": "AG", "reachable": "EF"}


@dataclass(frozen=True, slots=True)
class WrittenProperty:
    """A property as it was read.

    Attributes:
        name: Its name; empty if it has none.
        text: Its formula as written.
        location: Place where the formula stands.
        tree: The formula; temporal operators are calls whose names end in brackets.
    """

    name: str
    text: str
    location: Location
    tree: syntax.Expression


def operator_of(tree: syntax.Expression) -> str | None:
    """The operator that a call stands for: `AG`, ..., `AU`, `EU` or `enabled`; None for anything else."""
    if isinstance(tree, syntax.Call) and tree.function.text.endswith(")") and "(" in tree.function.text:
        return tree.function.text.removesuffix("()")
    return None


def read_properties(
    files: Sequence[SourceFile], *, has_lines: bool
) -> tuple[tuple[WrittenProperty, ...], tuple[Diagnostic, ...]]:
    """Return the properties of some texts and what is wrong with them.

    Args:
        files: The texts.
        has_lines: True if each line of a text is a property of its own (or empty, or a comment); else all of it is
            one.
    """
    found: list[WrittenProperty] = []
    diagnostics: list[Diagnostic] = []
    # Later work on the trees is recursive, too.
    allow_depth(MAXIMUM_NESTING, FRAMES_PER_LEVEL)
    for file in files:
        places = Places(file)
        offset = 0
        for line in file.text.split("\n") if has_lines else [file.text]:
            tokens = _tokens(line, offset, has_comments=has_lines)
            if not has_lines or len(tokens.texts) > _ENDS:
                read = _PropertyParser(file, tokens, places)
                with suppress(Fault, TooManyFaults):
                    found.append(read.property())
                diagnostics += read.diagnostics
            if len(diagnostics) >= MAXIMUM_SYNTAX_ERRORS:
                return tuple(found), tuple(diagnostics)
            offset += len(line) + 1
    return tuple(found), tuple(diagnostics)


_ENDS = len(tokenize("").texts)


def _tokens(text: str, offset: int, *, has_comments: bool) -> Tokens:
    """The tokens of a text that stands somewhere in a file, up to a comment that begins with `#`."""
    tokens = tokenize(text)
    if has_comments:
        for place, (token, kind) in enumerate(zip(tokens.texts, tokens.kinds, strict=True)):
            if kind == _OTHER and token == "#":
                tokens = tokenize(text[: tokens.starts[place]])
                break
    # Only the text before the end is left to say where the end is; blanks there would say nothing.
    end = len(text.rstrip()) if len(tokens.texts) > _ENDS else 0
    starts = [
        offset + (end if kind == _END else start) for start, kind in zip(tokens.starts, tokens.kinds, strict=True)
    ]
    return Tokens(tokens.texts, tokens.kinds, starts)


class _PropertyParser(ExpressionParser):
    """Reads one property."""

    def __init__(self, file: SourceFile, tokens: Tokens, places: Places) -> None:
        super().__init__(file, tokens, places)
        self._text = file.text
        self._offsets = tokens.starts

    def report(self, code: str, message: str, location: Location, fix: str, *related: RelatedPlace) -> None:
        """An error; a property ends where its text does."""
        message = message.replace("the end of the file", "the end of the property")
        self.diagnostics.append(Diagnostic(Severity.ERROR, code, message, location, fix, related))

    def property(self) -> WrittenProperty:
        """The whole text: perhaps a name, perhaps a claim, and a formula."""
        self._refuse_obstacles()
        name = ""
        if self.kinds[0] in (_NAME, _WORD) and self.texts[1] == ":":
            name = self.texts[0].removeprefix("^")
            self.place = 2
        begin = self.place
        tree = self._claim()
        if self.kinds[self.place] != _END:
            raise self.fault("the end of the property")
        if self.diagnostics:
            raise Fault
        last = self.place - 1
        text = self._text[self._offsets[begin] : self._offsets[last] + len(self.texts[last])]
        return WrittenProperty(name, text, self.since(begin), tree)

    def _refuse_obstacles(self) -> None:
        for index, kind in enumerate(self.kinds):
            token = self.texts[index]
            if kind == _OTHER and token[0] in "\"'":
                self.report(
                    "unclosed-string", "this text is never closed", self.at(index), f"Close it with {token[0]}."
                )
                raise Fault
            if kind == _OTHER and token.startswith("/*"):
                self.report("unclosed-comment", "this comment is never closed", self.at(index), "Close it with '*/'.")
                raise Fault
            if token == "\0":
                self.report("invalid-character", "the text contains a NUL character", self.at(index), "Remove it.")
                raise Fault

    def _refuse_requirement_words(self) -> None:
        """Refuse `always ...` and `never ...`, which requirements begin with."""
        begin = self.place
        word, following = self.texts[begin], self.texts[begin + 1]
        is_name = self.kinds[begin + 1] == _NAME or following in ("!", "(", "true", "false")
        if word not in ("always", "never") or not is_name:
            return
        last = self.kinds.index(_END) - 1
        start, end = self._offsets[begin + 1], self._offsets[last] + len(self.texts[last])
        meant = self._text[start:end]
        written = self._text[self._offsets[begin] : end]
        fix = f"Write 'invariant {meant if word == 'always' else f'!({meant})'}' instead of '{written}'."
        message = f"'{word}' begins requirements; a property that holds in every state begins with 'invariant'"
        self.report("syntax-error", message, self.at(begin), fix)
        raise Fault

    def _claim(self) -> syntax.Expression:
        self._refuse_requirement_words()
        begin = self.place
        operator = CLAIMS.get(self.texts[begin])
        if operator is None or not self._is_operator(begin):
            return self.expression()
        self.place = begin + 1
        self.deeper(begin)
        tree = self._call_of(operator, begin, self.expression())
        self.shallower()
        self.require_shallow(tree, begin)
        return tree

    def _is_operator(self, index: int) -> bool:
        """Return True if a word stands for an operator: what follows would not fit behind a name."""
        following = self.texts[index + 1]
        return following not in _BINARY and following not in (".", ")", "]", "U", "then", "else", ",", "")

    def _call_of(self, operator: str, index: int, *operands: syntax.Expression) -> syntax.Call:
        return syntax.Call(syntax.Name(f"{operator}()", self.at(index)), operands)

    def is_negation(self, index: int) -> bool:
        """Return True for a negation: `service` and `action` begin operands, no condition follows one, and `U` may."""
        following = self.texts[index + 1]
        begins_operand = self.texts[index] == NOT and following in ("service", "action", "if")
        return begins_operand or (following != "U" and super().is_negation(index))

    def _primary(self, *, is_negative: bool = False) -> syntax.Expression:
        index = self.place
        token, following = self.texts[index], self.texts[index + 1]
        if token in UNARY_OPERATORS and self._is_operator(index):
            return self._temporal(index, token, 1)
        if token in ("A", "E"):
            if following in ("G", "F", "X") and self.kinds[index + 2] != _END:
                return self._temporal(index, token + following, 2)
            if following == "[":
                return self._until(index, token)
        if token == "enabled" and following == "(":
            return self._enabled(index)
        if token in ("service", "action"):
            return self._location(index)
        return super()._primary(is_negative=is_negative)

    def _temporal(self, index: int, operator: str, words: int) -> syntax.Expression:
        self.place = index + words
        self.deeper(index)
        tree = self._call_of(operator, index, self._operand())
        self.shallower()
        return tree

    def _operand(self) -> syntax.Expression:
        """Parse the operand of one preceding operator: an operand behind signs, like that of `!`."""
        index = self.place
        token = self.texts[index]
        if token in ("!", "-") or self.is_negation(index):
            self.place = index + 1
            self.deeper(index)
            sign = "-" if token == "-" else "!"
            tree: syntax.Expression = syntax.Unary(sign, self._operand(), self.at(index))
            self.shallower()
            return tree
        if token != "(":
            return self._primary()
        self.deeper(index)
        self.place = index + 1
        tree = self._run()
        if self.texts[self.place] != ")":
            self.possible("an operator")
            self.possible("')'")
            raise self._unclosed(index)
        self.place += 1
        self.shallower()
        return tree

    def _until(self, index: int, quantifier: str) -> syntax.Expression:
        self.place = index + 2
        self.deeper(index + 1)
        left = self._run()
        self.take("U")
        right = self._run()
        self.take("]")
        self.shallower()
        return self._call_of(f"{quantifier}U", index, left, right)

    def _enabled(self, index: int) -> syntax.Expression:
        """`enabled(event)`; the kinds of events are reserved words."""
        self.place = index + 2
        name = self.name()
        if self.texts[self.place] == ")":
            # The bracket itself is in order.
            message = f"'{name.text}' alone is no event: its kind is missing"
            self.report(
                "syntax-error", message, self.at(self.place), f"Write 'enabled({name.text}.request)', for instance."
            )
            raise self.reported_fault()
        self.take(".")
        kind = self.place
        if self.kinds[kind] not in (_NAME, _WORD):
            raise self.fault("the kind of an event")
        self.place = kind + 1
        step = syntax.Name(self.texts[kind].removeprefix("^"), self.at(kind))
        event = syntax.Access(name, (step,), self.since(index + 2))
        self.take(")")
        return self._call_of("enabled", index, event)

    def _location(self, index: int) -> syntax.Expression:
        """`service name.location` or `action name.location`: the same without the word where no component is meant."""
        self.place = index + 1
        tree = self.access()
        if tree.root is None:
            raise self.fault("a name")
        root = syntax.Name(f"{self.texts[index]} {tree.root.text}", tree.root.location)
        return syntax.Access(root, tree.steps, self.since(index))
