"""The synthesis service over real sockets, with tasks that behave as their text says."""

import os
import queue
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import grpc
import pytest
from google.rpc import error_details_pb2
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc
from grpc_status import rpc_status

from robosc import __version__
from robosc.language import load_bundle
from robosc.signatures import make_key_pair, signer
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from robosc_client import Client
from robosc_server import application
from robosc_server.application import StartError
from robosc_server.main import main
from robosc_server.synthesis_service import PROGRESS_PERIOD_S as PAUSE_S
from robosc_server.synthesis_service import _ProgressWriter, progress_message
from robosc_server.tasks.task import Report
from support.background import is_running, is_stopped
from support.fake_tasks import TASK_FUNCTION as FAKE
from support.held_time import HeldLoop
from support.job_workers import StartedWorkers
from support.models import EXAMPLES
from support.service import served
from support.strangers import strangers
from support.waiting import PATIENCE_S, eventually

INITIAL_WINDOW = 4
"""HTTP/2's setting of that name, by its number."""

STUB: Any = synthesis_pb2_grpc.SynthesisServiceStub


def bundle(text: str = "", name: str = "robot.rscd") -> pb.Bundle:
    return pb.Bundle(main=pb.SourceFile(name=name, text=text))


def check(channel: Any, text: str, **more: Any) -> str:
    """Return the message of an echo."""
    response = STUB(channel).Check(pb.CheckRequest(bundle=bundle(text)), **{"timeout": PATIENCE_S, **more})
    return str(response.diagnostics[0].message)


@pytest.fixture(scope="module")
def fake() -> Iterator[Any]:
    with served(FAKE, worker_processes=2, bundle_bytes=1000) as address, grpc.insecure_channel(address) as channel:
        yield channel


def has_ended(pid: int) -> bool:
    return not is_running(pid)


def refusal(call: Any, streams: bool = False) -> tuple[Any, str, Any]:
    """Reason, sentence and error of a call that must fail."""
    with pytest.raises(grpc.RpcError) as caught:
        for _ in call() if streams else [call()]:
            pass
    error: Any = caught.value
    assert "Traceback" not in error.details()
    status = rpc_status.from_call(error)
    assert status is not None
    info = error_details_pb2.ErrorInfo()
    assert status.details[0].Unpack(info)
    assert info.domain == "robosc"
    return info.reason, error.details(), error


def stuck(channel: Any, text: str = "pid\nstuck", timeout: float | None = None) -> tuple[Any, int]:
    """A synthesis that has begun and never ends, and its worker's process."""
    call = STUB(channel).Synthesize(pb.SynthesizeRequest(bundle=bundle(text)), timeout=timeout)
    return call, int(next(call).progress.message)


def goes_on(pid: int) -> None:
    """Have a worker's process go on that rests, or is about to."""
    assert eventually(partial(is_stopped, pid))
    os.kill(pid, signal.SIGCONT)


@pytest.fixture(scope="module")
def one() -> Iterator[Any]:
    """A server with one worker."""
    with served(FAKE) as address, grpc.insecure_channel(address) as channel:
        yield channel


class TestStandardServices:
    @pytest.mark.parametrize("name", ["", "robosc_api.v1.SynthesisService", "robosc_api.v1.JobService"])
    def test_health(self, fake: Any, name: str) -> None:
        stub = health_pb2_grpc.HealthStub(fake)

        def is_serving() -> bool:
            answer = stub.Check(health_pb2.HealthCheckRequest(service=name), timeout=PATIENCE_S)
            return bool(answer.status == health_pb2.HealthCheckResponse.SERVING)

        assert eventually(is_serving)

    def test_reflection_lists_the_services(self, fake: Any) -> None:
        stub = reflection_pb2_grpc.ServerReflectionStub(fake)
        requests = [reflection_pb2.ServerReflectionRequest(list_services="")]
        (listing,) = stub.ServerReflectionInfo(iter(requests), timeout=PATIENCE_S)
        assert {service.name for service in listing.list_services_response.service} == {
            "robosc_api.v1.SynthesisService",
            "robosc_api.v1.JobService",
            "grpc.health.v1.Health",
            "grpc.reflection.v1alpha.ServerReflection",
        }

    def test_what_the_server_is(self, fake: Any) -> None:
        answer = STUB(fake).GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S)
        assert answer.version == __version__
        assert answer.limits.bundle_bytes == 1000
        targets = STUB(fake).ListTargets(pb.ListTargetsRequest(), timeout=PATIENCE_S).targets
        assert "ros2" in {target.name for target in targets}


