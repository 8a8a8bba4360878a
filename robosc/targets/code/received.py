"""Statements that read received data into local variables, and convert it to enums by their rules."""

from abc import ABC, abstractmethod

from robosc.expressions import EnumValue, Type
from robosc.expressions.text import expression_text
from robosc.model.received import Path, path_type
from robosc.model.structure import EnumDefinition, Model
from robosc.targets.code.expression_writer import ExpressionWriter, may_compute
from robosc.targets.code.expressions import TRUE_CODE, Code
from robosc.targets.code.naming import Namer
from robosc.targets.code.statements import Block, Comment, If, Return, Statement, when


class ReceivedReader(ABC):
    """Builds statements that read paths of one received datum; each path is read once.

    Args:
        model: The model, for the types of parts.
        root: Type of the datum.
        namer: Names the local variables; readers whose statements stand in one function share it.
    """

    def __init__(self, model: Model, root: Type, namer: Namer) -> None:
        self._model, self._root, self._namer = model, root, namer
        self._statements: list[Statement] = []
        self._codes: dict[Path, Code] = {}

    @property
    @abstractmethod
    def scope(self) -> ExpressionWriter:
        """Writer of conditions on the datum."""

    @abstractmethod
    def _read(self, path: Path, type_: Type) -> Code:
        """The code of a path of a type; what it needs is added to the statements."""

    @abstractmethod
    def _result(self, value: Code) -> Return:
        """Return an enum's value from its conversion."""

    @abstractmethod
    def _undecided(self, enum: EnumDefinition, test: Code) -> If:
        """Note that the default was taken past an unknown rule, where a test is true."""

    def read(self, path: Path) -> Code:
        """The code of a path; its statements are added on first use."""
        if path not in self._codes:
            self._codes[path] = self._read(path, self.type_at(path))
        return self._codes[path]

    def type_at(self, path: Path) -> Type:
        """The type of a path."""
        return path_type(self._model, self._root, path)

    def take(self) -> list[Statement]:
        """The statements since the last call."""
        found, self._statements = self._statements, []
        return found

    def take_used(self) -> list[Statement]:
        """The same where not all that they read is used."""
        return self.take()

    def local(self, path: Path, suffix: str = "") -> str:
        """Name of a new local variable for something about a path."""
        return self._namer.name("_".join(["value", *map(str, path)]) + suffix)

    def conversion(self, enum: EnumDefinition) -> Block:
        """The statements that make an enum out of the datum: a readable chain of conditions."""
        found: list[Statement] = []
        scope, all_false = self.scope, TRUE_CODE
        for rule in enum.rules:
            fires = scope.truth(rule.condition)
            all_false = scope.both(all_false, scope.falsity(rule.condition))
            # Data that only a later rule needs are not read before that rule's turn.
            found += self.take_used()
            words = f"{expression_text(rule.condition)} -> {rule.value}"
            found += [Comment(words), when(fires, self._result(scope.value(EnumValue(enum.name, rule.value))))]
        found.append(Comment(f"default -> {enum.default}"))
        if may_compute(rule.condition for rule in enum.rules):
            found.append(self._undecided(enum, all_false))
        return [*found, self._result(scope.value(EnumValue(enum.name, enum.default)))]
