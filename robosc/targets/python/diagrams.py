"""The supervisor's added conditions in Python: a formula where it is short, else functions that share nodes."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from robosc.automata import System
from robosc.conditions.rendering import Formulas, in_words, size_in_words
from robosc.expressions import Value
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import diagram_domains
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, Sort, call, literal, operation
from robosc.targets.code.text import indent
from robosc.targets.python.changes import reads
from robosc.targets.python.expressions import Scope, code_text
from robosc.targets.python.text import docstring


@dataclass(slots=True)
class Diagrams:
    """Writes decision diagrams; equal nodes of all diagrams share one method.

    Attributes:
        system: Gives the domains of what the nodes test.
        scope: Gives the names of what the nodes test.
        components: Names of all components.
        reads: For each node's method, by `self.name`, what it reads and calls.
        methods: Name and lines of each node's method so far.
    """

    system: System
    scope: Scope
    components: frozenset[str]
    reads: dict[str, set[str]]
    methods: list[tuple[str, list[str]]] = field(default_factory=list)
    _names: dict[tuple[object, ...], str] = field(default_factory=dict)
    _formulas: Formulas = field(init=False)

    def __post_init__(self) -> None:
        self._formulas = Formulas(diagram_domains(self.system))

    def condition(self, diagram: DecisionDiagram) -> tuple[str, Code]:
        """A diagram in words and as Python."""
        expression = self._formulas.formula(diagram)
        if expression is not None:
            return in_words(expression, self.components), self.scope.truth(expression)
        codes = [FALSE_CODE, TRUE_CODE]
        for node in diagram.nodes:
            codes.append(self._node(node, codes))
        return size_in_words(diagram), codes[diagram.root]

    def _node(self, node: DecisionNode, codes: list[Code]) -> Code:
        branches = [codes[child] for child in node.children]
        key = (node.automaton, node.variable, node.starts, *map(code_text, branches))
        if key not in self._names:
            name = f"_node_{len(self._names)}"
            self._names[key] = name
            self.methods.append((name, self._method(name, node, branches)))
        return call(f"self.{self._names[key]}")

    def _method(self, name: str, node: DecisionNode, branches: list[Code]) -> list[str]:
        values = self._formulas.domains[node.automaton, node.variable]
        if node.variable is None:
            subject = self.scope.location_code(node.automaton)
        else:
            subject = self.scope.variable_code(node.automaton, node.variable)
        self.reads[f"self.{name}"] = reads([subject, *branches])
        ends = [*node.starts[1:], len(values)]
        body = []
        # The last branch needs no test: a subject always has a value of its domain.
        for start, end, branch in list(zip(node.starts, ends, branches, strict=True))[:-1]:
            test = self._test(subject, values, start, end)
            body += [f"if {code_text(test)}:", f"    return {code_text(branch)}"]
        body.append(f"return {code_text(branches[-1])}")
        words = node.automaton if node.variable is None else f"{node.automaton}.{node.variable}"
        return [f"def {name}(self):", f"    {docstring(f'Node of the decision diagrams: {words}.')}", *indent(body)]

    def _test(self, subject: Code, values: Sequence[Value], start: int, end: int) -> Code:
        """Return a test that the subject has one of `values[start:end]`, all earlier ones being excluded already."""
        if isinstance(values[0], bool):
            return subject if values[end - 1] else self.scope.negated(subject)
        if isinstance(values[0], int):
            return operation("<", subject, literal(repr(values[end]), Sort.INTEGER))
        if end - start == 1:
            return operation("=", subject, literal(repr(values[start]), Sort.ENUM))
        return operation("in", subject, literal(repr(tuple(values[start:end])), Sort.ENUM))
