"""A second parser of RoboSC: textX reads a text with the grammar `robosc.tx`, and its objects become our syntax tree.

It is the slow and obvious twin of `robosc.language`, and defines what that must read. It stops at the first syntax
error, and takes no care of deep nesting or of texts that were made to be hostile.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from textx import metamodel_from_str
from textx.exceptions import TextXSyntaxError

from robosc.language import syntax
from robosc.language.limits import MAXIMUM_NAME
from robosc.language.words import RESERVED_WORDS
from robosc.source import Location, SourceFile

GRAMMAR = Path(__file__).with_name("robosc.tx")

_RECURSION = 50_000


@dataclass(frozen=True, slots=True)
class TextFault:
    """Fault of a text: a code of the language's diagnostics, and its place."""

    code: str
    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Parsed:
    """Outcome of parsing a text.

    Attributes:
        tree: The syntax tree, or None where something is wrong.
        faults: All faults of a text that the grammar reads, by place; else the one place where it stops.
        stopped: True if the grammar does not read the text.
    """

    tree: syntax.File | None
    faults: tuple[TextFault, ...]
    stopped: bool


def parse(file: SourceFile, *, has_not: bool = True) -> Parsed:
    """The syntax tree of a file.

    Args:
        file: The file.
        has_not: False for the language as it was before `not` became an operator.
    """
    with _deep_recursion():
        try:
            root = metamodel(has_not=has_not).model_from_str(file.text)
        except TextXSyntaxError as error:
            return Parsed(None, (TextFault("syntax-error", int(error.line), int(error.col)),), True)
        converter = _Converter(file)
        tree = converter.file(root.content)
    faults = tuple(sorted(set(converter.faults), key=lambda found: (found.line, found.column, found.code)))
    return Parsed(None if faults else tree, faults, False)


@cache
def metamodel(*, has_not: bool = True) -> Any:
    """The grammar, ready to read; with or without the operator `not`."""
    grammar = GRAMMAR.read_text(encoding="utf-8").replace("RESERVED", "|".join(sorted(RESERVED_WORDS)))
    grammar = grammar.replace("NOT_WORD", "not(?![A-Za-z_0-9])" if has_not else "(?!)")
    return metamodel_from_str(grammar, autokwd=True, memoization=True, use_regexp_group=False)


@contextmanager
def _deep_recursion() -> Iterator[None]:
    """A rule a level costs some fifty calls for every pair of parentheses."""
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, _RECURSION))
    try:
        yield
    finally:
        sys.setrecursionlimit(limit)


