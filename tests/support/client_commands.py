"""Commands of the client in this process, and what a server that a test has written answers them with."""

import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest

from robosc.certification import make_supervisor
from robosc.supervisor import encode
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.main import main
from support.answers import enveloped, job, supervisor
from support.models import EXAMPLES, example_bundle
from support.waiting import PATIENCE_S

MODEL = str(EXAMPLES / "line_follower" / "line_follower.rscd")


def encoded_supervisor(example: str) -> bytes:
    """The file of an example's supervisor."""
    made = make_supervisor(example_bundle(f"{example}/{example}")).supervisor
    assert made is not None
    return encode(made)


MADE = supervisor(encoded_supervisor("line_follower"))
FINDING = pb.Diagnostic(
    severity=pb.SEVERITY_ERROR, code="x", message="bad", location=pb.Location(file="robot.rscd", line=1, column=1)
)
NOTHING: Any = {"status": pb.SYNTHESIS_STATUS_MODEL_ERRORS, "diagnostics": [FINDING]}
SUCCEEDED = jobs_pb2.JOB_STATE_SUCCEEDED

Run = Callable[..., tuple[int, str, str]]
"""A command's exit status, output and errors from its arguments."""


def run(capfd: pytest.CaptureFixture[str], *arguments: Any) -> tuple[int, str, str]:
    """Exit status, output and errors of a command."""
    try:
        status = main([*map(str, arguments)])
    except SystemExit as left:
        assert isinstance(left.code, int)
        status = left.code
    printed = capfd.readouterr()
    assert "Traceback" not in printed.err
    return status, printed.out, printed.err


def interrupted(words: list[str], begun: threading.Event) -> tuple[int, str, str]:
    """Exit status, output and errors of a program that is interrupted once its call has begun."""
    with subprocess.Popen(
        [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert begun.wait(PATIENCE_S)
        process.send_signal(signal.SIGINT)
        output, error = process.communicate(timeout=PATIENCE_S)
    return process.returncode, output, error


def job_answers(kind: str, messages: Any) -> Any:
    """The answers about a job of a kind that has ended with these messages."""
    found = job(9, SUCCEEDED, kind=getattr(jobs_pb2, f"TASK_KIND_{kind.upper()}"))
    return {"GetJob": [[jobs_pb2.GetJobResponse(job=found)]], "GetJobResult": [enveloped(kind, messages)]}
