"""Generated methods that tell whether a controllable event is allowed now, and which requirements hold."""

from collections.abc import Iterable, Sequence

from robosc.automata import System
from robosc.expressions import Value, conjuncts
from robosc.supervisor import DecisionNode
from robosc.targets.code.conditions import Condition, Conditions, node_words
from robosc.targets.code.expressions import Code, Kind, Sort, call, literal, operation
from robosc.targets.code.text import indent
from robosc.targets.model_text import requirement_text
from robosc.targets.python.expressions import PYTHON, Precedence, Scope, code_text
from robosc.targets.python.layout import Layout
from robosc.targets.python.text import comment, docstring


class PythonConditions(Conditions):
    """Writes conditions over the state in Python.

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
        self._python = scope
        self.reads: dict[str, set[str]] = {}

    def allow_method(self, event: str) -> list[str]:
        """The method that tells whether `event` is allowed: plants, ranges, requirements, then the supervisor."""
        conditions = self.enabling(event)
        name = self._layout.methods["allow", event]
        self._note(name, (code for _, code in conditions))
        return [
            f"def {name}(self):",
            f"    {docstring(f'Return True if {event} is allowed now.')}",
            *indent(_return_all(conditions)),
        ]

    def requirements_method(self, communication: str) -> list[str]:
        """The method that tells for each requirement whether it holds."""
        body = []
        for requirement in self._layout.model.requirements_on(communication):
            body += comment(requirement_text(requirement))
            body.append(f"{code_text(self._scope.truth(requirement.condition))},")
        words = f"Return for each requirement on {communication} whether it holds."
        return self._tuple_method(("requirements", communication), words, body)

    def conjuncts_method(self, communication: str) -> list[str]:
        """The method that tells for each top-level conjunct of the requirements whether it holds."""
        body = [
            f"{code_text(self._scope.truth(part))},"
            for requirement in self._layout.model.requirements_on(communication)
            for part in conjuncts(requirement.condition)
        ]
        words = f"Return for each top-level conjunct of the requirements on {communication} whether it holds."
        return self._tuple_method(("conjuncts", communication), words, body)

    def _tuple_method(self, key: tuple[str, str], words: str, body: list[str]) -> list[str]:
        result = ["return (", *indent(body), ")"] if body else ["return ()"]
        return [f"def {self._layout.methods[key]}(self):", f"    {docstring(words)}", *indent(result)]

    def _note(self, method: str, codes: Iterable[Code]) -> None:
        pieces = (piece for code in codes for piece in code.pieces())
        self.reads[f"self.{method}"] = {piece.word for piece in pieces if piece.kind in (Kind.PLACE, Kind.CALL)}

    def _node_call(self, number: int) -> Code:
        return call(f"self._node_{number}")

    def _node_function(self, number: int, node: DecisionNode, branches: tuple[Code, ...]) -> list[str]:
        values = self._formulas.domains[node.automaton, node.variable]
        if node.variable is None:
            subject = self._python.location_code(node.automaton)
        else:
            subject = self._python.variable_code(node.automaton, node.variable)
        self._note(f"_node_{number}", [subject, *branches])
        ends = [*node.starts[1:], len(values)]
        body = []
        for start, end, branch in list(zip(node.starts, ends, branches, strict=True))[:-1]:
            test = self._test(subject, values, start, end)
            body += [f"if {code_text(test)}:", f"    return {code_text(branch)}"]
        body.append(f"return {code_text(branches[-1])}")
        return [f"def _node_{number}(self):", f"    {docstring(node_words(node))}", *indent(body)]

    def _test(self, subject: Code, values: Sequence[Value], start: int, end: int) -> Code:
        """Return a test that the subject has one of `values[start:end]`, all earlier ones being excluded already."""
        if isinstance(values[0], bool):
            return subject if values[end - 1] else self._scope.negated(subject)
        if isinstance(values[0], int):
            return operation("<", subject, literal(repr(values[end]), Sort.INTEGER))
        if end - start == 1:
            return operation("=", subject, literal(repr(values[start]), Sort.ENUM))
        return operation("in", subject, literal(repr(tuple(values[start:end])), Sort.ENUM))


def _return_all(conditions: list[Condition]) -> list[str]:
    if not conditions:
        return ["return True"]
    lines = ["return ("]
    for place, (words, code) in enumerate(conditions):
        text = code_text(code) if len(conditions) == 1 else PYTHON.within(code, Precedence.AND)
        lines += indent([*comment(words), text if place == 0 else f"and {text}"])
    return [*lines, ")"]
