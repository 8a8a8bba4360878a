"""Automata as requests: what is refused by its name, what a worker makes of them, and a real server over a socket."""

import json
from collections.abc import Iterator
from typing import Any, cast

import grpc
import pytest
from google.rpc import error_details_pb2
from grpc_status import rpc_status

import robosc
from robosc.pipeline.systems import decode_system
from robosc.supervisor import codec
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc, synthesis_pb2_grpc
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.requests import RequestLimits, accept_request
from robosc_server.tasks.run import run_task
from robosc_server.tasks.task import Failure, Outcome, Reason, RefusedError, Result, TaskKind, TaskLimits
from support.automata_models import BUFFER, DOOR, EMPTY, TANK, TWO_TANKS, WRONG
from support.requests import MESSAGES, RESPONSES, automata_bundle, small_request
from support.service import served
from support.waiting import PATIENCE_S

STUB: Any = synthesis_pb2_grpc.SynthesisServiceStub
JOBS: Any = jobs_pb2_grpc.JobServiceStub
LIMITS = TaskLimits()
MAKING = (TaskKind.SYNTHESIZE, TaskKind.GENERATE, TaskKind.EXPLORE, TaskKind.VERIFY, TaskKind.EXPLAIN)


def cif(text: str = TANK, **imported: str) -> pb.Bundle:
    return automata_bundle(text, pb.LANGUAGE_CIF, "tank.cif", **imported)


def request(kind: TaskKind, bundle: pb.Bundle, **more: Any) -> Any:
    target = {"target": "cif"} if kind is TaskKind.GENERATE else {}
    return MESSAGES[kind](bundle=bundle, **(target | more))


def refusal(kind: TaskKind, message: Any) -> str:
    with pytest.raises(RefusedError) as caught:
        accept_request(kind, message.SerializeToString(), RequestLimits())
    assert caught.value.reason is Reason.MALFORMED_REQUEST
    return str(caught.value)


def outcome(kind: TaskKind, message: Any, limits: TaskLimits = LIMITS) -> Outcome:
    task = accept_request(kind, message.SerializeToString(), RequestLimits())
    return run_task(kind, task.request, limits, lambda report: None)


def answers(kind: TaskKind, message: Any) -> list[Any]:
    found = outcome(kind, message)
    assert isinstance(found, Result), found
    return [RESPONSES[kind].FromString(item) for item in found.messages]


OPTIONS_OF_ROBOTS: dict[str, Any] = {
    "deployment": pb.DEPLOYMENT_LAYER,
    "allow_livelock": True,
    "verified_states": 0,
}


