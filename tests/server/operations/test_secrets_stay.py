"""A server as a program, asked for all kinds of things: its log and metrics hold nothing of a model, and no token."""

import contextlib
import json
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import grpc

from robosc_api.security import Scope, make_token
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc, synthesis_pb2_grpc
from robosc_api.v1 import synthesis_pb2 as pb
from support.waiting import PATIENCE_S

MARKER = "Marker7391"

RIGHT = f"""robot {MARKER} {{
  component {MARKER}Part {{
    incoming message {MARKER}_go with type: none
    outgoing message {MARKER}_stop with type: none
    behaviour {{
      variable {MARKER}_x: enum {{ {MARKER}_a {MARKER}_b }} = {MARKER}_a
      initial marked state {MARKER}_one {{ }}
    }}
  }}
}}
"""
TEXTS = (RIGHT, f"robot {MARKER} {{ {MARKER} ", f'import "{MARKER}"', "", f"{MARKER}\0{MARKER}", "robot R { }")
KINDS = ("check", "synthesize", "generate", "explore", "verify", "explain", "format")
METHODS = ("Check", "Synthesize", "Generate", "Explore", "Verify", "Explain", "Format")


@contextmanager
def program(folder: Path, *words: str) -> Iterator[tuple[str, str]]:
    """The server, its log in a file; yields its address and that of its metrics."""
    command = [
        sys.executable, "-m", "robosc_server.main", "--port", "0", "--worker-processes", "1", "--drain-seconds", "1",
        "--state-dir", str(folder / "state"), "--bundle-bytes", "20000", "--log-format", "json", *words,
    ]  # fmt: skip
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("robosc-server listening on "), (folder / "log").read_text()
        yield (
            line.split()[-1],
            next(entry["address"] for entry in log_of(folder) if entry["event"] == "metrics endpoint is listening"),
        )
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def log_of(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "log").read_text().splitlines()]


def request_for(method: str, text: str) -> Any:
    file = pb.SourceFile(name=f"{MARKER}.rscd", text=text)
    if method == "Format":
        return pb.FormatRequest(file=file)
    request = getattr(pb, f"{method}Request")(bundle=pb.Bundle(main=file, searched=[MARKER]))
    if method == "Generate":
        request.target = MARKER
    if method == "Verify":
        request.properties.append(f"always {MARKER}")
    return request


def ask(call: Any, request: Any, metadata: Any) -> None:
    """Make a call, whatever becomes of it."""
    with contextlib.suppress(grpc.RpcError):
        answer = call(request, metadata=metadata, timeout=PATIENCE_S)
        if hasattr(answer, "cancel"):
            for _ in answer:
                pass


def test_nothing_of_a_model_and_no_token_is_logged(tmp_path: Path) -> None:
    token, line = make_token("laptop", (Scope.SYNTHESIZE,))
    tokens = tmp_path / "tokens"
    tokens.write_text(line)
    tokens.chmod(0o600)
    metadata = (("authorization", f"Bearer {token}"), ("x-request-id", "mine"))
    with program(tmp_path, "--tokens", str(tokens), "--metrics-address", "127.0.0.1:0") as (address, shown_at):
        with grpc.insecure_channel(address) as channel:
            raw: Any = channel
            service: Any = synthesis_pb2_grpc.SynthesisServiceStub(channel)  # type: ignore[no-untyped-call]
            jobs: Any = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
            for method, kind in zip(METHODS, KINDS, strict=True):
                for text in TEXTS:
                    ask(getattr(service, method), request_for(method, text), metadata)
                ask(getattr(service, method), request_for(method, MARKER * 2_500), metadata)
                task = jobs_pb2.Task()
                getattr(task, kind).CopyFrom(request_for(method, RIGHT))
                ask(jobs.SubmitJob, jobs_pb2.SubmitJobRequest(task=task, label=MARKER), metadata)
            ask(jobs.GetJob, jobs_pb2.GetJobRequest(id=MARKER), metadata)
            ask(raw.unary_unary("/robosc_api.v1.SynthesisService/Check"), f"\xff{MARKER}".encode("latin-1"), metadata)
            ask(raw.unary_unary(f"/robosc_api.v1.SynthesisService/{MARKER}"), b"", metadata)
            ask(service.Check, request_for("Check", RIGHT), (("authorization", f"Bearer {token}{MARKER}"),))
        with urllib.request.urlopen(f"http://{shown_at}/metrics", timeout=PATIENCE_S) as answer:
            metrics = answer.read().decode()
    log = (tmp_path / "log").read_text()
    assert MARKER not in log
    assert token not in log
    assert MARKER not in metrics
    calls = [entry for entry in log_of(tmp_path) if entry["event"] == "call"]
    assert len(calls) >= len(METHODS) * (len(TEXTS) + 2)
    assert {entry["caller"] for entry in calls if "caller" in entry} == {"laptop"}
    assert all(entry["request"] for entry in calls)
    assert {"OK", "INVALID_ARGUMENT", "UNAUTHENTICATED"} <= {entry["code"] for entry in calls}
    assert not [entry for entry in log_of(tmp_path) if entry["event"] == "fault"]
