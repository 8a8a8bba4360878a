"""The calls of the service, over real sockets."""

import json
import math
import socket
import threading
import time
from collections import Counter
from dataclasses import replace
from functools import partial
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc.targets.ros.state_topic import state_topic
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.configuration import parse
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.host import monotonic
from robosc_bridge.remote import (
    RemoteEndpoint,
    RemoteError,
    RemoteSettings,
    convert,
    serve,
    service,
    settings_of,
    shutdown,
)
from robosc_bridge.remote import endpoint as endpoint_module
from robosc_bridge.remote.endpoint import MAXIMUM_CONNECTIONS, MAXIMUM_REQUEST_BYTES
from robosc_bridge.remote.watchers import MAXIMUM_EVENTS
from robosc_bridge.transport.system_host import SYSTEM_HOST
from support.remote import READING, FakeDaemon, connected, model, scan, served
from support.waiting import PATIENCE_S, wait_until


def status(stub: Any) -> Any:
    return stub.GetStatus(pb.GetStatusRequest(), timeout=PATIENCE_S)


def command(stub: Any, kind: Any, timeout: float = PATIENCE_S) -> str:
    return str(stub.Command(pb.CommandRequest(command=kind), timeout=timeout).refusal)


def failure(call: Any) -> tuple[grpc.StatusCode, str]:
    with pytest.raises(grpc.RpcError) as caught:
        list(call) if hasattr(call, "__iter__") else call()
    return caught.value.code(), caught.value.details() or ""


class TestDefinition:
    def test_it_is_the_models(self, stub: Any) -> None:
        found = stub.GetDefinition(pb.GetDefinitionRequest(), timeout=PATIENCE_S)
        topic = state_topic(model())
        assert found.robot == "Porter"
        assert json.loads(found.definition) == topic.definition
        assert {(item.event, item.component, item.state): item.id for item in found.transitions} == {
            (event, component, state): number
            for event, parts in topic.transitions.items()
            for component, numbers in parts
            for state, number in numbers.items()
        }

    def test_communications_have_kind_identifier_channel_and_fields(self, stub: Any) -> None:
        found = stub.GetDefinition(pb.GetDefinitionRequest(), timeout=PATIENCE_S)
        rows = [(item.name, item.component, item.identifier, item.channel) for item in found.communications]
        assert rows == [
            ("drive", "Wheels", "/cmd_vel", "drive"),
            ("order", "Desk", "/order", "grpc"),
            ("show", "Desk", "/show", "grpc"),
            ("open", "Desk", "/open", "grpc"),
            ("carry", "Desk", "/carry", "grpc"),
        ]
        assert [item.kind for item in found.communications] == [1, 2, 1, 3, 4]
        assert [list(item.fields) for item in found.communications] == [["linear", "angular"], [], [], [], []]

    @pytest.mark.parametrize("is_layer", [True, False])
    def test_the_deployment_is_reported(self, is_layer: bool) -> None:
        with FakeDaemon(is_layer=is_layer) as daemon, served(daemon) as endpoint, connected(endpoint.address) as stub:
            assert stub.GetDefinition(pb.GetDefinitionRequest(), timeout=PATIENCE_S).is_layer is is_layer

    @pytest.mark.parametrize("name", ["", "waffle_pi"])
    def test_the_turtlebot_is_reported(self, name: str, daemon: FakeDaemon) -> None:
        daemon.operations.turtlebot = name
        with served(daemon) as endpoint, connected(endpoint.address) as stub:
            assert stub.GetDefinition(pb.GetDefinitionRequest(), timeout=PATIENCE_S).turtlebot == name

    @pytest.mark.parametrize("place", [None, (0.0, -0.06)])
    def test_the_place_of_the_lidar_is_reported(self, place: tuple[float, float] | None, daemon: FakeDaemon) -> None:
        daemon.operations.scanner_place = place
        with served(daemon) as endpoint, connected(endpoint.address) as stub:
            definition = stub.GetDefinition(pb.GetDefinitionRequest(), timeout=PATIENCE_S)
        assert {definition.HasField("scanner_x_m"), definition.HasField("scanner_y_m")} == {place is not None}
        if place is not None:
            assert (definition.scanner_x_m, definition.scanner_y_m) == place


