"""Conditions that allow a controllable event as code: those of the model, and those that the supervisor adds."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial

from robosc.automata import System
from robosc.automata.executable import ExecutableEvent
from robosc.conditions.rendering import Formulas, in_words, size_in_words
from robosc.expressions import Expression, conjuncts
from robosc.expressions.text import variable_text
from robosc.supervisor import DecisionDiagram, DecisionNode, Supervisor
from robosc.supervisor.diagram import diagram_domains
from robosc.targets.acceptance import accepting_conditions, enabling_conditions
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code
from robosc.targets.code.statements import Block, Return, when
from robosc.targets.text import requirement_text

Condition = tuple[str, Code]
"""Words that explain a condition, and its code."""


def accepted(event: ExecutableEvent, scope: ExpressionWriter) -> list[Condition]:
    """Return the conditions for behaviours to accept a controllable event and keep synthesis variables in range."""
    found = ((words, scope.condition(item)) for words, item in accepting_conditions(event))
    return [item for item in found if item[1] != TRUE_CODE]


class Diagrams(ABC):
    """Writes decision diagrams over the state; equal nodes of all of them share one function.

    Args:
        system: The automata, for the domains of the diagrams.
        scope: Writes expressions over the state.
        text: Function that writes a condition in words.

    Attributes:
        nodes: Lines of each node's function so far, by its name.
    """

    def __init__(self, system: System, scope: ExpressionWriter, text: Callable[[Expression], str]) -> None:
        self._scope = scope
        self._text = text
        self._formulas = Formulas(diagram_domains(system))
        self._numbers: dict[tuple[object, ...], int] = {}
        self.nodes: dict[str, list[str]] = {}

    @abstractmethod
    def _node_call(self, number: int) -> Code:
        """A call of the function of a node."""

    @abstractmethod
    def _node_test(self, node: DecisionNode, start: int, end: int) -> Code:
        """Return the code that tests for values `start` to `end` - 1 of a domain, those before being excluded."""

    @abstractmethod
    def _node_function(self, number: int, words: str, body: Block) -> list[str]:
        """The function of a node."""

    def added(self, diagram: DecisionDiagram) -> Condition:
        """Return a condition of the supervisor: a formula where it is short, else functions that share nodes."""
        words, code = self.described(diagram)
        return f"added by the supervisor: {words}", code

    def described(self, diagram: DecisionDiagram) -> Condition:
        """Return a condition over the state with its formula, or with its size where that is not short."""
        expression = self._formulas.formula(diagram)
        if expression is not None:
            return self._text(expression), self._scope.truth(expression)
        codes = [FALSE_CODE, TRUE_CODE]
        for node in diagram.nodes:
            codes.append(self._node(node, tuple(codes[child] for child in node.children)))
        return size_in_words(diagram), codes[diagram.root]

    def _node(self, node: DecisionNode, branches: tuple[Code, ...]) -> Code:
        key = (node.automaton, node.variable, node.starts, branches)
        is_new = key not in self._numbers
        number = self._numbers.setdefault(key, len(self._numbers))
        code = self._node_call(number)
        if is_new:
            spans = zip(node.starts, node.starts[1:], branches, strict=False)
            tests = [when(self._node_test(node, start, end), Return(branch)) for start, end, branch in spans]
            subject = node.automaton if node.variable is None else variable_text(node.automaton, node.variable)
            # The last branch needs no test, since a subject always has a value of its domain.
            body: Block = [*tests, Return(branches[-1])]
            self.nodes[code.word] = self._node_function(number, f"Node of the decision diagrams: {subject}.", body)
        return code


class Conditions(Diagrams):
    """Writes the conditions of a model and its supervisor.

    Args:
        supervisor: The supervisor.
        system: Its automata, for the domains of the diagrams.
        scope: Writes expressions over the state.
    """

    def __init__(self, supervisor: Supervisor, system: System, scope: ExpressionWriter) -> None:
        components = frozenset(item.name for item in supervisor.model.components)
        super().__init__(system, scope, partial(in_words, components=components))
        self._supervisor = supervisor

    def enabling(self, event: str) -> list[Condition]:
        """Return the conditions for an event to be allowed: plants, ranges, requirements, then the supervisor's."""
        needed = enabling_conditions(self._supervisor.executable.events[event])
        found = [(words, self._scope.condition(item)) for words, item in needed]
        diagram = self._supervisor.added_condition(event)
        if diagram is not None:
            found.append(self.added(diagram))
        return [item for item in found if item[1] != TRUE_CODE]

    def requirements(self, communication: str) -> list[Condition]:
        """Return the requirements on a communication."""
        found = self._supervisor.model.requirements_on(communication)
        return [(requirement_text(item), self._scope.truth(item.condition)) for item in found]

    def conjuncts(self, communication: str) -> list[Condition]:
        """Return the top-level conjuncts of the requirements on a communication; they need no words."""
        found = self._supervisor.model.requirements_on(communication)
        return [("", self._scope.truth(part)) for item in found for part in conjuncts(item.condition)]
