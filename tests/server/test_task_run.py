"""The work of each kind against the command line on the same files: the same bytes, the same documents."""

import errno
import hashlib
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from google.protobuf.message import DecodeError, EncodeError

import robosc_server.tasks.run as run_module
from robosc.certification import make_supervisor
from robosc.cli.main import main as robosc
from robosc.json_documents import json_text
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.targets import available_targets
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.convert.chunks import CHUNK_BYTES
from robosc_server.tasks.describe import server_limits, targets_response, version_response
from robosc_server.tasks.exceeded import memory_exceeded, result_too_large
from robosc_server.tasks.memory import is_lack_of_memory
from robosc_server.tasks.requests import RequestLimits, accept_request
from robosc_server.tasks.run import PAUSE_S, ThrottledReports, run_task
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, TaskKind, TaskLimits
from support.models import EMPTY, EXAMPLES, STOPPING
from support.requests import MESSAGES, RESPONSES, bundle_at, small_request

LINE_FOLLOWER = EXAMPLES / "line_follower" / "line_follower.rscd"
MAZE_SOLVER = EXAMPLES / "maze_solver" / "maze_solver.rscd"
NAVIGATION = EXAMPLES / "navigation" / "navigation.rscd"
LIMITS = TaskLimits()
LIVELOCK = """robot R { component C {
    behaviour { initial marked state a { transition goto b } state b { transition goto a } } } }"""

KEPT_TEXT = """robot R { component C {
    outgoing message m with type: string
    behaviour { variable v: string  on response from m do v := value  initial marked state s { } } }
    component D { behaviour { initial marked state a { transition goto b } state b { transition goto a } } } }"""


def outcome(kind: TaskKind, request: Any, limits: TaskLimits = LIMITS) -> Outcome:
    """Return the outcome of an accepted request."""
    task = accept_request(kind, request.SerializeToString(), RequestLimits())
    return run_task(kind, task.request, limits, lambda report: None)


def answers(kind: TaskKind, request: Any) -> list[Any]:
    """The messages that answer a request."""
    found = outcome(kind, request)
    assert isinstance(found, Result), found
    return [RESPONSES[kind].FromString(message) for message in found.messages]


def failure(kind: TaskKind, request: Any, limits: TaskLimits = LIMITS) -> Failure:
    found = outcome(kind, request, limits)
    assert isinstance(found, Failure), found
    return found


CommandLine = Callable[..., tuple[int, str]]


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """Exit status and standard output of `robosc`."""

    def run(*arguments: object) -> tuple[int, str]:
        capsys.readouterr()
        status = robosc([str(argument) for argument in arguments])
        return status, capsys.readouterr().out

    return run


def findings_json(diagnostics: Any) -> list[dict[str, Any]]:
    """Findings as the command line prints them."""
    severities = {pb.SEVERITY_ERROR: "error", pb.SEVERITY_WARNING: "warning", pb.SEVERITY_NOTE: "note"}

    def place(location: Any) -> dict[str, Any]:
        return {name: getattr(location, name) for name in ("file", "line", "column", "length")}

    return [
        {
            "severity": severities[item.severity],
            "code": item.code,
            "message": item.message,
            "fix": item.mend,
            **(place(item.location) if item.HasField("location") else dict.fromkeys(place(item.location))),
            "related": [{"message": other.message, **place(other.location)} for other in item.related],
        }
        for item in diagnostics
    ]


def model_in(folder: Path, text: str) -> Path:
    model = folder / "model.rscd"
    model.write_text(text)
    return model


class TestCheck:
    @pytest.mark.parametrize(
        "text", ["robot R {", "library l { datatype d from a }", "robot R { component C {} component C {} }", "é"]
    )
    def test_the_findings_of_the_command_line(self, tmp_path: Path, cli: CommandLine, text: str) -> None:
        model = model_in(tmp_path, text)
        (answer,) = answers(TaskKind.CHECK, pb.CheckRequest(bundle=bundle_at(model)))
        assert findings_json(answer.diagnostics) == json.loads(cli("check", model, "--json")[1])["diagnostics"]
        assert answer.diagnostics

    def test_a_missing_library_is_reported_with_the_places_that_were_searched(
        self, tmp_path: Path, cli: CommandLine
    ) -> None:
        model = model_in(tmp_path, "import nothing\nrobot R {}")
        request = pb.CheckRequest(bundle=bundle_at(model))
        (answer,) = answers(TaskKind.CHECK, request)
        assert findings_json(answer.diagnostics) == json.loads(cli("check", model, "--json")[1])["diagnostics"]


