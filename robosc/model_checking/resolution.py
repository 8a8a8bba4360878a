"""Conversion of parsed properties to formulas: the language's own checker binds names and checks types.

A property can use the names of a robot's requirements, except constants, which a checked model does not contain. It can
also use services and actions, with the locations of their plants.
"""

from collections.abc import Iterator, Mapping, Sequence

from robosc.automata.plants import communication_plant
from robosc.errors import Diagnostic, LanguageError, sorted_diagnostics
from robosc.expressions import FALSE, EnumType
from robosc.language import syntax
from robosc.language.limits import MAXIMUM_SYNTAX_ERRORS
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.scope import ComponentNames, Scope
from robosc.model.structure import CommunicationKind, Model
from robosc.model.types import Types
from robosc.model_checking.formulas import (
    Condition,
    Enabled,
    Finally,
    Formula,
    Globally,
    Joined,
    Next,
    Not,
    Property,
    Quantifier,
    Until,
)
from robosc.model_checking.reading import WrittenProperty, operator_of, read_properties
from robosc.source import SourceFile

_TEMPORAL: Mapping[str, type[Next | Finally | Globally]] = {"X": Next, "F": Finally, "G": Globally}


def properties_of(
    model: Model, texts: Sequence[SourceFile] = (), listings: Sequence[SourceFile] = ()
) -> tuple[Property, ...]:
    """The properties that some texts claim of a robot.

    Args:
        model: The checked robot.
        texts: Texts of one property each.
        listings: Texts with a property on each line; empty lines and comments (`#`, `//`) count for nothing.

    Raises:
        LanguageError: They have errors: syntax, unknown names, types; it carries all of them.
    """
    written, faults = read_properties(texts, has_lines=False)
    listed, more = read_properties(listings, has_lines=True)
    resolver = _Resolver(model)
    found: list[Property] = []
    for item in (*written, *listed):
        if len(resolver.findings.diagnostics) < MAXIMUM_SYNTAX_ERRORS:
            found.append(resolver.property(item))
    diagnostics: list[Diagnostic] = [*faults, *more, *resolver.findings.diagnostics]
    if diagnostics:
        raise LanguageError(sorted_diagnostics(diagnostics))
    return tuple(found)


class _Resolver:
    """Binds names to one robot."""

    def __init__(self, model: Model) -> None:
        self.findings = Findings()
        self._events = frozenset(_events(model))
        self._code_only = {
            (component.name, variable.name)
            for component in model.components
            if component.behaviour
            for variable in component.behaviour.variables
            if not variable.is_synthesis
        }
        self._checker = ExpressionChecker(_scope(model, self.findings), self.findings)
        self._about_runs: set[int] = set()

    def property(self, written: WrittenProperty) -> Property:
        """One property; what is wrong with it is among the findings."""
        self._about_runs = _about_runs(written.tree)
        self._refuse_code_only(written.tree)
        return Property(written.name, written.text, written.location, self._formula(written.tree))

    def _refuse_code_only(self, tree: syntax.Expression) -> None:
        for node in _nodes(tree):
            if isinstance(node, syntax.Access) and node.root and node.steps:
                step = node.steps[0]
                if isinstance(step, syntax.Name) and (node.root.text, step.text) in self._code_only:
                    self.findings.error(
                        "unknown-name",
                        f"'{node.root.text}.{step.text}' is code-only: it decides about no request, so nothing is "
                        "known of its values before the robot runs",
                        node.location,
                        "Name component states and variables that a requirement, invariant, guard or provide "
                        "condition reads.",
                    )

    def _formula(self, tree: syntax.Expression) -> Formula:
        """The formula; what stands for one that is wrong is never used."""
        if id(tree) not in self._about_runs:
            return Condition(self._checker.condition(tree) or FALSE)
        operator = operator_of(tree)
        if operator is not None and isinstance(tree, syntax.Call):
            return self._operation(operator, tree)
        match tree:
            case syntax.Unary(operator="!", operand=operand):
                return Not(self._formula(operand))
            case syntax.Binary(operator="and", left=left, right=right):
                return Joined("and", self._formula(left), self._formula(right))
            case syntax.Binary(operator="or", left=left, right=right):
                return Joined("or", self._formula(left), self._formula(right))
            case syntax.Binary(operator="=>", left=left, right=right):
                return Joined("or", Not(self._formula(left)), self._formula(right))
            case _:
                what = f"'{tree.operator}'" if isinstance(tree, syntax.Unary | syntax.Binary) else "this"
                self.findings.error(
                    "type-mismatch",
                    f"{what} takes values, but a formula with a temporal operator or 'enabled' has none",
                    tree.location,
                    "Put parentheses around what the operator is about, or join formulas with 'and', 'or', '!' and "
                    "'=>' only.",
                )
                return Condition(FALSE)

    def _operation(self, operator: str, tree: syntax.Call) -> Formula:
        if operator == "enabled":
            return self._enabled(tree.arguments[0])
        operands = [self._formula(argument) for argument in tree.arguments]
        quantifier: Quantifier = "A" if operator[0] == "A" else "E"
        if operator[1] == "U":
            return Until(quantifier, operands[0], operands[1])
        return _TEMPORAL[operator[1]](quantifier, operands[0])

    def _enabled(self, tree: syntax.Expression) -> Formula:
        event = ""
        if isinstance(tree, syntax.Access) and tree.root and isinstance(tree.steps[0], syntax.Name):
            event = f"{tree.root.text}.{tree.steps[0].text}"
        if event not in self._events:
            self.findings.unknown("event", event, tree.location, self._events)
        return Enabled(event)


