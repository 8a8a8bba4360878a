"""Answers of a server that is one, in messages: the material of what a hostile one sends."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb

FILES = {"a/one.py": (b"print(1)\n", True), "b.txt": (b"", False), "c.txt": ("é".encode() * 50_000, False)}
GRAPH = {
    "initial": 0,
    "states": [
        {"components": {"C": name}, "variables": {"C.x": 1}, "communications": {}, "enabled": ["go"]} for name in "st"
    ],
    "transitions": [[0, "go", 1], [1, "go", 0]],
}


def progress(number: int = 1, stage: str = "synthesis") -> Any:
    """Return a response with the progress of a synthesis."""
    return pb.SynthesizeResponse(progress=pb.Progress(stage=stage, message=f"step {number}"))


def synthesis(**fields: Any) -> Any:
    """A synthesis that found nothing, or what the fields say."""
    chosen = {"status": pb.SYNTHESIS_STATUS_EMPTY, "reason": "because", **fields}
    return pb.SynthesizeResponse(result=pb.SynthesisResult(**chosen))


def supervisor(content: bytes = b"supervisor", **fields: Any) -> Any:
    """A synthesis that found a supervisor."""
    digest = hashlib.sha256(content).digest()
    chosen = {"supervisor": content, "supervisor_digest": digest, "reason": "", **fields}
    return synthesis(status=pb.SYNTHESIS_STATUS_SUPERVISOR, **chosen)


def generation(files: Mapping[str, tuple[bytes, bool]] | None = None, piece: int = 65536) -> list[Any]:
    """A generation of files."""
    chosen = FILES if files is None else files
    items = [
        pb.GeneratedFile(path=path, size=len(data), digest=hashlib.sha256(data).digest(), executable=is_program)
        for path, (data, is_program) in sorted(chosen.items())
    ]
    head = pb.GenerationResult(status=pb.SYNTHESIS_STATUS_SUPERVISOR, files=items, digest=files_digest(items))
    return [pb.GenerateResponse(result=head), *chunks(chosen, piece)]


def chunks(files: Mapping[str, tuple[bytes, bool]], piece: int = 65536) -> list[Any]:
    """The pieces of files."""
    return [
        pb.GenerateResponse(chunk=pb.FileChunk(file=number, offset=offset, data=data[offset : offset + piece]))
        for number, (_, (data, _)) in enumerate(sorted(files.items()))
        for offset in range(0, len(data), piece)
    ]


def files_digest(items: Iterable[Any]) -> bytes:
    """The digest over all files, as the API defines it."""
    parts = [item.path.encode() + b"\0" + bytes([item.executable]) + item.digest for item in items]
    return hashlib.sha256(b"".join(parts)).digest()


def exploration(graph: Any = None, piece: int = 50, **fields: Any) -> list[Any]:
    """An exploration."""
    document = GRAPH if graph is None else graph
    content = document if isinstance(document, bytes) else json.dumps(document).encode()
    chosen = {
        "status": pb.SYNTHESIS_STATUS_SUPERVISOR,
        "states": 2,
        "transitions": 2,
        "size": len(content),
        "digest": hashlib.sha256(content).digest(),
        **fields,
    }
    pieces = [content[place : place + piece] for place in range(0, len(content), piece)]
    head = pb.ExploreResponse(result=pb.ExplorationResult(**chosen))
    return [head, *(pb.ExploreResponse(chunk=item) for item in pieces)]


def explanation(text: str = "{}", status: Any = pb.EXPLANATION_STATUS_SUPERVISOR, reason: str = "") -> Any:
    """An explanation; the text is the document."""
    return pb.ExplainResponse(result=pb.ExplanationResult(status=status, explanation=text, reason=reason))


def verification(report: str = '{"status": "holds"}', status: Any = pb.VERIFICATION_STATUS_PASSED) -> Any:
    """A verification."""
    return pb.VerifyResponse(result=pb.VerificationResult(status=status, report=report))


def job(revision: int = 1, state: Any = jobs_pb2.JOB_STATE_RUNNING, **fields: Any) -> Any:
    """A job."""
    found = jobs_pb2.Job(
        **{
            "id": "job-1",
            "owner": "tester",
            "kind": jobs_pb2.TASK_KIND_SYNTHESIZE,
            "state": state,
            "revision": revision,
            "main_file": "robot.rscd",
            **fields,
        }
    )
    if not found.HasField("create_time"):
        found.create_time.seconds = 1_700_000_000
    if state == jobs_pb2.JOB_STATE_FAILED and not found.HasField("failure"):
        found.failure.reason, found.failure.message = "CPU_LIMIT", "too long"
    return found


def load(*callers: Any, **fields: Any) -> Any:
    """A load of the service."""
    given = {"workers": 4, "running_tasks": 1, "waiting_tasks": 2, "servers": 3, **fields}
    found = jobs_pb2.GetLoadResponse(callers=callers, **given)
    found.time.seconds = 1_700_000_100
    return found


def watched(*jobs: Any) -> list[Any]:
    """Return the responses that a watcher gets."""
    return [jobs_pb2.WatchJobResponse(job=item) for item in jobs]


def enveloped(kind: str, messages: Sequence[Any]) -> list[Any]:
    """Messages of a result as the service for jobs sends them."""
    return [jobs_pb2.GetJobResultResponse(**{kind: message}) for message in messages]