class TestSynthesize:
    @pytest.mark.parametrize(
        ("model", "deployment"),
        [
            (LINE_FOLLOWER, "controller"),
            (LINE_FOLLOWER.with_name("line_follower_layer.rscd"), "layer"),
            (MAZE_SOLVER, "controller"),
        ],
    )
    def test_the_file_of_the_command_line(self, tmp_path: Path, cli: CommandLine, model: Path, deployment: str) -> None:
        file = tmp_path / "out.rsup"
        status, text = cli("synth", model, "--deployment", deployment, "-o", file, "--json")
        document = json.loads(text)
        number = pb.DEPLOYMENT_LAYER if deployment == "layer" else pb.DEPLOYMENT_CONTROLLER
        request = pb.SynthesizeRequest(bundle=bundle_at(model), options=pb.SynthesisOptions(deployment=number))
        (answer,) = answers(TaskKind.SYNTHESIZE, request)
        result = answer.result
        assert (status, result.status) == (0, pb.SYNTHESIS_STATUS_SUPERVISOR)
        assert result.supervisor == file.read_bytes()
        assert result.supervisor_digest == hashlib.sha256(file.read_bytes()).digest()
        assert findings_json(result.diagnostics) == document["diagnostics"]
        assert result.summary.text == cli("synth", model, "--deployment", deployment)[1]
        assert result.summary.states == str(document["summary"]["states"])
        expected = make_supervisor(load_bundle(model), deployment=Deployment(deployment)).statistics
        assert expected is not None
        figures = result.statistics
        assert (figures.engine, figures.state_bits, figures.iterations) == (
            expected.engine,
            expected.state_bits,
            expected.iterations,
        )
        assert figures.iterations > 0
        assert figures.peak_nodes > 0
        assert (result.reason, result.explanation, result.signature) == ("", "", b"")

    @pytest.mark.parametrize("states", [0, 5, 200_000])
    def test_verified_as_far_as_it_is_asked_for(self, tmp_path: Path, cli: CommandLine, states: int) -> None:
        file = tmp_path / "out.rsup"
        assert cli("synth", LINE_FOLLOWER, "--verify-limit", states, "-o", file)[0] == 0
        options = pb.SynthesisOptions(verified_states=states)
        (answer,) = answers(TaskKind.SYNTHESIZE, pb.SynthesizeRequest(bundle=bundle_at(LINE_FOLLOWER), options=options))
        assert answer.result.supervisor == file.read_bytes()
        assert (b'"not checked"' in file.read_bytes()) is (states < 10)

    def test_no_supervisor(self, tmp_path: Path, cli: CommandLine) -> None:
        model = model_in(tmp_path, EMPTY)
        (answer,) = answers(TaskKind.SYNTHESIZE, pb.SynthesizeRequest(bundle=bundle_at(model)))
        status, text = cli("synth", model, "--json")
        document = json.loads(text)
        assert (status, answer.result.status) == (1, pb.SYNTHESIS_STATUS_EMPTY)
        assert answer.result.reason == document["reason"]
        assert json.loads(answer.result.explanation) == document["explanation"]
        assert not answer.result.HasField("summary")
        assert answer.result.supervisor_digest == b""

    def test_model_errors(self) -> None:
        (answer,) = answers(TaskKind.SYNTHESIZE, small_request(TaskKind.SYNTHESIZE, "robot R {"))
        assert answer.result.status == pb.SYNTHESIS_STATUS_MODEL_ERRORS
        assert answer.result.diagnostics

    def test_silent_steps_that_never_end(self) -> None:
        request = small_request(TaskKind.SYNTHESIZE, LIVELOCK)
        (answer,) = answers(TaskKind.SYNTHESIZE, request)
        assert answer.result.status == pb.SYNTHESIS_STATUS_MODEL_ERRORS
        assert "livelock" in [item.code for item in answer.result.diagnostics]
        request.options.allow_livelock = True
        (answer,) = answers(TaskKind.SYNTHESIZE, request)
        assert answer.result.status == pb.SYNTHESIS_STATUS_SUPERVISOR

    def test_a_cancel_that_must_be_possible(self) -> None:
        request = small_request(TaskKind.SYNTHESIZE, STOPPING)
        request.options.allow_livelock = True
        (answer,) = answers(TaskKind.SYNTHESIZE, request)
        assert answer.result.status == pb.SYNTHESIS_STATUS_MODEL_ERRORS
        (item,) = (item for item in answer.result.diagnostics if item.code == "forbidden-cancel")
        assert item.severity == pb.SEVERITY_ERROR
        assert "forbid a cancel" in answer.result.reason
        # A graph is only looked at.
        result, *_ = answers(TaskKind.EXPLORE, small_request(TaskKind.EXPLORE, STOPPING))
        assert result.result.status == pb.SYNTHESIS_STATUS_SUPERVISOR

    def test_the_same_request_gives_the_same_bytes(self) -> None:
        request = pb.SynthesizeRequest(bundle=bundle_at(MAZE_SOLVER))
        assert outcome(TaskKind.SYNTHESIZE, request) == outcome(TaskKind.SYNTHESIZE, request)


