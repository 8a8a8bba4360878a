"""Generated methods that tell which incoming message a message is, in a supervision layer (language B.13)."""

from robosc.errors import InternalError
from robosc.expressions.text import expression_text
from robosc.model.received import received_paths
from robosc.model.structure import Communication
from robosc.targets.code.text import indent
from robosc.targets.python.expressions import code_text
from robosc.targets.python.received import Reader
from robosc.targets.python.text import comment, docstring
from robosc.targets.python.writer import Writer


def matches_method(writer: Writer, communication: Communication) -> list[str]:
    """The method that tells whether a message is the communication's, by its condition.

    Every part that the condition reads is converted first, whether it decides or not: what is unknown is noted.
    """
    condition, type_ = communication.when, communication.request
    if condition is None or type_ is None:
        raise InternalError(f"{communication.name} has no condition")
    reader = Reader(writer.layout, type_, writer.used)
    for path in received_paths(condition):
        reader.read(path)
    scope = reader.scope
    holds = scope.truth(condition)
    return [
        f"def {writer.layout.methods['matches', communication.name]}(self, data):",
        f"    {docstring(f'Tell whether a message is {communication.name}.')}",
        *indent(reader.take_lines()),
        *indent(comment(f"when: {expression_text(condition)}")),
        f"    return Match({code_text(holds)}, {reader.all_words}, {reader.all_flags})",
    ]
