"""`submit`, `watch`, `get`, `cancel`, `list` and `bench` against a server that answers what a test has written."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc.cli.main import main as robosc
from robosc.signatures import make_key_pair, read_private_key, sign
from robosc.supervisor import encode, make_supervisor
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.commands.bench import varied
from robosc_client.load import Measured
from robosc_client.main import main
from support.answers import (
    enveloped,
    exploration,
    generation,
    job,
    progress,
    supervisor,
    synthesis,
    verification,
    watched,
)
from support.models import EXAMPLES, bundle_of, example_bundle
from support.scripted_service import PATIENCE_S, Refusal, scripted

MODEL = str(EXAMPLES / "line_follower" / "line_follower.rscd")


def encoded_supervisor(example: str) -> bytes:
    """The file of an example's supervisor."""
    made = make_supervisor(example_bundle(f"{example}/{example}")).supervisor
    assert made is not None
    return encode(made)


MADE = supervisor(encoded_supervisor("line_follower"))
SUCCEEDED = jobs_pb2.JOB_STATE_SUCCEEDED


def run(capfd: pytest.CaptureFixture[str], *arguments: Any) -> Any:
    status = main([*map(str, arguments)])
    printed = capfd.readouterr()
    assert "Traceback" not in printed.err
    return status, printed.out, printed.err


class TestSubmit:
    @pytest.mark.parametrize(
        ("arguments", "kind"),
        [
            (["check", MODEL], "check"),
            (["synth", MODEL, "--deployment", "layer", "--max-nodes", "9"], "synthesize"),
            (["generate", MODEL, "--target", "ros2", "--package", "p"], "generate"),
            (["explore", MODEL, "--limit", "7"], "explore"),
            (["verify", MODEL, "--property", "EF true", "--strict"], "verify"),
            (["format", MODEL], "format"),
        ],
    )
    def test_tasks(self, capfd: pytest.CaptureFixture[str], arguments: Any, kind: str) -> None:
        answer = jobs_pb2.SubmitJobResponse(job=job())
        with scripted(SubmitJob=[[answer]]) as (address, script):
            more = ["--label", "mine", "--idempotency-key", "k", "--keep", "60", "--server", address]
            assert run(capfd, "submit", *arguments, *more) == (0, "job-1\n", "")
            status, out, _ = run(capfd, "submit", *arguments, *more, "--json")
            (request, _) = script.of("SubmitJob")
        assert (status, json.loads(out)["existed"], json.loads(out)["job"]["id"]) == (0, False, "job-1")
        assert (request.task.WhichOneof("request"), request.label, request.idempotency_key) == (kind, "mine", "k")
        assert request.retention.seconds == 60
        chosen = getattr(request.task, kind)
        if kind == "synthesize":
            assert (chosen.options.deployment, chosen.options.maximum_nodes) == (pb.DEPLOYMENT_LAYER, 9)
        if kind == "explore":
            assert chosen.maximum_states == 7
        if kind == "verify":
            assert (list(chosen.properties), chosen.strict) == (["EF true"], True)
        if kind == "generate":
            assert (chosen.target, chosen.generation.package) == ("ros2", "p")

    def test_wrong_use(self, capfd: pytest.CaptureFixture[str]) -> None:
        status, _, err = run(capfd, "submit", "verify", MODEL, "--server", "127.0.0.1:1")
        assert status == 2
        assert "--property" in err

    def test_submitted_and_watched(self, capfd: pytest.CaptureFixture[str]) -> None:
        answers = {
            "SubmitJob": [[jobs_pb2.SubmitJobResponse(job=job(1, jobs_pb2.JOB_STATE_QUEUED))]],
            "WatchJob": [watched(job(1, jobs_pb2.JOB_STATE_QUEUED, waiting_before=2), job(2), job(3, SUCCEEDED))],
        }
        with scripted(**answers) as (address, _):
            status, out, _ = run(capfd, "submit", "check", MODEL, "--watch", "--server", address)
        assert status == 0
        first, *lines = out.splitlines()
        assert first == "job-1"
        assert [line.split()[1] for line in lines] == ["queued", "running", "succeeded"]
        assert "2 before it" in out

    @pytest.mark.parametrize("more", [[], ["--json"]])
    def test_the_id_is_told_before_anything_is_waited_for(self, more: Any) -> None:
        """So that Ctrl-C, or whatever else ends the waiting, does not lose the job."""
        left = threading.Event()

        def stuck(context: grpc.ServicerContext) -> None:
            context.add_callback(left.set)
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

    def test_a_watch_that_fails(self, capfd: pytest.CaptureFixture[str]) -> None:
        submitted = jobs_pb2.SubmitJobResponse(job=job(1, jobs_pb2.JOB_STATE_QUEUED))
        gone = Refusal(grpc.StatusCode.NOT_FOUND, "there is no such job", "NO_SUCH_JOB")
        with scripted(SubmitJob=[[submitted]], WatchJob=[[gone]]) as (address, _):
            status, out, _ = run(capfd, "submit", "check", MODEL, "--watch", "--json", "--server", address)
        assert status == 3
        assert "job-1" in json.loads(out)["error"]["message"]