class TestGenerate:
    def written(self, folder: Path) -> dict[str, tuple[bytes, bool]]:
        return {
            path.relative_to(folder).as_posix(): (path.read_bytes(), bool(path.stat().st_mode & 0o100))
            for path in folder.rglob("*")
            if path.is_file() and path.name != ".robosc-manifest.json"
        }

    @pytest.mark.parametrize("target", ["ros2", "c99", "all"])
    def test_the_files_of_the_command_line(self, tmp_path: Path, cli: CommandLine, target: str) -> None:
        folder = tmp_path / "out"
        assert cli("generate", LINE_FOLLOWER, "--target", target, "-o", folder, "--package", "mine")[0] == 0
        generation = pb.GenerateOptions(package="mine")
        request = pb.GenerateRequest(bundle=bundle_at(LINE_FOLLOWER), target=target, generation=generation)
        first, *chunks = answers(TaskKind.GENERATE, request)
        files = first.result.files
        contents = [b""] * len(files)
        order = []
        for message in chunks:
            chunk = message.chunk
            assert len(contents[chunk.file]) == chunk.offset
            assert 0 < len(chunk.data) <= CHUNK_BYTES
            contents[chunk.file] += chunk.data
            order.append(chunk.file)
        assert order == sorted(order)
        whole = hashlib.sha256()
        for file, content in zip(files, contents, strict=True):
            assert (file.size, file.digest) == (len(content), hashlib.sha256(content).digest())
            whole.update(file.path.encode() + b"\0" + (b"\1" if file.executable else b"\0") + file.digest)
        assert first.result.digest == whole.digest()
        paths = [file.path for file in files]
        assert paths == sorted(paths)
        found = {file.path: (content, file.executable) for file, content in zip(files, contents, strict=True)}
        assert found == self.written(folder)

    def test_long_files_come_in_several_pieces(self) -> None:
        text = LINE_FOLLOWER.read_text() + "// " + "x" * 200_000 + "\n"
        request = small_request(TaskKind.GENERATE, text)
        request.target = "c99"
        first, *chunks = answers(TaskKind.GENERATE, request)
        assert first.result.status == pb.SYNTHESIS_STATUS_SUPERVISOR
        assert sum(len(message.chunk.data) for message in chunks) == sum(file.size for file in first.result.files)

    @pytest.mark.parametrize("text", ["robot R {", EMPTY])
    def test_without_a_supervisor_there_are_no_files(self, text: str) -> None:
        (answer,) = answers(TaskKind.GENERATE, small_request(TaskKind.GENERATE, text))
        assert answer.result.status in (pb.SYNTHESIS_STATUS_MODEL_ERRORS, pb.SYNTHESIS_STATUS_EMPTY)
        assert not answer.result.files
        assert answer.result.digest == b""
        assert bool(answer.result.explanation) == (answer.result.status == pb.SYNTHESIS_STATUS_EMPTY)

    def test_a_target_that_refuses_the_model(self) -> None:
        request = small_request(TaskKind.GENERATE, KEPT_TEXT)
        request.target = "c99"
        request.options.allow_livelock = True
        (answer,) = answers(TaskKind.GENERATE, request)
        assert answer.result.status == pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL
        assert "the target c99 does not do received texts that are kept" in answer.result.reason
        assert "livelock" in [item.code for item in answer.result.diagnostics]

    def test_an_unknown_target(self) -> None:
        request = small_request(TaskKind.GENERATE)
        request.target = "pyhton"
        found = failure(TaskKind.GENERATE, request)
        assert (found.reason, found.message) == (
            Reason.MALFORMED_REQUEST,
            "unknown target 'pyhton'; did you mean 'python'?",
        )

    def test_a_supervised_controller_that_cannot_be(self) -> None:
        request = small_request(TaskKind.GENERATE)
        request.generation.supervised.package = "../x"
        found = failure(TaskKind.GENERATE, request)
        assert found.reason is Reason.MALFORMED_REQUEST
        assert "'package' must be the name of a package" in found.message