class TestStatus:
    def test_everything_is_reported(self, daemon: FakeDaemon, stub: Any) -> None:
        shown = daemon.show(reading=READING, scan=scan(1.0), problem="the drive base is lost", state=State.FAULT)
        found = status(stub).snapshot
        assert found.number == shown.number
        assert found.time.ToNanoseconds() == pytest.approx(shown.time_s * 1e9, abs=2000)
        assert found.age_s == 0.0
        assert pb.BridgeState.Name(found.state) == "BRIDGE_STATE_FAULT"
        assert found.problem == "the drive base is lost"
        reasons = [(item.code, item.text, item.holds_until_reset) for item in found.reasons]
        assert reasons == [
            ("SCAN_STALE", "The scanner has made no full revolution for too long.", False),
            ("OPERATOR_STOP", "An operator has stopped the robot.", True),
        ]
        assert [item.code for item in found.warnings] == ["BATTERY"]
        assert list(found.stops) == ["'/order' is stale"]
        assert [(item.name, item.works) for item in found.devices] == [("drive", True), ("scanner", False)]
        assert [(item.name, item.state, dict(item.variables)) for item in found.components] == [
            ("Desk", "idle", {"count": 3.0})
        ]
        assert list(found.enabled) == ["drive"]
        assert found.has_scan
        assert found.overruns == 4

    def test_the_drive_is_reported_with_what_is_not_known_left_out(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.show(reading=READING)
        drive = status(stub).snapshot.drive
        assert (drive.pose.x_m, drive.pose.y_m, drive.pose.heading_rad) == (1.0, 2.0, 0.5)
        assert (drive.velocity.linear_m_s, drive.velocity.angular_rad_s) == (0.1, -0.2)
        assert (drive.left_wheel_m_s, drive.right_wheel_m_s) == (0.1, 0.2)
        assert drive.is_torque_on
        assert list(drive.faults) == ["input voltage"]
        assert drive.battery_v == 11.8
        assert not drive.HasField("battery_share")
        assert dict(drive.buttons) == {"button_1": True}
        assert drive.age_s == pytest.approx(monotonic(), abs=PATIENCE_S)

    def test_what_the_drive_measures_of_its_wheels_and_its_motion_is_reported(
        self, daemon: FakeDaemon, stub: Any
    ) -> None:
        daemon.show(reading=READING)
        drive = status(stub).snapshot.drive
        assert not any(drive.HasField(name) for name in ("left_wheel_m", "right_wheel_m", "wheel_radius_m"))
        assert not any(drive.HasField(name) for name in ("linear_variance", "angular_variance"))
        assert (dict(drive.imu), list(drive.pose_covariance)) == ({}, [])
        imu = {"angular_velocity_z": -0.2}
        daemon.show(reading=replace(READING, time_s=12.5, imu=imu, wheels_m=(0.0, 0.75), wheel_radius_m=0.033))
        drive = status(stub).snapshot.drive
        assert (drive.time_s, dict(drive.imu)) == (12.5, imu)
        assert (drive.left_wheel_m, drive.right_wheel_m, drive.wheel_radius_m) == (0.0, 0.75, 0.033)
        assert drive.HasField("left_wheel_m")
        reading = replace(READING, pose_covariance=tuple(map(float, range(9))), velocity_variances=(0.0, 0.5))
        daemon.show(reading=reading)
        drive = status(stub).snapshot.drive
        assert list(drive.pose_covariance) == list(range(9))
        assert (drive.HasField("linear_variance"), drive.linear_variance, drive.angular_variance) == (True, 0.0, 0.5)

    def test_times_are_by_one_clock(self, daemon: FakeDaemon, stub: Any) -> None:
        before_s = monotonic()
        shown = replace(scan(1.5), min_m=0.12, max_m=3.5)
        daemon.show(reading=replace(READING, time_s=before_s), scan=shown)
        response = next(stub.Watch(pb.WatchRequest(with_scans=True), timeout=PATIENCE_S))
        assert before_s == response.snapshot.drive.time_s < response.scan.time_s == shown.time_s
        assert shown.time_s < response.sent_s < monotonic()
        assert (response.scan.min_m, response.scan.max_m) == (0.12, 3.5)

    def test_ages_are_by_the_clock_of_the_devices(
        self, daemon: FakeDaemon, stub: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        # The clock after the computer was suspended for a day.
        monkeypatch.setattr(time, "clock_gettime", lambda clock: time.monotonic() + 86_400.0)
        daemon.show(reading=replace(READING, time_s=SYSTEM_HOST.monotonic() - 100.0))
        assert status(stub).snapshot.drive.age_s == pytest.approx(100.0, abs=PATIENCE_S)
        message = pb.Scan()
        convert.put_scan(message, replace(scan(1.0), time_s=SYSTEM_HOST.monotonic() - 100.0))
        assert message.age_s == pytest.approx(100.0, abs=PATIENCE_S)

    def test_a_loop_that_hangs_is_seen_by_the_age(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.show(time_s=time.time() - 100.0)
        assert status(stub).snapshot.age_s == pytest.approx(100.0, abs=PATIENCE_S)

    def test_before_the_first_turn_there_is_none(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.feed._snapshot = None
        assert not status(stub).HasField("snapshot")

    @pytest.mark.parametrize("state", list(State))
    def test_each_state_has_its_name(self, state: State, daemon: FakeDaemon, stub: Any) -> None:
        daemon.show(state=state)
        assert pb.BridgeState.Name(status(stub).snapshot.state) == f"BRIDGE_STATE_{state.name}"


class TestCommands:
    @pytest.mark.parametrize("name", ["START", "STANDBY", "RESUME", "RESET"])
    def test_it_is_ordered_and_answered(self, name: str, daemon: FakeDaemon, stub: Any) -> None:
        assert command(stub, pb.CommandKind.Value(f"COMMAND_KIND_{name}")) == ""
        assert daemon.commands() == [OperatorCommand[name]]
        assert daemon.orders[0].by.startswith("ipv4:127.0.0.1:")

    def test_a_refusal_is_a_value(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.refusal = "The robot runs already."
        assert command(stub, pb.COMMAND_KIND_START) == "The robot runs already."

    @pytest.mark.parametrize("number", [0, 5, 1000, -1])
    def test_an_unknown_one_is_malformed(self, number: int, daemon: FakeDaemon, stub: Any) -> None:
        code, details = failure(lambda: command(stub, number))
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert details == f"there is no command of number {number}"
        assert daemon.orders == []

    def test_a_caller_that_goes_away_leaves_an_order_that_may_be_answered(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.refusal = None
        call = stub.Command.future(pb.CommandRequest(command=pb.COMMAND_KIND_START))
        wait_until(lambda: daemon.orders)
        call.cancel()
        daemon.refusal = ""
        # The loop's thread may answer, whatever was cancelled.
        wait_until(lambda: command(stub, pb.COMMAND_KIND_RESET) == "")
        daemon.orders[0].answer("")

    @pytest.mark.parametrize(
        ("name", "undone_by"),
        [("START", [OperatorCommand.STANDBY]), ("RESUME", [OperatorCommand.STOP]), ("RESET", []), ("STANDBY", [])],
    )
    def test_what_has_failed_for_its_caller_does_not_happen_later(
        self, name: str, undone_by: list[OperatorCommand], daemon: FakeDaemon, stub: Any
    ) -> None:
        daemon.refusal = None
        kind: Any = pb.CommandKind.Value(f"COMMAND_KIND_{name}")
        call = stub.Command.future(pb.CommandRequest(command=kind))
        wait_until(lambda: daemon.orders)
        call.cancel()
        wait_until(lambda: daemon.commands() == [OperatorCommand[name], *undone_by])
        daemon.refusal = ""
        assert command(stub, pb.COMMAND_KIND_RESET) == ""
        assert daemon.commands() == [OperatorCommand[name], *undone_by, OperatorCommand.RESET]

    def test_a_callers_own_deadline_takes_it_back_too(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.refusal = None
        limit_s = 0.25
        while not daemon.orders:
            # One that is over before the call has come says nothing.
            limit_s *= 2
            code, _ = failure(partial(command, stub, pb.COMMAND_KIND_START, limit_s))
            assert code is grpc.StatusCode.DEADLINE_EXCEEDED

        def is_taken_back() -> bool:
            counts = Counter(daemon.commands())
            return counts.keys() == {OperatorCommand.START, OperatorCommand.STANDBY} and len(set(counts.values())) == 1

        wait_until(is_taken_back)
        assert daemon.commands()[0] is OperatorCommand.START

    def test_a_loop_that_does_not_answer_is_reported(
        self, daemon: FakeDaemon, stub: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(service, "COMMAND_LIMIT_S", 0.05)
        daemon.refusal = None
        code, details = failure(lambda: command(stub, pb.COMMAND_KIND_START))
        assert code is grpc.StatusCode.DEADLINE_EXCEEDED
        assert "has not answered" in details
        wait_until(lambda: daemon.commands() == [OperatorCommand.START, OperatorCommand.STANDBY])

    def test_commands_that_wait_are_bounded_and_a_stop_is_not(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.refusal = None
        request = pb.CommandRequest(command=pb.COMMAND_KIND_START)
        calls = [stub.Command.future(request) for _ in range(service.MAXIMUM_COMMANDS)]
        wait_until(lambda: len(daemon.orders) == service.MAXIMUM_COMMANDS)
        code, details = failure(lambda: command(stub, pb.COMMAND_KIND_START))
        assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
        assert details == "there are 32 commands already"
        stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
        assert daemon.commands()[-1] is OperatorCommand.STOP
        for call in calls:
            call.cancel()


class TestStop:
    def test_it_takes_effect_before_it_is_answered_whatever_the_loop_does(self, daemon: FakeDaemon, stub: Any) -> None:
        daemon.turns = False
        daemon.operations.order(OperatorCommand.START, "test")
        stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
        assert daemon.commands() == [OperatorCommand.STOP]
        daemon.turns = True

    def test_it_wins_while_all_watchers_hang_and_all_programs_are_there(
        self, daemon: FakeDaemon, endpoint: RemoteEndpoint
    ) -> None:
        entry = {"time": 1.0, "kind": "event", "event": "x" * 20_000}
        channels = [connected(endpoint.address) for _ in range(4)]
        stubs = [channel.__enter__() for channel in channels]
        calls = []
        try:
            for number in range(service.MAXIMUM_WATCHERS):
                calls.append(stubs[number % 4].Watch(pb.WatchRequest(maximum_rate_hz=100)))
            for number in range(service.MAXIMUM_PROGRAMS):
                forever = threading.Event()
                calls.append(stubs[number % 4].Attach(_hello_and_wait(forever)))
                calls[-1].add_callback(forever.set)
            for call in calls:
                next(call)  # It is there; from now on nobody reads.
            for _ in range(300):
                daemon.feed.append(entry)
                daemon.show()
            code, details = failure(stubs[0].Watch(pb.WatchRequest()))
            assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
            assert details == "there are 100 watchers already"
            with connected(endpoint.address) as stub:
                stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
            assert daemon.commands() == [OperatorCommand.STOP]
        finally:
            for call in calls:
                call.cancel()
            for channel in channels:
                channel.__exit__(None, None, None)

    def test_callers_that_say_nothing_do_not_keep_it_out_for_long(
        self, daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        assert endpoint_module._HANDSHAKE_LIMIT_S <= 3.0
        monkeypatch.setattr(endpoint_module, "_HANDSHAKE_LIMIT_S", 0.2)
        with served(daemon) as endpoint:
            self._crowd(endpoint)
        assert daemon.commands()[-1] is OperatorCommand.STOP

    def _crowd(self, endpoint: RemoteEndpoint) -> None:
        host, _, port = endpoint.address.rpartition(":")
        silent = [socket.create_connection((host, int(port))) for _ in range(MAXIMUM_CONNECTIONS + 20)]

        def stopped() -> bool:
            try:
                with connected(endpoint.address) as stub:
                    stub.Stop(pb.StopRequest(), timeout=1.0)
            except grpc.RpcError:
                return False
            return True

        try:
            wait_until(stopped)
        finally:
            for line in silent:
                line.close()


def _hello_and_wait(forever: threading.Event) -> Any:
    yield pb.AttachRequest(hello=pb.Hello(name="program"))
    forever.wait(PATIENCE_S)


class TestWatch:
    def test_snapshots_and_events_come_as_they_happen(self, daemon: FakeDaemon, stub: Any) -> None:
        call = stub.Watch(pb.WatchRequest(maximum_rate_hz=100), timeout=PATIENCE_S)
        assert next(call).snapshot.state == pb.BRIDGE_STATE_RUNNING
        daemon.feed.append({"time": 2.5, "kind": "blocked", "identifier": "/cmd_vel", "data": {"x": math.nan}})
        daemon.feed.append({"time": 3.0, "kind": "event", "event": "order.response", "decision_us": 12})
        shown = daemon.show(state=State.STANDBY)
        events: list[Any] = []
        while len(events) < 2:
            response = next(call)
            events += response.events
            assert response.lost_events == 0
        assert [event["kind"] for event in events] == ["blocked", "event"]
        assert events[0]["identifier"] == "/cmd_vel"
        assert events[0]["data"]["x"] == "nan"
        assert events[1]["decision_us"] == 12
        while response.snapshot.number < shown.number:
            response = next(call)
        assert response.snapshot.state == pb.BRIDGE_STATE_STANDBY
        call.cancel()

    def test_the_loop_pays_for_one_watcher_however_many_there_are(self, daemon: FakeDaemon, stub: Any) -> None:
        calls = [stub.Watch(pb.WatchRequest(), timeout=PATIENCE_S) for _ in range(5)]
        for call in calls:
            next(call)
        assert len(daemon.feed._subscriptions) == 1
        for call in calls:
            call.cancel()
        wait_until(lambda: not daemon.feed.is_watched)

    def test_scans_come_once_each_and_only_if_wanted(self, daemon: FakeDaemon, stub: Any) -> None:
        revolution = scan(1.25)
        daemon.show(scan=revolution)
        with_scans = stub.Watch(pb.WatchRequest(with_scans=True, maximum_rate_hz=100), timeout=PATIENCE_S)
        first = next(with_scans)
        assert first.scan.ranges_m[0] == 1.25
        assert len(first.scan.ranges_m) == 360
        assert all(map(math.isnan, first.scan.ranges_m[1:]))
        assert first.scan.turns_per_s == 5.0
        daemon.show(scan=revolution)
        assert not next(with_scans).HasField("scan")
        daemon.show(scan=scan(0.5))
        response = next(with_scans)
        while not response.HasField("scan"):
            response = next(with_scans)
        assert response.scan.ranges_m[0] == 0.5
        with_scans.cancel()
        without = stub.Watch(pb.WatchRequest(), timeout=PATIENCE_S)
        assert not next(without).HasField("scan")
        assert daemon.feed.snapshot is not None
        without.cancel()

    def test_events_may_be_left_out(self, daemon: FakeDaemon, stub: Any) -> None:
        call = stub.Watch(pb.WatchRequest(without_events=True, maximum_rate_hz=100), timeout=PATIENCE_S)
        next(call)
        for _ in range(MAXIMUM_EVENTS * 2):
            daemon.feed.append({"time": 1.0, "kind": "event"})
        number = daemon.show().number
        response = next(call)
        while response.snapshot.number < number:
            response = next(call)
        assert not response.events
        assert response.lost_events == 0
        call.cancel()

    def test_the_rate_is_the_callers(self, daemon: FakeDaemon, stub: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        # Else signs of life wait for a reader that was late.
        monkeypatch.setattr(service, "SIGN_OF_LIFE_S", PATIENCE_S)
        call = stub.Watch(pb.WatchRequest(maximum_rate_hz=10), timeout=PATIENCE_S)
        next(call)
        begin_s = time.monotonic()
        for _ in range(3):
            daemon.show()
            next(call)
        # Each comes a tenth of a second after the one before, at the earliest; the first may come early.
        assert time.monotonic() - begin_s > 0.15
        call.cancel()

    def test_a_sign_of_life_comes_of_a_loop_that_hangs(
        self, daemon: FakeDaemon, stub: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(service, "SIGN_OF_LIFE_S", 0.02)
        daemon.show(time_s=time.time())
        call = stub.Watch(pb.WatchRequest(maximum_rate_hz=100), timeout=PATIENCE_S)
        before = next(call)
        after = next(call)
        assert after.snapshot.number == before.snapshot.number
        assert after.snapshot.age_s > before.snapshot.age_s
        call.cancel()

    @pytest.mark.parametrize("rate_hz", [-1.0, 0.01, 101.0, math.nan, math.inf])
    def test_a_rate_out_of_bounds_is_malformed(self, rate_hz: float, stub: Any) -> None:
        code, details = failure(stub.Watch(pb.WatchRequest(maximum_rate_hz=rate_hz), timeout=PATIENCE_S))
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert details == "maximum_rate_hz may be from 0.1 to 100"

    def test_who_reads_too_slowly_learns_how_many_events_it_lost(self, daemon: FakeDaemon, stub: Any) -> None:
        call = stub.Watch(pb.WatchRequest(maximum_rate_hz=100), timeout=PATIENCE_S)
        next(call)
        count = 3000
        for number in range(count):
            daemon.feed.append({"time": float(number), "kind": "event", "event": "x" * 20_000})
            if number % 100 == 0:
                daemon.show()
                time.sleep(0.005)
        seen, lost, last = 0, 0, -1.0
        while seen + lost < count:
            response = next(call)
            lost += response.lost_events
            for event in response.events:
                assert event["time"] > last
                last = event["time"]
                seen += 1
        assert lost > 0
        assert last == count - 1.0
        call.cancel()

    def test_the_end_of_the_bridge_is_reported_with_the_last_state(
        self, daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        # However long a busy machine takes for the last word.
        monkeypatch.setattr(shutdown, "OWN_END_S", PATIENCE_S)
        monkeypatch.setattr(endpoint_module, "_GRACE_S", PATIENCE_S)
        with served(daemon) as endpoint, connected(endpoint.address) as stub:
            call = stub.Watch(pb.WatchRequest(maximum_rate_hz=0.1), timeout=PATIENCE_S)
            next(call)
            daemon.show(state=State.OVER)
            endpoint.stop()
            responses = []
            with pytest.raises(grpc.RpcError) as caught:
                for response in call:
                    responses.append(response)
            assert caught.value.code() is grpc.StatusCode.UNAVAILABLE
            assert caught.value.details() == "the bridge ends"
            assert responses[-1].snapshot.state == pb.BRIDGE_STATE_OVER


class TestHostileCallers:
    @pytest.mark.parametrize("method", ["GetStatus", "Command", "Stop", "GetDefinition"])
    def test_bytes_that_are_no_message(self, method: str, daemon: FakeDaemon, endpoint: RemoteEndpoint) -> None:
        channel: Any
        with grpc.insecure_channel(endpoint.address) as channel:
            call = channel.unary_unary(f"/robosc_api.v1.BridgeService/{method}")
            code, details = failure(lambda: call(b"\xff", timeout=PATIENCE_S))
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert details == "the request is not a valid message of this service"
        assert daemon.orders == []

    def test_bytes_that_are_no_message_in_streams(self, endpoint: RemoteEndpoint) -> None:
        channel: Any
        with grpc.insecure_channel(endpoint.address) as channel:
            watch = channel.unary_stream("/robosc_api.v1.BridgeService/Watch")(b"\xff", timeout=PATIENCE_S)
            assert failure(watch)[0] is grpc.StatusCode.INVALID_ARGUMENT
            attach = channel.stream_stream("/robosc_api.v1.BridgeService/Attach")(iter([b"\xff"]), timeout=PATIENCE_S)
            assert failure(attach)[0] is grpc.StatusCode.INVALID_ARGUMENT

    def test_a_message_that_is_too_large(self, stub: Any, endpoint: RemoteEndpoint) -> None:
        channel: Any
        with grpc.insecure_channel(endpoint.address) as channel:
            call = channel.unary_unary("/robosc_api.v1.BridgeService/GetStatus")
            code, _ = failure(lambda: call(b"\x00" * (MAXIMUM_REQUEST_BYTES + 1), timeout=PATIENCE_S))
        assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
        assert status(stub).HasField("snapshot")

    def test_what_is_no_http(self, endpoint: RemoteEndpoint, stub: Any) -> None:
        host, _, port = endpoint.address.rpartition(":")
        with socket.create_connection((host, int(port))) as line:
            line.sendall(b"GET / HTTP/1.1\r\n\r\n" + bytes(range(256)) * 100)
        assert status(stub).HasField("snapshot")


class TestEndpoint:
    def test_health(self, endpoint: RemoteEndpoint) -> None:
        with grpc.insecure_channel(endpoint.address) as channel:
            for name in ("", "robosc_api.v1.BridgeService"):
                request = health_pb2.HealthCheckRequest(service=name)
                answer = health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S)
                assert answer.status == health_pb2.HealthCheckResponse.SERVING

    def test_an_address_in_use_is_reported(self, daemon: FakeDaemon, endpoint: RemoteEndpoint) -> None:
        with pytest.raises(RemoteError, match="cannot listen on 127"):
            serve(daemon.operations, RemoteSettings(endpoint.address))

    def test_beyond_this_machine_only_with_tls(self, daemon: FakeDaemon) -> None:
        with pytest.raises(RemoteError, match="is reachable from other machines"):
            serve(daemon.operations, RemoteSettings("0.0.0.0:0"))

    def test_it_ends_and_gives_its_port_back(self, daemon: FakeDaemon) -> None:
        endpoint = serve(daemon.operations, RemoteSettings("127.0.0.1:0"))
        endpoint.stop()
        endpoint.stop()
        wait_until(lambda: not any(thread.name == "remote endpoint" for thread in threading.enumerate()))
        again = serve(daemon.operations, RemoteSettings(endpoint.address))
        assert again.address == endpoint.address
        again.stop()

    def test_its_death_is_seen(self, daemon: FakeDaemon) -> None:
        endpoint = RemoteEndpoint(daemon.operations, RemoteSettings("127.0.0.1:0"))
        assert not endpoint.is_alive
        endpoint.start()
        try:
            assert endpoint.is_alive
            assert endpoint._loop is not None
            endpoint._loop.call_soon_threadsafe(endpoint._loop.stop)
            wait_until(lambda: not endpoint.is_alive)
        finally:
            endpoint.stop()

    def test_the_configuration_says_where_and_how(self) -> None:
        text = """
        robot: burger
        drive: {driver: opencr, port: /dev/none}
        safety: {operator_link_timeout_s: 2}
        remote:
          grpc_address: 0.0.0.0:50061
          tls_certificate: /etc/robot.pem
          tls_key: /etc/robot.key
          client_ca: /etc/ca.pem
          tokens: /etc/tokens
          insecure_beyond_loopback: true
        """
        settings = settings_of(parse(text.encode(), "test.yaml").configuration)
        assert settings is not None
        assert (settings.address, settings.operator_timeout_s) == ("0.0.0.0:50061", 2.0)
        security = settings.security
        assert str(security.certificate) == "/etc/robot.pem"
        assert str(security.key) == "/etc/robot.key"
        assert str(security.client_ca) == "/etc/ca.pem"
        assert str(security.tokens) == "/etc/tokens"
        assert security.insecure_beyond_loopback
        without = parse(b"robot: burger\ndrive: {driver: opencr, port: /dev/none}\n", "test.yaml").configuration
        assert settings_of(without) is None
