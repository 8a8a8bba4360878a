"""`robosc-client` and `robosc` side by side: what one prints and writes, the other one does."""

import io
import json
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from grpc_health.v1 import health_pb2

from robosc.cli.main import main as robosc
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.supervisor import decode, encode
from robosc_api.security import ServerSecurity
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.main import main as robosc_client
from support.answers import exploration, job, supervisor, synthesis, verification
from support.background import has_ended
from support.certificates import Authority
from support.client_commands import Run, interrupted
from support.fake_tasks import TASK_FUNCTION
from support.health_servers import answering
from support.long_work import long_work
from support.models import ACCEPTING, EXAMPLE_DEPLOYMENTS, UNSUPPORTED
from support.models import EXAMPLES as EXAMPLES_FOLDER
from support.mutants import change
from support.scripted_service import scripted
from support.service import logged_server_process, served, server_process
from support.waiting import PATIENCE_S, eventually

EXAMPLES = sorted(EXAMPLES_FOLDER.glob("*/*.rscd"))
NAVIGATION = EXAMPLES_FOLDER / "navigation" / "navigation.rscd"

VERDICT = """{"status": "holds", "properties": [{"name": null, "property": "EF true", "holds": true, "run":
{"kind": "witness", "states": [{"components": {}, "variables": {}, "communications": {}}], "events": [], "left": [],
"loop": null}}]}"""

STATE: dict[str, Any] = {"components": {}, "variables": {}, "communications": {}}


def report_with(**fault: Any) -> str:
    """A report about a supervisor that has one fault."""
    return json.dumps(
        {
            "status": "failed", "model": "R", "deployment": "controller", "checks": {"safe": "failed"},
            "faults": [{"check": "safe", "message": "bad", **fault}], "remarks": [], "states": 1, "transitions": 1,
            "method": "search", "diagnostics": [],
        }
    )  # fmt: skip


ERRONEOUS = "robot R { component C { incoming message go with type: Missing } requirement jump needs C.x }"

EMPTY = """
robot R {
    component C {
        incoming message go with type: none
        behaviour {
            initial state a { on request to go goto b }
            marked state b { }
        }
    }
    requirement go needs C.b
}
"""

DENIED = """
robot R {
    component Door {
        outgoing message opened with type: none
        behaviour { initial marked state shut { on response from opened goto ajar } marked state ajar { } }
    }
    component Base {
        incoming message enter with type: none
        incoming message leave with type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    requirement enter needs Door.ajar
    mission delivery { visit Base.inside then Base.outside }
}
"""

LIVELOCK = """
robot R {
    component C { behaviour { initial marked state a { transition goto b } state b { transition goto a } } }
}
"""

WITH_LIBRARY = """
robot R {
    component Base from Parts import Platform
    requirement go needs Base.ready
}
"""

COMPETING = """
robot R {
    component Lights {
        incoming message red with identifier: "/light", type: none
        incoming message green with identifier: "/light", type: none
    }
}
"""

LIBRARY = """
library Parts {
    component Platform {
        incoming message go with type: none
        behaviour { initial marked state ready { on request to go } }
    }
}
"""


@pytest.fixture(scope="module")
def server() -> Any:
    """Address of a real server, a program of its own."""
    with server_process() as (_, address):
        yield address


@pytest.fixture(scope="module")
def fake() -> Any:
    """Address of a server whose work does what the model's text says."""
    with served(TASK_FUNCTION, worker_processes=2, bundle_bytes=1000) as address:
        yield address


class Outcome(NamedTuple):
    """A command's exit status, texts, and files with their modes."""

    status: int
    output: str
    errors: str
    files: dict[str, tuple[bytes, int]]


Both = Callable[..., Outcome]


