"""The link on a virtual host, over datagrams, connections and a serial line, with a station of pymavlink's codec."""

import itertools
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from robosc_bridge.daemon.programs.items import Detached
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground_station.link import LASTING_S, REST, TURN_S, GroundLink
from robosc_bridge.ground_station.session import STATION_LIMIT_S
from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.host import NetworkPort
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_simulated import VirtualHost
from support.ground import KEY, PlayedDaemon, Station, of_type

FASTEST = Velocity(0.2, 2.0)
LISTENING = "udpin:127.0.0.1:14550"
CALLING = LISTENING.replace("udpin", "udpout")


@pytest.fixture
def host() -> Iterator[VirtualHost]:
    with VirtualHost() as found:
        yield found


class Peer:
    """A station at an end of a line of the virtual host.

    Args:
        host: The virtual host.
        address: Address that it calls, or listens at.
        key: Signing key.
        system: Its own number.
    """

    def __init__(self, host: VirtualHost, address: str = CALLING, key: bytes | None = None, system: int = 255) -> None:
        self.station = Station(key, system)
        self.line = host.open_network(address)
        self._host = host

    def send(self, data: bytes) -> None:
        self.line.write(data)

    def receive(self, limit_s: float = 0.2) -> list[Any]:
        data = self.line.read(limit_s)
        self.line.answer_sender()
        return self.station.hear(data)

    def until(self, name: str, limit_s: float = 2.0, is_so: Callable[[Any], bool] = lambda _: True) -> Any:
        """The next message of a kind."""
        end_s = self._host.monotonic() + limit_s
        while (left_s := end_s - self._host.monotonic()) > 0:
            for item in of_type(name, self.receive(left_s)):
                if is_so(item):
                    return item
        raise AssertionError(f"no {name} within {limit_s} s")


@contextmanager
def linked(
    host: VirtualHost, address: str = LISTENING, daemon: PlayedDaemon | None = None, **values: Any
) -> Iterator[tuple[PlayedDaemon, GroundLink]]:
    daemon = daemon or PlayedDaemon()
    link = GroundLink(daemon.operations, GroundSettings(address, FASTEST, **{"accepts_unsigned": True, **values}), host)
    is_over = False

    def turn() -> None:
        while not is_over:
            daemon.show()
            host.sleep(0.02)

    link.start()
    host.thread(turn, "loop").start()
    # Both have begun.
    host.sleep(0.0)
    try:
        yield daemon, link
    finally:
        is_over = True
        link.stop()
        assert not link.is_alive
        assert not daemon.feed.is_watched


def test_a_station_that_is_called_sees_the_robot_and_arms_it(host: VirtualHost) -> None:
    station = Peer(host, LISTENING)
    with linked(host, CALLING) as (daemon, _):
        beat = station.until("HEARTBEAT", 0.1)
        assert (beat.type, beat.get_srcSystem(), beat.get_srcComponent()) == (10, 1, 1)
        daemon.answers[OperatorCommand.START] = ""
        station.send(station.station.heartbeat())
        station.send(station.station.command(400, 1.0))
        assert station.until("COMMAND_ACK", 0.1).result == 0
        assert daemon.commands == [OperatorCommand.START]
        assert daemon.seen == 1
        daemon.show(state=State.RUNNING)
        assert station.until("HEARTBEAT", 1.1, lambda beat: bool(beat.base_mode & 128)).custom_mode == 10


def test_heartbeats_come_once_a_second(host: VirtualHost) -> None:
    station = Peer(host, LISTENING)
    with linked(host, CALLING):
        for _ in range(60):
            station.until("HEARTBEAT", 1.0 + TURN_S)
        begin_s = host.monotonic()
        for _ in range(60):
            station.until("HEARTBEAT", 1.0 + TURN_S)
        assert host.monotonic() - begin_s == pytest.approx(60.0, abs=TURN_S)


def test_one_station_is_answered_and_another_may_stop(host: VirtualHost) -> None:
    with linked(host) as (daemon, _):
        first, second = Peer(host), Peer(host, system=254)
        first.send(first.station.heartbeat())
        first.until("HEARTBEAT")
        second.send(second.station.command(400, 1.0))
        second.send(second.station.command(400, 0.0))
        assert second.until("COMMAND_ACK").result == 0
        assert daemon.commands == [OperatorCommand.STANDBY]
        assert {item.get_type() for item in second.station.heard} == {"COMMAND_ACK"}
        first.until("HEARTBEAT")


