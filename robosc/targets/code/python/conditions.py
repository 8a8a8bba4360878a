"""Generated methods that say whether a controllable event is allowed now, and which requirements hold."""

from collections.abc import Iterable

from robosc.automata import System
from robosc.supervisor import DecisionNode
from robosc.targets.code.conditions import Condition, Conditions, Diagrams
from robosc.targets.code.expressions import Code, call, integer, operation, words_of
from robosc.targets.code.python.expressions import PYTHON, Precedence, Scope, code_text, constant
from robosc.targets.code.python.layout import Layout
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.text import comment, docstring
from robosc.targets.code.statements import Block, codes
from robosc.targets.text import indent


class PythonDiagrams(Diagrams):
    """Writes decision diagrams over the state in Python."""

    def _node_test(self, node: DecisionNode, start: int, end: int) -> Code:
        values = self._formulas.domains[node.automaton, node.variable]
        if node.variable is None:
            subject = self._scope.location_place(node.automaton)
        else:
            subject = self._scope.variable_code(node.automaton, node.variable)
        if isinstance(values[0], bool):
            return subject if values[end - 1] else self._scope.negated(subject)
        if isinstance(values[0], int):
            return operation("<", subject, integer(int(values[end])))
        found = tuple(values[start:end])
        return (
            operation("=", subject, constant(found[0]))
            if len(found) == 1
            else operation("in", subject, constant(found))
        )


class PythonConditions(PythonDiagrams, Conditions):
    """Writes the conditions of a model and its supervisor in Python.

    Args:
        layout: Names.
        system: The automata, for the domains of decision diagrams.
        scope: Writes expressions over the state.

    Attributes:
        reads: For each method so far, by `self.method`, what its expressions read and call: `self.attribute`.
    """

    def __init__(self, layout: Layout, system: System, scope: Scope) -> None:
        super().__init__(layout.supervisor, system, scope)
        self._layout = layout
        self.reads: dict[str, set[str]] = {}

    def allow_method(self, event: str) -> list[str]:
        """The method that says whether `event` is allowed: plants, ranges, requirements, then the supervisor."""
        conditions = self.enabling(event)
        self.reads[f"self.{self._layout.methods['allow', event]}"] = words_of(code for _, code in conditions)
        lines: list[str] = []
        for words, code in conditions:
            text = code_text(code) if len(conditions) == 1 else PYTHON.within(code, Precedence.AND)
            lines += [*comment(words), f"and {text}" if lines else text]
        result = ["return (", *indent(lines), ")"] if lines else ["return True"]
        return self._method("allow", event, f"Return True if {event} is allowed now.", result)

    def requirements_method(self, communication: str) -> list[str]:
        """The method that says for each requirement whether it holds."""
        words = f"Return for each requirement on {communication} whether it holds."
        return self._tuple_method("requirements", communication, words, self.requirements(communication))

    def conjuncts_method(self, communication: str) -> list[str]:
        """The method that says for each top-level conjunct of the requirements whether it holds."""
        words = f"Return for each top-level conjunct of the requirements on {communication} whether it holds."
        return self._tuple_method("conjuncts", communication, words, self.conjuncts(communication))

    def read_by(self, words: Iterable[str]) -> set[str]:
        """Return some words, with all that those of them which are methods read and call."""
        found: set[str] = set()
        to_do = list(words)
        while to_do:
            word = to_do.pop()
            if word not in found:
                found.add(word)
                to_do += self.reads.get(word, ())
        return found

    def _tuple_method(self, purpose: str, subject: str, words: str, items: list[Condition]) -> list[str]:
        lines = [line for said, code in items for line in [*comment(said), f"{code_text(code)},"]]
        return self._method(purpose, subject, words, ["return (", *indent(lines), ")"] if lines else ["return ()"])

    def _method(self, purpose: str, subject: str, words: str, lines: list[str]) -> list[str]:
        return [f"def {self._layout.methods[purpose, subject]}(self):", f"    {docstring(words)}", *indent(lines)]

    def _node_call(self, number: int) -> Code:
        return call(f"self._node_{number}")

    def _node_function(self, number: int, words: str, body: Block) -> list[str]:
        self.reads[f"self._node_{number}"] = words_of(codes(body))
        return method(f"_node_{number}", words, body)
