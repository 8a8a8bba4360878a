"""`submit`, `watch`, `get`, `cancel`, `list` and `bench` against a server that answers what a test has written."""

import json
import os
import signal
import subprocess
import sys
import threading
import tty
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import grpc
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.commands.bench import varied
from robosc_client.jobs import MAXIMUM_IDEMPOTENCY_KEY, MAXIMUM_LABEL
from robosc_client.load_measurement import Measured
from robosc_server.jobs import convert
from support.answers import (
    enveloped,
    explanation,
    exploration,
    generation,
    job,
    progress,
    supervisor,
    synthesis,
    verification,
    watched,
)
from support.client_commands import FINDING, MADE, MODEL, NOTHING, SUCCEEDED, Run, interrupted, job_answers
from support.models import bundle_of
from support.scripted_service import Refusal, scripted
from support.waiting import PATIENCE_S


class TestSubmit:
    @pytest.mark.parametrize(
        ("arguments", "kind"),
        [
            (["check", MODEL], "check"),
            (["synth", MODEL, "--deployment", "layer", "--max-nodes", "9"], "synthesize"),
            (["generate", MODEL, "--target", "ros2", "--package", "p"], "generate"),
            (["explore", MODEL, "--limit", "7"], "explore"),
            (["verify", MODEL, "--property", "EF true"], "verify"),
            (["explain-synthesis", MODEL, "--event", "stop", "--after", ""], "explain"),
            (["format", MODEL], "format"),
        ],
    )
    def test_tasks(self, run: Run, arguments: Any, kind: str) -> None:
        answer = jobs_pb2.SubmitJobResponse(job=job())
        with scripted(SubmitJob=[[answer]]) as (address, script):
            more = ["--label", "mine", "--idempotency-key", "k", "--keep", "60", "--server", address]
            assert run("submit", *arguments, *more) == (0, "job-1\n", "")
            status, out, _ = run("submit", *arguments, *more, "--json")
            (request, _) = script.of("SubmitJob")
        assert (status, json.loads(out)["existed"], json.loads(out)["job"]["id"]) == (0, False, "job-1")
        assert (request.task.WhichOneof("request"), request.label, request.idempotency_key) == (kind, "mine", "k")
        assert request.retention.seconds == 60
        chosen = getattr(request.task, kind)
        if kind == "synthesize":
            assert (chosen.options.deployment, chosen.options.maximum_nodes) == (pb.DEPLOYMENT_LAYER, 9)
        if kind == "explore":
            assert chosen.maximum_states == 7
        if kind == "explain":
            assert (chosen.event, chosen.after, chosen.HasField("after"), chosen.HasField("state")) == (
                "stop", "", True, False
            )  # fmt: skip
        if kind == "verify":
            assert (list(chosen.properties), chosen.strict, chosen.maximum_states) == (["EF true"], False, 0)
        if kind == "generate":
            assert (chosen.target, chosen.generation.package) == ("ros2", "p")

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["verify", MODEL], "(robosc-client submit verify MODEL --property PROPERTY)"),
            (["verify", MODEL, "--property", "EF true", "--strict"], "they need FILE.rsup"),
            (["verify", MODEL, "--property", "EF true", "--limit", "7"], "they need FILE.rsup"),
            (["verify", MODEL, "--property", "AG nonsense"], "nonsense"),
            (["verify", "made.rsup", MODEL, "--reorder"], "they need --property"),
            (["verify", "made.rsup"], "needs its model"),
            (["verify", MODEL, "--property", "EF true", "--max-nodes", str(2**64)], "--max-nodes must be at most"),
            (["synth", MODEL, "--max-nodes", str(2**64)], "--max-nodes must be at most"),
            (["format", "/nothing.rscd"], "cannot read /nothing.rscd"),
        ],
    )
    @pytest.mark.parametrize("more", [[], ["--json"]])
    def test_wrong_use(self, run: Run, arguments: Any, words: str, more: Any) -> None:
        """Refusals are those of the commands that wait for their result, before a server is asked."""
        status, out, err = run("submit", *arguments, "--server", "127.0.0.1:1", *more)
        assert status == 2
        assert words in (out if more else err)
        assert not more or json.loads(out)

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["check", MODEL, "--idempotency-key", ""], "1 to 128 printable ASCII characters"),
            (["check", MODEL, "--idempotency-key", "x" * 129], "1 to 128 printable ASCII characters"),
            (["check", MODEL, "--idempotency-key", "é"], "1 to 128 printable ASCII characters"),
            (["check", MODEL, "--label", "two\nlines"], "at most 200 printable characters"),
            (["check", MODEL, "--label", "x" * 201], "at most 200 printable characters"),
            (["check", MODEL, "--keep", "inf"], "above 0 and below 1,000,000,000"),
            (["explore", MODEL, "--limit", "0"], "a number from 1 to 1,000,000,000"),
            (["explore", MODEL, "--allow-livelock"], "unrecognized arguments"),
            (["explain-synthesis", MODEL, "--allow-livelock"], "unrecognized arguments"),
            (["format", MODEL, "-L", "."], "unrecognized arguments"),
        ],
    )
    def test_wrong_options(self, run: Run, arguments: Any, words: str) -> None:
        status, _, err = run("submit", *arguments, "--server", "127.0.0.1:1")
        assert status == 2
        assert words in err

    def test_bounds_are_the_server_s(self) -> None:
        assert (MAXIMUM_LABEL, MAXIMUM_IDEMPOTENCY_KEY) == (convert.MAXIMUM_LABEL, convert.MAXIMUM_IDEMPOTENCY_KEY)

    def test_a_supervisor_to_verify(self, run: Run, tmp_path: Path) -> None:
        place = tmp_path / "made.rsup"
        place.write_bytes(b"supervisor")
        with scripted(SubmitJob=[[jobs_pb2.SubmitJobResponse(job=job())]]) as (address, script):
            assert run("submit", "verify", place, MODEL, "--strict", "--server", address)[0] == 0
            (request,) = script.of("SubmitJob")
        sent = request.task.verify
        assert (sent.supervisor, sent.strict, sent.maximum_states) == (b"supervisor", True, 1_000_000)

    def test_a_text_that_is_no_model(self, run: Run, tmp_path: Path) -> None:
        """Has a layout all the same, which is the server's to judge."""
        file = tmp_path / "odd.rscd"
        file.write_bytes(b"\xef\xbb\xbfrobot {")
        with scripted(SubmitJob=[[jobs_pb2.SubmitJobResponse(job=job())]]) as (address, script):
            assert run("submit", "format", file, "--server", address)[0] == 0
            (request,) = script.of("SubmitJob")
            assert (request.task.format.file.name, request.task.format.file.text) == ("odd.rscd", "robot {")
            file.write_bytes(b"\xff")
            assert run("submit", "format", file, "--server", address)[0] == 1

    def test_submitted_and_watched(self, run: Run) -> None:
        answers = {
            "SubmitJob": [[jobs_pb2.SubmitJobResponse(job=job(1, jobs_pb2.JOB_STATE_QUEUED))]],
            "WatchJob": [watched(job(1, jobs_pb2.JOB_STATE_QUEUED, waiting_before=2), job(2), job(3, SUCCEEDED))],
        }
        with scripted(**answers) as (address, _):
            status, out, _ = run("submit", "check", MODEL, "--watch", "--server", address)
        assert status == 0
        first, *lines = out.splitlines()
        assert first == "job-1"
        assert [line.split()[1] for line in lines] == ["queued", "running", "succeeded"]
        assert "2 before it" in out

    @pytest.mark.parametrize("more", [[], ["--json"]])
    def test_the_id_is_printed_before_anything_is_waited_for(self, more: Any) -> None:
        """Check that Ctrl-C, or whatever else ends the waiting, does not lose the job."""
        left = threading.Event()

        def stuck(context: grpc.ServicerContext) -> None:
            if context.add_callback(left.set):
                left.wait(PATIENCE_S)

        submitted = jobs_pb2.SubmitJobResponse(job=job(1, jobs_pb2.JOB_STATE_QUEUED))
        with scripted(SubmitJob=[[submitted]], WatchJob=[[stuck]]) as (address, _):
            words = ["submit", "check", MODEL, "--watch", "--server", address, *more]
            with subprocess.Popen(
                [sys.executable, "-m", "robosc_client.command", *words],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            ) as process:
                stream = process.stderr if more else process.stdout
                assert stream is not None
                assert stream.readline().split()[-1] == "job-1"
                process.send_signal(signal.SIGINT)
                out, _ = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 130
        assert not more or json.loads(out)["error"]["status"] == 130

    def test_a_watch_that_fails(self, run: Run) -> None:
        submitted = jobs_pb2.SubmitJobResponse(job=job(1, jobs_pb2.JOB_STATE_QUEUED))
        gone = Refusal(grpc.StatusCode.NOT_FOUND, "there is no such job", "NO_SUCH_JOB")
        with scripted(SubmitJob=[[submitted]], WatchJob=[[gone]]) as (address, _):
            status, out, _ = run("submit", "check", MODEL, "--watch", "--json", "--server", address)
        assert status == 3
        assert "job-1" in json.loads(out)["error"]["message"]


