"""Generated methods that compute the data of a request at the moment it is made."""

from robosc.model.structure import ObjectValue, ProvidedValue
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, operation
from robosc.targets.code.provide import first_provided
from robosc.targets.code.python.expressions import constant
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.statements import Block, Let, Return, when

_NOTHING = constant(None)


def provide_method(writer: Writer, communication: str) -> list[str]:
    """The method that gives the data of a request: of the first statement whose condition is true, else none."""
    statements = writer.model.provides_for(communication)
    default = Return(operation("list", TRUE_CODE, _NOTHING))
    body = first_provided(statements, writer.scope, lambda value: _result(writer, value), default)
    words = f"Return data of a request of {communication}: (is known, data); None is the default message."
    return method(writer.layout.methods["provide", communication], words, body)


def _result(writer: Writer, provided: ProvidedValue) -> Block:
    """Statements that return the data; where a part may be unknown, it is computed and tested first."""
    held: list[Let] = []
    data = _data(writer, provided, held)
    tests = [operation("is None", item.place) for item in held]
    refusal = [when(operation("or", *tests), Return(operation("list", FALSE_CODE, _NOTHING)))] if tests else []
    return [*held, *refusal, Return(operation("list", TRUE_CODE, data))]


def _data(writer: Writer, provided: ProvidedValue, held: list[Let]) -> Code:
    if isinstance(provided, ObjectValue):
        entries = [operation("entry", constant(name), _data(writer, item, held)) for name, item in provided.properties]
        return operation("object", operation("list", *entries))
    code = writer.scope.value(provided)
    if code.is_known:
        return code
    held.append(Let(code.held_in(f"data_{len(held) + 1}"), code))
    return held[-1].place
