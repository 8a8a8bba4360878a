"""Generated methods that tell whether a controllable event is allowed now."""

from robosc.expressions import (
    Expression,
    IntegerType,
    StateTest,
    conjuncts,
)
from robosc.targets import acceptance
from robosc.targets.acceptance import InOneOf, StaysInRange, accepting_conditions, enabling_conditions
from robosc.targets.code.expressions import TRUE_CODE, Code, Sort, call, integer, literal, operation
from robosc.targets.code.text import indent
from robosc.targets.model_text import requirement_text
from robosc.targets.python.changes import reads
from robosc.targets.python.expressions import PYTHON, Precedence, code_text
from robosc.targets.python.text import comment, docstring
from robosc.targets.python.writer import Writer

Condition = tuple[str, Code]
"""Words that explain a condition, and its code."""


def allow_method(writer: Writer, event: str) -> list[str]:
    """The method that tells whether `event` is allowed: plants, ranges, requirements, then the supervisor."""
    conditions = [item for item in _conditions(writer, event) if item[1] != TRUE_CODE]
    name = writer.layout.methods["allow", event]
    writer.reads[f"self.{name}"] = reads(code for _, code in conditions)
    return [
        f"def {name}(self):",
        f"    {docstring(f'Return True if {event} is allowed now.')}",
        *indent(_return_all(conditions)),
    ]


def requirements_method(writer: Writer, communication: str) -> list[str]:
    """The method that tells for each requirement whether it holds."""
    requirements = writer.model.requirements_on(communication)
    body = []
    for requirement in requirements:
        body += comment(requirement_text(requirement))
        body.append(f"{code_text(writer.scope.truth(requirement.condition))},")
    words = f"Return for each requirement on {communication} whether it holds."
    return _tuple_method(writer, ("requirements", communication), words, body)


def conjuncts_method(writer: Writer, communication: str) -> list[str]:
    """The method that tells for each top-level conjunct of the requirements whether it holds."""
    body = [
        f"{code_text(writer.scope.truth(part))},"
        for requirement in writer.model.requirements_on(communication)
        for part in conjuncts(requirement.condition)
    ]
    words = f"Return for each top-level conjunct of the requirements on {communication} whether it holds."
    return _tuple_method(writer, ("conjuncts", communication), words, body)


def _tuple_method(writer: Writer, key: tuple[str, str], words: str, body: list[str]) -> list[str]:
    result = ["return (", *indent(body), ")"] if body else ["return ()"]
    return [f"def {writer.layout.methods[key]}(self):", f"    {docstring(words)}", *indent(result)]


def _return_all(conditions: list[Condition]) -> list[str]:
    if not conditions:
        return ["return True"]
    lines = ["return ("]
    for place, (words, code) in enumerate(conditions):
        text = code_text(code) if len(conditions) == 1 else PYTHON.within(code, Precedence.AND)
        lines += indent([*comment(words), text if place == 0 else f"and {text}"])
    return [*lines, ")"]


def accepted(writer: Writer, event: str) -> list[Condition]:
    """Return the conditions for behaviours to accept a controllable event and keep synthesis variables in range."""
    return [(words, _code(writer, item)) for words, item in accepting_conditions(writer.model, event)]


def _conditions(writer: Writer, event: str) -> list[Condition]:
    found = enabling_conditions(writer.layout.supervisor, event)
    return [*((words, _code(writer, item)) for words, item in found), *_added_condition(writer, event)]


def _code(writer: Writer, condition: acceptance.Condition) -> Code:
    """Return the code that tests whether a condition holds."""
    match condition:
        case InOneOf(automaton=automaton, locations=locations):
            return _in_one_of(writer, automaton, locations)
        case StaysInRange(component=component, state=state, expression=expression, type=type_):
            fits = _fits(writer, type_, expression)
            if fits == TRUE_CODE or state is None:
                return fits
            return writer.scope.either(writer.scope.falsity(StateTest(component, state)), fits)
        case _:
            return writer.scope.truth(condition)


def _in_one_of(writer: Writer, automaton: str, names: tuple[str, ...]) -> Code:
    if len(names) == 1:
        return writer.scope.state_code(automaton, names[0])
    return operation("in", writer.scope.location_code(automaton), literal(repr(names), Sort.TEXT))


def _fits(writer: Writer, type_: IntegerType, expression: Expression) -> Code:
    """Return code for whether an update keeps a synthesis variable in range; an unknown value leaves it alone."""
    low, high = type_.low, type_.high
    code = writer.scope.value(expression)
    if low is None or high is None:
        return TRUE_CODE
    if not code.is_known:
        writer.used.add("stays_in_range")
        return call("stays_in_range", code, integer(low), integer(high))
    if code.is_within(low, high):
        return TRUE_CODE
    return operation("between", integer(low), code, integer(high))


def _added_condition(writer: Writer, event: str) -> list[Condition]:
    diagram = writer.layout.supervisor.added_condition(event)
    if diagram is None:
        return []
    words, code = writer.diagrams.condition(diagram)
    return [(f"added by the supervisor: {words}", code)]