def test_when_a_station_is_gone_another_takes_its_place_after_its_time(host: VirtualHost) -> None:
    with linked(host):
        first, second = Peer(host), Peer(host)
        first.send(first.station.heartbeat())
        first.until("HEARTBEAT")
        first.send(first.station.heartbeat())
        begin_s = host.monotonic()
        while not second.station.heard:
            second.send(second.station.heartbeat())
            second.receive(0.1)
        # Its first heartbeat comes within a second.
        assert STATION_LIMIT_S < host.monotonic() - begin_s < STATION_LIMIT_S + 1.0 + 0.1 + TURN_S


def test_garbage_takes_nobodys_place(host: VirtualHost) -> None:
    with linked(host):
        station, other = Peer(host), Peer(host)
        for size in (1, 12, 300, 9000, 60_000):
            other.send(b"\xfd" * size)
            other.send(os.urandom(size))
        station.send(station.station.heartbeat())
        station.until("HEARTBEAT")
        assert other.receive() == []


def test_a_flood_of_datagrams_leaves_two_thirds_of_the_time(host: VirtualHost, monkeypatch: pytest.MonkeyPatch) -> None:
    work_s = 0.001
    steps = 0
    with linked(host) as (daemon, link):
        station = Peer(host)
        station.send(station.station.heartbeat())
        station.until("HEARTBEAT")
        evil = b"".join(station.station.command(410) for _ in range(100))
        is_over = False

        def flood() -> None:
            while not is_over:
                station.send(evil)
                host.sleep(work_s / 2)

        real = link._session.step

        def slow(*arguments: Any, **values: Any) -> bytes:
            nonlocal steps
            steps += 1
            host.sleep(work_s)
            return real(*arguments, **values)

        monkeypatch.setattr(link._session, "step", slow)
        host.thread(flood, "flood").start()
        begin_s = host.monotonic()
        station.until("HEARTBEAT")
        station.until("HEARTBEAT")
        passed_s = host.monotonic() - begin_s
        is_over = True
        assert steps == pytest.approx(passed_s / (work_s * (1 + REST)), rel=0.1)
        assert daemon.orders == []


def test_signed(host: VirtualHost, tmp_path: Path) -> None:
    (tmp_path / "key").write_bytes(KEY)
    signing = Signing(tmp_path / "key")
    with linked(host, signing=signing, accepts_unsigned=False) as (daemon, _):
        stranger, station = Peer(host), Peer(host, key=KEY)
        stranger.send(stranger.station.heartbeat())
        station.station.codec.signing.timestamp = signing.begin().timestamp()
        station.send(station.station.heartbeat())
        assert station.until("HEARTBEAT").get_signed()
        daemon.answers[OperatorCommand.START] = ""
        station.send(station.station.command(400, 1.0))
        assert station.until("COMMAND_ACK").result == 0
        assert stranger.receive() == []


def test_who_sends_our_own_packets_back_takes_nobodys_place(host: VirtualHost, tmp_path: Path) -> None:
    (tmp_path / "key").write_bytes(KEY)
    signing = Signing(tmp_path / "key")
    with linked(host, signing=signing, accepts_unsigned=False) as (daemon, _):
        thief, station = Peer(host), Peer(host, key=KEY)
        station.station.codec.signing.timestamp = signing.begin().timestamp()
        station.send(station.station.heartbeat())
        for _ in range(3):
            # Overheard, while the station is silent for longer than its place is kept.
            packets = station.line.read(2.0)
            assert packets
            host.sleep(STATION_LIMIT_S + 1.0)
            thief.send(packets)
        assert thief.receive() == []
        daemon.answers[OperatorCommand.START] = ""
        station.send(station.station.command(400, 1.0))
        assert station.until("COMMAND_ACK").result == 0
        assert thief.station.heard == []


def accepted(connection: NetworkPort | None) -> NetworkPort:
    assert connection is not None
    return connection


def test_a_server_that_goes_and_comes_again_is_found(host: VirtualHost) -> None:
    server = host.serve(5760)
    with linked(host, "tcp:127.0.0.1:5760"):
        for _ in range(2):
            connection = accepted(server.accept(10.0))
            station = Station()
            connection.write(station.command(410))
            while not of_type("COMMAND_ACK", station.heard):
                station.hear(connection.read(5.0))
            connection.close()


