"""Printer of statements in Python."""

from collections.abc import Sequence

from robosc.targets.code.expressions import Code, variable
from robosc.targets.code.python.expressions import code_text
from robosc.targets.code.python.text import comment, docstring
from robosc.targets.code.statements import Assign, Block, Comment, Do, If, Let, Return, Statement
from robosc.targets.text import indent


def method(name: str, words: str, body: Block, parameters: Sequence[Code] = ()) -> list[str]:
    """A method, which words explain."""
    return function(name, words, body, [variable("self"), *parameters])


def function(name: str, words: str, body: Block, parameters: Sequence[Code]) -> list[str]:
    """A function, which words explain."""
    head = ", ".join(map(code_text, parameters))
    return [f"def {name}({head}):", f"    {docstring(words)}", *indent(statement_lines(body))]


def statement_lines(block: Block) -> list[str]:
    """The lines of statements."""
    return [line for item in block for line in _lines(item)]


def _lines(statement: Statement) -> list[str]:
    match statement:
        case Comment(words):
            return comment(words)
        case Let(place, value):
            return [f"{code_text(place)} = {code_text(value)}"]
        case Assign(place, value, operator):
            return [f"{code_text(place)} {operator}= {code_text(value)}"]
        case Do(code):
            return [code_text(code)]
        case Return(value):
            return [f"return {code_text(value)}"]
        # The printer of C goes the same way; brackets, indentation and the words between differ in every line.
        case If(branches, otherwise):
            lines: list[str] = []
            for condition, body in branches:
                word = "elif" if lines else "if"
                lines += [f"{word} {code_text(condition)}:", *indent(statement_lines(body))]
            return [*lines, "else:", *indent(statement_lines(otherwise))] if otherwise else lines