class TestAcceptance:
    def test_the_same_text_in_two_languages_is_two_tasks(self) -> None:
        languages = (pb.LANGUAGE_UNSPECIFIED, pb.LANGUAGE_ROBOSC, pb.LANGUAGE_CIF)
        bundles = [pb.Bundle(main=pb.SourceFile(name="tank.cif", text=TANK), language=item) for item in languages]
        for kind in (TaskKind.CHECK, TaskKind.SYNTHESIZE, TaskKind.EXPLORE, TaskKind.GENERATE):
            unsaid, robosc_, of_cif = (
                accept_request(kind, request(kind, item).SerializeToString(), RequestLimits()).key for item in bundles
            )
            assert unsaid == robosc_ != of_cif

    def test_what_changes_the_result_changes_the_key(self) -> None:
        def key(kind: TaskKind, **more: Any) -> str:
            return accept_request(kind, request(kind, cif(), **more).SerializeToString(), RequestLimits()).key

        for kind, more in (
            (TaskKind.SYNTHESIZE, {"modular": True}),
            (TaskKind.GENERATE, {"initial": "tank.level = 1"}),
            (TaskKind.GENERATE, {"modular": True}),
            (TaskKind.VERIFY, {"strict": True}),
            (TaskKind.VERIFY, {"controller": True}),
            (TaskKind.VERIFY, {"as_is": True}),
        ):
            assert key(kind) != key(kind, **more)

    def test_a_language_has_its_endings(self) -> None:
        for language, ending in (
            (pb.LANGUAGE_CIF, ".cif"),
            (pb.LANGUAGE_FAUDES, ".gen"),
            (pb.LANGUAGE_SUPREMICA, ".wmod"),
        ):
            message = request(TaskKind.CHECK, automata_bundle("", language, "tank.rscd"))
            assert refusal(TaskKind.CHECK, message).startswith(
                f"a file of this language has a name that ends in {ending}"
            )
        message = request(TaskKind.CHECK, automata_bundle("", 77, "tank.cif"))  # type: ignore[arg-type]
        assert refusal(TaskKind.CHECK, message) == "the request has the unknown language 77"

    @pytest.mark.parametrize("name", ["/etc/tank.cif", "C:tank.cif", "\\\\host\\tank.cif"])
    def test_no_file_has_a_place_on_a_machine(self, name: str) -> None:
        assert "must be relative" in refusal(TaskKind.CHECK, request(TaskKind.CHECK, cif(**{name: ""})))

    @pytest.mark.parametrize(
        ("kind", "name", "value"),
        [
            *[
                (kind, name, {"options": pb.SynthesisOptions(**{name: value})})
                for kind in MAKING
                for name, value in OPTIONS_OF_ROBOTS.items()
            ],
            (TaskKind.GENERATE, "publish_state", {"generation": pb.GenerateOptions(publish_state=True)}),
            (TaskKind.GENERATE, "log_events", {"generation": pb.GenerateOptions(log_events=True)}),
            (TaskKind.GENERATE, "supervised", {"generation": pb.GenerateOptions(supervised=pb.SupervisedController())}),
            (TaskKind.GENERATE, "metadata", {"generation": pb.GenerateOptions(metadata=pb.PackageMetadata())}),
            (TaskKind.GENERATE, "state_message", {"generation": pb.GenerateOptions(state_message="json")}),
            (TaskKind.VERIFY, "supervisor", {"supervisor": b"x"}),
            (TaskKind.VERIFY, "properties", {"properties": ["invariant true"]}),
            (TaskKind.VERIFY, "property_files", {"property_files": [pb.SourceFile(name="p.txt")]}),
        ],
    )
    def test_what_is_of_robots_is_refused(self, kind: TaskKind, name: str, value: dict[str, Any]) -> None:
        message = request(kind, cif(), **value)
        assert refusal(kind, message) == f"{name} applies to RoboSC models, and the request has automata"

    def test_files_of_robots_are_refused(self) -> None:
        others: dict[str, pb.Bundle] = {
            "searched": pb.Bundle(searched=["here"]),
            "distribution": pb.Bundle(distribution="jazzy"),
            "interfaces": pb.Bundle(interfaces=[pb.SourceFile(name="a/msg/B.msg")]),
        }
        for name, other in others.items():
            bundle = cif()
            bundle.MergeFrom(other)
            assert refusal(TaskKind.CHECK, request(TaskKind.CHECK, bundle)).startswith(
                f"{name} applies to RoboSC models"
            )
        plain = automata_bundle(BUFFER, pb.LANGUAGE_FAUDES, "line.gen", **{"other.gen": BUFFER})
        assert refusal(TaskKind.CHECK, request(TaskKind.CHECK, plain)).startswith("libraries: plain automata import no")

    def test_what_is_of_automata_is_refused_for_robots(self) -> None:
        message = small_request(TaskKind.GENERATE)
        message.initial = "A = a"
        problem = "initial applies to automata, and the request has a RoboSC model"
        assert refusal(TaskKind.GENERATE, message) == problem
        message = request(TaskKind.EXPLAIN, cif(), modular=True)
        assert refusal(TaskKind.EXPLAIN, message).startswith("modular applies to RoboSC models")
        message = small_request(TaskKind.EXPLAIN)
        message.modular, message.state = True, "A.a"
        assert refusal(TaskKind.EXPLAIN, message).startswith("modular explains events")
        message = pb.VerifyRequest(bundle=small_request(TaskKind.CHECK).bundle, strict=True)
        assert "apply only to a given supervisor" in refusal(TaskKind.VERIFY, message)
        for name in ("controller", "as_is"):
            message = pb.VerifyRequest(bundle=small_request(TaskKind.CHECK).bundle, supervisor=b"x")
            setattr(message, name, True)
            assert refusal(TaskKind.VERIFY, message) == "controller and as_is apply only to automata"

    def test_targets_that_cannot_be_are_refused(self) -> None:
        message = request(TaskKind.GENERATE, cif(), target="all")
        assert refusal(TaskKind.GENERATE, message) == (
            "the target all is for RoboSC models: of automata name c99, cif or python"
        )
        message = request(TaskKind.GENERATE, cif(), generation=pb.GenerateOptions(package="tank"))
        assert refusal(TaskKind.GENERATE, message).startswith("package: of automata, the target cif makes one file")


