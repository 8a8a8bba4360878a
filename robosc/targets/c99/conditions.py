"""Generated functions that tell whether a controllable event is allowed now, and which requirements hold."""

from robosc.conditions.rendering import Formulas, in_words, size_in_words
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    IntegerType,
    conjuncts,
)
from robosc.model.structure import Model
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import diagram_domains
from robosc.targets import acceptance
from robosc.targets.acceptance import InOneOf, StaysInRange, accepting_conditions, enabling_conditions
from robosc.targets.c99.expressions import code_text
from robosc.targets.c99.layout import Layout
from robosc.targets.c99.text import comment
from robosc.targets.c99.unit import Reading, Unit, low_text, number_code
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, Kind, call
from robosc.targets.code.text import indent
from robosc.targets.model_text import requirement_text

Condition = tuple[str, Code]
"""Words that explain a condition, and its code."""

_SIGNATURE = "const state_t *s"


class Conditions:
    """Writes conditions over the state; equal nodes of all decision diagrams share one function.

    Args:
        unit: The file.

    Attributes:
        nodes: Lines of each node's function so far, by its name.
    """

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._reading = Reading(unit)
        self._formulas = Formulas(diagram_domains(unit.system))
        self._names: dict[tuple[object, ...], str] = {}
        self.nodes: dict[str, list[str]] = {}

    @property
    def _layout(self) -> Layout:
        return self._unit.layout

    @property
    def _model(self) -> Model:
        return self._unit.layout.model

    def allow_function(self, event: str) -> list[str]:
        """The function that tells whether an event is allowed: plants, ranges, requirements, then the supervisor."""
        conditions = [item for item in self._conditions(event) if item[1] != TRUE_CODE]
        lines = [f"static bool {self._layout.function('allows', event)}({_SIGNATURE})", "{", "    (void)s;"]
        for words, code in conditions:
            lines += indent([*(comment(words) if words else []), *self._reading.unless(code, "return false;")])
        return [*lines, "    return true;", "}"]

    def requirements_function(self, communication: str) -> list[str]:
        """The function that tells for each requirement on a request whether it holds."""
        body = []
        for place, requirement in enumerate(self._model.requirements_on(communication)):
            body += comment(requirement_text(requirement))
            body.append(f"holds[{place}] = {code_text(self._reading.truth(requirement.condition))};")
        return self._filling("requirements", communication, body)

    def conjuncts_function(self, communication: str) -> list[str]:
        """The function that tells for each top-level conjunct of the requirements whether it holds."""
        parts = [
            part
            for requirement in self._model.requirements_on(communication)
            for part in conjuncts(requirement.condition)
        ]
        body = [f"holds[{place}] = {code_text(self._reading.truth(part))};" for place, part in enumerate(parts)]
        return self._filling("conjuncts", communication, body)

    def _filling(self, purpose: str, communication: str, body: list[str]) -> list[str]:
        head = f"static void {self._layout.function(purpose, communication)}({_SIGNATURE}, bool *holds)"
        return [head, "{", "    (void)s;", "    (void)holds;", *indent(body), "}"]

    def accepted(self, event: str, reading: Reading) -> list[Condition]:
        """Return conditions for behaviours to accept a controllable event and keep synthesis variables in range."""
        return [(words, self._code(item, reading)) for words, item in accepting_conditions(self._model, event)]

    def _conditions(self, event: str) -> list[Condition]:
        found = enabling_conditions(self._layout.supervisor, event)
        return [*((words, self._code(item, self._reading)) for words, item in found), *self._added_condition(event)]

    def _code(self, condition: acceptance.Condition, reading: Reading) -> Code:
        """Return the code that tests whether a condition holds."""
        match condition:
            case InOneOf(automaton=automaton, locations=locations):
                return reading.in_one_of(automaton, locations)
            case StaysInRange(component=component, state=state, expression=expression, type=type_):
                fits = self._fits(reading.value(expression), type_)
                if fits == TRUE_CODE or state is None:
                    return fits
                return reading.either(reading.state_code(component, state, False), fits)
            case _:
                return reading.truth(condition)

    def _fits(self, code: Code, type_: IntegerType) -> Code:
        """Return the code that tests whether a value is in a range; an unknown one leaves the variable alone."""
        low = MINIMUM_INTEGER if type_.low is None else type_.low
        high = MAXIMUM_INTEGER if type_.high is None else type_.high
        if code.is_within(low, high):
            return TRUE_CODE
        return call("stays_in_range", code, number_code(low), number_code(high))

    def _added_condition(self, event: str) -> list[Condition]:
        diagram = self._layout.supervisor.added_condition(event)
        if diagram is None:
            return []
        words, code = self._diagram(diagram)
        return [(f"added by the supervisor: {words}", code)]

    def _diagram(self, diagram: DecisionDiagram) -> tuple[str, Code]:
        """A formula where it is short, else functions that share nodes."""
        expression = self._formulas.formula(diagram)
        if expression is not None:
            components = frozenset(item.name for item in self._model.components)
            return in_words(expression, components), self._reading.truth(expression)
        codes = [FALSE_CODE, TRUE_CODE]
        for node in diagram.nodes:
            codes.append(self._node(node, codes))
        return size_in_words(diagram), codes[diagram.root]

    def _node(self, node: DecisionNode, codes: list[Code]) -> Code:
        branches = tuple(code_text(codes[child]) for child in node.children)
        key = (node.automaton, node.variable, node.starts, branches)
        if len(branches) == 1:
            return codes[node.children[0]]
        if key not in self._names:
            name = f"node_{len(self._names) + 1}"
            self._names[key] = name
            self.nodes[name] = self._node_function(name, node, branches)
        return call(self._names[key], Code(Kind.PLACE, "s"))

    def _node_function(self, name: str, node: DecisionNode, branches: tuple[str, ...]) -> list[str]:
        words = node.automaton if node.variable is None else f"{node.automaton}.{node.variable}"
        lines = [
            *comment(f"Node of the decision diagrams: {words}."),
            f"static bool {name}({_SIGNATURE})",
            "{",
            "    (void)s;",
        ]
        # The last branch needs no test: a subject always has a value of its domain.
        for end, branch in list(zip(node.starts[1:], branches, strict=False)):
            lines += indent([f"if ({self._is_before(node, end)}) {{", f"    return {branch};", "}"])
        return [*lines, f"    return {branches[-1]};", "}"]

    def _is_before(self, node: DecisionNode, end: int) -> str:
        """Return the code that tests whether the subject's value stands before place `end` of its domain."""
        domain = self._formulas.domains[node.automaton, node.variable]
        if node.variable is None:
            number = end  # Locations are numbered in the order of their domain.
            return f"{self._reading.location(node.automaton)} < {number}"
        text, type_ = self._reading.variable(node.automaton, node.variable)
        if isinstance(domain[0], bool):
            return f"!{text}"
        return f"{text} < {low_text(int(domain[end])) if isinstance(type_, IntegerType) else end}"