class TestExplore:
    def test_the_graph_of_the_command_line(self, cli: CommandLine) -> None:
        first, *chunks = answers(TaskKind.EXPLORE, pb.ExploreRequest(bundle=bundle_at(LINE_FOLLOWER)))
        graph = b"".join(message.chunk for message in chunks)
        assert graph.decode() == cli("explore", LINE_FOLLOWER, "--json")[1]
        document = json.loads(graph)
        result = first.result
        assert (result.states, result.transitions) == (len(document["states"]), len(document["transitions"]))
        assert (result.size, result.digest) == (len(graph), hashlib.sha256(graph).digest())
        assert result.status == pb.SYNTHESIS_STATUS_SUPERVISOR

    def test_too_many_states(self) -> None:
        request = pb.ExploreRequest(bundle=bundle_at(LINE_FOLLOWER), maximum_states=3)
        (answer,) = answers(TaskKind.EXPLORE, request)
        assert answer.result.status == pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL
        assert "more than 3 states" in answer.result.reason
        assert answer.result.digest == b""

    def test_silent_steps_that_never_end_are_in_the_graph(self) -> None:
        first, *_ = answers(TaskKind.EXPLORE, small_request(TaskKind.EXPLORE, LIVELOCK))
        assert first.result.states == 2

    def test_no_supervisor(self) -> None:
        (answer,) = answers(TaskKind.EXPLORE, small_request(TaskKind.EXPLORE, EMPTY))
        assert answer.result.status == pb.SYNTHESIS_STATUS_EMPTY
        assert answer.result.explanation


@pytest.fixture(scope="module")
def supervisor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("verify") / "line.rsup"
    assert robosc(["synth", str(LINE_FOLLOWER), "-o", str(file)]) == 0
    return file