class TestWatch:
    def test_failed(self, run: Run) -> None:
        with scripted(WatchJob=[watched(job(1), job(2, jobs_pb2.JOB_STATE_FAILED))]) as (address, _):
            status, out, _ = run("watch", "job-1", "--server", address)
            assert status == 1
            assert "too long [CPU_LIMIT]" in out
            status, out, _ = run("watch", "job-1", "--json", "--server", address)
            assert status == 1
            assert json.loads(out)["job"]["failure"] == {"reason": "CPU_LIMIT", "message": "too long"}

    def test_a_line_moves_on_a_terminal(self) -> None:
        """The text is no markup, and gone at the end."""
        states = [job(number, progress=pb.Progress(stage="check", message=f"[bold]step {number}")) for number in (1, 2)]

        is_shown = threading.Event()

        def until_shown(context: grpc.ServicerContext) -> Any:
            yield from watched(*states)
            assert is_shown.wait(PATIENCE_S)
            yield from watched(job(3, SUCCEEDED))

        main_end, other_end = os.openpty()
        with scripted(WatchJob=[[until_shown]]) as (address, _):
            command = [sys.executable, "-m", "robosc_client.main", "watch", "job-1", "--server", address]
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=other_end, text=True)
            os.close(other_end)
            shown = b""
            try:
                while part := os.read(main_end, 4096):
                    shown += part
                    if b"[bold]step 2" in shown:
                        is_shown.set()
            except OSError:  # Linux's way to say that nobody has the other end any more.
                pass
            os.close(main_end)
            out, _ = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 0
        assert "succeeded" in out
        assert b"[bold]step 2" in shown
        assert shown.rstrip().endswith((b"\x1b[2K", b"\x1b[?25h", b"\x1b[1A"))


