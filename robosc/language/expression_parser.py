"""Expressions and types, read from tokens."""

from itertools import pairwise
from typing import NamedTuple

from robosc.language import precedence, syntax
from robosc.language.advice import is_foreign_operator, type_elsewhere
from robosc.language.cursor import Cursor, Fault, TooManyFaults
from robosc.language.limits import MAXIMUM_NESTING
from robosc.language.negation import NOT, is_negation
from robosc.language.tokens import Kind
from robosc.language.words import FOREIGN_TYPES, unescape

_OPERATORS = frozenset().union(*precedence.LEVELS) | {"=>"}
_BASIC_TYPES = {str(name): name for name in syntax.BasicTypeName}
_CONVERSIONS = ("integer", "double")
_QUANTIFIERS = ("any", "all")
_NEGATIONS_ELSEWHERE = ("Not", "NOT")
_NAME, _NUMBER, _STRING, _END = int(Kind.NAME), int(Kind.NUMBER), int(Kind.STRING), int(Kind.END)


class _Group(NamedTuple):
    """Content of one pair of parentheses, as far as it has been read."""

    opening: int
    operands: list[syntax.Expression]
    operators: list[precedence.Operator]
    signs: list[precedence.Operator]


class ExpressionParser(Cursor):
    """Reads expressions and types."""

    def expression(self) -> syntax.Expression:
        """An expression, the whole of it."""
        begin = self.place
        tree = self._run()
        return self._too_deep(begin) if self._is_deep(tree, begin) else tree

    def require_shallow(self, tree: syntax.Expression, begin: int) -> None:
        """Raise the fault that a tree from token `begin` on has too many levels, if it has."""
        if self._is_deep(tree, begin):
            self._too_deep(begin)
            raise self.reported_fault()

    def _is_deep(self, tree: syntax.Expression, begin: int) -> bool:
        # Fewer tokens than levels that are allowed cannot nest too deeply.
        return self.place - begin > MAXIMUM_NESTING and precedence.depth_of(tree) > MAXIMUM_NESTING

    def _too_deep(self, begin: int) -> syntax.Literal:
        """Report the expression from token `begin` on; what stands for it."""
        message = f"the expression has more than {MAXIMUM_NESTING} levels"
        self.report("nesting-too-deep", message, self.since(begin), "Split the expression.")
        return syntax.Literal(False, self.at(begin))

    def begins_expression(self) -> bool:
        """Return True if the next token can begin an expression."""
        index = self.place
        kind, token = self.kinds[index], self.texts[index]
        return kind in (_NAME, _NUMBER, _STRING) or token in _OPERAND_SIGNS

    def begins_with_name(self, ending: str) -> bool:
        """Return True if the next word can only be a name that an expression begins with.

        Args:
            ending: Word that stands behind such an expression; where it does not, the word that comes next is one of
                the language.
        """
        following = self.texts[self.place + 1]
        if following == "-":
            # `always - 1 > x disables m` and `always -x < 1` begin alike: what ends the expression decides.
            return self._is_ended_by(ending)
        return following in _AFTER_NAME or self._is_ending(self.place + 1, ending)

    def _is_ending(self, index: int, ending: str) -> bool:
        """Return True if an expression ends at a token, because of the word there; `leads` is one with `to` alone."""
        return self.texts[index] == ending and (ending != "leads" or self.texts[index + 1] == "to")

    def _is_ended_by(self, ending: str) -> bool:
        """Return True if the next word is the begin of an expression with `ending` behind it; reads nothing."""
        begin, found, possible, faults = self.place, len(self.diagnostics), self._possible, self._faults
        try:
            self.expression()
            return self._is_ending(self.place, ending)
        except (Fault, TooManyFaults):
            return False
        finally:
            self.place, self._possible, self._depth, self._faults = begin, possible, len(self._lists), faults
            del self.diagnostics[found:]

    def is_negation(self, index: int) -> bool:
        """Return True if the word `not`, at a token where an operand begins, is the operator, not a name."""
        if self.kinds[index + 1] == _END:
            self.possible("an expression", ahead=1)
        return is_negation(self.texts, self.kinds, index)

    def _run(self) -> syntax.Expression:
        """Operands and operators in turns; parentheses are matched with a stack, so their depth costs no recursion."""
        texts = self.texts
        begin = self.place
        outer: list[_Group] = []
        group = _Group(-1, [], [], [])
        while True:
            index = self.place
            token = texts[index]
            if token in ("!", "-") or (token == NOT and self.is_negation(index)):
                group.signs.append(("-" if token == "-" else "!", self.at(index)))
                self.place = index + 1
                continue
            if token == "(":
                self.deeper(index)
                outer.append(group)
                group = _Group(index, [], [], [])
                self.place = index + 1
                continue
            if token in _NEGATIONS_ELSEWHERE and is_negation(texts, self.kinds, index, word=token):
                raise self.fault("an expression", fix=f"Write 'not' instead of '{token}'.")
            tree = self._primary(is_negative=bool(group.signs) and group.signs[-1][0] == "-")
            group.operands.append(self._signed(group, tree) if group.signs else tree)
            while outer and texts[self.place] == ")":
                self.place += 1
                self.shallower()
                tree = self._tree(group, group.opening)
                group = outer.pop()
                group.operands.append(self._signed(group, tree))
            token = texts[self.place]
            if token in _OPERATORS:
                group.operators.append((token, self.at(self.place)))
                self.place += 1
                continue
            self.possible("an operator")
            if outer:
                self.possible("')'")
                raise self._unclosed(group.opening)
            return self._tree(group, begin)

    def _tree(self, group: _Group, begin: int) -> syntax.Expression:
        try:
            return precedence.build(group.operands, group.operators, self.report)
        except precedence.TooDeepError:
            return self._too_deep(begin)

    def _signed(self, group: "_Group", tree: syntax.Expression) -> syntax.Expression:
        """An operand behind the signs that stand before it."""
        signs = group.signs
        if len(signs) > MAXIMUM_NESTING:
            what = f"more than {MAXIMUM_NESTING} signs stand before one operand"
            self.report("nesting-too-deep", what, signs[0][1], "Remove signs that cancel each other.")
            del signs[1:]
        for (sign, _), (following, place) in pairwise(signs):
            if sign == "-" and following == "!":
                message = "'-' cannot stand before '!' or 'not'; expected a number"
                self.report("syntax-error", message, place, "Remove the '-'.")
        for sign, location in reversed(signs):
            tree = syntax.Unary(sign, tree, location)
        signs.clear()
        return tree

    def _unclosed(self, opening: int) -> Fault:
        if is_foreign_operator(self.texts[self.place]):
            return self.fault("an operator", "')'")
        self.expect("an operator", "')'")
        self.report("syntax-error", "this '(' is never closed", self.at(opening), self._closing(opening))
        return self.reported_fault()

    def _closing(self, opening: int) -> str:
        """Advice on where to close a parenthesis: before the next token, if that is in the same line."""
        token = self.texts[self.place]
        is_here = bool(token) and self.at(self.place).line == self.at(opening).line
        return f"Close it with ')', before '{token}'." if is_here else "Close it with ')'."

    def _primary(self, *, is_negative: bool = False) -> syntax.Expression:
        index = self.place
        kind, token = self.kinds[index], self.texts[index]
        if kind == _NAME:
            return self._call(index) if self.texts[index + 1] == "(" and token[0] != "^" else self.access()
        if kind == _NUMBER:
            self.place = index + 1
            return self._number(index, is_negative=is_negative)
        if kind == _STRING:
            self.place = index + 1
            return syntax.Literal(unescape(token), self.at(index))
        if token in ("true", "false"):
            self.place = index + 1
            return syntax.Literal(token == "true", self.at(index))
        if token == "value":
            return self.access()
        if token == "if":
            return self._conditional()
        if token in _CONVERSIONS and self.texts[index + 1] == "(":
            return self._call(index)
        raise self.fault("an expression")

    def _conditional(self) -> syntax.Conditional:
        index = self.take("if")
        self.deeper(index)
        condition = self._run()
        self.take("then")
        then = self._run()
        self.take("else")
        otherwise = self._run()
        self.shallower()
        return syntax.Conditional(condition, then, otherwise, self.at(index))

    def _call(self, index: int) -> syntax.Expression:
        name = syntax.Name(self.texts[index], self.at(index))
        self.place = index + 1
        opening = self.take("(")
        self.deeper(opening)
        tree: syntax.Expression
        is_quantifier = name.text in _QUANTIFIERS and self.kinds[self.place] == _NAME
        if is_quantifier and self.texts[self.place + 1] == "in":
            variable = self.name()
            self.take("in")
            array = self.access()
            self.take(":")
            tree = syntax.Quantifier(name, variable, array, self._run())
        else:
            arguments = [] if self.texts[self.place] == ")" else [self._run()]
            while arguments and self.takes(","):
                arguments.append(self._run())
            tree = syntax.Call(name, tuple(arguments))
        self.shallower()
        if self.texts[self.place] in (":", "in") and name.text in _QUANTIFIERS:
            message = f"'{name.text}' needs a name for the elements before its array"
            fix = f"Write '{name.text}(x in array: condition)', with a name that is not reserved."
            self.report("syntax-error", message, self.at(self.place), fix)
            raise self.reported_fault()
        if self.texts[self.place] != ")":
            raise self._unclosed(opening)
        self.place += 1
        return tree

    def _number(self, index: int, *, is_negative: bool) -> syntax.Literal:
        token, location = self.texts[index], self.at(index)
        if "." not in token:
            return syntax.Literal(self.whole(index, is_negative=is_negative, begin=index), location)
        value = float(token)
        if value == float("inf"):
            message = "the number does not fit into a double"
            self.report("number-too-large", message, location, "Use a smaller number.")
            value = 0.0
        return syntax.Literal(value, location)

    def access(self) -> syntax.Access:
        """`value` or a name, with what follows it."""
        begin = self.place
        if self.texts[begin] == "value":
            root = None
            self.place += 1
        else:
            root = self.name()
        token = self.texts[self.place]
        if token not in (".", "["):
            return syntax.Access(root, (), self.at(begin) if root is None else root.location)
        steps: list[syntax.Name | syntax.Index | syntax.Slice] = []
        while token in (".", "["):
            if token == ".":
                self.place += 1
                steps.append(self.name())
            else:
                steps.append(self._brackets())
            token = self.texts[self.place]
        return syntax.Access(root, tuple(steps), self.since(begin))

    def _brackets(self) -> syntax.Index | syntax.Slice:
        opening = self.take("[")
        self.deeper(opening)
        low = self._run()
        high = self._run() if self.takes("..") else None
        self.shallower()
        self.take("]")
        location = self.since(opening)
        return syntax.Index(low, location) if high is None else syntax.Slice(low, high, location)

    def initial_value(self) -> syntax.Expression:
        """A literal, perhaps negative, or an access."""
        index = self.place
        if self.texts[index] != "-":
            if self.kinds[index] not in (_NAME, _NUMBER, _STRING) and self.texts[index] not in (
                "true",
                "false",
                "value",
            ):
                raise self.fault("a name", "a number", "'true'", "'false'")
            tree = self._primary() if self.kinds[index] != _NAME else self.access()
            self.require_shallow(tree, index)
            return tree
        sign = self.at(self.take("-"))
        if self.kinds[self.place] != _NUMBER:
            raise self.fault("a number")
        return syntax.Unary("-", self._primary(is_negative=True), sign)

    # Types

    def type(self) -> syntax.Type:
        """A type."""
        openings: list[int] = []
        while self.texts[self.place] == "array":
            openings.append(self.place)
            self.place += 1
            self.take("(")
        self.deeper(openings[0] if openings else self.place, len(openings))
        tree: syntax.Type = self._plain_type()
        for opening in reversed(openings):
            if self.texts[self.place] != ")":
                message = "the '(' of this array is never closed"
                self.expect("')'")
                self.report("syntax-error", message, self.at(opening), self._closing(opening))
                raise self.reported_fault()
            self.place += 1
            tree = syntax.ArrayType(tree, self.since(opening))
        self.shallower(len(openings))
        return tree

    def _no_foreign_type(self, index: int) -> None:
        """Raise the fault that a type is written as in another language or in ROS, if that explains what follows."""
        name, following = self.texts[index], self.texts[index + 1 : index + 4]
        if following[:1] == ["("] and name in FOREIGN_TYPES:
            raise self.fault("a type", fix=f"Write '{FOREIGN_TYPES[name]}' instead of '{name}'.")
        sign = "/" if following[:1] == ["/"] else "::" if following[:2] == [":", ":"] else ""
        parts = self.texts[index : index + len(sign) + 2 : len(sign) + 1]
        if (sign and self.kinds[index + len(sign) + 1] == _NAME) or (sign and parts[-1] == "string"):
            raise self.fault("a type", fix=f"Write '{type_elsewhere(parts)}' instead of '{sign.join(parts)}'.")

    def _plain_type(self) -> syntax.BasicType | syntax.NamedType:
        index = self.place
        if self.kinds[index] == _NAME and self.texts[index + 1] in ("(", "/", ":"):
            self._no_foreign_type(index)
        basic = _BASIC_TYPES.get(self.texts[index])
        if basic is None:
            if self.kinds[index] == _NAME:
                return syntax.NamedType(self.name())
            raise self.fault("a type")
        self.place = index + 1
        if basic is not syntax.BasicTypeName.INTEGER or not self.takes("("):
            return syntax.BasicType(basic, None, None, self.at(index))
        low = self.integer()
        self.take("..")
        high = self.integer()
        self.take(")")
        return syntax.BasicType(basic, low, high, self.since(index))


_AFTER_NAME = frozenset({"needs", ".", "[", "or", "and", "=", "!=", ">", ">=", "<", "<=", "+", "*", "/", "=>", ""})
"""Tokens that follow a name that begins an expression, or a communication's name (`-` is looked at more closely)."""

_OPERAND_SIGNS = frozenset({"(", "!", "-", "true", "false", "value", "if", *_CONVERSIONS})