class _Converter:
    """textX objects to syntax tree; collects what the grammar alone does not say."""

    def __init__(self, file: SourceFile) -> None:
        self.faults: list[TextFault] = []
        self._file = file

    # Places

    def _location(self, begin: int, end: int) -> Location:
        """The place of a stretch of text, cut at the end of its first line."""
        before, written = self._file.text[:begin], self._file.text[begin:end]
        line, column = before.count("\n") + 1, begin - (before.rfind("\n") + 1) + 1
        return Location(self._file.name, line, column, len(written.split("\n")[0]))

    def _at(self, node: Any) -> Location:
        return self._location(node._tx_position, node._tx_position_end)

    def _first(self, node: Any, word: str) -> Location:
        """The place of the word that an object begins with."""
        return self._location(node._tx_position, node._tx_position + len(word))

    def _report(self, code: str, location: Location) -> None:
        self.faults.append(TextFault(code, location.line, location.column))

    # Definitions

    def file(self, root: Any) -> syntax.File:
        """A robot or a library."""
        items = tuple(self._item(item) for item in root.items)
        return syntax.File(_kind(root) == "Library", self._name(root.name), items)

    def _name(self, node: Any) -> syntax.Name:
        name = node.text.removeprefix("^")
        if len(name) > MAXIMUM_NAME:
            self._report("name-too-long", self._at(node))
        return syntax.Name(name, self._at(node))

    def _optional(self, node: Any) -> syntax.Name | None:
        return None if node is None else self._name(node)

    def _condition(self, node: Any) -> syntax.Expression | None:
        return None if node is None else self._expression(node)

    def _item(self, node: Any) -> syntax.Item:
        match _kind(node):
            case "Component":
                return self._component(node)
            case "ObjectType":
                properties = tuple(syntax.Property(self._name(p.name), self._type(p.type)) for p in node.properties)
                return syntax.ObjectDefinition(self._name(node.name), properties)
            case "EnumType":
                rules = tuple(syntax.EnumRule(self._condition(r.condition), self._name(r.value)) for r in node.rules)
                return syntax.EnumDefinition(self._name(node.name), self._type(node.source), rules)
            case "Interface":
                return syntax.Interface(self._name(node.name), self._name(node.type), self._name(node.package))
            case "Constant":
                return syntax.Constant(self._name(node.name), self._type(node.type), self._expression(node.value))
            case "Requirement":
                return self._requirement(node)
            case "Goal":
                place = self._first(node, "goal")
                self._in_robot(node, place)
                return syntax.Goal(*self._aim(node), place)
            case "Assumption":
                place = self._first(node, "assume")
                self._in_robot(node, place)
                return syntax.Assumption(node.allowed is not None, *self._aim(node.allowed or node), place)
            case "Mission":
                place = self._first(node, "mission")
                self._in_robot(node, place)
                detours = tuple(self._detour(detour) for detour in node.detours)
                condition, visits = self._condition(node.condition), self._visits(node.visits)
                return syntax.Mission(self._name(node.name), condition, visits, detours, place)
            case "Preference":
                place = self._first(node, "prefer")
                self._in_robot(node, place)
                preferred, others = (tuple(map(self._name, part.names)) for part in (node.preferred, node.others))
                return syntax.Preference(preferred, others, place)
            case "Limit":
                range_, condition = self._range(node.range), self._condition(node.condition)
                return syntax.Limit(self._name(node.communication), range_, condition, self._first(node, "limit"))
            case _:
                value, condition = self._provided(node.value), self._condition(node.condition)
                return syntax.Provide(self._name(node.communication), value, condition, self._first(node, "provide"))

    def _requirement(self, node: Any) -> syntax.Requirement | syntax.Invariant:
        place = self._first(node, "requirement")
        if node.invariant is not None:
            return syntax.Invariant(node.invariant.word == "never", self._expression(node.invariant.expression), place)
        form = node.needs or node.disables
        names = tuple(self._name(name) for name in form.communications.names)
        return syntax.Requirement(names, node.needs is None, self._expression(form.expression), place)

    def _in_robot(self, node: Any, place: Location) -> None:
        if _kind(node.parent) == "Library":
            self._report("goal-in-library", place)

    def _aim(self, node: Any) -> tuple[syntax.GoalForm, syntax.Expression | None, syntax.Expression]:
        if node.answer is not None:
            return "leads to", self._expression(node.answer.trigger), self._expression(node.answer.condition)
        if node.recurring is not None:
            return "always eventually", None, self._expression(node.recurring.condition)
        return "once", None, self._expression(node.once.condition)

    def _visits(self, node: Any) -> tuple[syntax.Visit, ...]:
        return tuple(syntax.Visit(self._expression(visit.condition), self._at(visit)) for visit in node.visits)

    def _detour(self, node: Any) -> syntax.Detour:
        return syntax.Detour(self._expression(node.trigger), self._visits(node.visits), self._first(node, "on"))

    def _range(self, node: Any) -> syntax.ObjectRange | syntax.Range:
        if node.object is None:
            low, high = self._expression(node.bounds.low), self._expression(node.bounds.high)
            return syntax.Range(low, high, self._at(node.bounds))
        properties = tuple((self._name(item.name), self._range(item.range)) for item in node.object.properties)
        return syntax.ObjectRange(properties, self._at(node.object))

    def _provided(self, node: Any) -> syntax.ObjectValue | syntax.Expression:
        if node.object is None:
            return self._expression(node.expression)
        properties = tuple((self._name(item.name), self._provided(item.value)) for item in node.object.properties)
        return syntax.ObjectValue(properties, self._at(node.object))

    # Components

    def _component(self, node: Any) -> syntax.Component:
        name = self._name(node.name)
        if node.imported is not None:
            source = syntax.Import(self._name(node.imported.library), self._name(node.imported.component))
            return syntax.Component(name, (), source)
        return syntax.Component(name, tuple(self._part(item) for item in node.body.items), None)

    def _part(self, node: Any) -> syntax.Communication | syntax.Behaviour:
        kind = _kind(node)
        if kind == "Behaviour":
            items = tuple(self._behaviour_item(item) for item in node.items)
            return syntax.Behaviour(items, self._first(node, "behaviour"))
        identifier = None if node.identifier is None else self._text(node.identifier.text)
        name, link, options = self._name(node.name), self._optional(node.link), self._options(node.options)
        if kind == "Message":
            direction = syntax.Direction(node.direction)
            return syntax.Message(direction, name, identifier, self._type(node.type), link, options)
        request, response = self._type(node.request), self._type(node.response)
        if kind == "Service":
            return syntax.Service(name, identifier, request, response, link, options)
        return syntax.Action(name, identifier, request, response, self._type(node.feedback), link, options)

    def _options(self, nodes: Any) -> tuple[syntax.Option, ...]:
        found: dict[str, syntax.Option] = {}
        for node in nodes:
            place = self._first(node, node.key)
            if node.key in found:
                self._report("syntax-error", place)
            found[node.key] = syntax.Option(node.key, self._option_value(node), place)
        return tuple(found.values())

    def _option_value(self, node: Any) -> syntax.Name | syntax.Text | syntax.Expression:
        match node.key:
            case "qos":
                return self._name(node.quality)
            case "stamped":
                return self._text(node.text)
            case "when" if node.default is not None:
                return self._name(node.default)
            case "when":
                return self._expression(node.condition)
        number = node.number
        if number.double:
            return syntax.Literal(self._double(number.double, self._at(number)), self._at(number))
        return syntax.Literal(self._signed(number.integer, number), self._at(number))

    def _behaviour_item(self, node: Any) -> syntax.Variable | syntax.State | syntax.Transition:
        match _kind(node):
            case "Variable":
                initial = None if node.initial is None else self._initial(node.initial)
                return syntax.Variable(self._name(node.name), self._type(node.type), initial)
            case "State":
                transitions = tuple(self._transition(item) for item in node.transitions)
                return syntax.State(self._name(node.name), bool(node.initial), bool(node.marked), transitions)
            case _:
                return self._transition(node)

    def _initial(self, node: Any) -> syntax.Expression:
        if node.minus is not None:
            return syntax.Unary("-", self._literal(node.number, is_negative=True), self._at(node.minus))
        return self._access(node.access) if node.literal is None else self._literal(node.literal)

    def _transition(self, node: Any) -> syntax.Transition:
        target = self._optional(node.target)
        if _kind(node) == "Tau":
            return syntax.TauTransition(self._condition(node.guard), target, self._first(node, "transition"))
        updates = tuple(syntax.Update(self._access(u.target), self._expression(u.value)) for u in node.updates)
        preposition = syntax.Name(node.preposition.text, self._at(node.preposition))
        communication = self._name(node.communication)
        return syntax.CommunicationTransition(node.kind, preposition, communication, updates, target, self._at(node))

    # Types

    def _type(self, node: Any) -> syntax.Type:
        if node.array is not None:
            return syntax.ArrayType(self._type(node.array.element), self._at(node.array))
        if node.name is not None:
            return syntax.NamedType(self._name(node.name))
        if node.basic is not None:
            return syntax.BasicType(syntax.BasicTypeName(node.basic.word), None, None, self._at(node.basic))
        low, high = (
            None if bound is None else self._signed(bound.digits, bound)
            for bound in (node.integer.low, node.integer.high)
        )
        return syntax.BasicType(syntax.BasicTypeName.INTEGER, low, high, self._at(node.integer))

    # Expressions

    def _expression(self, node: Any) -> syntax.Expression:
        tree, operators = self._level(node.tree)
        implications = [place for text, place in operators if text == "=>"]
        if implications and len(operators) > 1:
            self._report("ambiguous-implication", min(implications))
        return tree

    def _level(self, node: Any) -> tuple[syntax.Expression, list[tuple[str, Location]]]:
        """The tree of one level, and the binary operators in it that no parentheses enclose."""
        if _kind(node) in ("Not", "Negation"):
            return self._unary(node), []
        tree, operators = self._level(node.first)
        for item in node.rest:
            place = self._first(item, item.operator)
            operand, more = self._level(item.operand)
            tree = syntax.Binary(item.operator, tree, operand, place)
            operators += [(item.operator, place), *more]
        return tree, operators

    def _unary(self, node: Any) -> syntax.Expression:
        if node.operator:
            sign = "!" if node.operator == "not" else node.operator
            return syntax.Unary(sign, self._unary(node.operand), self._first(node, node.operator))
        if _kind(node) == "Not":
            return self._unary(node.negation)
        return self._primary(node.primary, is_negative=_kind(node.parent) == "Negation")

    def _primary(self, node: Any, *, is_negative: bool) -> syntax.Expression:
        if node.group is not None:
            return self._expression(node.group)
        if node.literal is not None:
            return self._literal(node.literal, is_negative=is_negative)
        if node.access is not None:
            return self._access(node.access)
        if node.call is not None:
            function = syntax.Name(node.call.function.text, self._at(node.call.function))
            return syntax.Call(function, tuple(self._expression(item) for item in node.call.arguments))
        if node.quantifier is not None:
            parts = node.quantifier
            word, variable = self._name(parts.word), self._name(parts.variable)
            return syntax.Quantifier(word, variable, self._access(parts.array), self._expression(parts.condition))
        parts = node.conditional
        return syntax.Conditional(
            self._expression(parts.condition),
            self._expression(parts.then),
            self._expression(parts.otherwise),
            self._first(parts, "if"),
        )

    def _access(self, node: Any) -> syntax.Access:
        root = None if node.root.text == "value" else self._name(node.root)
        return syntax.Access(root, tuple(self._step(step) for step in node.steps), self._at(node))

    def _step(self, node: Any) -> syntax.Name | syntax.Index | syntax.Slice:
        if node.name is not None:
            return self._name(node.name)
        low = self._expression(node.low)
        if node.high is None:
            return syntax.Index(low, self._at(node))
        return syntax.Slice(low, self._expression(node.high), self._at(node))

    # Literals

    def _text(self, node: Any) -> syntax.Text:
        return syntax.Text(_unescaped(node.token), self._at(node))

    def _literal(self, node: Any, *, is_negative: bool = False) -> syntax.Literal:
        token, place = str(node.token), self._at(node)
        if token[0] in "\"'":
            return syntax.Literal(_unescaped(token), place)
        if token in ("true", "false"):
            return syntax.Literal(token == "true", place)
        if "." in token:
            return syntax.Literal(self._double(token, place), place)
        return syntax.Literal(self._integer(token, place, is_negative=is_negative), place)

    def _signed(self, digits: str, node: Any) -> int:
        value = self._integer(digits, self._at(node), is_negative=node.minus)
        return -value if node.minus else value

    def _integer(self, digits: str, place: Location, *, is_negative: bool) -> int:
        if int(digits) > 2**31 - (0 if is_negative else 1):
            self._report("integer-too-large", place)
        return int(digits)

    def _double(self, token: str, place: Location) -> float:
        if float(token) == float("inf"):
            self._report("number-too-large", place)
        return float(token)


def _kind(node: Any) -> str:
    return type(node).__name__


def _unescaped(token: str) -> str:
    """The text of a quoted token: a backslash takes the next character, n and t mean newline and tab."""
    characters = iter(token[1:-1])
    text = ""
    for character in characters:
        if character == "\\":
            following = next(characters)
            text += {"n": "\n", "t": "\t"}.get(following, following)
        else:
            text += character
    return text
