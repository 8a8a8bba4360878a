"""Another language calls a server: TypeScript, with stubs made from the .proto files, run by Node."""

import base64
import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc import __version__
from robosc.cli.main import main as robosc
from robosc.targets import ALL, available_targets
from support.models import EXAMPLES
from support.service import server_process
from support.typescript import compiled_client
from support.waiting import PATIENCE_S

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The client, compiled with all checks of types."""
    return compiled_client(tmp_path_factory.mktemp("typescript"))


@pytest.fixture(scope="module")
def answers(client: Path) -> Any:
    with server_process() as (_, address):
        ran = subprocess.run(["node", client, address, MODEL], capture_output=True, text=True, timeout=2 * PATIENCE_S)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.fixture
def command_line(capsys: pytest.CaptureFixture[str]) -> Iterator[Any]:
    def run(*arguments: object) -> str:
        capsys.readouterr()
        robosc([str(argument) for argument in arguments])
        return capsys.readouterr().out

    yield run


def test_what_the_server_is(answers: Any) -> None:
    assert answers["version"] == __version__
    assert answers["bundleBytes"] == 2**20
    assert answers["targets"] == sorted([ALL, *(target.name for target in available_targets())])


def test_findings_and_layout(answers: Any) -> None:
    assert answers["findings"] == [["syntax-error", 1, 10]]
    assert answers["formatted"] == "robot R { }\n"


def test_the_supervisor_is_that_of_the_command_line(answers: Any, tmp_path: Path, command_line: Any) -> None:
    file = tmp_path / "out.rsup"
    command_line("synth", MODEL, "-o", file)
    found = answers["synthesis"]
    assert base64.b64decode(found["supervisor"]) == file.read_bytes()
    assert (found["status"], found["states"]) == ("SYNTHESIS_STATUS_SUPERVISOR", "16")
    # The number of reports depends on the time that it took.
    assert set(found["stages"]) <= {"check", "synthesis", "verification", "controller"}
    job = answers["job"]
    assert base64.b64decode(job["supervisor"]) == file.read_bytes()
    assert (job["label"], job["mainFile"]) == ("a job of another language", MODEL.name)
    assert job["states"][-1] == "JOB_STATE_SUCCEEDED"


def test_files_graph_and_verdicts_are_those_of_the_command_line(
    answers: Any, tmp_path: Path, command_line: Any
) -> None:
    command_line("generate", MODEL, "--target", "python", "-o", tmp_path)
    names = [path for path in tmp_path.rglob("*") if path.is_file() and path.name != ".robosc-manifest.json"]
    assert answers["files"] == {path.relative_to(tmp_path).as_posix(): path.read_text() for path in names}
    assert answers["graph"] == json.loads(command_line("explore", MODEL, "--json"))
    properties = ["--property", "reachable true", "--property", "AG false"]
    assert answers["verification"] == {
        "status": "VERIFICATION_STATUS_FAILED",
        "report": json.loads(command_line("verify", MODEL, "--json", *properties)),
    }


def test_a_refusal_reports_its_reason(answers: Any) -> None:
    assert answers["refusal"] == {
        "code": "INVALID_ARGUMENT",
        "message": "a file's name must be relative, not '/etc/passwd'",
        "reason": "MALFORMED_REQUEST",
        "domain": "robosc",
    }