@pytest.fixture
def both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], server: Any) -> Both:
    """Run a command here and on the server, each in a folder of its own: the outcome, which must be the same."""

    def run(*arguments: Any, prepare: Callable[[Path], None] | None = None) -> Outcome:
        outcomes = []
        for name, program, more in (("here", robosc, []), ("there", robosc_client, ["--server", server])):
            folder = tmp_path / f"{name}-{len(list(tmp_path.iterdir()))}"
            folder.mkdir()
            monkeypatch.chdir(folder)
            if prepare is not None:
                prepare(folder)
            status = program([*map(str, arguments), *more])
            printed = capfd.readouterr()
            files = {
                str(path.relative_to(folder)): (path.read_bytes(), path.stat().st_mode & 0o777)
                for path in sorted(folder.rglob("*"))
                if path.is_file()
            }
            outcomes.append(Outcome(status, printed.out, printed.err.replace("robosc-client:", "robosc:"), files))
        here, there = outcomes
        assert here == there
        return here

    return run


@pytest.fixture(scope="module")
def supervisors(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a right supervisor, a wrong one, one of another model, and what is none."""
    folder = tmp_path_factory.mktemp("supervisors")
    assert robosc(["synth", str(NAVIGATION), "-o", str(folder / "right.rsup")]) == 0
    assert robosc(["synth", str(EXAMPLES[0]), "-o", str(folder / "other.rsup")]) == 0
    right = decode((folder / "right.rsup").read_bytes())
    (folder / "wrong.rsup").write_bytes(encode(change(right, added=())))
    (folder / "none.rsup").write_bytes(b"{}")
    return folder


def write(folder: Any, text: str, name: str = "robot.rscd") -> Any:
    path = folder / name
    path.write_text(text)
    return path


class TestSameAsHere:
    def test_there_are_examples(self) -> None:
        assert len(EXAMPLES) >= 4

    @pytest.mark.parametrize("json", [[], ["--json"]])
    @pytest.mark.parametrize("model", EXAMPLES, ids=lambda path: path.stem)
    def test_check(self, both: Both, model: Any, json: Any) -> None:
        assert both("check", model, *json).status == 0

    @pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
    def test_synth(self, both: Both, name: str, deployment: Deployment) -> None:
        model = EXAMPLES_FOLDER / f"{name}.rscd"
        found = both("synth", model, "-o", "robot.rsup", "--deployment", deployment)
        assert found.status == 0
        supervisor = decode(found.files["robot.rsup"][0])
        assert supervisor.deployment == deployment
        assert supervisor.certificate.bundle_sha256 == load_bundle(model).digest

    @pytest.mark.parametrize("json", [[], ["--json"]])
    def test_warnings_that_only_synthesis_can_give(self, both: Both, tmp_path: Path, json: Any) -> None:
        found = both("synth", write(tmp_path, COMPETING), *json)
        assert found.status == 0
        assert "'green' and 'red' can both be requested on '/light' in the initial state" in found.output + found.errors

    @pytest.mark.parametrize("model", EXAMPLES, ids=lambda path: path.stem)
    def test_check_that_synthesizes(self, both: Both, model: Any) -> None:
        deployment = "layer" if model.stem.endswith("_layer") else "controller"
        for how in ([], ["--json"]) if model == NAVIGATION else ([],):
            assert both("check", model, "--synthesize", "--deployment", deployment, *how).status == 0

    @pytest.mark.parametrize("how", [[], ["--json"], ["--strict"], ["--engine", "autoref"]])
    @pytest.mark.parametrize(
        ("text", "status"),
        [
            (EMPTY, 1),
            (ERRONEOUS, 1),
            (COMPETING, 0),
            (LIBRARY, 0),
            (UNSUPPORTED, 1),
            (LIVELOCK, 1),
            ("robot R {", 1),
            ("x\0", 1),
        ],
    )
    def test_check_that_synthesizes_in_vain(self, both: Both, tmp_path: Path, text: str, status: int, how: Any) -> None:
        found = both("check", write(tmp_path, text), "--synthesize", *how)
        assert found.status == (1 if how == ["--strict"] and text == COMPETING else status)
        if how == ["--json"] and text == UNSUPPORTED:
            assert json.loads(found.output)["status"] == "unsupported model"

    @pytest.mark.parametrize("how", [[], ["--all"], ["--json"], ["--json", "--all"]])
    @pytest.mark.parametrize("more", [[], ["--synthesize"]])
    def test_what_the_model_accepts(self, both: Both, tmp_path: Path, more: Any, how: Any) -> None:
        found = both("check", write(tmp_path, ACCEPTING), *more, *how)
        assert (found.status, "shared-topic" in found.output + found.errors) == (0, "--all" in how)
        assert ("one of them" in found.output + found.errors) is ("--all" in how and bool(more))

    @pytest.mark.parametrize(
        "how", [["--deployment", "layer"], ["--engine", "cudd"], ["--reorder"], ["--max-nodes", "9"]]
    )
    def test_check_that_does_not_synthesize(self, both: Both, how: Any) -> None:
        assert both("check", EXAMPLES[0], *how).status == 2

    @pytest.mark.parametrize(
        "command", [["synth"], ["check", "--synthesize"], ["explore"], ["generate", "--target", "c99", "-o", "out"]]
    )
    def test_goals_that_cannot_be_reached(self, both: Both, tmp_path: Path, command: Any) -> None:
        model = write(tmp_path, DENIED)
        found = both(command[0], model, *command[1:])
        assert found.status == 1
        assert "  assume Door.shut leads to Door.ajar\n" in found.errors
        assert "'--counter-strategy' play the surroundings" in found.errors
        document = json.loads(both(command[0], model, *command[1:], "--json").output)
        assert document["goals"]["blamed"][0]["text"] == "requirement enter needs Door.ajar"
        assert document["explanation"] is None

    @pytest.mark.parametrize("states", [0, 5, 200_000])
    def test_verify_limit(self, both: Both, states: int) -> None:
        found = both("synth", NAVIGATION, "--verify-limit", states, "-o", "robot.rsup")
        assert (b'"not checked"' in found.files["robot.rsup"][0]) is (states < 10)

    @pytest.mark.parametrize("how", [[], ["-o", "robot.rsup"]])
    def test_synth_json(self, both: Both, how: Any) -> None:
        found = both("synth", EXAMPLES[0], "--json", *how)
        assert '"summary"' in found.output

    @pytest.mark.parametrize("target", ["python", "ros2"])
    def test_generate(self, both: Both, target: Any) -> None:
        model = next(path for path in EXAMPLES if path.stem == "line_follower")
        found = both("generate", model, "--target", target, "-o", "package")
        assert found.status == 0
        assert len(found.files) > 1

    @pytest.mark.parametrize("how", [[], ["--json"], ["--dot"], ["--limit", "3"], ["--deployment", "layer"]])
    def test_explore(self, both: Both, how: Any) -> None:
        model = next(path for path in EXAMPLES if path.stem == "maze_solver")
        assert both("explore", model, *how).status == (1 if "--limit" in how else 0)

    @pytest.mark.parametrize(
        ("name", "how", "status"),
        [
            ("navigation", [], 0),
            ("navigation", ["--json"], 0),
            ("navigation", ["--deployment", "layer"], 0),
            ("navigation", ["--after", "", "--json"], 0),
            ("navigation", ["--event", "nothing"], 2),
            ("navigation", ["--event", "nothing", "--json"], 2),
            ("navigation", ["--state", "nothing"], 2),
        ],
    )
    def test_explain_synthesis(self, both: Both, name: str, how: Any, status: int) -> None:
        model = next(path for path in EXAMPLES if path.stem == name)
        assert both("explain-synthesis", model, *how).status == status

    @pytest.mark.parametrize("text", ["robot R {", "library L { }", EMPTY, DENIED, UNSUPPORTED])
    @pytest.mark.parametrize("how", [[], ["--json"]])
    def test_explain_synthesis_without_a_supervisor(self, both: Both, tmp_path: Path, text: str, how: Any) -> None:
        assert both("explain-synthesis", write(tmp_path, text), *how).status == 1

    @pytest.mark.parametrize(
        ("which", "how", "status"),
        [
            ("right", [], 0),
            ("right", ["--json", "--strict"], 0),
            ("right", ["-q"], 0),
            ("right", ["--deployment", "layer"], 1),
            ("right", ["--limit", "10"], 1),
            ("wrong", [], 1),
            ("wrong", ["--json"], 1),
            ("other", [], 1),
            ("none", [], 1),
            ("none", ["--json"], 1),
        ],
    )
    def test_verify(self, both: Both, supervisors: Any, which: str, how: Any, status: int) -> None:
        assert both("verify", supervisors / f"{which}.rsup", NAVIGATION, *how).status == status

    @pytest.mark.parametrize("how", [[], ["--json"], ["-q"]])
    @pytest.mark.parametrize(
        ("which", "claims"),
        [
            (None, ["AG EF Navigator.idle", "named: invariant Navigator.failures < 2", "AF AX Navigator.idle"]),
            (None, ["A[true U enabled(navigate.request)]", "EG !enabled(navigate.request)"]),
            (None, ["AG nonsense"]),
            (None, ["AG (", "EF true"]),
            ("right", ["reachable Navigator.failures = 2"]),
            ("right", ["AG nonsense"]),
            ("wrong", ["EF true"]),
        ],
    )
    def test_properties(self, both: Both, supervisors: Any, which: str | None, claims: Any, how: Any) -> None:
        chosen = [part for claim in claims for part in ("--property", claim)]
        given = [] if which is None else [supervisors / f"{which}.rsup"]
        both("verify", *given, NAVIGATION, *chosen, *how)

    @pytest.mark.parametrize("how", [[], ["--check"], ["--diff"], ["--json"], ["--json", "--diff"]])
    def test_format(self, both: Both, how: Any) -> None:
        texts = {"a": "robot  R{ }", "b": "robot R { }\n", "c": "robot {", "d": "\ufeffrobot R{ // why\n}"}

        def prepare(folder: Path) -> None:
            for name, text in texts.items():
                (folder / f"{name}.rscd").write_text(text, encoding="utf-8")

        found = both("format", "a.rscd", "b.rscd", "c.rscd", "d.rscd", *how, prepare=prepare)
        assert found.status == 1
        assert (found.files["a.rscd"][0] == b"robot R { }\n") is (how in ([], ["--json"]))

    def test_format_standard_input(self, both: Both, monkeypatch: pytest.MonkeyPatch) -> None:
        def prepare(folder: Path) -> None:
            monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"robot  R{ }")))

        found = both("format", "-", prepare=prepare)
        assert (found.status, found.output) == (0, "robot R { }\n")

    def test_libraries(self, both: Both, tmp_path: Path) -> None:
        model, library = tmp_path / "robot", tmp_path / "parts"
        model.mkdir()
        library.mkdir()
        write(library, LIBRARY, "parts.rscd")
        assert both("synth", write(model, WITH_LIBRARY), "-L", library, "-o", "robot.rsup").status == 0

    @pytest.mark.parametrize("text", [ERRONEOUS, EMPTY, DENIED, "robot R {", "robot", "", "x\0", LIBRARY])
    @pytest.mark.parametrize(
        "command",
        [["check"], ["synth", "-o", "robot.rsup"], ["synth", "--json"], ["generate", "--target", "ros2", "-o", "out"]],
    )
    def test_trouble(self, both: Both, tmp_path: Path, text: str, command: Any) -> None:
        found = both(command[0], write(tmp_path, text), *command[1:])
        assert found.status == (0 if command == ["check"] and text in (EMPTY, DENIED, LIBRARY) else 1)
        assert found.files == {}
        assert "Traceback" not in found.output + found.errors

    def test_not_overwritten(self, both: Both, tmp_path: Path, capfd: pytest.CaptureFixture[str], server: Any) -> None:
        model = EXAMPLES[0]
        changed = tmp_path / "out"
        assert (
            robosc_client(["generate", str(model), "--server", server, "--target", "python", "-o", str(changed)]) == 0
        )
        capfd.readouterr()
        victim = next(path for path in sorted(changed.rglob("*.py")))
        victim.write_text("mine")
        found = both("generate", model, "--target", "python", "-o", changed)
        assert found.status == 1
        assert victim.read_text() == "mine"


class TestExitCodes:
    @pytest.mark.parametrize("command", [["check"], ["synth"], ["generate", "--target", "ros2", "-o", "out"]])
    def test_nobody_there(self, tmp_path: Path, run: Run, command: Any) -> None:
        model = write(tmp_path, "")
        status, _, error = run(command[0], model, *command[1:], "--server", "127.0.0.1:1")
        assert status == 3
        assert error.startswith("robosc-client: no server answers at 127.0.0.1:1: ")
        assert "refused" in error
        assert error.count("\n") == 1

    @pytest.mark.parametrize("command", [["check"], ["synth"], ["bench", "-n", "1"], ["submit", "check"]])
    def test_what_cannot_be_used_never_reaches_a_server(
        self, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch, command: Any
    ) -> None:
        """And is wrong use, from wherever it comes."""
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
        model, none = write(tmp_path, ""), tmp_path / "none"
        (tmp_path / "settings" / "robosc").mkdir(parents=True)
        profile = f"[profiles.lab]\nserver = 'lab.example:1'\ntoken_file = '{tmp_path / 'token'}'\n"
        (tmp_path / "settings" / "robosc" / "client.toml").write_text(profile)
        (tmp_path / "token").write_text("secret")
        (tmp_path / "token").chmod(0o600)
        nobody = ["--server", "127.0.0.1:1"]
        for more in (
            [*nobody, "--ca", none],
            [*nobody, "--ca", model],
            [*nobody, "--certificate", model],
            [*nobody, "--key", model],
            [*nobody, "--tls", "--key", model],
            [*nobody, "--token-file", none],
            ["--profile", "lab"],
        ):
            status, _, error = run(*command, model, *more)
            assert status == 2, more
            assert error.count("\n") == 1
        monkeypatch.setenv("ROBOSC_CA", str(none))
        assert run(*command, model, *nobody)[0] == 2

    @pytest.mark.parametrize(
        "command", [["version"], ["list"], ["watch", "job-1"], ["health"]], ids=lambda words: words[0]
    )
    def test_another_authority(self, tmp_path: Path, run: Run, command: Any) -> None:
        """A server that is there and not believed is not reported as one that is not there."""
        for name in ("theirs", "mine"):
            (tmp_path / name).mkdir()
        certificate, key = Authority(tmp_path / "theirs").sign("server")
        mine = Authority(tmp_path / "mine", "another").file
        with answering(
            health_pb2.HealthCheckResponse.SERVING, ServerSecurity(certificate=certificate, key=key)
        ) as address:
            # Long enough for a handshake: on this machine, now, that shows. There is no retry beyond it.
            for deadline_s in (1, 4, 16, 64):
                given = ["--server", address, "--ca", mine, "--deadline", deadline_s]
                status, _, error = run(*command, *given)
                if "CERTIFICATE_VERIFY_FAILED" in error:
                    break
        assert status == 3
        assert error.startswith(f"robosc-client: no server answers at {address}: ")
        assert "CERTIFICATE_VERIFY_FAILED" in error
        assert error.count("\n") == 1

    def test_deadline(self, tmp_path: Path, run: Run, fake: Any) -> None:
        status, _, error = run(
            "synth", write(tmp_path, "stuck"), "--server", fake, "--deadline", "1", "-o", tmp_path / "x.rsup"
        )
        assert status == 3
        assert "within 1 seconds" in error
        assert not (tmp_path / "x.rsup").exists()

    def test_deadline_of_a_long_synthesis(self, tmp_path: Path, run: Run, server: Any) -> None:
        status, _, error = run("synth", write(tmp_path, long_work(9)), "--server", server, "--deadline", "0.7")
        assert (status, error) == (3, f"robosc-client: no result from {server} within 0.7 seconds\n")
        # Its worker is gone and another one does the next work.
        assert robosc_client(["check", str(EXAMPLES[0]), "--server", server]) == 0

    def test_too_large(self, tmp_path: Path, run: Run, fake: Any) -> None:
        status, _, error = run("check", write(tmp_path, "x" * 2000), "--server", fake)
        assert status == 3
        assert "at most 1000" in error

    def test_fault(self, tmp_path: Path, run: Run, fake: Any) -> None:
        status, _, error = run("check", write(tmp_path, "raise"), "--server", fake)
        assert status == 3
        assert "failed (internal)" in error.splitlines()[-1]

    @pytest.mark.parametrize("arguments", [["--engine", "abacus"], ["--target", "toaster"]])
    def test_unknown_names(self, tmp_path: Path, run: Run, server: Any, arguments: Any) -> None:
        chosen = {"--target": "python", "-o": str(tmp_path / "out"), arguments[0]: arguments[1]}
        more = [part for pair in chosen.items() for part in pair]
        status, _, error = run("generate", EXAMPLES[0], "--server", server, *more)
        assert status == 3
        assert arguments[1] in error
        assert error.count("\n") == 1

    def test_limits_that_no_request_can_say(self, run: Run, supervisors: Path) -> None:
        """Are refused before a server is asked: 0 would be its own limit, and no limit of the caller's."""
        command = ["verify", supervisors / "right.rsup", NAVIGATION, "--limit", "0", "--server", "127.0.0.1:1"]
        status, _, error = run(*command)
        assert status == 2
        assert error == "robosc-client: --limit must be at least 1 for a server\n"

    def test_no_file(self, tmp_path: Path, run: Run, fake: Any) -> None:
        status, _, error = run("check", tmp_path / "none.rscd", "--server", fake)
        assert status == 2
        assert "none.rscd" in error

    @pytest.mark.parametrize(
        "arguments",
        [
            ["--server", "localhost:1", "--profile", "lab"],
            ["--server", "localhost:0"],
            ["--server", "localhost:65536"],
            ["--server", "unix:/tmp/x"],
            ["--server", "localhost:1", "--deadline", "0"],
            ["--server", "localhost:1", "--deadline", "soon"],
            ["--server", "localhost:1", "--deployment", "space"],
        ],
    )
    def test_wrong_use(self, tmp_path: Path, run: Run, arguments: Any) -> None:
        status, _, error = run("synth", write(tmp_path, ""), *arguments)
        assert status == 2
        assert "usage:" in error

    def test_help_lists_them(self, run: Run) -> None:
        assert "exit status:" in run("--help")[1]

    @pytest.mark.parametrize(
        ("command", "has_model"),
        [
            (["synth"], True), (["check"], True), (["submit", "synth"], True), (["get"], True), (["targets"], False),
            (["list"], False), (["version"], False), (["cancel"], False), (["health"], False),
            (["profile", "add"], False), (["profile", "list"], False),
        ],
    )  # fmt: skip
    def test_help_lists_the_command_s_own(self, run: Run, command: Any, has_model: bool) -> None:
        statuses = run(*command, "--help")[1].partition("exit status:")[2]
        assert "  130  Ctrl-C\n" in statuses
        assert ("model" in statuses) is has_model

    def test_verify_names_this_program(self, run: Run) -> None:
        status, _, error = run("verify", NAVIGATION, "--server", "127.0.0.1:1")
        assert status == 2
        assert "(robosc-client verify FILE.rsup MODEL)" in error
        assert "robosc verify" not in error

    @pytest.mark.parametrize(
        ("command", "option"), [("synth", "--max-nodes"), ("explore", "--max-nodes"), ("explore", "--limit")]
    )
    def test_numbers_that_no_request_can_say(self, run: Run, command: str, option: str) -> None:
        status, _, error = run(command, NAVIGATION, option, 10**20, "--server", "127.0.0.1:1")
        assert status == 2
        assert f"{option} must be at most 18446744073709551615" in error

    @pytest.mark.parametrize(
        ("answer", "status", "words"),
        [
            (synthesis(status=pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL, reason="too strange"), 1, "too strange"),
            (supervisor(b"{}"), 3, "supervisor is refused"),
            (supervisor(b"{}", supervisor_digest=bytes(32)), 3, "digest"),
        ],
    )
    def test_odd_answers(self, tmp_path: Path, run: Run, answer: Any, status: Any, words: str) -> None:
        with scripted(Synthesize=[[answer]]) as (address, _):
            model = write(tmp_path, "robot R { }")
            outcome = run("synth", model, "--server", address, "-o", tmp_path / "x.rsup")
        assert outcome[0] == status
        assert words in outcome[2]
        assert outcome[2].count("\n") == 1
        assert not (tmp_path / "x.rsup").exists()

    @pytest.mark.parametrize(
        ("command", "answers"),
        [
            (["explore"], {"Explore": [exploration()]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification('{"properties": []}')]]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification('{"properties": 7}')]]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification("{}")]]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification(VERDICT.replace("true", "false", 1))]]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification(VERDICT.replace('"left"', '"lost"'))]]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification(VERDICT.replace("[{", "[{}, {"))]]}),
            (["verify", "--property", "EF true"], {"Verify": [[verification(VERDICT.replace("null}", "8}"))]]}),
        ],
    )
    def test_documents_of_other_robots(self, tmp_path: Path, run: Run, command: Any, answers: Any) -> None:
        with scripted(**answers) as (address, _):
            model = write(tmp_path, "robot R { }")
            status, _, error = run(command[0], model, *command[1:], "--server", address)
        assert status == 3
        assert "malformed" in error
        assert error.count("\n") == 1

    def test_a_given_supervisor_and_no_report(self, run: Run, supervisors: Path) -> None:
        null_fault = report_with(trace=None, shortest=None, state=None)
        odd_state = report_with(trace=[], shortest=True, state={**STATE, "moods": {}})
        for report in ("{}", '{"status": "passed"}', '{"checks": 7}', null_fault, odd_state):
            with scripted(Verify=[[verification(report)]]) as (address, _):
                outcome = run("verify", supervisors / "right.rsup", NAVIGATION, "--server", address)
            assert outcome[0] == 3
            assert "malformed" in outcome[2]
        sound = report_with(trace=["go"], shortest=True, state=STATE)
        with scripted(Verify=[[verification(sound)]]) as (address, _):
            assert run("verify", supervisors / "right.rsup", NAVIGATION, "--server", address)[0] == 1

    def test_nothing_moves_the_cursor(self, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
        """Check for any text from a server: neither stream gets a character that a terminal obeys."""
        evil = "\x1b]0;owned\x07\x9b2J\u202e"
        place = pb.Location(file=evil, line=1, column=1, length=1)
        finding = pb.Diagnostic(
            severity=pb.SEVERITY_WARNING, code=evil, message=evil, mend=evil, location=place,
            related=[pb.RelatedPlace(message=evil, location=place)],
        )  # fmt: skip
        answers = {
            "Check": [[pb.CheckResponse(diagnostics=[finding])]],
            "Synthesize": [[synthesis(reason=evil, diagnostics=[finding])]],
            "Verify": [
                [
                    pb.VerifyResponse(
                        result=pb.VerificationResult(
                            status=pb.VERIFICATION_STATUS_NO_SUPERVISOR, reason=evil, report="{}"
                        )
                    )
                ]
            ],
            "ListTargets": [[pb.ListTargetsResponse(targets=[pb.Target(name=evil, description=evil)])]],
            "GetVersion": [[pb.GetVersionResponse(version=evil, engines=[evil])]],
        }
        model = str(write(tmp_path, "robot R { }"))
        commands = [["check", model], ["synth", model], ["verify", model, "--property", "EF true"]]
        with scripted(**answers) as (address, _):
            for command in [*commands, ["targets"], ["version"]]:
                for more in ([], ["--json"]):
                    robosc_client([*command, *more, "--server", address])
                    printed = capfd.readouterr()
                    for character in printed.out + printed.err:
                        assert character.isprintable() or character == "\n"


class TestPrograms:
    @pytest.mark.parametrize(
        "command",
        [
            ["check", "MODEL"],
            ["check", "MODEL", "--synthesize"],
            ["synth", "MODEL"],
            ["generate", "MODEL", "--target", "ros2", "-o", "out"],
            ["verify", "MODEL", "--property", "EF true"],
            ["format", "MODEL"],
            ["submit", "format", "MODEL"],
            ["watch", "job-1"],
            ["list"],
            ["bench", "MODEL", "-c", "3"],
        ],
        ids=" ".join,
    )
    def test_interrupted_client(self, tmp_path: Path, command: Any) -> None:
        begun, ended = threading.Event(), threading.Event()

        def stuck(context: Any) -> None:
            context.add_callback(ended.set)
            begun.set()
            ended.wait(PATIENCE_S)

        model = write(tmp_path, "robot R { }")
        services = (
            pb.DESCRIPTOR.services_by_name["SynthesisService"],
            jobs_pb2.DESCRIPTOR.services_by_name["JobService"],
        )
        answers = {method.name: [[stuck]] for service in services for method in service.methods}
        with scripted(**answers) as (address, _):
            given = [str(model) if word == "MODEL" else word for word in command]
            words = ["-m", "robosc_client.command", *given, "--server", address]
            status, output, error = interrupted(words, begun)
            assert (status, output, error) == (130, "", "robosc-client: interrupted\n")
            assert ended.wait(PATIENCE_S)

    @pytest.mark.parametrize("json", [[], ["--json"]])
    def test_a_reader_who_leaves(self, json: Any) -> None:
        """A reader such as `| head` leaves: that is no fault, and it is not reported."""
        page = jobs_pb2.ListJobsResponse(
            jobs=[job(id=f"job-{number}") for number in range(100)], next_page_token="more"
        )
        pages = [[jobs_pb2.ListJobsResponse(jobs=page.jobs, next_page_token=str(number))] for number in range(50)]
        with scripted(ListJobs=pages) as (address, _):
            words = ["-m", "robosc_client.command", "list", "--most", "5000", "--server", address, *json]
            with subprocess.Popen(
                [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            ) as process:
                assert process.stdout is not None
                assert process.stdout.readline()
                process.stdout.close()
                assert process.stderr is not None
                assert process.stderr.read() == ""
                assert process.wait(PATIENCE_S) == 0

    @pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
    def test_server_stops_gracefully(self, number: Any, capfd: pytest.CaptureFixture[str]) -> None:
        with logged_server_process() as (process, address, log):
            workers = children(process.pid)
            assert workers
            assert robosc_client(["check", str(EXAMPLES[0]), "--server", address]) == 0
            process.send_signal(number)
            assert process.wait(PATIENCE_S) == 0, "".join(log)
            assert process.stdout is not None
            assert process.stdout.read() == ""
        assert all(eventually(partial(has_ended, pid)) for pid in workers)

    def test_a_killed_server_leaves_no_workers(self) -> None:
        with server_process() as (process, _):
            workers = children(process.pid)
            assert workers
            process.kill()
            process.wait(PATIENCE_S)
            assert all(eventually(partial(has_ended, pid)) for pid in workers)


def children(pid: Any) -> Any:
    """Numbers of a process's children."""
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        # A thread may end meanwhile.
        with suppress(FileNotFoundError, ProcessLookupError):
            found += map(int, (task / "children").read_text().split())
    return found