class TestGet:
    def test_where_it_is(self, run: Run) -> None:
        message = job(4, progress=pb.Progress(stage="check", message="half"), label="mine")
        with scripted(GetJob=[[jobs_pb2.GetJobResponse(job=message)]]) as (address, _):
            assert run("get", "job-1", "--server", address) == (
                0, "job-1  running    synthesize  robot.rscd  mine  check: half\n", ""
            )  # fmt: skip
            document = json.loads(run("get", "job-1", "--json", "--server", address)[1])["job"]
        assert (document["state"], document["created"], document["ended"]) == (
            "running",
            "2023-11-14T22:13:20+00:00",
            None,
        )

    def test_a_job_that_waits_says_for_what(self, run: Run) -> None:
        reason = pb.Progress(stage="waiting", message="the token has used up its quota")
        message = job(4, jobs_pb2.JOB_STATE_QUEUED, progress=reason)
        with scripted(GetJob=[[jobs_pb2.GetJobResponse(job=message)]]) as (address, _):
            expected = "job-1  queued     synthesize  robot.rscd  waiting: the token has used up its quota\n"
            assert run("get", "job-1", "--server", address) == (0, expected, "")

    def test_a_model_without_findings_is_reported_as_such(self, run: Run) -> None:
        with scripted(**job_answers("check", [pb.CheckResponse()])) as (address, _):
            expected = (0, "robot.rscd: no findings\n", "")
            assert run("get", "job-1", "--result", "--server", address) == expected

    @pytest.mark.parametrize(
        ("kind", "messages", "status", "word"),
        [
            ("check", [pb.CheckResponse()], 0, '"errors": 0'),
            (
                "check",
                [pb.CheckResponse(accepted=[pb.Diagnostic(severity=pb.SEVERITY_NOTE, accepted="so it is meant")])],
                0,
                '"accepted": "so it is meant"',
            ),
            ("synthesize", [synthesis()], 1, '"status": "empty"'),
            ("synthesize", [MADE], 0, '"status": "supervisor"'),
            ("generate", generation(), 0, "a/one.py"),
            ("explore", exploration(), 0, '"transitions"'),
            ("verify", [verification()], 0, '"holds"'),
            ("explain", [explanation()], 0, '"remarks"'),
            ("format", [pb.FormatResponse(text="robot R { }\n")], 0, "robot R { }"),
        ],
    )
    def test_results(self, run: Run, tmp_path: Path, kind: str, messages: Any, status: int, word: str) -> None:
        with scripted(**job_answers(kind, messages)) as (address, _):
            found, out, _ = run("get", "job-1", "--result", "--json", "--server", address)
            assert found == status, out
            assert word in out
            json.loads(out)
            assert run("get", "job-1", "--result", "--server", address)[0] == status
            place = tmp_path / "out"
            found, _, err = run("get", "job-1", "-o", place, "--server", address)
        if kind == "check":
            assert found == 2
            assert "--result" in err
        elif status:
            assert (found, err) == (1, "robot.rscd: because\n")
            assert not place.exists()
        else:
            assert (found, place.exists()) == (0, True)
        if kind == "generate":
            assert (place / "a" / "one.py").stat().st_mode & 0o111
        if kind == "explore":
            assert len(json.loads(place.read_text())["states"]) == 2

    @pytest.mark.parametrize(
        ("kind", "messages", "words"),
        [
            ("synthesize", [synthesis(reason="none exists", diagnostics=[FINDING])], ["error: bad [x]", "none exists"]),
            ("generate", [pb.GenerateResponse(result=pb.GenerationResult(**NOTHING))], ["error: bad [x]", "1 error"]),
            ("explore", [pb.ExploreResponse(result=pb.ExplorationResult(**NOTHING))], ["error: bad [x]", "1 error"]),
            (
                "explore",
                [
                    pb.ExploreResponse(
                        result=pb.ExplorationResult(
                            status=pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL, reason="more than 7 states"
                        )
                    )
                ],
                ["robosc-client: more than 7 states"],
            ),
            ("format", [pb.FormatResponse(diagnostics=[FINDING])], ["error: bad [x]", "1 error"]),
            (
                "explain",
                [explanation("", pb.EXPLANATION_STATUS_UNSUPPORTED_MODEL, "too strange")],
                ["robot.rscd: too strange"],
            ),
            (
                "verify",
                [
                    pb.VerifyResponse(
                        result=pb.VerificationResult(
                            status=pb.VERIFICATION_STATUS_UNSUPPORTED_MODEL, reason="too strange"
                        )
                    )
                ],
                ["too strange"],
            ),
        ],
    )
    def test_nothing_that_could_be_written(
        self, run: Run, tmp_path: Path, kind: str, messages: Any, words: Any
    ) -> None:
        """Then it says why, as the command does that waits for it."""
        place = tmp_path / "out"
        with scripted(**job_answers(kind, messages)) as (address, _):
            status, out, err = run("get", "job-1", "-o", place, "--server", address)
            assert (status, out) == (1, "")
            for word in words:
                assert word in err
            status, out, _ = run("get", "job-1", "-o", place, "--json", "--server", address)
        assert status == 1
        found = json.loads(out)["result"]
        assert found["diagnostics"] if "1 error" in words else found["reason"]
        assert not place.exists()

    @pytest.mark.parametrize(
        ("state", "words"),
        [
            (jobs_pb2.JOB_STATE_FAILED, "job job-1 has failed: too long [CPU_LIMIT]"),
            (jobs_pb2.JOB_STATE_CANCELLED, "job job-1 was cancelled"),
        ],
    )
    def test_without_a_result(self, run: Run, tmp_path: Path, state: Any, words: str) -> None:
        """Exit statuses are those of `watch`; where the job is can be said of any."""
        with scripted(GetJob=[[jobs_pb2.GetJobResponse(job=job(4, state))]]) as (address, script):
            for more in (["--result"], ["-o", tmp_path / "out"]):
                result = run("get", "job-1", *more, "--server", address)
                assert result == (1, "", f"robosc-client: {words}\n")
                status, out, _ = run("get", "job-1", *more, "--json", "--server", address)
                document = json.loads(out)
                assert (status, document["result"]) == (1, None)
                has_failed = state == jobs_pb2.JOB_STATE_FAILED
                reason = {"reason": "CPU_LIMIT", "message": "too long"} if has_failed else None
                assert document["job"]["failure"] == reason
            assert run("get", "job-1", "--server", address)[0] == 0
            assert {name for name, _ in script.requests} == {"GetJob"}

    def test_a_result_of_another_kind(self, run: Run, tmp_path: Path) -> None:
        """Is none of this job: a text must not come where a supervisor is wanted."""
        answers = job_answers("synthesize", [])
        answers["GetJobResult"] = [enveloped("format", [pb.FormatResponse(text="robot R { }\n")])]
        with scripted(**answers) as (address, _):
            for more in (["-o", tmp_path / "out"], ["--result"], ["--result", "--json"]):
                status, _, err = run("get", "job-1", *more, "--server", address)
                assert status == 3
                assert "malformed" in err
        assert not (tmp_path / "out").exists()

    def test_a_text_on_a_terminal_and_in_a_file(self) -> None:
        """Check that text that would move the cursor is shown, and not obeyed; a file has every byte."""
        text = "robot R {\n\t// \x1b]0;owned\x07 \x9b2J\r\n}\n"
        with scripted(**job_answers("format", [pb.FormatResponse(text=text)])) as (address, _):
            command = [sys.executable, "-m", "robosc_client.main", "get", "job-1", "--result", "--server", address]
            piped = subprocess.run(command, capture_output=True, timeout=PATIENCE_S, check=True).stdout
            main_end, other_end = os.openpty()
            tty.setraw(other_end)
            subprocess.run(command, stdout=other_end, timeout=PATIENCE_S, check=True)
            os.close(other_end)
            shown = b""
            # It comes in parts, and an end of Linux's own when the other end is closed.
            with suppress(OSError):
                while part := os.read(main_end, 4096):
                    shown += part
            os.close(main_end)
        assert piped == text.encode()
        assert shown == b"robot R {\n\t// \\x1b]0;owned\\x07 \\x9b2J\\r\n}\n"

    def test_nothing_is_written_outside_of_the_folder(self, run: Run, tmp_path: Path) -> None:
        """Not through links in the folder either; a link in a file's place is replaced, not followed."""
        outside, folder = tmp_path / "outside", tmp_path / "out"
        outside.mkdir()
        folder.mkdir()
        (outside / "file").write_text("mine")
        (folder / "link").symlink_to(outside)
        for path in ("link/x", "../outside/x", str(outside / "x"), "a/../../outside/x"):
            with scripted(**job_answers("generate", generation({path: (b"x", True)}))) as (address, _):
                assert run("get", "job-1", "-o", folder, "--server", address)[0] in (1, 3)
        (folder / "file").symlink_to(outside / "file")
        with scripted(**job_answers("generate", generation({"file": (b"x", False)}))) as (address, _):
            assert run("get", "job-1", "-o", folder, "--force", "--server", address)[0] == 0
        assert [item.name for item in outside.iterdir()] == ["file"]
        assert (outside / "file").read_text() == "mine"
        assert not (folder / "file").is_symlink()