class TestWatch:
    def test_failed(self, capfd: pytest.CaptureFixture[str]) -> None:
        with scripted(WatchJob=[watched(job(1), job(2, jobs_pb2.JOB_STATE_FAILED))]) as (address, _):
            status, out, _ = run(capfd, "watch", "job-1", "--server", address)
            assert status == 1
            assert "too long [CPU_LIMIT]" in out
            status, out, _ = run(capfd, "watch", "job-1", "--json", "--server", address)
            assert status == 1
            assert json.loads(out)["job"]["failure"] == {"reason": "CPU_LIMIT", "message": "too long"}

    def test_a_line_moves_on_a_terminal(self, tmp_path: Path) -> None:
        """And it is markup to nobody, and gone at the end."""
        told = [job(number, progress=pb.Progress(stage="check", message=f"[bold]step {number}")) for number in (1, 2)]

        def slowly(context: grpc.ServicerContext) -> Any:
            for item in watched(*told, job(3, SUCCEEDED)):
                yield item
                time.sleep(0.3)

        main_end, other_end = os.openpty()
        with scripted(WatchJob=[[slowly]]) as (address, _):
            command = [sys.executable, "-m", "robosc_client.main", "watch", "job-1", "--server", address]
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=other_end, text=True)
            os.close(other_end)
            shown = b""
            try:
                while part := os.read(main_end, 4096):
                    shown += part
            except OSError:  # Linux's way to tell that nobody has the other end any more.
                pass
            os.close(main_end)
            out, _ = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 0
        assert "succeeded" in out
        assert b"[bold]step 2" in shown
        assert shown.rstrip().endswith((b"\x1b[2K", b"\x1b[?25h", b"\x1b[1A"))


