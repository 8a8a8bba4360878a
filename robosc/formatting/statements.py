"""The structure of a text as its layout needs it: statements, and where their lines may be broken.

Tokens are named by their indices, so no part of a text can get lost. The parser has already accepted the text, so there
are no syntax errors.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from robosc.language import syntax
from robosc.language.negation import NOT, is_negation
from robosc.language.precedence import LEVELS
from robosc.language.tokens import Kind, Tokens

_NAME = int(Kind.NAME)
_RANKS = {operator: 2 * rank for rank, level in enumerate(LEVELS) for operator in level} | {"=>": 9}
"""Ranks of how tightly operators bind; `=>` more tightly than the comparisons, and less than sums."""
_CONVERSIONS = ("integer", "double")
_TYPE_KEYS = ("type", "request", "response", "feedback")


class Break(IntEnum):
    """Kind of break before a token, if its group is broken."""

    NONE = 0
    """The line has no break."""
    LINE = 1
    """A line begins."""
    ENTRY = 2
    """A line begins, and the author's blank lines before it are kept."""
    CLOSE = 3
    """A line begins with the end of a bracket."""


class Group(NamedTuple):
    """Tokens whose breaks are taken all or none.

    Attributes:
        first: Its first token.
        last: Its last token.
        levels: Number of levels by which its lines are indented deeper than those of the group around it.
        is_bracket: True if it is a bracket with what stands in it.
        is_clause: True if the break before its first token belongs to it.
    """

    first: int
    last: int
    levels: int
    is_bracket: bool = False
    is_clause: bool = False


class Statement(NamedTuple):
    """Statement that begins a line: a definition, the head of one that goes on in braces, or a closing brace.

    Attributes:
        first: Its first token.
        last: Its last token.
        level: Depth of its indentation.
        groups: Its groups; of two that begin at one token, the inner one comes first.
    """

    first: int
    last: int
    level: int
    groups: tuple[Group, ...]


class Structure(NamedTuple):
    """The structure of a text.

    Attributes:
        statements: All of it, in order.
        breaks: For each token, the `Break` before it.
        tight: For each token, 1 if it is written tightly behind the one before, although both could stand alone.
    """

    statements: tuple[Statement, ...]
    breaks: bytearray
    tight: bytearray


def find_structure(tokens: Tokens, tree: syntax.File) -> Structure:
    """The structure of a text.

    Args:
        tokens: Its tokens.
        tree: Its syntax tree, which shows what tokens alone do not: which requirements are invariants, and which words
            of goals are names.
    """
    walker = _Walker(tokens, tree)
    walker.file()
    return Structure(tuple(walker.statements), walker.breaks, walker.tight)


class _Run:
    """Operands and operators in turns.

    Attributes:
        starts: First token of each operand.
        operators: Tokens of the operators between them.
    """

    __slots__ = ("operators", "starts")

    def __init__(self, start: int) -> None:
        self.starts = [start]
        self.operators: list[int] = []


class _Frame:
    """A bracket or conditional that has been opened.

    Attributes:
        opening: Its first token.
        around: The run that it is an operand of, or belongs to one.
        is_conditional: True if it is a conditional.
        parts: Number of its runs that have ended.
    """

    __slots__ = ("around", "is_conditional", "opening", "parts")

    def __init__(self, opening: int, around: _Run, *, is_conditional: bool = False) -> None:
        self.opening = opening
        self.around = around
        self.is_conditional = is_conditional
        self.parts = 0


