"""Generated functions that tell whether a controllable event is allowed now, and which requirements hold."""

from robosc.expressions import conjuncts
from robosc.supervisor import DecisionNode
from robosc.targets.c99.expressions import number_code
from robosc.targets.c99.text import comment
from robosc.targets.c99.unit import Reading, Unit
from robosc.targets.code.conditions import Conditions, node_words
from robosc.targets.code.expressions import Code, Kind, Sort, call, operation, place
from robosc.targets.code.text import indent
from robosc.targets.model_text import requirement_text

_SIGNATURE = "const state_t *s"


class CConditions(Conditions):
    """Writes conditions over the state in C.

    Args:
        unit: The file.
    """

    def __init__(self, unit: Unit) -> None:
        self._reading = Reading(unit)
        self._unit = unit
        self._layout = unit.layout
        super().__init__(unit.layout.supervisor, unit.system, self._reading)

    def allow_function(self, event: str) -> list[str]:
        """The function that tells whether an event is allowed: plants, ranges, requirements, then the supervisor."""
        lines = [f"static bool {self._layout.function('allows', event)}({_SIGNATURE})", "{", "    (void)s;"]
        for words, code in self.enabling(event):
            lines += indent([*(comment(words) if words else []), *self._reading.unless(code, "return false;")])
        return [*lines, "    return true;", "}"]

    def requirements_function(self, communication: str) -> list[str]:
        """The function that tells for each requirement on a request whether it holds."""
        body = []
        for number, requirement in enumerate(self._layout.model.requirements_on(communication)):
            body += comment(requirement_text(requirement))
            body.append(f"holds[{number}] = {self._unit.text(self._reading.truth(requirement.condition))};")
        return self._filling("requirements", communication, body)

    def conjuncts_function(self, communication: str) -> list[str]:
        """The function that tells for each top-level conjunct of the requirements whether it holds."""
        parts = [
            part
            for requirement in self._layout.model.requirements_on(communication)
            for part in conjuncts(requirement.condition)
        ]
        body = [f"holds[{number}] = {self._unit.text(self._reading.truth(part))};" for number, part in enumerate(parts)]
        return self._filling("conjuncts", communication, body)

    def _filling(self, purpose: str, communication: str, body: list[str]) -> list[str]:
        head = f"static void {self._layout.function(purpose, communication)}({_SIGNATURE}, bool *holds)"
        return [head, "{", "    (void)s;", "    (void)holds;", *indent(body), "}"]

    def _node_call(self, number: int) -> Code:
        return call(f"node_{number + 1}", Code(Kind.PLACE, "s"))

    def _node_function(self, number: int, node: DecisionNode, branches: tuple[Code, ...]) -> list[str]:
        lines = [*comment(node_words(node)), f"static bool node_{number + 1}({_SIGNATURE})", "{", "    (void)s;"]
        with self._unit.uses_apart() as self._unit.uses[f"node_{number + 1}"]:
            for end, branch in list(zip(node.starts[1:], branches, strict=False)):
                test = self._unit.text(self._is_before(node, end))
                lines += indent([f"if ({test}) {{", f"    return {self._unit.text(branch)};", "}"])
            return [*lines, f"    return {self._unit.text(branches[-1])};", "}"]

    def _is_before(self, node: DecisionNode, end: int) -> Code:
        """Return the code that tests whether the subject's value stands before place `end` of its domain."""
        domain = self._formulas.domains[node.automaton, node.variable]
        if node.variable is None:
            # Locations are numbered in the order of their domain.
            return operation("below", Code(Kind.PLACE, self._reading.location(node.automaton)), number_code(end))
        subject = place(*self._reading.variable(node.automaton, node.variable))
        if isinstance(domain[0], bool):
            return self._scope.negated(subject)
        return operation("below", subject, number_code(int(domain[end]) if subject.sort is Sort.INTEGER else end))
