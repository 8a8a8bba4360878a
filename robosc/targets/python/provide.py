"""Generated methods that compute the data of a request at the moment it is made."""

from robosc.model.structure import ObjectValue, ProvidedValue
from robosc.targets.code.expressions import TRUE_CODE
from robosc.targets.code.text import indent
from robosc.targets.model_text import provide_text
from robosc.targets.python.expressions import code_text
from robosc.targets.python.text import comment, docstring
from robosc.targets.python.writer import Writer


def provide_method(writer: Writer, communication: str) -> list[str]:
    """The method that gives the data of a request: of the first statement whose condition is true, else none."""
    lines = [
        f"def {writer.layout.methods['provide', communication]}(self):",
        f"    {docstring(f'Data of a request of {communication}: (is known, data); None is the default message.')}",
    ]
    for statement in writer.model.provides_for(communication):
        condition = TRUE_CODE if statement.condition is None else writer.scope.truth(statement.condition)
        lines += indent(comment(provide_text(statement)))
        result = _result(writer, statement.value)
        if condition == TRUE_CODE:
            return [*lines, *indent(result)]
        lines += [f"    if {code_text(condition)}:", *indent(result, 2)]
    return [*lines, "    return True, None"]


def _result(writer: Writer, provided: ProvidedValue) -> list[str]:
    """Statements that return the data; where a part may be unknown, it is computed and tested first."""
    locals_: list[tuple[str, str]] = []
    text = _literal(writer, provided, locals_)
    lines = [f"{name} = {code}" for name, code in locals_]
    if locals_:
        tests = " or ".join(f"{name} is None" for name, _ in locals_)
        lines += [f"if {tests}:", "    return False, None"]
    return [*lines, f"return True, {text}"]


def _literal(writer: Writer, provided: ProvidedValue, locals_: list[tuple[str, str]]) -> str:
    if isinstance(provided, ObjectValue):
        entries = (f"{name!r}: {_literal(writer, item, locals_)}" for name, item in provided.properties)
        return "{" + ", ".join(entries) + "}"
    code = writer.scope.value(provided)
    if code.is_known:
        return code_text(code)
    name = f"data_{len(locals_) + 1}"
    locals_.append((name, code_text(code)))
    return name