class TestListAndCancel:
    def test_list(self, run: Run) -> None:
        page = [jobs_pb2.ListJobsResponse(jobs=[job(id=f"job-{n}") for n in range(5)], next_page_token="more")]
        with scripted(ListJobs=[page, page]) as (address, script):
            chosen = ["--state", "running", "--state", "queued", "--kind", "check", "--all", "--most", "5"]
            status, out, _ = run("list", *chosen, "--server", address)
            assert (status, len(out.splitlines())) == (0, 5)
            (request,) = script.of("ListJobs")
            assert len(json.loads(run("list", *chosen, "--json", "--server", address)[1])["jobs"]) == 5
        assert (list(request.states), request.kind, request.all_owners, request.page_size) == ([2, 1], 1, True, 5)

    def test_kinds_as_the_commands_call_them(self, run: Run) -> None:
        with scripted(ListJobs=[[jobs_pb2.ListJobsResponse()]]) as (address, script):
            for name in ("synth", "synthesize"):
                assert run("list", "--kind", name, "--server", address)[0] == 0
            assert [request.kind for request in script.of("ListJobs")] == [jobs_pb2.TASK_KIND_SYNTHESIZE] * 2

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--most", "0"], "must be a number from 1 to 1,000,000"),
            (["--most", "x"], "must be a number from 1 to 1,000,000"),
            (
                ["--kind", "fly"],
                "'fly' is not one of check, synthesize, generate, explore, verify, explain, format, synth",
            ),
            (["--state", "idle"], "'idle' is not one of queued, running, succeeded, failed, cancelled"),
            (["--deadline", "inf"], "above 0 and below 1,000,000,000"),
            (["--deadline", "soon"], "above 0 and below 1,000,000,000"),
        ],
    )
    def test_wrong_use(self, run: Run, options: Any, words: str) -> None:
        status, _, err = run("list", *options, "--server", "127.0.0.1:1")
        assert status == 2
        assert words in err

    def test_cancel(self, run: Run) -> None:
        ended = jobs_pb2.CancelJobResponse(job=job(2, jobs_pb2.JOB_STATE_CANCELLED))
        with scripted(CancelJob=[[ended]]) as (address, _):
            status, out, _ = run("cancel", "job-1", "--server", address)
        assert status == 0
        assert "cancelled" in out

    def test_no_such_job(self, run: Run) -> None:
        with scripted(GetJob=[[Refusal(grpc.StatusCode.NOT_FOUND, "there is no job x", "NO_SUCH_JOB")]]) as (
            address,
            _,
        ):
            status, _, err = run("get", "x", "--server", address)
        assert status == 3
        assert "there is no job x" in err