def test_nobody_there_is_reported_once_and_tried_ever_more_seldom(
    host: VirtualHost, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries_s: list[float] = []
    opened = host.open_network

    def counted(address: str) -> NetworkPort:
        tries_s.append(host.monotonic())
        return opened(address)

    monkeypatch.setattr(host, "open_network", counted)
    with linked(host, "tcp:127.0.0.1:1"):
        host.sleep(600.0)
        pauses_s = [after_s - before_s for before_s, after_s in itertools.pairwise(tries_s)]
        assert len(pauses_s) == 153
        assert pauses_s == pytest.approx([0.25, 0.5, 1.0, 2.0] + [4.0] * (len(pauses_s) - 4))
    assert caplog.text.count("no program listens there") == 1


def test_a_problem_is_reported_again_after_a_line_that_has_lasted(
    host: VirtualHost, caplog: pytest.LogCaptureFixture
) -> None:
    server = host.serve(5760)
    with linked(host, "tcp:127.0.0.1:5760"):
        for lasted_s in (LASTING_S - 1.0, LASTING_S + 1.0, 0.0):
            connection = accepted(server.accept(60.0))
            host.sleep(lasted_s)
            connection.close()
            host.sleep(0.1)
        assert caplog.text.count("the other end has closed the connection") == 2


def test_a_serial_line(host: VirtualHost) -> None:
    end = host.new_end(None)
    with linked(host, end.path, baud=57600) as (daemon, _):
        assert end.host_baud() == 57600
        station = Station()
        end.write(b"noise\xfd" + station.command(410) + station.command(400, 0.0))
        host.sleep(TURN_S)
        station.hear(bytes(end.read()))
        assert len(of_type("COMMAND_ACK", station.heard)) == 2
        assert daemon.commands == [OperatorCommand.STANDBY]


def test_a_lost_line_ends_driving_at_once(host: VirtualHost) -> None:
    daemon = PlayedDaemon(is_layer=True)
    daemon.show(state=State.RUNNING)
    server = host.serve(5760)
    with linked(host, "tcp:127.0.0.1:5760", daemon):
        connection = accepted(server.accept(1.0))
        station = Station()
        stick = station.codec.manual_control_encode(1, 500, 0, 0, 0, 0)
        connection.write(station.pack(stick))
        assert host.wait(lambda: len(daemon.received) == 2, TURN_S)
        connection.close()
        begin_s = host.monotonic()
        assert host.wait(lambda: isinstance(daemon.received[-1], Detached), TURN_S)
        assert host.monotonic() == begin_s


def test_the_last_heartbeat_says_that_it_ends(host: VirtualHost) -> None:
    station = Peer(host, LISTENING)
    with linked(host, CALLING) as (daemon, _):
        station.until("HEARTBEAT")
        daemon.show(state=State.OVER)
    while station.receive():
        pass
    assert of_type("HEARTBEAT", station.station.heard)[-1].system_status == 7


def test_an_error_inside_ends_nothing(
    host: VirtualHost, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = Peer(host, LISTENING)
    with linked(host, CALLING) as (_, link):
        station.until("HEARTBEAT")
        with monkeypatch.context() as patch:
            patch.setattr(link._session, "step", lambda *_, **__: 1 / 0)
            host.sleep(TURN_S)
        assert "ZeroDivisionError" in caplog.text
        station.until("HEARTBEAT")


def test_it_may_be_stopped_at_any_time(host: VirtualHost) -> None:
    link = GroundLink(PlayedDaemon().operations, GroundSettings(LISTENING, FASTEST), host)
    link.stop()
    for passed_s in (0.0, 0.01, 1.0, 100.0):
        # Also between two attempts to find a station.
        link = GroundLink(PlayedDaemon().operations, GroundSettings("tcp:127.0.0.1:1", FASTEST), host)
        assert not link.is_alive
        link.start()
        host.sleep(passed_s)
        assert link.is_alive
        began_s = host.monotonic()
        link.stop()
        assert not link.is_alive
        link.stop()
        assert host.monotonic() == began_s


def test_a_thread_that_ends_unexpectedly_is_seen(host: VirtualHost, monkeypatch: pytest.MonkeyPatch) -> None:
    class Over(BaseException):
        pass

    def end(*_: Any, **__: Any) -> bytes:
        raise Over

    ended: list[Any] = []
    monkeypatch.setattr(threading, "excepthook", ended.append)
    link = GroundLink(PlayedDaemon().operations, GroundSettings(LISTENING, FASTEST), host)
    monkeypatch.setattr(link._session, "step", end)
    link.start()
    assert host.wait(lambda: not link.is_alive, 2 * TURN_S)
    link.stop()
    host.close()
    assert ended[0].exc_type is Over