class TestVerify:
    def verified(self, model: Path = LINE_FOLLOWER, **fields: Any) -> Any:
        (answer,) = answers(TaskKind.VERIFY, pb.VerifyRequest(bundle=bundle_at(model), **fields))
        return answer.result

    @pytest.mark.parametrize("is_strict", [False, True])
    def test_a_right_supervisor(self, cli: CommandLine, supervisor: Path, is_strict: bool) -> None:
        result = self.verified(supervisor=supervisor.read_bytes(), strict=is_strict)
        status, text = cli("verify", supervisor, LINE_FOLLOWER, "--json", *["--strict"] * is_strict)
        assert (status, result.status, result.report) == (0, pb.VERIFICATION_STATUS_PASSED, text)
        assert result.reason == ""

    def test_a_supervisor_of_another_model(self, cli: CommandLine, supervisor: Path) -> None:
        result = self.verified(MAZE_SOLVER, supervisor=supervisor.read_bytes())
        status, text = cli("verify", supervisor, MAZE_SOLVER, "--json")
        assert (status, result.status, result.report) == (1, pb.VERIFICATION_STATUS_FAILED, text)

    def test_what_was_not_looked_at(self, cli: CommandLine, supervisor: Path) -> None:
        result = self.verified(supervisor=supervisor.read_bytes(), strict=True, maximum_states=1)
        _, text = cli("verify", supervisor, LINE_FOLLOWER, "--json", "--strict", "--limit", "1")
        assert (result.status, result.report) == (pb.VERIFICATION_STATUS_NOT_CHECKED, text)

    def test_texts_with_errors(self, tmp_path: Path, cli: CommandLine, supervisor: Path) -> None:
        model = model_in(tmp_path, "robot R {")
        result = self.verified(model, supervisor=supervisor.read_bytes())
        _, text = cli("verify", supervisor, model, "--json")
        assert (result.status, result.report) == (pb.VERIFICATION_STATUS_FAILED, text)
        assert findings_json(result.diagnostics) == json.loads(text)["diagnostics"]

    def test_a_library(self, tmp_path: Path, supervisor: Path) -> None:
        result = self.verified(model_in(tmp_path, "library l {}"), supervisor=supervisor.read_bytes())
        assert result.status == pb.VERIFICATION_STATUS_NOT_CHECKED
        assert "library" in result.reason

    def test_what_is_no_supervisor(self, tmp_path: Path, cli: CommandLine) -> None:
        file = tmp_path / "no.rsup"
        file.write_bytes(b"nonsense")
        result = self.verified(supervisor=b"nonsense")
        _, text = cli("verify", file, LINE_FOLLOWER, "--json")
        assert (result.status, result.report) == (pb.VERIFICATION_STATUS_FAILED, text)
        assert result.reason == json.loads(text)["reason"]

    def test_another_deployment(self, cli: CommandLine, tmp_path: Path) -> None:
        file = tmp_path / "maze.rsup"
        assert cli("synth", MAZE_SOLVER, "-o", file)[0] == 0
        options = pb.SynthesisOptions(deployment=pb.DEPLOYMENT_LAYER)
        result = self.verified(MAZE_SOLVER, supervisor=file.read_bytes(), options=options)
        _, text = cli("verify", file, MAZE_SOLVER, "--deployment", "layer", "--json")
        assert result.report == text

    @pytest.mark.parametrize(
        ("claims", "status"),
        [
            (["reachable true", "AG EF true"], pb.VERIFICATION_STATUS_PASSED),
            (["never: AG false"], pb.VERIFICATION_STATUS_FAILED),
            (["AG nonsense", "AG ("], pb.VERIFICATION_STATUS_PROPERTY_ERRORS),
        ],
    )
    @pytest.mark.parametrize("is_given", [False, True])
    def test_properties(
        self, cli: CommandLine, supervisor: Path, claims: list[str], status: Any, is_given: bool
    ) -> None:
        options = [word for claim in claims for word in ("--property", claim)]
        _, text = cli("verify", *[supervisor] * is_given, LINE_FOLLOWER, "--json", *options)
        given = supervisor.read_bytes() if is_given else b""
        result = self.verified(supervisor=given, properties=claims)
        assert (result.status, result.report) == (status, text)
        assert bool(result.diagnostics) == (status == pb.VERIFICATION_STATUS_PROPERTY_ERRORS)

    def test_files_of_properties(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: CommandLine) -> None:
        monkeypatch.chdir(tmp_path)
        Path("claims").write_text("# a comment\nreachable true\n\nAG true\n")
        _, text = cli("verify", LINE_FOLLOWER, "--json", "--properties", "claims")
        result = self.verified(property_files=[pb.SourceFile(name="claims", text=Path("claims").read_text())])
        assert (result.status, result.report) == (pb.VERIFICATION_STATUS_PASSED, text)

    def test_no_property_in_a_file(self) -> None:
        request = pb.VerifyRequest(bundle=bundle_at(LINE_FOLLOWER), property_files=[pb.SourceFile(name="a", text="#")])
        found = failure(TaskKind.VERIFY, request)
        assert (found.reason, found.message) == (Reason.MALFORMED_REQUEST, "there is no property in a")

    @pytest.mark.parametrize("text", [EMPTY, "robot R {"])
    def test_no_supervisor(self, tmp_path: Path, cli: CommandLine, text: str) -> None:
        model = model_in(tmp_path, text)
        result = self.verified(model, properties=["reachable true"])
        _, printed = cli("verify", model, "--json", "--property", "reachable true")
        assert (result.status, result.report) == (pb.VERIFICATION_STATUS_NO_SUPERVISOR, printed)