class _Expressions:
    """Walks over expressions, types and object values; all without recursion, however deep they nest."""

    def __init__(self, tokens: Tokens) -> None:
        self.texts, self.kinds, _ = tokens
        self.breaks = bytearray(len(self.texts))
        self.tight = bytearray(len(self.texts))
        self.groups: list[Group] = []
        self.place = 0

    def type(self) -> None:
        """Walk over a type."""
        depth = 0
        while self.texts[self.place] == "array":
            self.tight[self.place + 1] = 1
            self.place += 2
            depth += 1
        is_integer = self.texts[self.place] == "integer"
        self.place += 1
        if is_integer and self.texts[self.place] == "(":
            self.tight[self.place] = 1
            self.place += 1
            self.number()
            self.place += 1
            self.number()
            self.place += 1
        self.place += depth

    def number(self) -> None:
        """Walk over a number, perhaps behind a `-`."""
        if self.texts[self.place] == "-":
            self.tight[self.place + 1] = 1
            self.place += 1
        self.place += 1

    def expression(self, levels: int = 0) -> bool:
        """Walk over an expression.

        Args:
            levels: Number of levels by which its lines are indented deeper than those of the group around it.

        Returns:
            True if its last line, if it is broken, is nothing but a closing bracket.
        """
        frames: list[_Frame] = []
        run = _Run(self.place)
        while True:
            opened = self._operand(run)
            if opened is not None:
                frames.append(opened)
                run = _Run(self.place)
                continue
            # Behind an operand: steps, what closes brackets, an operator, the end.
            while True:
                index = self.place
                token = self.texts[index]
                if token == ".":
                    self.place += 2
                elif token == "[":
                    frames.append(self._open(index, run))
                    run = _Run(self.place)
                    break
                elif token in _RANKS:
                    self.breaks[index] = Break.LINE
                    self.place += 1
                    run.operators.append(index)
                    run.starts.append(self.place)
                    break
                elif not frames:
                    self._chains(run, levels)
                    return self.texts[index - 1] == ")" and not run.operators
                elif self._ends(frames[-1], run, levels if len(frames) == 1 else 1):
                    run = frames.pop().around
                else:
                    run = _Run(self.place)
                    break

    def _operand(self, run: _Run) -> _Frame | None:
        """Walk over an operand, up to what follows a name; the frame that it opens, if it does."""
        texts = self.texts
        while texts[self.place] in ("!", "-") or is_negation(texts, self.kinds, self.place):
            self.place += 1
            self.tight[self.place] = texts[self.place - 1] != NOT
        index = self.place
        token = texts[index]
        if token == "(":
            return self._open(index, run)
        self.place = index + 1
        if token == "if":
            return _Frame(index, run, is_conditional=True)
        is_function = token[0] != "^" if self.kinds[index] == _NAME else token in _CONVERSIONS
        if not is_function or texts[index + 1] != "(":
            return None
        self.tight[index + 1] = 1
        if texts[index + 2] == ")":
            self.place = index + 3
            return None
        frame = self._open(index + 1, run)
        if token in ("any", "all") and texts[index + 3] == "in":
            # The array is a run like another; the colon behind it ends that.
            self.place += 2
        return frame

    def _open(self, opening: int, around: _Run) -> _Frame:
        self.place = opening + 1
        self.breaks[self.place] = Break.LINE
        return _Frame(opening, around)

    def _ends(self, frame: _Frame, run: _Run, levels: int) -> bool:
        """Return True if the innermost frame ends behind this run of it; else another run of it begins.

        Args:
            frame: The frame.
            run: The run of it that was read last.
            levels: Number of levels by which the lines of what is around the frame are indented deeper.
        """
        index = self.place
        frame.parts += 1
        if frame.is_conditional:
            self._chains(run, 1)
            if frame.parts < 3:
                self.breaks[index] = Break.LINE
                self.place = index + 1
                return False
            self.groups.append(Group(frame.opening, index - 1, 1 if frame.around.operators else levels))
            return True
        is_last = self.texts[index] in (")", "]")
        self._chains(run, 0 if is_last and frame.parts == 1 else 1)
        self.place = index + 1
        if not is_last:
            if self.texts[index] != "..":
                self.breaks[index + 1] = Break.LINE
            return False
        self._close(frame.opening, index)
        return True

    def _close(self, opening: int, closing: int) -> None:
        """The group of a bracket; one around a single token has no breaks."""
        if closing - opening > 2:
            self.breaks[closing] = Break.CLOSE
            self.groups.append(Group(opening, closing, 1, is_bracket=True))
        else:
            self.breaks[opening + 1] = Break.NONE

    def _chains(self, run: _Run, levels: int) -> None:
        """The groups of a run that has ended: a chain for each stretch of operators that bind equally tightly."""
        if not run.operators:
            return
        last = self.place - 1
        open_chains: list[tuple[int, int]] = []
        for start, operator in zip(run.starts, run.operators, strict=False):
            rank = _RANKS[self.texts[operator]]
            while open_chains and open_chains[-1][0] > rank:
                start = open_chains.pop()[1]
                self.groups.append(Group(start, operator - 1, 1))
            if not open_chains or open_chains[-1][0] < rank:
                open_chains.append((rank, start))
        while open_chains:
            start = open_chains.pop()[1]
            self.groups.append(Group(start, last, 1 if open_chains else levels))

    def braces(self, entry: Callable[[], None], separator: str = "") -> None:
        """Walk over entries in braces that stand on one line if they fit."""
        opening = self.place
        self.place += 1
        while self.texts[self.place] != "}":
            self.breaks[self.place] = Break.ENTRY
            entry()
            if self.texts[self.place] == separator:
                self.place += 1
        if self.place > opening + 1:
            self.breaks[self.place] = Break.CLOSE
            self.groups.append(Group(opening, self.place, 1, is_bracket=True))
        self.place += 1

    def provided(self) -> None:
        """Walk over an object value, an expression, or ranges as limits have them."""
        if self.texts[self.place] != "{":
            self.expression()
            if self.texts[self.place] == "..":
                self.place += 1
                self.expression(1)
            return
        openings: list[int] = []
        while True:
            if self.texts[self.place] == "{":
                openings.append(self.place)
                self.place += 1
            else:
                self.expression(1)
                if self.texts[self.place] == "..":
                    self.place += 1
                    self.expression(1)
            while openings and self.texts[self.place] == "}":
                opening = openings.pop()
                if self.place > opening + 1:
                    self.breaks[self.place] = Break.CLOSE
                    self.groups.append(Group(opening, self.place, 1, is_bracket=True))
                self.place += 1
            if not openings:
                return
            if self.texts[self.place] == ",":
                self.place += 1
            # A name and its colon.
            self.breaks[self.place] = Break.ENTRY
            self.place += 2