class TestBench:
    def test_counted(self, run: Run) -> None:
        peers: set[str] = set()

        def note(context: grpc.ServicerContext) -> None:
            peers.add(context.peer())

        answers = {"Check": [[note, pb.CheckResponse()]], "Synthesize": [[note, progress(), supervisor()]]}
        with scripted(**answers) as (address, script):
            for task, method in (("check", "Check"), ("synth", "Synthesize")):
                for more in ([], ["--uncached"]):
                    script.requests.clear()
                    peers.clear()
                    options = ["--task", task, "-c", "4", "--connections", "2", "-n", "20", *more, "--server", address]
                    status, out, _ = run("bench", MODEL, "--json", *options)
                    document = json.loads(out)
                    assert (status, document["calls"], document["errors"]) == (0, 20, {})
                    assert document["milliseconds"]["p50"] <= document["milliseconds"]["p99"]
                    assert len(peers) == 2
                    texts = {request.bundle.main.text for request in script.of(method)}
                    assert len(script.of(method)) == 20
                    assert len(texts) == (20 if more else 1)
            assert "a second" in run("bench", MODEL, "-d", "0.2", "--server", address)[1]

    @pytest.mark.parametrize("more", [[], ["--uncached"]])
    def test_what_cannot_be_sent(self, run: Run, more: Any) -> None:
        options = ["--task", "synth", "--max-nodes", str(2**70), "-n", "1", *more]
        status, _, err = run("bench", MODEL, *options, "--server", "127.0.0.1:1")
        assert status == 2
        assert "--max-nodes must be at most" in err

    def test_errors_by_reason(self, run: Run) -> None:
        refusal = Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED, "busy", "SERVER_BUSY", 1.0)
        with scripted(Check=[[pb.CheckResponse()], [refusal]]) as (address, _):
            status, out, _ = run("bench", MODEL, "-n", "10", "--json", "--server", address)
        assert status == 3
        assert (json.loads(out)["calls"], json.loads(out)["errors"]) == (1, {"SERVER_BUSY": 9})

    @pytest.mark.parametrize("json_flag", [[], ["--json"]])
    def test_interrupted_it_reports_what_it_has_measured(self, json_flag: Any) -> None:
        begun, ended = threading.Event(), threading.Event()

        def stuck(context: Any) -> None:
            context.add_callback(ended.set)
            begun.set()
            ended.wait(PATIENCE_S)

        refusal = Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED, "busy", "SERVER_BUSY", 1.0)
        with scripted(Check=[[pb.CheckResponse()], [refusal], [pb.CheckResponse()], [stuck]]) as (address, _):
            options = ["-c", "1", "-n", "9", "--server", address, *json_flag]
            words = ["-m", "robosc_client.command", "bench", MODEL, *options]
            status, output, error = interrupted(words, begun)
        assert (status, error) == (130, "robosc-client: interrupted\n")
        if json_flag:
            report = json.loads(output)
            assert (report["calls"], report["errors"], report["interrupted"]) == (2, {"SERVER_BUSY": 1}, True)
        else:
            assert output.startswith("2 calls in ") and "errors: 1 SERVER_BUSY" in output

    def test_a_model_is_varied_in_a_comment_alone(self) -> None:
        bundle = bundle_of("robot R { }")
        texts = {varied(bundle, number).main.text for number in range(10)}
        assert len(texts) == 10
        assert all(text.startswith("robot R { }\n// ") and text.count("\n") == 2 for text in texts)

    def test_percentiles(self) -> None:
        measured = Measured(2.0, tuple(float(number) for number in range(1, 101)), 0, {})
        assert [measured.percentile_s(percent) for percent in (50, 90, 99, 100)] == [50, 90, 99, 100]
        assert Measured(1.0, (5.0,), 0, {}).percentile_s(50) == 5.0
        assert Measured(1.0, (), 0, {}).document()["milliseconds"]["p50"] is None
        assert measured.calls_per_second == 50

    @given(
        st.lists(st.floats(0, 1e3), min_size=1, max_size=300),
        st.integers(1, 100),
    )
    def test_percentiles_are_what_they_are_called(self, times: list[float], percent: int) -> None:
        """The least of the times within which at least so many of a hundred calls were answered."""
        wanted = min(
            time_s
            for time_s in times
            if Fraction(sum(other <= time_s for other in times), len(times)) >= Fraction(percent, 100)
        )
        assert Measured(1.0, tuple(sorted(times)), 0, {}).percentile_s(percent) == wanted

    def test_wrong_use(self, run: Run) -> None:
        for options in (["-c", "0"], ["-n", "0"], ["-n", "1", "-d", "1"], ["-d", "0"], ["--task", "fly"]):
            assert run("bench", MODEL, "--server", "127.0.0.1:1", *options)[0] == 2