class TestFormat:
    def test_the_layout_of_the_command_line(self, tmp_path: Path, cli: CommandLine) -> None:
        model = model_in(tmp_path, "robot R{component C{}}\r\n")
        request = small_request(TaskKind.FORMAT, "robot R{component C{}}\r\n")
        (answer,) = answers(TaskKind.FORMAT, request)
        assert cli("format", model)[0] == 0
        assert answer.text.encode() == model.read_bytes()
        assert not answer.diagnostics

    def test_syntax_errors(self) -> None:
        (answer,) = answers(TaskKind.FORMAT, small_request(TaskKind.FORMAT, "robot", name="a/b.rscd"))
        assert answer.text == ""
        assert answer.diagnostics[0].location.file == "a/b.rscd"


class TestFailures:
    def test_an_unknown_engine(self) -> None:
        request = small_request(TaskKind.SYNTHESIZE, EMPTY)
        request.options.engine = "abacus"
        found = failure(TaskKind.SYNTHESIZE, request)
        assert found.reason is Reason.MALFORMED_REQUEST
        assert "unknown engine 'abacus'" in found.message

    @pytest.mark.parametrize("kind", [TaskKind.SYNTHESIZE, TaskKind.GENERATE, TaskKind.EXPLORE, TaskKind.VERIFY])
    @pytest.mark.parametrize("is_asked_for", [False, True])
    def test_too_many_nodes(self, kind: TaskKind, is_asked_for: bool) -> None:
        request = small_request(kind, NAVIGATION.read_text())
        if is_asked_for:
            request.options.maximum_nodes = 20
        limits = LIMITS if is_asked_for else replace(LIMITS, nodes=20)
        found = failure(kind, request, limits)
        assert found.reason is Reason.NODE_LIMIT
        advice = f"raise it with --max-nodes, up to {limits.nodes} on this server"
        assert found.message == f"BDD node limit 20 exceeded; {advice}"

    @pytest.mark.parametrize("kind", TaskKind)
    def test_a_result_too_large(self, kind: TaskKind) -> None:
        text = "robot R {" if kind is TaskKind.CHECK else LINE_FOLLOWER.read_text()
        whole = outcome(kind, small_request(kind, text))
        assert isinstance(whole, Result)
        size = sum(map(len, whole.messages))
        assert outcome(kind, small_request(kind, text), replace(LIMITS, result_bytes=size)) == whole
        smaller = replace(LIMITS, result_bytes=size - 1)
        found = failure(kind, small_request(kind, text), smaller)
        assert found == result_too_large(smaller)
        assert f"limit of {size - 1} bytes" in found.message
        assert found.message.endswith("raise result_bytes")

    def test_no_memory(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def greedy(*_: Any) -> Any:
            raise MemoryError

        monkeypatch.setattr(run_module, "check", greedy)
        assert failure(TaskKind.CHECK, small_request(TaskKind.CHECK)) == memory_exceeded(LIMITS)

    def test_the_engine_still_reports_a_lack_of_memory_in_the_words_that_are_known(self) -> None:
        cudd = pytest.importorskip("dd.cudd")
        manager = cudd.BDD(initial_cache_size=2**14, memory_estimate=2**24)
        manager.configure(max_memory=2**20)
        names = [f"x{number}" for number in range(400)]
        manager.declare(*names)
        node = manager.true

        def grow() -> None:
            nonlocal node
            for low, high in zip(names[:200], names[200:], strict=True):
                node = node & ~manager.apply("xor", manager.var(low), manager.var(high))

        with pytest.raises(ValueError, match="NULL") as refused:
            grow()
        assert is_lack_of_memory(refused.value)

    @pytest.mark.parametrize(
        ("error", "reason"),
        [
            (EncodeError("Failed to serialize proto"), Reason.MEMORY_LIMIT),
            (DecodeError("Error parsing message"), Reason.MEMORY_LIMIT),
            (OSError(errno.ENOMEM, "Cannot allocate memory"), Reason.MEMORY_LIMIT),
            (ValueError("`DdNode *node` is `NULL` pointer."), Reason.MEMORY_LIMIT),
            (OSError(errno.ENOENT, "No such file"), Reason.INTERNAL_FAULT),
            (ValueError("NULL"), Reason.INTERNAL_FAULT),
            (RuntimeError("can't start new thread"), Reason.INTERNAL_FAULT),
        ],
    )
    @pytest.mark.parametrize("depth", range(3))
    def test_no_memory_in_other_words(
        self, error: Exception, reason: Reason, depth: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Libraries in C have errors of their own for it, and others may follow from those."""

        def greedy(*_: Any) -> Any:
            try:
                raise error
            except Exception as cause:
                if depth == 1:
                    raise KeyError("name") from cause
                if depth == 2:
                    raise KeyError("name")  # noqa: B904 - while the other one is handled
                raise

        monkeypatch.setattr(run_module, "check", greedy)
        assert failure(TaskKind.CHECK, small_request(TaskKind.CHECK)).reason is reason

    @pytest.mark.parametrize("last", ["yield answer", "raise SystemError('no reason')"])
    def test_a_result_that_no_memory_is_left_for(self, last: str) -> None:
        """The limit of memory is the reason wherever the task ends that has used it all."""
        program = f"""if True:
            import resource
            from robosc_api.v1 import synthesis_pb2 as pb
            from robosc_server.tasks import run
            from robosc_server.tasks.task import TaskKind, TaskLimits
            from robosc_server.workers import confinement

            def greedy(content, limits, on_report):
                answer = pb.ExploreResponse(chunk=bytes(65536))
                kept, size = [], 2**22
                while size >= 1024:
                    try:
                        kept.append(bytearray(size))
                    except MemoryError:
                        size //= 2
                {last}
                yield answer

            run._WORK[TaskKind.EXPLORE] = greedy
            limit = confinement.address_space_bytes() + 40 * 2**20
            resource.setrlimit(resource.RLIMIT_AS, (limit, limit + 2**26))
            found = run.run_task(TaskKind.EXPLORE, b"", TaskLimits(), lambda report: None)
            confinement.raise_memory_limit()
            print(found.reason)
        """
        done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
        assert done.stdout == "MEMORY_LIMIT\n"

    def test_a_fault_reports_places_and_nothing_of_the_model(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def faulty(*_: Any) -> Any:
            try:
                raise KeyError("SecretName")
            except KeyError as error:
                raise RuntimeError("SecretName is not there") from error

        monkeypatch.setattr(run_module, "check", faulty)
        found = failure(TaskKind.CHECK, small_request(TaskKind.CHECK, "robot SecretName {}"))
        assert found.reason is Reason.INTERNAL_FAULT
        assert "SecretName" not in found.message
        assert "KeyError" in found.details
        assert found.details.endswith("RuntimeError")
        assert "in faulty" in found.details
        assert "SecretName is" not in found.details.replace('raise RuntimeError("SecretName is not there")', "")

    def test_every_kind_is_done(self) -> None:
        assert set(run_module._WORK) == set(TaskKind) == set(MESSAGES)


class TestReports:
    def test_each_stage_is_reported_once_if_it_is_short(self) -> None:
        now_s = [0.0]
        reports: list[Report] = []
        paced = ThrottledReports(reports.append, lambda: now_s[0])
        for stage, message, pause_s in [
            ("check", "1", 0.0),
            ("check", "2", PAUSE_S / 2),
            ("synthesis", "3", 0.0),
            ("synthesis", "4", PAUSE_S),
            ("synthesis", "5", PAUSE_S / 2),
            ("check", "6", 0.0),
        ]:
            now_s[0] += pause_s
            paced(Report(stage, message))
        assert [report.message for report in reports] == ["1", "3", "4", "6"]

    def test_of_each_kind(self) -> None:
        for kind, stages in {
            TaskKind.CHECK: ["check"],
            TaskKind.SYNTHESIZE: ["check", "synthesis", "verification", "controller"],
            TaskKind.GENERATE: ["check", "synthesis", "verification", "controller", "generation"],
            TaskKind.EXPLORE: ["check", "synthesis", "verification", "controller", "exploration"],
            TaskKind.VERIFY: ["check", "synthesis", "verification", "controller", "verification"],
            TaskKind.FORMAT: [],
        }.items():
            reports: list[Report] = []
            request = small_request(kind, LINE_FOLLOWER.read_text()).SerializeToString()
            run_task(kind, request, LIMITS, reports.append)
            assert list(dict.fromkeys(report.stage for report in reports)) == list(dict.fromkeys(stages))


class TestDescription:
    def test_targets(self) -> None:
        found = {target.name: target.description for target in targets_response().targets}
        assert list(found) == sorted(found)
        assert found.keys() == {"all", *(info.name for info in available_targets())}
        assert all(found.values())

    def test_version_engines_and_limits(self) -> None:
        limits = server_limits(
            RequestLimits(), TaskLimits(), waiting_tasks=64, waiting_tasks_per_caller=8, retention_seconds=86400.0
        )
        found = version_response(limits)
        assert found.engines[-1] == "autoref"
        printed = json_text({field.name: getattr(found.limits, field.name) for field in found.limits.DESCRIPTOR.fields})
        assert json.loads(printed) == {
            "bundle_bytes": 2**20,
            "bundle_files": 1000,
            "task_seconds": 600.0,
            "task_cpu_seconds": 600.0,
            "task_memory_bytes": 2 * 2**30,
            "task_nodes": 20_000_000,
            "result_bytes": 64 * 2**20,
            "waiting_tasks": 64,
            "waiting_tasks_per_caller": 8,
            "retention_seconds": 86400.0,
        }


def test_definitions_of_ros_types_travel_with_a_bundle_and_common_ones_are_there() -> None:
    text = """robot R {
        interface own use Level from own_msgs
        interface gone use Gone from own_msgs
        interface battery use BatteryState from sensor_msgs
        datatype object Level { levl: double }
        datatype object Battery { percentag: double }
        component C {
            outgoing message level with type: Level links own
            outgoing message charge with type: Battery links battery
        }
    }"""
    main = pb.SourceFile(name="robot.rscd", text=text)
    definitions = [
        pb.SourceFile(name="own_msgs/msg/Level.msg", text="float64 level"),
        pb.SourceFile(name="own_msgs/types.txt", text="msg/Level\n"),
    ]
    for interfaces, searched, expected in (
        (definitions, ["."], ["unknown-ros-type", "needless-property", "needless-property"]),
        ([], ["."], ["definition-not-found", "needless-property"]),
        ([], [], ["needless-property"]),
    ):
        bundle = pb.Bundle(main=main, interfaces=interfaces, searched=searched)
        (answer,) = answers(TaskKind.CHECK, pb.CheckRequest(bundle=bundle))
        assert [item.code for item in answer.diagnostics] == expected


@pytest.mark.parametrize("distribution", ["", "jazzy", "lyrical"])
def test_a_robot_is_checked_against_the_chosen_distribution(distribution: str) -> None:
    text = """robot R {
        interface pose use Pose2D from geometry_msgs
        component C { outgoing message pose with identifier: "/pose", type: none links pose }
    }"""
    bundle = pb.Bundle(main=pb.SourceFile(name="robot.rscd", text=text), distribution=distribution)
    (answer,) = answers(TaskKind.CHECK, pb.CheckRequest(bundle=bundle))
    expected = ["unknown-ros-type"] if distribution == "lyrical" else []
    assert [item.code for item in answer.diagnostics] == expected