class TestRequests:
    @pytest.mark.parametrize("name", ["Check", "Format", "ListTargets", "GetVersion"])
    def test_bytes_that_are_no_message(self, fake: Any, name: str) -> None:
        call = fake.unary_unary(f"/robosc_api.v1.SynthesisService/{name}")
        reason, details, error = refusal(lambda: call(b"\xff", timeout=PATIENCE_S))
        assert (reason, error.code()) == ("MALFORMED_REQUEST", grpc.StatusCode.INVALID_ARGUMENT)
        assert details == "the request is not a valid message of this service"

    @pytest.mark.parametrize("name", ["Synthesize", "Generate", "Explore", "Verify", "Explain"])
    def test_bytes_that_are_no_message_of_a_stream(self, fake: Any, name: str) -> None:
        call = fake.unary_stream(f"/robosc_api.v1.SynthesisService/{name}")
        assert refusal(lambda: call(b"\xff", timeout=PATIENCE_S), streams=True)[0] == "MALFORMED_REQUEST"

    def test_what_the_work_refuses(self, fake: Any) -> None:
        reason, details, _ = refusal(partial(check, fake, "refuse there is no such thing"))
        assert (reason, details) == ("MALFORMED_REQUEST", "there is no such thing")

    @pytest.mark.parametrize("size", [991, 2**22, 2**24])
    def test_bundle_too_large(self, fake: Any, size: int) -> None:
        # The watch over connections must not take the bytes of what gRPC refuses by itself for a flood.
        for _ in range(3):
            with pytest.raises(grpc.RpcError) as caught:
                check(fake, "x" * size)
            assert caught.value.code() is grpc.StatusCode.RESOURCE_EXHAUSTED