class _Walker(_Expressions):
    """Walks over definitions."""

    def __init__(self, tokens: Tokens, tree: syntax.File) -> None:
        super().__init__(tokens)
        self.statements: list[Statement] = []
        requirements = (item for item in tree.items if isinstance(item, syntax.Requirement | syntax.Invariant))
        self._are_invariants = (isinstance(item, syntax.Invariant) for item in requirements)
        self._aims = (item for item in tree.items if isinstance(item, syntax.Goal | syntax.Assumption))
        # The words are those of the parser, whose table has what reads a statement; here is what lays it out.
        self._items: Mapping[str, Callable[[int], None]] = {
            "component": self._component,
            "datatype": self._data_type,
            "interface": self._interface,
            "constant": self._constant,
            "requirement": self._requirement,
            "provide": self._provide,
            "limit": self._provide,
            "goal": self._aim,
            "assume": self._aim,
            "mission": self._mission,
            "prefer": self._preference,
            "incoming": self._communication,
            "outgoing": self._communication,
            "service": self._communication,
            "action": self._communication,
            "behaviour": self._body,
            "variable": self._variable,
            "initial": self._body,
            "marked": self._body,
            "state": self._body,
            "on": self._on,
            "transition": self._tau,
        }

    def file(self) -> None:
        """Walk over a robot or library."""
        self._body(0)

    def _end(self, first: int, level: int) -> None:
        """End a statement before the next token."""
        self.statements.append(Statement(first, self.place - 1, level, tuple(self.groups)))
        self.groups.clear()

    def _body(self, level: int, entry: Callable[[int], None] | None = None) -> None:
        """A head of any words, and what stands in its braces: entries of one kind, or items known by their words."""
        self._rest_of_body(self.place, level, entry)

    def _rest_of_body(self, first: int, level: int, entry: Callable[[int], None] | None) -> None:
        """The same behind a part of the head, which began at token `first`."""
        while self.texts[self.place] != "{":
            self.place += 1
        self.place += 1
        self._end(first, level)
        while self.texts[self.place] != "}":
            parser = entry or self._items[self.texts[self.place]]
            parser(level + 1)
        first = self.place
        self.place += 1
        self._end(first, level)

    def _component(self, level: int) -> None:
        if self.texts[self.place + 2] != "from":
            self._body(level)
            return
        first = self.place
        self.place += 6
        self._end(first, level)

    def _interface(self, level: int) -> None:
        first = self.place
        self.place += 6
        self._end(first, level)

    def _constant(self, level: int) -> None:
        first = self.place
        self.place += 3
        self.type()
        self.place += 1
        self.expression()
        self._end(first, level)

    def _data_type(self, level: int) -> None:
        first = self.place
        if self.texts[first + 1] == "enum":
            self.place += 4
            self.type()
            self._rest_of_body(first, level, self._rule)
            return
        self.place += 3
        self.braces(self._property)
        self._end(first, level)

    def _property(self) -> None:
        self.place += 2
        self.type()

    def _rule(self, level: int) -> None:
        first = self.place
        is_bracket = False
        if self.texts[first] == "default":
            self.place += 1
        else:
            is_bracket = self.expression()
        arrow = self.place
        self.place += 2
        self._clause(arrow, is_alone=is_bracket)
        self._end(first, level)

    def _clause(self, first: int, *, is_alone: bool) -> None:
        """Take the end of a statement that may stand on a line of its own.

        Args:
            first: Its first token.
            is_alone: True if it can stay behind what comes before although that is broken.
        """
        self.breaks[first] = Break.LINE
        if is_alone:
            self.groups.append(Group(first, self.place - 1, 0, is_clause=True))

    def _communication(self, level: int) -> None:
        first = self.place
        self.place += 3 if self.texts[first + 1] == "message" else 2
        while True:
            # Behind `with` or a comma.
            self.place += 1
            self.breaks[self.place] = Break.LINE
            key = self.texts[self.place]
            self.place += 2
            if key in _TYPE_KEYS:
                self.type()
            elif key == "when" and self.texts[self.place] != "default":
                self.expression(1)
            else:
                self.number()
            if self.texts[self.place] != ",":
                break
        if self.texts[self.place] == "links":
            self.breaks[self.place] = Break.LINE
            self.place += 2
        self._end(first, level)

    def _variable(self, level: int) -> None:
        first = self.place
        self.place += 3
        self.type()
        if self.texts[self.place] == "=":
            self.place += 1
            self.expression()
        self._end(first, level)

    def _on(self, level: int) -> None:
        first = self.place
        self.place += 4
        if self.texts[self.place] == "do":
            while self.texts[self.place] in ("do", ","):
                self.place += 1
                self.breaks[self.place] = Break.LINE
                self.expression()
                self.place += 1
                self.expression(1)
        self._goto()
        self._end(first, level)

    def _tau(self, level: int) -> None:
        first = self.place
        self.place += 1
        if self.texts[self.place] == "if":
            self.breaks[self.place] = Break.LINE
            self.place += 1
            self.expression(1)
        self._goto()
        self._end(first, level)

    def _goto(self) -> None:
        if self.texts[self.place] == "goto":
            self.breaks[self.place] = Break.LINE
            self.place += 2

    def _requirement(self, level: int) -> None:
        first = self.place
        self.place += 1
        if next(self._are_invariants):
            self.place += 1
            self.expression()
        elif self.texts[self.place] == "{" or self.texts[self.place + 1] == "needs":
            self._communications()
            self.place += 1
            self.expression()
        else:
            is_bracket = self.expression()
            disables = self.place
            self.place += 1
            self._communications()
            self._clause(disables, is_alone=is_bracket)
        self._end(first, level)

    def _aim(self, level: int) -> None:
        first = self.place
        tree = next(self._aims)
        self.place += 2 if isinstance(tree, syntax.Assumption) and tree.is_allowed else 1
        if tree.trigger is None:
            self.place += len(tree.form.split())
            self.expression()
        else:
            is_bracket = self.expression()
            leads = self.place
            self.place += 2
            self.expression(1)
            self._clause(leads, is_alone=is_bracket)
        self._end(first, level)

    def _mission(self, level: int) -> None:
        first = self.place
        self.place += 2
        if self.texts[self.place] == "while":
            self.breaks[self.place] = Break.LINE
            self.place += 1
            self.expression(1)
        self._rest_of_body(first, level, self._visits)

    def _visits(self, level: int) -> None:
        """The visits of a mission, or one of its detours."""
        first = self.place
        if self.texts[first] == "on":
            self.place += 1
            self.expression(1)
            self.place += 2
            self.breaks[self.place] = Break.LINE
        while self.texts[self.place] in ("visit", "then"):
            self.place += 1
            self.expression(1)
            if self.texts[self.place] == "then":
                self.breaks[self.place] = Break.LINE
        self._end(first, level)

    def _preference(self, level: int) -> None:
        first = self.place
        self.place += 1
        is_bracket = self.texts[self.place] == "{"
        self._communications()
        over = self.place
        self.place += 1
        self._communications()
        self._clause(over, is_alone=is_bracket)
        self._end(first, level)

    def _communications(self) -> None:
        if self.texts[self.place] == "{":
            self.braces(self._name, ",")
        else:
            self.place += 1

    def _name(self) -> None:
        self.place += 1

    def _provide(self, level: int) -> None:
        first = self.place
        self.place += 3
        self.provided()
        clause = self.place
        if self.texts[clause] == "if":
            self.place += 1
            self.expression(1)
            self._clause(clause, is_alone=True)
        self._end(first, level)
