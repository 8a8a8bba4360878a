"""The page about the interface says what is so."""

import re
from pathlib import Path

from robosc_api.v1 import jobs_pb2, synthesis_pb2
from robosc_server.operations.failures import code_of
from robosc_server.tasks.convert.chunks import CHUNK_BYTES
from robosc_server.tasks.requests import RequestLimits
from robosc_server.tasks.task import Reason, TaskLimits
from support.node import NODE_FOLDER

PAGE = (Path(__file__).parents[2] / "docs" / "api.md").read_text()


def rows(heading: str) -> list[list[str]]:
    """The cells of the table whose first line begins with a word."""
    lines = PAGE.splitlines()
    begin = next(number for number, line in enumerate(lines) if line.startswith(f"| {heading} |"))
    found = []
    for line in lines[begin + 2 :]:
        if not line.startswith("|"):
            break
        found.append([cell.strip() for cell in line.strip("|").split(" | ")])
    return found


def test_every_method_is_there() -> None:
    described = [name for row in rows("method") for name in re.findall(r"`(\w+)`", row[0])]
    services = [*synthesis_pb2.DESCRIPTOR.services_by_name.values(), *jobs_pb2.DESCRIPTOR.services_by_name.values()]
    assert sorted(described) == sorted(method.name for service in services for method in service.methods)


def test_what_streams_is_said_to() -> None:
    for method in synthesis_pb2.DESCRIPTOR.services_by_name["SynthesisService"].methods:
        answer = next(row[3] for row in rows("method") if row[0] == f"`{method.name}`")
        assert answer.startswith("progress") == method.server_streaming


def test_every_reason_is_there_with_its_status() -> None:
    described = {reason: row[1] for row in rows("reason") for reason in re.findall(r"`(\w+)`", row[0])}
    assert described == {reason.value: f"`{code_of(reason).name}`" for reason in Reason}


def test_limits() -> None:
    request, task = RequestLimits(), TaskLimits()
    told = {row[0]: row[1] for row in rows("limit")}
    assert list(told.values()) == [
        f"{request.bundle_bytes // 2**20} MiB",
        f"{request.bundle_files:,} each",
        "100",
        f"{task.seconds:g} s",
        f"{task.cpu_seconds:g} s",
        f"{task.memory_bytes // 2**30} GiB",
        f"{task.nodes:,}",
        f"{task.result_bytes // 2**20} MiB",
    ]
    assert f"at most {CHUNK_BYTES // 1024} KiB" in PAGE
    assert f"at most {request.name_bytes} bytes" in PAGE


def test_the_example_is_a_part_of_the_client_that_is_tested() -> None:
    (example,) = re.findall(r"```typescript\n(.*?)```", PAGE, re.DOTALL)
    assert example in (NODE_FOLDER / "client.ts").read_text()


def test_no_lock_names_a_registry() -> None:
    assert '"resolved"' not in (NODE_FOLDER / "package-lock.json").read_text()