class TestWork:
    def test_reports_come_in_order_and_one_result_ends_them(self, fake: Any) -> None:
        request = pb.SynthesizeRequest(bundle=bundle("pid\nstop\nreports 20\nstop\necho because"))
        call = STUB(fake).Synthesize(request, timeout=PATIENCE_S)
        pid = int(next(call).progress.message)
        goes_on(pid)
        received: list[int] = []
        # The newest progress is sent in any case, and nothing is sent after newer progress.
        for response in call:
            received.append(int(response.progress.message.removeprefix("step ")))
            if received[-1] == 19:
                break
        assert received == sorted(set(received))
        goes_on(pid)
        (last,) = call
        assert last.result.reason == "because"

    async def test_nobody_receives_progress_more_often_than_is_of_use(self, loop: HeldLoop) -> None:
        received: list[bytes] = []

        class Context:
            async def write(self, message: bytes) -> None:
                received.append(message)

        def report(number: int) -> Report:
            return Report("synthesis", f"step {number}")

        context: Any = Context()
        async with _ProgressWriter(context) as progress:
            for number in range(100):
                await progress.report(report(number))
            await loop.passed(PAUSE_S / 2)
            assert received == []
            await loop.passed(PAUSE_S / 2)
            assert received == [progress_message(report(99))]
            await progress.report(report(100))
            await progress.report(report(101))
            await loop.passed(PAUSE_S / 2)
            assert len(received) == 1
            await loop.passed(PAUSE_S / 2)
            assert received[1:] == [progress_message(report(101))]
            # After a while without a word, the next one is sent at once.
            await loop.passed(10.0)
            await progress.report(report(102))
            await loop.passed(0.0)
            assert received[2:] == [progress_message(report(102))]

    def test_what_is_done_at_once_reports_nothing_of_its_progress(
        self, fake: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("robosc_server.synthesis_service.PROGRESS_PERIOD_S", PATIENCE_S)
        request = pb.SynthesizeRequest(bundle=bundle("reports 20\necho silence"))
        (response,) = STUB(fake).Synthesize(request, timeout=PATIENCE_S)
        assert response.result.reason == "silence"

    def test_an_equal_request_is_not_done_again(self, fake: Any) -> None:
        request = pb.SynthesizeRequest(bundle=bundle("pid\nstop\necho once"))
        call = STUB(fake).Synthesize(request, timeout=PATIENCE_S)
        first = [next(call)]
        goes_on(int(first[0].progress.message))
        first += call
        again = list(STUB(fake).Synthesize(request, timeout=PATIENCE_S))
        assert [response.WhichOneof("event") for response in first] == ["progress", "result"]
        assert again == first[1:]

    def test_what_a_library_prints_does_not_disturb(self, fake: Any) -> None:
        assert check(fake, "noise\necho said") == "said"

    @pytest.mark.parametrize(
        ("text", "reason"), [("raise", "INTERNAL_FAULT"), ("die 9", "WORKER_DIED"), ("exit 3", "WORKER_DIED")]
    )
    def test_a_fault_is_reported_and_the_server_lives_on(self, fake: Any, text: str, reason: str) -> None:
        found, details, _ = refusal(partial(check, fake, text))
        assert found == reason
        assert "on purpose" not in details
        assert check(fake, f"echo after {text}") == f"after {text}"

    def test_two_requests_at_once(self, fake: Any) -> None:
        call, pid = stuck(fake)
        assert check(fake, "echo beside") == "beside"
        assert is_running(pid)
        call.cancel()
        assert eventually(partial(has_ended, pid))


class TestEnding:
    def test_cancelling_kills_the_worker_and_frees_its_place(self, one: Any) -> None:
        for text in ("pid\nstuck", "pid\nspin", "pid\nstop"):
            call, pid = stuck(one, text)
            call.cancel()
            assert eventually(partial(has_ended, pid))
        assert check(one, "echo free") == "free"

    def test_the_callers_deadline_kills_the_worker(self, fake: Any) -> None:
        pids: list[int] = []

        def passes(timeout_s: float) -> None:
            with pytest.raises(grpc.RpcError) as caught:
                call, pid = stuck(fake, timeout=timeout_s)
                pids.append(pid)
                next(call)
            assert caught.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED

        # Long enough for a task to begin: on this machine, now, that shows.
        timeout_s = 0.3
        while not pids:
            passes(timeout_s)
            timeout_s *= 2
        assert eventually(partial(has_ended, pids[0]))

    def test_the_servers_own_limit(self) -> None:
        loop = HeldLoop()
        limits = {"task_seconds": 500.0, "request_seconds": 1e8}
        with served(FAKE, loop=loop, **limits) as address, grpc.insecure_channel(address) as channel:
            call = STUB(channel).Check.future(pb.CheckRequest(bundle=bundle("stuck")), timeout=PATIENCE_S)

            def is_over() -> bool:
                loop.advance(500.0)
                return bool(call.done())

            assert eventually(is_over)
            reason, _, error = refusal(call.result)
            assert (reason, error.code()) == ("TIME_LIMIT", grpc.StatusCode.DEADLINE_EXCEEDED)

    def test_too_many_that_wait_are_refused_and_learn_when_to_come_again(self) -> None:
        with served(FAKE, waiting_tasks=1) as address, grpc.insecure_channel(address) as channel:
            call, _ = stuck(channel)
            ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
            calls = [
                STUB(channel).Check.future(pb.CheckRequest(bundle=bundle("echo done")), timeout=PATIENCE_S)
                for _ in range(2)
            ]
            for one in calls:
                one.add_done_callback(ended.put)
            # Either of them may come first.
            refused = ended.get(timeout=PATIENCE_S)
            assert refused.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
            assert float(dict(refused.trailing_metadata())["retry-after"]) > 0
            call.cancel()
            assert ended.get(timeout=PATIENCE_S).result().diagnostics[0].message == "done"

    def test_who_does_not_read_holds_no_worker_up(self, one: Any) -> None:
        # Far more than fits on the way; it is not read.
        unread = STUB(one).Synthesize(pb.SynthesizeRequest(bundle=bundle("long reports 900\necho done")))
        assert check(one, "echo others") == "others"
        unread.cancel()

    def test_who_reads_no_results_gets_no_more_of_them(self) -> None:
        # Frames that are not read stop the server's end of the connection at this much.
        options = [("grpc.http2.lookahead_bytes", 65535), ("grpc.http2.bdp_probe", 0)]
        with served(FAKE, result_bytes=3_000_000) as address, grpc.insecure_channel(address, options) as channel:
            request = pb.SynthesizeRequest(bundle=bundle("size 2900000")).SerializeToString()
            synthesize: Any = channel.unary_stream("/robosc_api.v1.SynthesisService/Synthesize")
            calls = [synthesize(request, timeout=PATIENCE_S) for _ in range(6)]
            refused: list[Any] = []
            read = 0
            # The last one first: when it is at its turn, those before it are done and unread.
            for call in reversed(calls):
                try:
                    read += sum(1 for _ in call)
                except grpc.RpcError as error:
                    refused.append(error)
            assert read + len(refused) == 6
            assert 1 <= len(refused) <= 4
            assert all(error.code() is grpc.StatusCode.RESOURCE_EXHAUSTED for error in refused)
            # They are read: there is room again, as soon as the server has seen it.
            assert eventually(lambda: is_taken(lambda: list(synthesize(request, timeout=PATIENCE_S))))

    def test_who_reads_no_findings_gets_no_more_of_them(self) -> None:
        with served(FAKE, result_bytes=3_000_000) as address:
            with strangers(address, 1, settings={INITIAL_WINDOW: 0}) as (deaf,):
                for number in range(1, 12, 2):
                    deaf.call(number, "/robosc_api.v1.SynthesisService/Check")
                    deaf.message(number, pb.CheckRequest(bundle=bundle("size 2900000")).SerializeToString())
                assert eventually(lambda: deaf.has_received(b"not read its earlier results"))
            # The line is gone, and with it what was unread, as soon as the server has seen it.
            with grpc.insecure_channel(address) as channel:
                assert eventually(lambda: is_taken(lambda: check(channel, "size 2900000")))

    def test_a_connection_of_a_stranger_disturbs_nobody(self, fake: Any) -> None:
        # Not HTTP/2, and half of it.
        target = fake._channel.target().decode().split(":///")[-1]
        host, _, port = target.rpartition(":")
        for content in (b"GET / HTTP/1.1\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"\0" * 100):
            with socket.create_connection((host, int(port))) as connection:
                connection.sendall(content)
                assert check(fake, f"echo {len(content)}") == str(len(content))


def is_taken(call: Callable[[], object]) -> bool:
    """Make a call; return False where the server asks to make it again later."""
    try:
        call()
    except grpc.RpcError as error:
        assert error.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
        return False
    return True


@contextmanager
def line_that_dies(address: str) -> Iterator[tuple[str, threading.Event]]:
    """A line to a server that carries nothing any more, without a notice, once the event is set; its address."""
    host, _, port = address.rpartition(":")
    is_dead = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def carry(source: socket.socket, target: socket.socket) -> None:
            with suppress(OSError):
                while data := source.recv(65536):
                    if not is_dead.is_set():
                        target.sendall(data)

        def serve() -> None:
            with suppress(OSError):
                near, _ = listener.accept()
                far = socket.create_connection((host, int(port)))
                ends.extend((near, far))
                for pair in ((near, far), (far, near)):
                    threading.Thread(target=carry, args=pair, daemon=True).start()

        ends: list[socket.socket] = []
        threading.Thread(target=serve, daemon=True).start()
        try:
            yield f"127.0.0.1:{listener.getsockname()[1]}", is_dead
        finally:
            for end in ends:
                end.close()


class TestLostCallers:
    def test_the_work_of_a_caller_whose_line_has_died_is_ended(self, monkeypatch: pytest.MonkeyPatch) -> None:
        quick = (("grpc.keepalive_time_ms", 300), ("grpc.http2.ping_timeout_ms", 300))
        monkeypatch.setattr(application, "KEEPALIVE", quick)
        with (
            served(FAKE) as address,
            line_that_dies(address) as (line, is_dead),
            grpc.insecure_channel(line) as channel,
        ):
            _, pid = stuck(channel)
            is_dead.set()
            # No end of the connection reached the server: it asks for a sign of life, and gets none.
            assert eventually(partial(has_ended, pid))


class TestStopping:
    def test_a_call_under_way_is_finished_and_new_ones_are_refused(self) -> None:
        with ExitStack() as server:
            address = server.enter_context(served(FAKE, worker_processes=2, drain_seconds=PATIENCE_S))
            channel: Any = server.enter_context(grpc.insecure_channel(address))
            begun = STUB(channel).Synthesize(pb.SynthesizeRequest(bundle=bundle("pid\nstop\necho done")))
            first = int(next(begun).progress.message)
            ending = threading.Thread(target=server.pop_all().close)
            # The channel is closed first: this one is another.
            with grpc.insecure_channel(address) as other:
                call = STUB(other).Synthesize(pb.SynthesizeRequest(bundle=bundle("pid\nstop\necho done too")))
                second = int(next(call).progress.message)
                ending.start()
                refused: list[str] = []

                def is_refused() -> bool:
                    try:
                        check(other, f"echo {len(refused)}")
                    except grpc.RpcError as error:
                        refused.append(str(error.code().name))
                    return bool(refused)

                assert eventually(is_refused)
                assert refused == ["UNAVAILABLE"]
                # The channel of the first one is gone, and so is it.
                assert eventually(partial(has_ended, first))
                goes_on(second)
                assert [response.result.reason for response in call] == ["done too"]
            ending.join(PATIENCE_S)
            assert not ending.is_alive()

    def test_what_never_ends_is_ended(self) -> None:
        with served(FAKE) as address, grpc.insecure_channel(address) as channel:
            _, pid = stuck(channel)
        assert eventually(partial(has_ended, pid))


class TestStart:
    def test_port_in_use(self) -> None:
        with served(given_workers=StartedWorkers()) as address:
            port = int(address.rsplit(":", 1)[1])
            with pytest.raises(StartError, match=str(port)), served(given_workers=StartedWorkers(), port=port):
                pass

    @pytest.mark.parametrize(
        "arguments", [["--port", "65536"], ["--port", "x"], ["--worker-processes", "0"], ["--nonsense"]]
    )
    def test_wrong_use(self, arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert left.value.code == 2
        assert capsys.readouterr().err

    def test_no_thread_is_left(self, monkeypatch: pytest.MonkeyPatch) -> None:
        # Those of servers that other tests share come and go meanwhile: what counts is who has started a thread.
        ours, start = {threading.current_thread()}, threading.Thread.start

        def noted(thread: threading.Thread) -> None:
            if threading.current_thread() in ours:
                ours.add(thread)
            start(thread)

        monkeypatch.setattr(threading.Thread, "start", noted)
        with served(FAKE):
            pass
        ours.remove(threading.current_thread())
        assert len(ours) > 1
        assert eventually(lambda: not any(thread.is_alive() for thread in ours))


def test_supervisors_are_signed_and_nothing_else(tmp_path: Path) -> None:
    key = make_key_pair(tmp_path / "site.key", tmp_path / "site.pub")
    bundle = load_bundle(EXAMPLES / "line_follower" / "line_follower.rscd")
    with served(signing_key=tmp_path / "site.key") as address, Client(address) as client:
        made = client.synthesize(bundle)
        assert signer(made.supervisor, made.signature, [key]) == key
        assert client.check(bundle) == ()
