"""textX objects to syntax tree: what the grammar found becomes our own values, and textX goes no further."""

import re
from bisect import bisect_right
from typing import Any

from robosc.errors import Diagnostic, Severity
from robosc.language import precedence, syntax
from robosc.language.scan import MAXIMUM_NESTING
from robosc.source import Location, SourceFile

MAXIMUM_NAME = 255
"""Characters that a name may have."""


class Places:
    """Offsets to lines and columns."""

    def __init__(self, file: SourceFile) -> None:
        self._name = file.name
        self._starts = [0, *(match.end() for match in re.finditer("\n", file.text))]
        self._ends = [*(start - 1 for start in self._starts[1:]), len(file.text)]

    def location(self, begin: int, end: int) -> Location:
        """The place from `begin` to `end`, cut at the end of its first line."""
        line = bisect_right(self._starts, begin) - 1
        end = min(end, self._ends[line])
        return Location(self._name, line + 1, begin - self._starts[line] + 1, max(1, end - begin))


def error(code: str, message: str, location: Location, mend: str = "Simplify the text.") -> Diagnostic:
    """An error of a text."""
    return Diagnostic(Severity.ERROR, code, message, location, mend)


class Converter:
    """textX objects to syntax tree; collects what the grammar alone cannot say."""

    def __init__(self, places: Places) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._places = places

    def _at(self, node: Any) -> Location:
        return self._places.location(node._tx_position, node._tx_position_end)

    def _keyword(self, node: Any, word: str) -> Location:
        return self._places.location(node._tx_position, node._tx_position + len(word))

    def _report(self, code: str, message: str, location: Location, mend: str) -> None:
        self.diagnostics.append(error(code, message, location, mend))

    def file(self, root: Any) -> syntax.File:
        """A robot or a library."""
        items = tuple(self._item(item) for item in root.items)
        return syntax.File(_kind(root) == "Library", self._name(root.name), items)

    def _name(self, node: Any) -> syntax.Name:
        text = node.text.removeprefix("^")
        location = self._at(node)
        if len(text) > MAXIMUM_NAME:
            self._report(
                "name-too-long", f"the name has more than {MAXIMUM_NAME} characters", location, "Shorten the name."
            )
        return syntax.Name(text, location)

    def _optional(self, node: Any) -> syntax.Name | None:
        return None if node is None else self._name(node)

    def _item(self, node: Any) -> syntax.Item:
        match _kind(node):
            case "Component":
                return self._component(node)
            case "ObjectType":
                properties = tuple(syntax.Property(self._name(p.name), self._type(p.type)) for p in node.properties)
                return syntax.ObjectDefinition(self._name(node.name), properties)
            case "EnumType":
                rules = tuple(self._rule(rule) for rule in node.rules)
                return syntax.EnumDefinition(self._name(node.name), self._type(node.source), rules)
            case "Interface":
                return syntax.Interface(self._name(node.name), self._name(node.type), self._name(node.package))
            case "Requirement":
                return self._requirement(node)
            case _:
                return self._provide(node)

    def _rule(self, node: Any) -> syntax.EnumRule:
        condition = None if node.condition is None else self._expression(node.condition)
        return syntax.EnumRule(condition, self._name(node.value))

    def _requirement(self, node: Any) -> syntax.Requirement:
        form = node.needs or node.disables
        names = tuple(self._name(name) for name in form.communications.names)
        place = self._keyword(node, "requirement")
        return syntax.Requirement(names, node.needs is None, self._expression(form.expression), place)

    def _provide(self, node: Any) -> syntax.Provide:
        condition = None if node.condition is None else self._expression(node.condition)
        return syntax.Provide(
            self._name(node.communication), self._provided(node.value), condition, self._keyword(node, "provide")
        )

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
            return syntax.Behaviour(
                tuple(self._behaviour_item(item) for item in node.items), self._keyword(node, "behaviour")
            )
        identifier = None if node.identifier is None else self._text(node.identifier.text)
        name, link = self._name(node.name), self._optional(node.link)
        match kind:
            case "Message":
                return syntax.Message(syntax.Direction(node.direction), name, identifier, self._type(node.type), link)
            case "Service":
                return syntax.Service(name, identifier, self._type(node.request), self._type(node.response), link)
            case _:
                request, response = self._type(node.request), self._type(node.response)
                return syntax.Action(name, identifier, request, response, self._type(node.feedback), link)

    def _behaviour_item(self, node: Any) -> syntax.Variable | syntax.State | syntax.Transition:
        match _kind(node):
            case "Variable":
                initial = None if node.initial is None else self._primary(node.initial)
                return syntax.Variable(self._name(node.name), self._type(node.type), initial)
            case "State":
                transitions = tuple(self._transition(item) for item in node.transitions)
                return syntax.State(self._name(node.name), bool(node.initial), bool(node.marked), transitions)
            case _:
                return self._transition(node)

    def _transition(self, node: Any) -> syntax.Transition:
        if _kind(node) == "Tau":
            guard = None if node.guard is None else self._expression(node.guard)
            return syntax.TauTransition(guard, self._optional(node.target), self._keyword(node, "transition"))
        updates = tuple(syntax.Update(self._access(item.target), self._expression(item.value)) for item in node.updates)
        preposition = syntax.Name(node.preposition.text, self._at(node.preposition))
        return syntax.CommunicationTransition(
            node.kind, preposition, self._name(node.communication), updates, self._optional(node.target), self._at(node)
        )

    # Types and expressions

    def _type(self, node: Any) -> syntax.Type:
        tree: syntax.Type = self._plain_type(node)
        for opening in reversed(node.arrays):
            place = self._places.location(opening._tx_position, node._tx_position_end)
            tree = syntax.ArrayType(tree, place)
        for opening in node.arrays[: max(0, len(node.arrays) - len(node.closings))]:
            place = self._keyword(opening, "array")
            self._report("syntax-error", "the '(' of this array is never closed", place, "Close it with ')'.")
        for closing in node.closings[len(node.arrays) :]:
            self._report("syntax-error", "this ')' closes nothing", self._at(closing), "Remove it.")
        return tree

    def _plain_type(self, node: Any) -> syntax.BasicType | syntax.NamedType:
        if node.name is not None:
            return syntax.NamedType(self._name(node.name))
        if node.integer is None:
            return syntax.BasicType(syntax.BasicTypeName(node.basic.word), None, None, self._at(node.basic))
        bounds, place = node.integer, self._at(node.integer)
        if not bounds.low:
            return syntax.BasicType(syntax.BasicTypeName.INTEGER, None, None, place)
        low, high = self._integer(bounds.low, place), self._integer(bounds.high, place)
        return syntax.BasicType(syntax.BasicTypeName.INTEGER, low, high, place)

    def _integer(self, text: str, location: Location) -> int:
        digits = text.lstrip("0") or "0"
        # Compared by length first: turning a million digits into a number would take minutes.
        if len(digits) > 10 or int(digits) > 2**31 - 1:
            self._report(
                "integer-too-large", "the number does not fit into 32 bits", location, "Use a number up to 2147483647."
            )
            return 0
        return int(digits)

    def _text(self, node: Any) -> syntax.Text:
        return syntax.Text(unescape(node.token), self._at(node))

    def _expression(self, node: Any) -> syntax.Expression:
        tree = self._flat(node)
        if precedence.depth_of(tree) > MAXIMUM_NESTING:
            self._report(
                "nesting-too-deep",
                f"the expression has more than {MAXIMUM_NESTING} levels",
                self._at(node),
                "Split the expression.",
            )
        return tree

    def _flat(self, node: Any) -> syntax.Expression:
        builder = precedence.ExpressionBuilder(self._report)
        self._operand(node.first, builder)
        for item in node.rest:
            builder.operator(item.operator, self._keyword(item, item.operator))
            self._operand(item.operand, builder)
        return builder.finish()

    def _operand(self, node: Any, builder: precedence.ExpressionBuilder) -> None:
        for prefix in node.prefixes:
            builder.prefix(prefix.text, self._at(prefix))
        builder.operand(self._primary(node))
        for closing in node.closings:
            builder.closing(self._at(closing))

    def _primary(self, node: Any) -> syntax.Literal | syntax.Access:
        return self._access(node.access) if node.literal is None else self._literal(node.literal)

    def _literal(self, node: Any) -> syntax.Literal:
        token, location = node.token, self._at(node)
        if token[0] in "\"'":
            return syntax.Literal(unescape(token), location)
        if token in ("true", "false"):
            return syntax.Literal(token == "true", location)
        if "." not in token:
            return syntax.Literal(self._integer(token, location), location)
        value = float(token)
        if value == float("inf"):
            self._report("number-too-large", "the number does not fit into a double", location, "Use a smaller number.")
            value = 0.0
        return syntax.Literal(value, location)

    def _access(self, node: Any) -> syntax.Access:
        root = None if node.root.text == "value" else self._name(node.root)
        steps: list[syntax.Name | syntax.Index] = []
        for step in node.steps:
            if step.name is not None:
                steps.append(self._name(step.name))
            else:
                place = self._at(step)
                steps.append(syntax.Index(self._integer(step.index, place), place))
        return syntax.Access(root, tuple(steps), self._at(node))


def unescape(token: str) -> str:
    """The text of a quoted token; a backslash takes the next character, n and t mean newline and tab."""
    special = {"n": "\n", "t": "\t"}
    return re.sub(r"\\([\s\S])", lambda match: special.get(match.group(1), match.group(1)), token[1:-1])


def _kind(node: Any) -> str:
    return type(node).__name__
