"""Generated methods that decide which incoming message a message is, in a supervision layer."""

from robosc.errors import InternalError
from robosc.expressions.text import expression_text
from robosc.model.received import received_paths
from robosc.model.structure import Communication
from robosc.targets.code.expressions import call, variable
from robosc.targets.code.python.received import Reader
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.statements import Comment, Return


def matches_method(writer: Writer, communication: Communication) -> list[str]:
    """The method that says whether a message is the communication's, by its condition.

    Every part that the condition reads is converted first, whether it decides or not: what is unknown is noted.
    """
    condition, type_ = communication.when, communication.request
    if condition is None or type_ is None:
        raise InternalError(f"{communication.name} has no condition")
    reader = Reader(writer.layout, type_, writer.used)
    for path in received_paths(condition):
        reader.read(path)
    name, words = (
        writer.layout.methods["matches", communication.name],
        f"Return whether a message is {communication.name}.",
    )
    holds = Return(call("Match", reader.scope.truth(condition), *reader.noted))
    body = [*reader.take(), Comment(f"when: {expression_text(condition)}"), holds]
    return method(name, words, body, [variable("data")])
