"""Requests to the synthesis service, as messages."""

from pathlib import Path
from typing import Any

from robosc.language import load_bundle
from robosc.source import Bundle
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.task import TaskKind

MESSAGES: dict[TaskKind, Any] = {
    TaskKind.CHECK: pb.CheckRequest,
    TaskKind.SYNTHESIZE: pb.SynthesizeRequest,
    TaskKind.GENERATE: pb.GenerateRequest,
    TaskKind.EXPLORE: pb.ExploreRequest,
    TaskKind.VERIFY: pb.VerifyRequest,
    TaskKind.EXPLAIN: pb.ExplainRequest,
    TaskKind.FORMAT: pb.FormatRequest,
}
RESPONSES: dict[TaskKind, Any] = {
    TaskKind.CHECK: pb.CheckResponse,
    TaskKind.SYNTHESIZE: pb.SynthesizeResponse,
    TaskKind.GENERATE: pb.GenerateResponse,
    TaskKind.EXPLORE: pb.ExploreResponse,
    TaskKind.VERIFY: pb.VerifyResponse,
    TaskKind.EXPLAIN: pb.ExplainResponse,
    TaskKind.FORMAT: pb.FormatResponse,
}


def bundle_message(bundle: Bundle) -> pb.Bundle:
    """A bundle as a client sends it."""

    def files(texts: Any) -> list[pb.SourceFile]:
        return [pb.SourceFile(name=text.name, text=text.text) for text in texts]

    return pb.Bundle(
        main=files([bundle.main])[0],
        libraries=files(bundle.libraries),
        searched=bundle.searched,
        interfaces=files(bundle.interfaces),
    )


def automata_bundle(text: str, language: pb.Language, name: str, **imported: str) -> pb.Bundle:
    """Automata, and the files that they import by name."""
    return pb.Bundle(
        main=pb.SourceFile(name=name, text=text),
        libraries=[pb.SourceFile(name=key, text=imported[key]) for key in imported],
        language=language,
    )


def bundle_at(model: Path) -> pb.Bundle:
    """A model's file and its libraries."""
    return bundle_message(load_bundle(model))


def varint(number: int) -> bytes:
    """A number in the variable length that Protocol Buffers give it."""
    found = b""
    while number > 0x7F:
        found += bytes([number & 0x7F | 0x80])
        number >>= 7
    return found + bytes([number])


def small_request(kind: TaskKind, text: str = "", name: str = "robot.rscd") -> Any:
    """A request of a kind with the least that it needs."""
    main = pb.SourceFile(name=name, text=text)
    if kind is TaskKind.FORMAT:
        return pb.FormatRequest(file=main)
    extra: dict[TaskKind, dict[str, Any]] = {
        TaskKind.GENERATE: {"target": "python"},
        TaskKind.VERIFY: {"properties": ["invariant true"]},
    }
    return MESSAGES[kind](bundle=pb.Bundle(main=main), **extra.get(kind, {}))
