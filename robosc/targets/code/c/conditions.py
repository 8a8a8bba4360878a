"""Generated functions that say whether a controllable event is allowed now, and which requirements hold."""

from abc import abstractmethod

from robosc.supervisor import DecisionNode
from robosc.targets.code.c.expressions import number_code
from robosc.targets.code.c.statements import statement_lines, unused
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.conditions import Condition, Conditions, Diagrams
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Kind,
    Sort,
    call,
    operation,
    variable,
    words_of,
)
from robosc.targets.code.statements import Assign, Block, Comment, Return, Statement, when

_SIGNATURE = "const state_t *s"


class CDiagrams(Diagrams):
    """Writes decision diagrams over the state in C."""

    @abstractmethod
    def _definition(self, name: str, head: str, body: Block) -> list[str]:
        """The function of a node."""

    def _node_call(self, number: int) -> Code:
        return call(f"node_{number + 1}", Code(Kind.PLACE, "s"))

    def _node_function(self, number: int, words: str, body: Block) -> list[str]:
        name = f"node_{number + 1}"
        lines = self._definition(name, f"static bool {name}({_SIGNATURE})", [*unused("s"), *body])
        return [*statement_lines([Comment(words)]), *lines]

    def _node_test(self, node: DecisionNode, start: int, end: int) -> Code:
        domain = self._formulas.domains[node.automaton, node.variable]
        if node.variable is None:
            # Locations are numbered in the order of their domain.
            return operation("below", self._scope.location_place(node.automaton), number_code(end))
        subject = self._scope.variable_place(node.automaton, node.variable)
        if isinstance(domain[0], bool):
            return self._scope.negated(subject)
        return operation("below", subject, number_code(int(domain[end]) if subject.sort is Sort.INTEGER else end))


class CConditions(CDiagrams, Conditions):
    """Writes the conditions of a model and its supervisor in C.

    Args:
        unit: The file.

    Attributes:
        reads: For each event so far, the places that its condition reads, and the functions that it calls.
    """

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._layout = unit.layout
        self.reads: dict[str, set[str]] = {}
        super().__init__(unit.layout.supervisor, unit.system, Reading(unit))

    def allow_function(self, event: str) -> list[str]:
        """The function that says whether an event is allowed: plants, ranges, requirements, then the supervisor."""
        body = unused("s")
        conditions = self.enabling(event)
        self.reads[event] = words_of(code for _, code in conditions)
        for words, code in conditions:
            body += [Comment(words), when(self._scope.negated(code), Return(FALSE_CODE))]
        head = f"static bool {self._layout.function('allows', event)}({_SIGNATURE})"
        return self._unit.definition(head, [*body, Return(TRUE_CODE)])

    def requirements_function(self, communication: str) -> list[str]:
        """The function that says for each requirement on a request whether it holds."""
        return self._filling("requirements", communication, self.requirements(communication))

    def conjuncts_function(self, communication: str) -> list[str]:
        """The function that says for each top-level conjunct of the requirements whether it holds."""
        return self._filling("conjuncts", communication, self.conjuncts(communication))

    def _filling(self, purpose: str, communication: str, items: list[Condition]) -> list[str]:
        body: list[Statement] = unused("s", "holds")
        for number, (words, code) in enumerate(items):
            body += [Comment(words), Assign(variable(f"holds[{number}]"), code)]
        head = f"static void {self._layout.function(purpose, communication)}({_SIGNATURE}, bool *holds)"
        return self._unit.definition(head, body)

    def _definition(self, name: str, head: str, body: Block) -> list[str]:
        with self._unit.separate_uses() as self._unit.uses[name]:
            return self._unit.definition(head, body)
