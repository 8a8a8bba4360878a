"""The controlled system of automata as a CIF model: plants as they are, requirements and the supervisor as supervisors.

Names are absolute names of CIF, as its front end (`robosc.cif`) makes them: the event `hall.door.u_open` is declared in
the group or automaton `hall.door`. An automaton with one event of its own name is an input variable.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from robosc._version import __version__
from robosc.automata.state import Subject, subject_type
from robosc.automata.structure import Assignment, Automaton, DiscreteVariable, Edge, Role, System
from robosc.cif.terms import result_range
from robosc.cif.typing import NAMELESS
from robosc.conditions.formula import to_expression
from robosc.conditions.literals import membership, merged
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    TRUE,
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    StateTest,
    Type,
    Unary,
    Value,
    VariableRead,
    conjuncts,
    domain,
)
from robosc.expressions.bounds import call_bounds
from robosc.recursion import allow_depth
from robosc.supervisor import AddedCondition, DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import diagram_domains
from robosc.targets.cif import text
from robosc.targets.cif.generate import SUPERVISED
from robosc.targets.cif.text import Level, Text, all_of, any_of, chosen, comment, compared, escaped, implied, negated
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions, SupervisedSystem

FORMULA_LIMIT = 60
"""Operands beyond which a condition is written as a decision diagram."""

_LEVELS, _FRAMES = 5_000, 4
_NAME = re.compile("[A-Za-z_][A-Za-z0-9_]*")

_Path = tuple[str, ...]


def controlled_system(supervised: SupervisedSystem) -> str:
    """A CIF model of automata under their supervisor.

    Raises:
        UnsupportedModelError: The automata are none of a CIF model: a name is none of CIF, or an event carries data.
    """
    allow_depth(_LEVELS, _FRAMES)
    return "".join(f"{line}\n" for line in _Writer(supervised.system).lines(supervised.added, supervised.initial))


def generate(supervised: SupervisedSystem, options: GenerateOptions) -> GeneratedFiles:
    """The one file of automata under their supervisor; raises UnsupportedModelError as `controlled_system`."""
    if options.package is not None:
        raise UnsupportedModelError("target cif: it makes one file and no package, so there is nothing to be named")
    return GeneratedFiles({SUPERVISED: controlled_system(supervised)})


@dataclass(slots=True)
class _Node:
    """A group, or an automaton, of the model.

    Attributes:
        children: Groups and automata in it, by name.
        declarations: Lines that declare the events, enums and input variables in it.
        names: Names of all that is declared in it.
        automaton: The automaton; None if it is a group.
    """

    children: dict[str, "_Node"] = field(default_factory=dict)
    declarations: list[str] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    automaton: Automaton | None = None


class _Writer:
    """Writer of one system.

    Args:
        system: The system.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._domains = diagram_domains(system)
        self._root = _Node()
        self._inputs = {item.event for item in system.inputs}
        variables = {item.name for item in system.automata if item.alphabet == {item.name} and len(item.variables) == 1}
        for name in sorted(self._inputs - variables):
            raise UnsupportedModelError(f"target cif: the event '{name}' carries data")
        self._enums = {
            variable.type.name: variable.type
            for automaton in system.automata
            for variable in automaton.variables
            if isinstance(variable.type, EnumType)
        }
        for enum in self._enums.values():
            literals = ", ".join(escaped(_checked(item)) for item in enum.values)
            self._declare(_path(enum.name), "enum {} = " + literals, enum.values)
        for event in system.events:
            if event.name not in self._inputs:
                self._declare(_path(event.name), f"{'' if event.is_controllable else 'un'}controllable {{}}")
        for automaton in system.automata:
            self._place(automaton)
        self._supervisor = _free("sup", self._root.names)
        self._node_prefix = "node"
        while any(name.startswith(self._node_prefix) for name in self._root.names):
            self._node_prefix += "_"
        self._diagram_lines: dict[str, Text] = {}

    # Places of the parts

    def _node(self, path: _Path) -> _Node:
        node = self._root
        for name in path:
            node.names.add(name)
            node = node.children.setdefault(name, _Node())
        return node

    def _declare(self, path: _Path, line: str, more: Iterable[str] = ()) -> None:
        node = self._node(path[:-1])
        node.declarations.append(f"{line.format(escaped(path[-1]))};")
        node.names |= {path[-1], *more}

    def _place(self, automaton: Automaton) -> None:
        path = _path(automaton.name)
        if automaton.name in self._inputs:
            (variable,) = automaton.variables
            self._declare(path, f"input {self._type(variable.type, path[:-1])} {{}}")
            return
        node = self._node(path)
        node.automaton = automaton
        node.names |= {item.name for item in automaton.variables}
        node.names |= {_checked(item) for item in automaton.locations if item != NAMELESS}

    def _reference(self, path: _Path, scope: _Path) -> str:
        """The name of something, as it is written in a group or automaton."""
        if path[:-1] == scope:
            return escaped(path[-1])
        name = ".".join(escaped(part) for part in path)
        node, is_hidden = self._root, False
        for part in scope:
            node = node.children.get(part, _Node())
            is_hidden = is_hidden or path[0] in node.names
        return f"^{name}" if is_hidden else name

    # Types and values

    def _type(self, type_: Type, scope: _Path) -> str:
        match type_:
            case BooleanType():
                return "bool"
            case EnumType(name=name):
                return self._reference(_path(name), scope)
            case IntegerType(low=int(low), high=int(high)):
                return f"int[{_integer(low)}..{_integer(high)}]"
        raise UnsupportedModelError("target cif: a variable has a type that no CIF model for synthesis has")

    def _value(self, value: Value, type_: Type, scope: _Path) -> Text:
        if isinstance(type_, EnumType):
            return Text(self._reference((*_path(type_.name)[:-1], str(value)), scope))
        return self._text(Constant(value), scope)

    # Expressions

    def _text(self, node: Expression, scope: _Path) -> Text:
        match node:
            case Constant(value=bool(value)):
                return text.TRUE if value else text.FALSE
            case Constant(value=int(value)):
                return _integer(value)
            case EnumValue(enum=enum, value=literal):
                return self._value(literal, self._enums[enum], scope)
            case VariableRead(component=name, variable=variable):
                path = _path(name)
                return Text(self._reference(path if name in self._inputs else (*path, variable), scope))
            case StateTest(component=name, state=location):
                return text.TRUE if location == NAMELESS else Text(self._reference((*_path(name), location), scope))
            case Unary(operator="-", operand=operand):
                return Text(f"-{self._text(operand, scope).within(Level.UNARY)}", Level.UNARY)
            case Unary(operator="holds", operand=operand):
                return self._text(operand, scope)
            case Unary(operand=operand):
                return negated(self._text(operand, scope))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                cases = [(self._text(condition, scope), self._text(then, scope))]
                return chosen(cases, self._text(otherwise, scope))
            case Call(function="abs" | "min" | "max" as function, arguments=arguments):
                return Text(f"{function}({', '.join([str(self._text(item, scope)) for item in arguments])})")
            case Binary(operator=operator, left=left, right=right):
                return _joined(operator, self._text(left, scope), self._text(right, scope))
        raise UnsupportedModelError("target cif: an expression reads what no CIF model for synthesis has")

    def _bounds(self, node: Expression) -> tuple[int, int]:
        """Least and greatest value of an integer expression."""
        match node:
            case Constant(value=int(value)):
                return value, value
            case VariableRead(component=name, variable=variable):
                type_ = subject_type(self._system, Subject(name, variable))
                assert isinstance(type_, IntegerType)  # noqa: S101 - the check has typed it
                return int(type_.low or 0), int(type_.high or 0)
            case Unary(operand=operand):
                low, high = self._bounds(operand)
                return -high, -low
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                # A value that is never chosen is not written.
                if (found := self._text(condition, ())) in (text.TRUE, text.FALSE):
                    return self._bounds(then if found == text.TRUE else otherwise)
                (a, b), (c, d) = self._bounds(then), self._bounds(otherwise)
                return min(a, c), max(b, d)
            case Call(function=function, arguments=arguments):
                return call_bounds(function, [self._bounds(item) for item in arguments])
            case Binary(operator=operator, left=left, right=right):
                return result_range(operator, self._bounds(left), self._bounds(right))
        raise AssertionError(node)

    # The model

    def lines(self, added: Sequence[AddedCondition], initial: DecisionDiagram | None) -> Iterator[str]:
        """Yield its lines."""
        system = self._system
        yield comment(f"The controlled system of {system.name}, made by RoboSC {__version__}.")
        if system.is_controlled:
            yield comment("All is as it was: the supervisor was there already.")
        else:
            yield comment(
                "Plants are as they were, requirements are supervisors, and the automaton at the end is what they"
            )
            yield comment(
                "need beside them: each controllable event only where no variable leaves its range, and where"
            )
            yield comment("synthesis found that nothing that cannot be prevented leads against a requirement.")
        yield from self._body(self._root, ())
        yield from (f"initial {self._text(item, ())};" for item in conjuncts(system.initial) if item != TRUE)
        yield from (f"marked {self._text(item, ())};" for item in conjuncts(system.marker) if item != TRUE)
        yield from (f"plant invariant {self._text(item, ())};" for item in system.plant_invariants)
        # The conditions on events see to requirements on states.
        if system.is_controlled:
            yield from (f"supervisor invariant {self._text(item, ())};" for item in system.invariants)
        for kind, conditions in (("plant", system.plant_conditions), ("supervisor", system.conditions)):
            for item in conditions:
                yield f"{kind} {self._reference(_path(item.event), ())} needs {self._text(item.condition, ())};"
        yield from self._supervisor_lines({item.event: item.condition for item in added}, initial)

    def _body(self, node: _Node, path: _Path) -> Iterator[str]:
        yield from node.declarations
        for name, child in node.children.items():
            inner = (*path, name)
            if child.automaton is None:
                yield f"group {escaped(name)}:"
            else:
                role = "plant" if child.automaton.role is Role.PLANT else "supervisor"
                yield f"{role} automaton {escaped(name)}:"
            yield from (f"  {line}" for line in self._body(child, inner))
            if child.automaton is not None:
                yield from (f"  {line}" for line in self._automaton(child.automaton, inner))
            yield "end"

    def _automaton(self, automaton: Automaton, path: _Path) -> Iterator[str]:
        if automaton.alphabet != {edge.event for edge in automaton.edges}:
            yield self._events("alphabet", automaton.alphabet, path)
        if automaton.monitors:
            yield self._events("monitor", automaton.monitors, path)
        for variable in automaton.variables:
            yield self._variable(variable, path)
        for location in automaton.locations:
            name = "location" if location == NAMELESS else f"location {escaped(location)}"
            inside = ["initial;"] if location in automaton.initial else []
            inside += ["marked;"] if location in automaton.marked else []
            edges = [edge for edge in automaton.edges if edge.source == location]
            inside += self._edges(edges, {item.name: item.type for item in automaton.variables}, path)
            yield f"{name}{':' if inside else ';'}"
            yield from (f"  {line}" for line in inside)

    def _events(self, word: str, events: Iterable[str], scope: _Path) -> str:
        return f"{word} {', '.join(self._reference(_path(item), scope) for item in sorted(events))}".rstrip() + ";"

    def _variable(self, item: DiscreteVariable, scope: _Path) -> str:
        values = [str(self._value(value, item.type, scope)) for value in item.initial]
        if len(values) == 1:
            begins = f"= {values[0]}"
        else:
            begins = "in any" if len(values) == len(domain(item.type)) else f"in {{{', '.join(values)}}}"
        return f"disc {self._type(item.type, scope)} {escaped(_checked(item.name))} {begins};"

    def _edges(self, edges: Iterable[Edge], types: Mapping[str, Type], scope: _Path) -> Iterator[str]:
        def what(edge: Edge) -> tuple[object, ...]:
            return edge.guard, edge.updates, edge.target

        for _, found in groupby(edges, what):
            several = list(found)
            edge = several[0]
            line = f"edge {', '.join(self._reference(_path(item.event), scope) for item in several)}"
            if edge.guard != TRUE:
                line += f" when {self._text(edge.guard, scope)}"
            if edge.updates:
                line += " do " + ", ".join(
                    f"{escaped(item.variable)} := {self._assigned(item, types[item.variable], scope)}"
                    for item in edge.updates
                )
            yield line + (f" goto {escaped(edge.target)};" if edge.target != edge.source else ";")

    def _assigned(self, update: Assignment, type_: Type, scope: _Path) -> Text:
        """The new value of a variable; CIF takes none of which it knows that it is always out of range."""
        value = self._text(update.expression, scope)
        if isinstance(type_, IntegerType):
            least, greatest = self._bounds(update.expression)
            low, high = int(type_.low or 0), int(type_.high or 0)
            if greatest < low or least > high:
                return Text(f"if true: {value} else {low} end")
        return value

    # The supervisor

    def _supervisor_lines(self, added: dict[str, DecisionDiagram], initial: DecisionDiagram | None) -> Iterator[str]:
        alphabet = frozenset[str]().union(*(item.alphabet for item in self._system.automata))
        events = [item.name for item in self._system.events if item.is_controllable and item.name in alphabet]
        guards = [all_of([*self._ranges(event), self._condition(added.get(event))]) for event in events]
        begins = self._condition(initial)
        if self._system.is_controlled and {*guards, begins} <= {text.TRUE}:
            return
        yield f"supervisor automaton {self._supervisor}:"
        yield f"  {self._events('alphabet', events, (self._supervisor,))}"
        yield from (f"  alg bool {name} = {found};" for found, name in self._diagram_lines.items())
        if begins != text.TRUE:
            yield f"  initial {begins};"
        yield "  location:"
        yield "    initial; marked;"
        for event, guard in zip(events, guards, strict=True):
            yield f"    edge {self._reference(_path(event), (self._supervisor,))} when {guard};"
        yield "end"

    def _ranges(self, event: str) -> Iterator[Text]:
        """Yield the conditions that a controllable event takes no variable out of its range."""
        scope = (self._supervisor,)
        for automaton in self._system.automata:
            types = {item.name: item.type for item in automaton.variables}
            for edge in automaton.edges if event in automaton.alphabet else ():
                for update in edge.updates if edge.event == event else ():
                    match types[update.variable]:
                        case IntegerType(low=int(low), high=int(high)):
                            stays = list(self._stays(update.expression, low, high))
                            here = self._text(StateTest(automaton.name, edge.source), scope)
                            if len(automaton.locations) == 1:
                                here = text.TRUE
                            yield implied(all_of([here, self._text(edge.guard, scope)]), all_of(stays))

    def _stays(self, expression: Expression, low: int, high: int) -> Iterator[Text]:
        """Yield the conditions that a value is in a range, as far as it need not be."""
        scope = (self._supervisor,)
        least, greatest = self._bounds(expression)
        match expression:
            case Binary(operator="-", left=left, right=right) if (
                low >= 0 and self._bounds(right)[1] + high <= MAXIMUM_INTEGER
            ):
                # In conditions, tools of CIF take sums and no differences.
                whole = self._text(left, scope).within(Level.SUM)
                if least < low:
                    yield compared(self._plus(right, low).within(Level.SUM), "<=", whole)
                if greatest > high:
                    yield compared(whole, "<=", self._plus(right, high).within(Level.SUM))
            case _:
                new = self._text(expression, scope).within(Level.SUM)
                if least < low:
                    yield compared(str(_integer(low)), "<=", new)
                if greatest > high:
                    yield compared(new, "<=", str(_integer(high)))

    def _plus(self, expression: Expression, number: int) -> Text:
        if isinstance(expression, Constant) and isinstance(expression.value, int):
            return _integer(expression.value + number)
        return self._text(Binary("+", expression, Constant(number)) if number else expression, (self._supervisor,))

    def _condition(self, diagram: DecisionDiagram | None) -> Text:
        """A condition as a formula, or by algebraic variables that stand for the nodes of its diagram."""
        if diagram is None:
            return text.TRUE
        formula = to_expression(diagram, self._domains, limit=FORMULA_LIMIT)
        if formula is not None:
            return self._text(formula, (self._supervisor,))
        texts = [text.FALSE, text.TRUE]
        for node in diagram.nodes:
            texts.append(self._decision(node, texts))
        return texts[diagram.root]

    def _decision(self, node: DecisionNode, texts: list[Text]) -> Text:
        """The algebraic variable of a node; equal nodes share one."""
        subject = node.automaton, node.variable
        count = len(self._domains[subject])
        runs: dict[Text, list[range]] = {}
        for start, end, child in zip(node.starts, (*node.starts[1:], count), node.children, strict=True):
            runs.setdefault(texts[child], []).append(range(start, end))
        *first, (last, _) = runs.items()
        scope = (self._supervisor,)
        tests = (membership(subject, self._domains[subject], merged(where)).expression for _, where in first)
        cases = [(self._text(test, scope), child) for test, (child, _) in zip(tests, first, strict=True)]
        found = chosen(cases, last)
        if not first:
            return last
        name = Text(f"{self._node_prefix}{len(self._diagram_lines) + 1}")
        return self._diagram_lines.setdefault(found.text, name)


