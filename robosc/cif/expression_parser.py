"""Expressions and types of CIF, read by recursive descent with the precedence of the language."""

from math import isinf

from robosc.cif import syntax
from robosc.cif.cursor import Cursor
from robosc.cif.reserved_words import FUNCTIONS
from robosc.cif.tokens import Kind
from robosc.source import Location

_LEVELS: tuple[frozenset[str], ...] = (
    frozenset({"or"}),
    frozenset({"and"}),
    frozenset({"<", "<=", "=", "!=", ">=", ">", "in", "sub"}),
    frozenset({"+", "-"}),
    frozenset({"*", "/", "div", "mod"}),
)
"""Operators that associate to the left, the loosest first."""

_LEVEL_OF = {operator: level for level, operators in enumerate(_LEVELS) for operator in operators}
_NAME, _REAL, _INTEGER, _STRING = (int(kind) for kind in (Kind.NAME, Kind.REAL, Kind.INTEGER, Kind.STRING))
_LONGEST_CHAIN = 100
"""Operators in a row of arithmetic or comparison; those of logic may be any number: they are joined like a tree."""


class ExpressionParser(Cursor):
    """Parser of expressions and types."""

    def expressions(self) -> tuple[syntax.Expression, ...]:
        """Read expressions with commas between them, at least one."""
        found = [self.expression()]
        while self.takes(","):
            found.append(self.expression())
        return tuple(found)

    def expressions_up_to(self, closing: str) -> tuple[syntax.Expression, ...]:
        """Read any number of expressions and what closes them."""
        if self.takes(closing):
            return ()
        found = self.expressions()
        self.take(closing)
        return found

    def expression(self) -> syntax.Expression:
        """Read an expression."""
        self.deeper()
        left = self._binary(0)
        operator = self.texts[self.place]
        if operator in ("=>", "<=>"):
            at = self.here
            self.place += 1
            left = syntax.Binary(operator, left, self._binary(0), at)
            if self.texts[self.place] in ("=>", "<=>"):
                raise self.fault("the end of the expression", "Put one of the two in brackets: they do not chain.")
        self.shallower()
        return left

    def _binary(self, level: int) -> syntax.Expression:
        left = self._unary()
        while True:
            found = _LEVEL_OF.get(self.texts[self.place], -1)
            if found < level:
                return left
            left = self._chain(left, found)

    def _chain(self, left: syntax.Expression, level: int) -> syntax.Expression:
        """Read on behind the first operand of operators of one level."""
        operators: list[int] = []
        operands = [left]
        while _LEVEL_OF.get(self.texts[self.place], -1) == level:
            if level > 1 and len(operators) == _LONGEST_CHAIN:
                raise self.fault("brackets or fewer operators", "Split this long expression.")
            operators.append(self.place)
            self.place += 1
            operands.append(self._binary(level + 1) if level + 1 < len(_LEVELS) else self._unary())
        if level < 2:
            return self._balanced(operators, operands)
        for index, right in zip(operators, operands[1:], strict=True):
            left = syntax.Binary(self.texts[index], left, right, self.at(index))
        return left

    def _balanced(self, operators: list[int], operands: list[syntax.Expression]) -> syntax.Expression:
        """Join operands of `and` or of `or`: a tree of them may be as long as a model likes, and stays shallow."""
        if not operators:
            return operands[0]
        middle = len(operators) // 2
        left = self._balanced(operators[:middle], operands[: middle + 1])
        right = self._balanced(operators[middle + 1 :], operands[middle + 1 :])
        index = operators[middle]
        return syntax.Binary(self.texts[index], left, right, self.at(index))

    def _unary(self) -> syntax.Expression:
        word = self.texts[self.place]
        if word not in ("-", "+", "not", "sample"):
            return self._postfix()
        at = self.here
        self.place += 1
        self.deeper()
        operand = self._postfix() if word == "sample" else self._unary()
        self.shallower()
        return syntax.Unary(word, operand, at)

    def _postfix(self) -> syntax.Expression:
        word, at = self.texts[self.place], self.here
        if word in FUNCTIONS:
            self.place += 1
            found: syntax.Expression = syntax.Call(word, self._arguments(), at)
        else:
            found = self._atom()
        length = 0
        while self.texts[self.place] in ("[", "("):
            length += 1
            if length > _LONGEST_CHAIN:
                raise self.fault("fewer brackets in a row", "Split this long expression.")
            found = syntax.Call(found, self._arguments(), at) if self.sees("(") else self._bracket(found, at)
        return found

    def _arguments(self) -> tuple[syntax.Expression, ...]:
        self.take("(")
        return self.expressions_up_to(")")

    def _bracket(self, base: syntax.Expression, at: Location) -> syntax.Expression:
        """Read an index or a slice."""
        self.take("[")
        low = None if self.sees(":") else self.expression()
        if self.takes(":"):
            high = None if self.sees("]") else self.expression()
            self.take("]")
            return syntax.Slice(base, low, high, at)
        self.take("]")
        assert low is not None  # noqa: S101 - without a colon there was an expression
        return syntax.Index(base, low, at)

    def _atom(self) -> syntax.Expression:
        kind, word, at = self.kinds[self.place], self.texts[self.place], self.here
        if kind == _NAME:
            name = self.name()
            return syntax.Special("'", name, at) if self.takes("'") else name
        if kind == _INTEGER:
            return syntax.Literal(self.integer(), at)
        if kind == _REAL:
            self.place += 1
            value = float(word)
            if isinf(value):
                self.report("the number is larger than real numbers can be", at, "Use a number below 1.8e308.")
            return syntax.Literal(value, at)
        if kind == _STRING:
            return syntax.Literal(self.string(), at)
        match word:
            case "true" | "false":
                self.place += 1
                return syntax.Literal(word == "true", at)
            case "time" | "?" | "self":
                self.place += 1
                return syntax.Special(word, None, at)
            case "(":
                self.place += 1
                items = self.expressions_up_to(")") if not self.sees(")") else ()
                if not items:
                    raise self.fault("an expression")
                return items[0] if len(items) == 1 else syntax.Group("tuple", items, at)
            case "[":
                self.place += 1
                return syntax.Group("list", self.expressions_up_to("]"), at)
            case "{":
                self.place += 1
                return self._braces(at)
            case "<":
                return self._cast(at)
            case "if":
                return self._if(at)
            case "switch":
                return self._switch(at)
        raise self.fault("an expression")

    def _braces(self, at: Location) -> syntax.Expression:
        """Read a set or a dictionary behind its brace."""
        if self.takes("}"):
            return syntax.Group("set", (), at)
        items = [self.expression()]
        is_dictionary = self.sees(":")
        if is_dictionary:
            self.take(":")
            items.append(self.expression())
        while self.takes(","):
            items.append(self.expression())
            if is_dictionary:
                self.take(":")
                items.append(self.expression())
        self.take("}")
        return syntax.Group("dict" if is_dictionary else "set", tuple(items), at)

    def _cast(self, at: Location) -> syntax.Expression:
        self.take("<")
        type_ = self.type()
        self.take(">")
        self.deeper()
        operand = self._atom()
        self.shallower()
        return syntax.Cast(type_, operand, at)

    def _if(self, at: Location) -> syntax.Expression:
        self.take("if")
        branches = [self._branch()]
        while self.takes("elif"):
            branches.append(self._branch())
        if len(branches) > _LONGEST_CHAIN:
            raise self.fault("fewer branches", "Split this long expression, or use a switch.")
        self.take("else")
        otherwise = self.expression()
        self.take("end")
        return syntax.If(tuple(branches), otherwise, at)

    def _branch(self) -> tuple[tuple[syntax.Expression, ...], syntax.Expression]:
        guards = self.expressions()
        self.take(":")
        return guards, self.expression()

    def _switch(self, at: Location) -> syntax.Expression:
        self.take("switch")
        subject = self.expression()
        self.take(":")
        cases = []
        while self.takes("case"):
            key = self.expression()
            self.take(":")
            cases.append((key, self.expression()))
        otherwise = self.expression() if self.takes("else") else None
        if not cases and otherwise is None:
            raise self.fault("'case' or 'else'")
        self.take("end")
        return syntax.Switch(subject, tuple(cases), otherwise, at)

    # Types

    def type(self) -> syntax.Type:
        """Read a type."""
        self.deeper()
        found = self._type()
        self.shallower()
        return found

    def _type(self) -> syntax.Type:
        at, word = self.here, self.texts[self.place]
        if self.kinds[self.place] == _NAME:
            return syntax.Type("name", at, name=self.name())
        if word not in ("bool", "int", "real", "string", "list", "set", "dict", "tuple", "func", "dist"):
            raise self.fault("a type")
        self.place += 1
        match word:
            case "int":
                bounds = self._bounds(needs_two=True) if self.sees("[") else ()
                return syntax.Type("int", at, bounds)
            case "list":
                bounds = self._bounds(needs_two=False) if self.sees("[") else ()
                return syntax.Type("list", at, bounds, (self.type(),))
            case "set" | "dist":
                return syntax.Type(word, at, parts=(self.type(),))
            case "dict":
                self.take("(")
                key = self.type()
                self.take(":")
                value = self.type()
                self.take(")")
                return syntax.Type("dict", at, parts=(key, value))
            case "tuple":
                return self._tuple(at)
            case "func":
                parts = [self.type()]
                self.take("(")
                if not self.takes(")"):
                    parts.append(self.type())
                    while self.takes(","):
                        parts.append(self.type())
                    self.take(")")
                return syntax.Type("func", at, parts=tuple(parts))
        return syntax.Type(word, at)

    def _bounds(self, *, needs_two: bool) -> tuple[syntax.Expression, ...]:
        self.take("[")
        bounds = [self.expression()]
        if needs_two or self.sees(".."):
            self.take("..")
            bounds.append(self.expression())
        self.take("]")
        return tuple(bounds)

    def _tuple(self, at: Location) -> syntax.Type:
        self.take("(")
        parts: list[syntax.Type] = []
        fields: list[syntax.Identifier] = []
        while True:
            type_ = self.type()
            for name in self.identifiers():
                parts.append(type_)
                fields.append(name)
            if not self.takes(";"):
                break
        self.take(")")
        return syntax.Type("tuple", at, parts=tuple(parts), fields=tuple(fields))

    def identifiers(self) -> tuple[syntax.Identifier, ...]:
        """Read names of what is declared, with commas between them."""
        found = [self.identifier()]
        while self.takes(","):
            found.append(self.identifier())
        return tuple(found)

    def names(self) -> tuple[syntax.Name, ...]:
        """Read references, with commas between them."""
        found = [self.name()]
        while self.takes(","):
            found.append(self.name())
        return tuple(found)