class TestGet:
    def answers(self, kind: str, messages: Any) -> Any:
        found = job(9, SUCCEEDED, kind=getattr(jobs_pb2, f"TASK_KIND_{kind.upper()}"))
        return {"GetJob": [[jobs_pb2.GetJobResponse(job=found)]], "GetJobResult": [enveloped(kind, messages)]}

    def test_where_it_is(self, capfd: pytest.CaptureFixture[str]) -> None:
        message = job(4, progress=pb.Progress(stage="check", message="half"), label="mine")
        with scripted(GetJob=[[jobs_pb2.GetJobResponse(job=message)]]) as (address, _):
            assert run(capfd, "get", "job-1", "--server", address) == (
                0, "job-1  running    synthesize  robot.rscd  mine  check: half\n", ""
            )  # fmt: skip
            document = json.loads(run(capfd, "get", "job-1", "--json", "--server", address)[1])["job"]
        assert (document["state"], document["created"], document["ended"]) == (
            "running",
            "2023-11-14T22:13:20+00:00",
            None,
        )

    @pytest.mark.parametrize(
        ("kind", "messages", "status", "word"),
        [
            ("check", [pb.CheckResponse()], 0, '"errors": 0'),
            ("synthesize", [synthesis()], 1, '"status": "empty"'),
            ("synthesize", [MADE], 0, '"status": "supervisor"'),
            ("generate", generation(), 0, "a/one.py"),
            ("explore", exploration(), 0, '"transitions"'),
            ("verify", [verification()], 0, '"holds"'),
            ("format", [pb.FormatResponse(text="robot R { }\n")], 0, "robot R { }"),
        ],
    )
    def test_results(
        self, capfd: pytest.CaptureFixture[str], tmp_path: Path, kind: str, messages: Any, status: int, word: str
    ) -> None:
        with scripted(**self.answers(kind, messages)) as (address, _):
            found, out, _ = run(capfd, "get", "job-1", "--result", "--json", "--server", address)
            assert found == status, out
            assert word in out
            json.loads(out)
            assert run(capfd, "get", "job-1", "--result", "--server", address)[0] == status
            place = tmp_path / "out"
            found, _, err = run(capfd, "get", "job-1", "-o", place, "--server", address)
        if status or kind == "check":
            assert found == 2
            assert "--result" in err
        else:
            assert (found, place.exists()) == (0, True)
        if kind == "generate":
            assert (place / "a" / "one.py").stat().st_mode & 0o111
        if kind == "explore":
            assert len(json.loads(place.read_text())["states"]) == 2

    def test_a_result_of_another_kind(self, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
        """Is none of this job: a text must not come where a supervisor is wanted."""
        answers = self.answers("synthesize", [])
        answers["GetJobResult"] = [enveloped("format", [pb.FormatResponse(text="robot R { }\n")])]
        with scripted(**answers) as (address, _):
            for more in (["-o", tmp_path / "out"], ["--result"], ["--result", "--json"]):
                status, _, err = run(capfd, "get", "job-1", *more, "--server", address)
                assert status == 3
                assert "malformed" in err
        assert not (tmp_path / "out").exists()

    def test_a_text_on_a_terminal_and_in_a_file(self, tmp_path: Path) -> None:
        """What would move the cursor is shown, and not obeyed; a file has every byte."""
        text = "robot R {\n\t// \x1b]0;owned\x07 \x9b2J\r\n}\n"
        with scripted(**self.answers("format", [pb.FormatResponse(text=text)])) as (address, _):
            command = [sys.executable, "-m", "robosc_client.main", "get", "job-1", "--result", "--server", address]
            piped = subprocess.run(command, capture_output=True, timeout=PATIENCE_S, check=True).stdout
            main_end, other_end = os.openpty()
            tty.setraw(other_end)
            subprocess.run(command, stdout=other_end, timeout=PATIENCE_S, check=True)
            shown = os.read(main_end, 4096)
            os.close(main_end)
            os.close(other_end)
        assert piped == text.encode()
        assert shown == b"robot R {\n\t// \\x1b]0;owned\\x07 \\x9b2J\\r\n}\n"

    def test_nothing_is_written_outside_of_the_folder(self, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
        """Not through links in the folder either; a link in a file's place is replaced, not followed."""
        outside, folder = tmp_path / "outside", tmp_path / "out"
        outside.mkdir()
        folder.mkdir()
        (outside / "file").write_text("mine")
        (folder / "link").symlink_to(outside)
        for path in ("link/x", "../outside/x", str(outside / "x"), "a/../../outside/x"):
            with scripted(**self.answers("generate", generation({path: (b"x", True)}))) as (address, _):
                assert run(capfd, "get", "job-1", "-o", folder, "--server", address)[0] in (1, 3)
        (folder / "file").symlink_to(outside / "file")
        with scripted(**self.answers("generate", generation({"file": (b"x", False)}))) as (address, _):
            assert run(capfd, "get", "job-1", "-o", folder, "--force", "--server", address)[0] == 0
        assert [item.name for item in outside.iterdir()] == ["file"]
        assert (outside / "file").read_text() == "mine"
        assert not (folder / "file").is_symlink()


class TestSignatures:
    @pytest.fixture
    def made(self, tmp_path: Path) -> Any:
        """A supervisor's file, and keys: `right` has signed it."""
        for name in ("right", "wrong"):
            make_key_pair(tmp_path / f"{name}.key", tmp_path / f"{name}.pub")
        assert robosc(["synth", MODEL, "-o", str(tmp_path / "made.rsup")]) == 0
        content = (tmp_path / "made.rsup").read_bytes()
        return content, sign(content, read_private_key(tmp_path / "right.key"))

    @pytest.mark.parametrize("command", ["synth", "get"])
    def test_checked_and_kept(self, capfd: pytest.CaptureFixture[str], tmp_path: Path, made: Any, command: str) -> None:
        content, signature = made
        place = tmp_path / "there.rsup"
        beside = tmp_path / "there.rsup.sig"
        what = ["synth", MODEL] if command == "synth" else ["get", "job-1"]

        def asked(answer: Any, *more: Any) -> Any:
            answers = {
                "Synthesize": [[answer]],
                "GetJob": [[jobs_pb2.GetJobResponse(job=job(9, SUCCEEDED))]],
                "GetJobResult": [enveloped("synthesize", [answer])],
            }
            with scripted(**answers) as (address, _):
                return run(capfd, *what, "-o", place, "--server", address, *more)

        trusted = ["--signed-by", tmp_path / "right.pub"]
        assert asked(supervisor(content, signature=signature), *trusted)[0] == 0
        assert (place.read_bytes(), beside.read_bytes()) == (content, signature)
        assert robosc(["verify", str(place), "--signed-by", str(tmp_path / "right.pub")]) == 0
        # Without one, that of an earlier supervisor must not stay.
        assert asked(supervisor(content))[0] == 0
        assert not beside.exists()
        place.unlink()
        for answer, keys in (
            (supervisor(content), trusted),
            (supervisor(content, signature=signature), ["--signed-by", tmp_path / "wrong.pub"]),
            (supervisor(content, signature=b"x"), trusted),
            (supervisor(content + b" ", signature=signature), trusted),
        ):
            status, _, err = asked(answer, *keys)
            assert status in (1, 3)
            assert err
            assert not place.exists()
            assert not beside.exists()

    @pytest.mark.parametrize(
        ("made_of", "options"),
        [
            ("navigation", []),
            ("line_follower", ["--deployment", "layer"]),
        ],
    )
    def test_a_supervisor_that_was_not_asked_for(
        self, capfd: pytest.CaptureFixture[str], tmp_path: Path, made: Any, made_of: str, options: Any
    ) -> None:
        """Is refused although its signature is right, and without one, too."""
        content = encoded_supervisor(made_of)
        answer = supervisor(content, signature=sign(content, read_private_key(tmp_path / "right.key")))
        place = tmp_path / "there.rsup"
        with scripted(Synthesize=[[answer]]) as (address, _):
            for trusted in ([], ["--signed-by", tmp_path / "right.pub"]):
                status, _, err = run(capfd, "synth", MODEL, *options, "-o", place, "--server", address, *trusted)
                assert status == 3
                assert "is refused: it was made" in err
                assert list(tmp_path.glob("there*")) == []

    def test_a_job_s_supervisor(self, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
        """Must be one, and of the deployment that is named."""
        place = tmp_path / "there.rsup"
        for answer, options, status in (
            (MADE, ["--deployment", "controller"], 0),
            (MADE, ["--deployment", "layer"], 3),
            (supervisor(b"{}"), [], 3),
        ):
            place.unlink(missing_ok=True)
            with scripted(**TestGet().answers("synthesize", [answer])) as (address, _):
                assert run(capfd, "get", "job-1", "-o", place, *options, "--server", address)[0] == status
            assert place.exists() == (status == 0)
        assert run(capfd, "get", "job-1", "--deployment", "layer", "--server", "127.0.0.1:1")[0] == 2

    @pytest.mark.parametrize(
        ("kind", "messages"),
        [
            ("check", [pb.CheckResponse()]),
            ("synthesize", [synthesis()]),
            ("generate", generation()),
            ("explore", exploration()),
            ("verify", [verification()]),
            ("format", [pb.FormatResponse(text="robot R { }\n")]),
        ],
    )
    def test_what_nobody_can_have_signed(
        self, capfd: pytest.CaptureFixture[str], tmp_path: Path, made: Any, kind: str, messages: Any
    ) -> None:
        trusted = ["--signed-by", tmp_path / "right.pub"]
        with scripted(**TestGet().answers(kind, messages)) as (address, _):
            for more in (["-o", tmp_path / "out"], ["--result"], ["--result", "--json"]):
                status, _, err = run(capfd, "get", "job-1", *more, *trusted, "--server", address)
                assert status == 3
                assert "no supervisor" in err
            assert run(capfd, "get", "job-1", *trusted, "--server", address)[0] == 2
        assert not (tmp_path / "out").exists()

    def test_results_that_are_printed(self, capfd: pytest.CaptureFixture[str], tmp_path: Path, made: Any) -> None:
        content, signature = made
        unknown = b"{}"
        signed = sign(unknown, read_private_key(tmp_path / "right.key"))
        for answer, status in (
            (supervisor(content, signature=signature), 0),
            (supervisor(content), 3),
            (supervisor(unknown, signature=signed), 3),
        ):
            with scripted(**TestGet().answers("synthesize", [answer])) as (address, _):
                options = ["--result", "--signed-by", tmp_path / "right.pub", "--server", address]
                assert run(capfd, "get", "job-1", *options)[0] == status


class TestListAndCancel:
    def test_list(self, capfd: pytest.CaptureFixture[str]) -> None:
        page = [jobs_pb2.ListJobsResponse(jobs=[job(id=f"job-{n}") for n in range(5)], next_page_token="more")]
        with scripted(ListJobs=[page, page]) as (address, script):
            chosen = ["--state", "running", "--state", "queued", "--kind", "check", "--all", "--most", "5"]
            status, out, _ = run(capfd, "list", *chosen, "--server", address)
            assert (status, len(out.splitlines())) == (0, 5)
            (request,) = script.of("ListJobs")
            assert len(json.loads(run(capfd, "list", *chosen, "--json", "--server", address)[1])["jobs"]) == 5
        assert (list(request.states), request.kind, request.all_owners, request.page_size) == ([2, 1], 1, True, 5)

    def test_cancel(self, capfd: pytest.CaptureFixture[str]) -> None:
        ended = jobs_pb2.CancelJobResponse(job=job(2, jobs_pb2.JOB_STATE_CANCELLED))
        with scripted(CancelJob=[[ended]]) as (address, _):
            status, out, _ = run(capfd, "cancel", "job-1", "--server", address)
        assert status == 0
        assert "cancelled" in out

    def test_no_such_job(self, capfd: pytest.CaptureFixture[str]) -> None:
        with scripted(GetJob=[[Refusal(grpc.StatusCode.NOT_FOUND, "there is no job x", "NO_SUCH_JOB")]]) as (
            address,
            _,
        ):
            status, _, err = run(capfd, "get", "x", "--server", address)
        assert status == 3
        assert "there is no job x" in err


class TestBench:
    def test_counted(self, capfd: pytest.CaptureFixture[str]) -> None:
        answers = {"Check": [[pb.CheckResponse()]], "Synthesize": [[progress(), supervisor()]]}
        with scripted(**answers) as (address, script):
            for task, method in (("check", "Check"), ("synth", "Synthesize")):
                for more in ([], ["--uncached"]):
                    script.requests.clear()
                    options = ["--task", task, "-c", "4", "--connections", "2", "-n", "20", *more, "--server", address]
                    status, out, _ = run(capfd, "bench", MODEL, "--json", *options)
                    document = json.loads(out)
                    assert (status, document["calls"], document["errors"]) == (0, 20, {})
                    assert document["milliseconds"]["p50"] <= document["milliseconds"]["p99"]
                    texts = {request.bundle.main.text for request in script.of(method)}
                    assert len(script.of(method)) == 20
                    assert len(texts) == (20 if more else 1)
            assert "a second" in run(capfd, "bench", MODEL, "-d", "0.2", "--server", address)[1]

    @pytest.mark.parametrize("more", [[], ["--uncached"]])
    def test_what_cannot_be_sent(self, capfd: pytest.CaptureFixture[str], more: Any) -> None:
        options = ["--task", "synth", "--max-nodes", str(2**70), "-n", "1", *more]
        status, _, err = run(capfd, "bench", MODEL, *options, "--server", "127.0.0.1:1")
        assert status == 3
        assert "cannot be sent" in err

    def test_errors_by_reason(self, capfd: pytest.CaptureFixture[str]) -> None:
        refusal = Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED, "busy", "SERVER_BUSY", 1.0)
        with scripted(Check=[[pb.CheckResponse()], [refusal]]) as (address, _):
            status, out, _ = run(capfd, "bench", MODEL, "-n", "10", "--json", "--server", address)
        assert status == 3
        assert (json.loads(out)["calls"], json.loads(out)["errors"]) == (1, {"SERVER_BUSY": 9})

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

    def test_wrong_use(self, capfd: pytest.CaptureFixture[str]) -> None:
        for options in (["-c", "0"], ["-n", "0"], ["-n", "1", "-d", "1"], ["-d", "0"], ["--task", "fly"]):
            with pytest.raises(SystemExit) as left:
                main(["bench", MODEL, "--server", "127.0.0.1:1", *options])
            assert left.value.code == 2