def _joined(operator: str, left: Text, right: Text) -> Text:
    match operator:
        case "and":
            return all_of([left, right])
        case "or":
            return any_of([left, right])
        case "implies":
            return implied(left, right)
        case "+" | "-":
            return Text(f"{left.within(Level.SUM)} {operator} {right.within(Level.PRODUCT)}", Level.SUM)
        case "*" | "div" | "mod":
            return Text(f"{left.within(Level.PRODUCT)} {operator} {right.within(Level.UNARY)}", Level.PRODUCT)
    return compared(left.within(Level.SUM), operator, right.within(Level.SUM))


def _integer(value: int) -> Text:
    if value == MINIMUM_INTEGER:
        # Its digits alone are no integer of CIF.
        return Text(f"-{-(value + 1)} - 1", Level.SUM)
    return Text(str(value), Level.ATOM if value >= 0 else Level.UNARY)


def _free(name: str, taken: Iterable[str]) -> str:
    """The first of `sup`, `sup2`, `sup3`, ... that is not taken."""
    known, number, found = set(taken), 1, name
    while found in known:
        number += 1
        found = f"{name}{number}"
    return found


def _checked(name: str) -> str:
    if _NAME.fullmatch(name) is None:
        raise UnsupportedModelError(f"target cif: '{name}' is not a name of CIF")
    return name


def _path(name: str) -> _Path:
    return tuple(_checked(part) for part in name.split("."))