def _scope(model: Model, findings: Findings) -> Scope:
    """Return everything that can be named."""
    names: dict[str, ComponentNames] = {}
    for communication in model.communications:
        if communication.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION):
            plant = communication_plant(communication)
            found = ComponentNames(plant.name, frozenset(plant.locations), {})
            names[communication.name] = names[plant.name] = found
    for component in model.components:
        behaviour = component.behaviour
        states = frozenset(state.name for state in behaviour.states) if behaviour else frozenset()
        variables = {item.name: item.type for item in behaviour.variables} if behaviour else {}
        # A component wins over a service or action of the same name, as it does over a type.
        names[component.name] = ComponentNames(component.name, states, variables)
    enums = {item.name: EnumType(item.name, item.values) for item in model.enums}
    for item in model.enums:
        # A library's enum goes by its own name where no other enum does.
        short = item.name.rpartition(".")[2]
        if [other.name.rpartition(".")[2] for other in model.enums].count(short) == 1:
            enums[short] = enums[item.name]
    return Scope(Types(findings), names, enums)


def _events(model: Model) -> Iterator[str]:
    for communication in model.communications:
        yield from communication.events
    yield from model.taus


def _children(tree: syntax.Expression) -> tuple[syntax.Expression, ...]:
    match tree:
        case syntax.Unary(operand=operand):
            return (operand,)
        case syntax.Binary(left=left, right=right):
            return (left, right)
        case syntax.Conditional(condition=condition, then=then, otherwise=otherwise):
            return (condition, then, otherwise)
        case syntax.Call(arguments=arguments):
            return arguments
        case syntax.Quantifier(array=array, condition=condition):
            return (array, condition)
        case _:
            return ()


def _nodes(tree: syntax.Expression) -> Sequence[syntax.Expression]:
    """Every node of a tree, parents before children."""
    found: list[syntax.Expression] = []
    stack = [tree]
    while stack:
        node = stack.pop()
        found.append(node)
        stack += reversed(_children(node))
    return found


def _about_runs(tree: syntax.Expression) -> set[int]:
    """The nodes that have an operator of properties in them, by their `id`."""
    found: set[int] = set()
    for node in reversed(_nodes(tree)):
        if operator_of(node) is not None or any(id(child) in found for child in _children(node)):
            found.add(id(node))
    return found
