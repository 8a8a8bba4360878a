"""Printer of statements in C."""

from robosc.targets.code.c.expressions import c_type, code_text
from robosc.targets.code.c.text import comment, declared
from robosc.targets.code.expressions import Sort, operation, variable
from robosc.targets.code.statements import Assign, Block, Comment, Do, If, Let, Return, Statement
from robosc.targets.text import indent


def unused(*names: str) -> list[Statement]:
    """Statements that use what may be unused otherwise, of which compilers warn."""
    return [Do(operation("void", variable(name))) for name in names]


def statement_lines(block: Block) -> list[str]:
    """The lines of statements."""
    return [line for item in block for line in _lines(item)]


def _lines(statement: Statement) -> list[str]:
    match statement:
        case Comment(words):
            return comment(words) if words else []
        case Let(place, value, type_):
            # A text is constant already, as is what an array's pointer points to.
            constant = "" if type_ or value.sort is Sort.TEXT else "const "
            return [f"{constant}{declared(type_ or c_type(value.sort), place.word)} = {code_text(value)};"]
        case Assign(place, value, operator):
            return [f"{code_text(place)} {operator}= {code_text(value)};"]
        case Do(code):
            return [f"{code_text(code)};"]
        case Return(value):
            return [f"return {code_text(value)};"]
        case If(branches, otherwise):
            lines: list[str] = []
            for condition, body in branches:
                word = "} else if" if lines else "if"
                lines += [f"{word} ({code_text(condition)}) {{", *indent(statement_lines(body))]
            return [*lines, *(["} else {", *indent(statement_lines(otherwise))] if otherwise else []), "}"]