class TestWork:
    def test_findings_have_their_places(self) -> None:
        (answer,) = answers(TaskKind.CHECK, request(TaskKind.CHECK, cif(WRONG)))
        (finding,) = answer.diagnostics
        assert (finding.code, finding.location.file, finding.location.line) == ("cif-unknown-name", "tank.cif", 3)
        for kind in MAKING:
            first, *_ = answers(kind, request(kind, cif(WRONG)))
            assert [item.code for item in first.result.diagnostics] == ["cif-unknown-name"]

    def test_imports_come_from_the_bundle(self) -> None:
        parts = {
            "parts/tank.cif": 'import "../limits.cif";' + TANK.replace("0..3", "0..n"),
            "limits.cif": "const int n = 3;",
        }
        bundle = cif('import "parts/tank.cif";', **parts)
        assert not answers(TaskKind.CHECK, request(TaskKind.CHECK, bundle))[0].diagnostics
        (answer,) = answers(TaskKind.SYNTHESIZE, request(TaskKind.SYNTHESIZE, bundle))
        assert answer.result.summary.states == "2"

    @pytest.mark.parametrize("name", ["nothing.cif", "../../../../../../etc/passwd", "/etc/passwd", __file__])
    def test_no_import_is_read_from_the_server(self, name: str) -> None:
        bundle = cif(f'import "{name}";{TANK}')
        (finding,) = answers(TaskKind.CHECK, request(TaskKind.CHECK, bundle))[0].diagnostics
        assert (finding.code, finding.message) == ("cif-import", f"there is no file '{name}' that can be read")

    def test_a_supervisor_is_that_of_the_library(self) -> None:
        model = robosc.load(text=TWO_TANKS, name="tank.cif")
        local = cast(robosc.SystemSynthesis, robosc.synthesize(model, is_modular=True))
        assert local.supervisor is not None
        message = request(TaskKind.SYNTHESIZE, cif(TWO_TANKS), modular=True)
        (answer,) = answers(TaskKind.SYNTHESIZE, message)
        assert answer.result.status == pb.SYNTHESIS_STATUS_SUPERVISOR
        assert answer.result.supervisor == local.supervisor.encode()
        assert decode_system(answer.result.supervisor).modules == local.supervisor.modules
        summary = answer.result.summary
        assert (summary.controllable_events, summary.uncontrollable_events, summary.states) == (2, 2, "4")
        assert [(item.event, item.condition) for item in summary.added] == [
            ("tank.c_fill", "tank.level <= 1"),
            ("tub.c_fill", "tub.level <= 1"),
        ]

    @pytest.mark.parametrize(
        ("text", "language", "name"),
        [(BUFFER, pb.LANGUAGE_FAUDES, "line.gen"), (DOOR, pb.LANGUAGE_SUPREMICA, "door.wmod")],
    )
    def test_plain_automata(self, text: str, language: pb.Language, name: str) -> None:
        bundle = automata_bundle(text, language, name)
        (answer,) = answers(TaskKind.SYNTHESIZE, request(TaskKind.SYNTHESIZE, bundle))
        assert answer.result.status == pb.SYNTHESIS_STATUS_SUPERVISOR

    def test_a_supervisor_that_no_file_can_hold(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(codec, "MAXIMUM_BYTES", 1000)
        (answer,) = answers(TaskKind.SYNTHESIZE, request(TaskKind.SYNTHESIZE, cif()))
        assert (answer.result.status, answer.result.supervisor) == (pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL, b"")
        assert "more than the 1000 that a supervisor file may have" in answer.result.reason

    def test_what_is_to_blame_is_reported(self) -> None:
        for kind in (TaskKind.SYNTHESIZE, TaskKind.GENERATE, TaskKind.EXPLORE):
            (answer,) = answers(kind, request(kind, cif(EMPTY)))
            assert answer.result.status == pb.SYNTHESIS_STATUS_EMPTY
            assert json.loads(answer.result.explanation)["blamed"]
        (answer,) = answers(TaskKind.VERIFY, request(TaskKind.VERIFY, cif(EMPTY)))
        assert answer.result.status == pb.VERIFICATION_STATUS_NO_SUPERVISOR
        assert json.loads(answer.result.report)["status"] == "empty"

    def test_every_target(self) -> None:
        made = {}
        for target in ("cif", "c99", "python", "ros2"):
            first, *_ = answers(TaskKind.GENERATE, request(TaskKind.GENERATE, cif(), target=target))
            made[target] = [file.path for file in first.result.files]
            if not made[target]:
                assert first.result.status == pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL
                assert first.result.reason.startswith("the target ros2 needs a model of a robot")
        assert (made["cif"], made["python"], made["ros2"]) == (["supervisor.cif"], ["tank_supervisor.py"], [])
        assert "tank_supervisor.c" in made["c99"]

    def test_code_begins_where_it_is_asked_to(self) -> None:
        bundle = cif(TANK.replace("= 1;", "in any;"))
        for initial, status in (
            ("", pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL),
            ("tank.level = 1", pb.SYNTHESIS_STATUS_SUPERVISOR),
        ):
            message = request(TaskKind.GENERATE, bundle, target="python", initial=initial)
            assert answers(TaskKind.GENERATE, message)[0].result.status == status
        wrong = outcome(TaskKind.GENERATE, request(TaskKind.GENERATE, bundle, target="python", initial="basin = 1"))
        assert wrong == Failure(Reason.MALFORMED_REQUEST, "initial names what the automata do not have")

    def test_limits_hold(self) -> None:
        many = "".join(TANK.replace("tank", f"tank{number}") for number in range(9))
        for kind in MAKING:
            found = outcome(kind, request(kind, cif(many)), TaskLimits(nodes=10))
            assert isinstance(found, Failure)
            assert found.reason is Reason.NODE_LIMIT
        found = outcome(TaskKind.EXPLORE, request(TaskKind.EXPLORE, cif()), TaskLimits(result_bytes=100))
        assert isinstance(found, Failure)
        assert found.reason is Reason.RESULT_TOO_LARGE
        (answer,) = answers(TaskKind.EXPLORE, request(TaskKind.EXPLORE, cif(), maximum_states=1))
        assert (answer.result.status, "raise the limit" in answer.result.reason) == (
            pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL,
            True,
        )

    @pytest.mark.parametrize(
        ("text", "code"),
        [
            ("const int n = " + "(" * 100_000, "cif-syntax-error"),
            ("group a: " * 30_000, "cif-syntax-error"),
            ("const int n = " + "1 + " * 100_000 + "1;", "cif-syntax-error"),
            (
                "group def D0(): plant p: location: initial; end end "
                + "".join(f"group def D{n + 1}(): a: D{n}(); b: D{n}(); end " for n in range(40))
                + "x: D40();",
                "cif-too-large",
            ),
            ("plant p: disc int[0..2000000000] x = 0; location: initial; end", "cif-too-large"),
        ],
    )
    def test_a_hostile_text_is_one_finding(self, text: str, code: str) -> None:
        (answer,) = answers(TaskKind.CHECK, request(TaskKind.CHECK, cif(text)))
        assert [item.code for item in answer.diagnostics] == [code]


@pytest.fixture(scope="module")
def channel() -> Iterator[Any]:
    with served() as address, grpc.insecure_channel(address) as connected:
        yield connected


class TestServer:
    def test_the_language_is_what_counts(self, channel: Any) -> None:
        """The answer to one request is none to another of the same bytes."""
        stub = STUB(channel)
        found = {}
        for language in (pb.LANGUAGE_CIF, pb.LANGUAGE_UNSPECIFIED, pb.LANGUAGE_CIF):
            bundle = automata_bundle(TANK, language, "tank.cif")
            found[language] = list(stub.Check(pb.CheckRequest(bundle=bundle), timeout=PATIENCE_S).diagnostics)
        assert found[pb.LANGUAGE_CIF] == []
        assert found[pb.LANGUAGE_UNSPECIFIED]

    def test_workers_are_confined_and_synthesize(self, channel: Any) -> None:
        stub = STUB(channel)
        *_, answer = stub.Synthesize(request(TaskKind.SYNTHESIZE, cif(TWO_TANKS), modular=True), timeout=PATIENCE_S)
        assert len(decode_system(answer.result.supervisor).modules) == 2
        for target in ("cif", "c99", "python"):
            files = list(stub.Generate(request(TaskKind.GENERATE, cif(), target=target), timeout=PATIENCE_S))
            assert any(item.WhichOneof("event") == "chunk" for item in files)

    def test_a_refusal_names_the_field(self, channel: Any) -> None:
        stub = STUB(channel)
        with pytest.raises(grpc.RpcError) as caught:
            list(stub.Verify(request(TaskKind.VERIFY, cif(), properties=["invariant true"]), timeout=PATIENCE_S))
        error: Any = caught.value
        assert error.code() is grpc.StatusCode.INVALID_ARGUMENT
        assert error.details().startswith("properties applies to RoboSC models")
        info = error_details_pb2.ErrorInfo()
        status = rpc_status.from_call(error)
        assert status is not None
        assert status.details[0].Unpack(info)
        assert info.reason == "MALFORMED_REQUEST"

    def test_a_job(self, channel: Any) -> None:
        stub = JOBS(channel)
        task = jobs_pb2.Task(verify=request(TaskKind.VERIFY, cif(), strict=True))
        job = stub.SubmitJob(jobs_pb2.SubmitJobRequest(task=task), timeout=PATIENCE_S).job
        *_, last = stub.WatchJob(jobs_pb2.WatchJobRequest(id=job.id), timeout=PATIENCE_S)
        assert (last.job.state, last.job.main_file) == (jobs_pb2.JOB_STATE_SUCCEEDED, "tank.cif")
        (found,) = stub.GetJobResult(jobs_pb2.GetJobResultRequest(id=job.id), timeout=PATIENCE_S)
        assert found.verify.result.status == pb.VERIFICATION_STATUS_PASSED
