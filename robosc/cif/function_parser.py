"""Functions that a user defines, annotations and addresses, read by recursive descent."""

from robosc.cif import syntax
from robosc.cif.cursor import Fault, Stop
from robosc.cif.expression_parser import ExpressionParser
from robosc.cif.tokens import Kind

_NAME, _ANNOTATION = int(Kind.NAME), int(Kind.ANNOTATION)

Variables = list[tuple[syntax.Identifier, syntax.Type, syntax.Expression | None]]
Statements = tuple[syntax.Statement, ...]


class FunctionParser(ExpressionParser):
    """Parser of functions."""

    def annotations(self, sign: str) -> None:
        """Read annotations and leave them aside."""
        while self.kinds[self.place] == _ANNOTATION:
            if self.texts[self.place].startswith("@@") != (sign == "@@"):
                # One of the other kind is for the declaration behind it, or means nothing here.
                return
            self.place += 1
            if not self.takes("("):
                continue
            while not self.takes(")"):
                if self.kinds[self.place] == _NAME and self.texts[self.place + 1] == ":":
                    self.place += 2
                self.expression()
                if not self.takes(","):
                    self.take(")")
                    break

    def address(self) -> syntax.Expression:
        """Read what is assigned: a name, an index of one, or several in brackets."""
        at = self.here
        if self.takes("("):
            self.deeper()
            items = [self.address()]
            self.take(",")
            items.append(self.address())
            while self.takes(","):
                items.append(self.address())
            self.take(")")
            self.shallower()
            return syntax.Group("tuple", tuple(items), at)
        found: syntax.Expression = self.name()
        while self.takes("["):
            found = syntax.Index(found, self.expression(), at)
            self.take("]")
        return found

    def function(self) -> syntax.Function:
        """Read a function."""
        try:
            self.take("func")
            results = [self.type()]
            while self.takes(","):
                results.append(self.type())
            name = self.identifier()
            self.take("(")
            parameters: list[tuple[syntax.Identifier, syntax.Type]] = []
            if not self.takes(")"):
                while True:
                    self.annotations("@")
                    type_ = self.type()
                    parameters += [(parameter, type_) for parameter in self.identifiers()]
                    if not self.takes(";"):
                        break
                self.take(")")
            self.take(":")
            variables, statements = self._function_body()
        except Fault:
            raise Stop from None
        return syntax.Function(name, tuple(results), tuple(parameters), tuple(variables), statements)

    def _function_body(self) -> tuple[Variables, Statements]:
        variables: Variables = []
        if self.kinds[self.place] == int(Kind.STRING):
            self.place += 1
            self.take(";")
            return variables, ()
        while not self._is_statement():
            self.annotations("@")
            type_ = self.type()
            while True:
                name = self.identifier()
                variables.append((name, type_, self.expression() if self.takes("=") else None))
                if not self.takes(","):
                    break
            self.take(";")
        statements = self._statements("end")
        self.take("end")
        return variables, statements

    def _is_statement(self) -> bool:
        """Return True if no variable of the function comes next: its name would follow its type."""
        kind, word = self.kinds[self.place], self.texts[self.place]
        if kind == _NAME:
            return self.kinds[self.place + 1] != _NAME
        return word in ("return", "break", "continue", "while", "if", "(")

    def _statements(self, *closing: str) -> Statements:
        found = [self._statement()]
        while self.texts[self.place] not in closing:
            found.append(self._statement())
        return tuple(found)

    def _statement(self) -> syntax.Statement:
        at, word = self.here, self.texts[self.place]
        if self.takes("return"):
            values = self.expressions()
            self.take(";")
            return syntax.Return(_joined(values), at)
        if self.takes("break") or self.takes("continue"):
            self.take(";")
            return syntax.Leave(word, at)
        if word in ("while", "if"):
            return self._block()
        addresses = [self.address()]
        while self.takes(","):
            addresses.append(self.address())
        self.take(":=")
        values = self.expressions()
        self.take(";")
        return syntax.Assignment(_joined(tuple(addresses)), _joined(values), at)

    def _block(self) -> syntax.Statement:
        """Read a statement that holds others."""
        self.deeper()
        at, is_choice = self.here, self.sees("if")
        self.place += 1
        closing = ("elif", "else", "end") if is_choice else ("end",)
        branches = [self._statement_branch(*closing)]
        while is_choice and self.takes("elif"):
            branches.append(self._statement_branch(*closing))
        otherwise = self._statements("end") if is_choice and self.takes("else") else ()
        self.take("end")
        self.shallower()
        return syntax.Block(is_choice, tuple(branches), otherwise, at)

    def _statement_branch(self, *closing: str) -> tuple[tuple[syntax.Expression, ...], Statements]:
        guards = self.expressions()
        self.take(":")
        return guards, self._statements(*closing)


def _joined(items: tuple[syntax.Expression, ...]) -> syntax.Expression:
    """Several addresses or values as a tuple of them, one as it is."""
    return items[0] if len(items) == 1 else syntax.Group("tuple", items, items[0].at)
