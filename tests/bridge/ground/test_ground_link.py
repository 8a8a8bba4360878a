"""The link over real UDP, TCP and a pseudo-terminal, with pymavlink's own ground station at the other end."""

import contextlib
import os
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from robosc_bridge.daemon.backoff import Backoff
from robosc_bridge.daemon.programs import Detached
from robosc_bridge.daemon.states import Command, State
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground import link as link_module
from robosc_bridge.ground.link import GroundLink
from robosc_bridge.ground.session import STATION_LIMIT_S
from robosc_bridge.ground.settings import GroundSettings
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.lines import Line, open_line
from support.ground import KEY, PlayedDaemon, Station, of_type
from support.waiting import PATIENCE_S, wait_until

FASTEST = Velocity(0.2, 2.0)
STEP_S = 0.01


class Turns:
    """A clock that goes on by a step whenever the link looks at it, and a daemon that turns as often.

    So its time passes with the link's own turns, however slow the machine is.

    Args:
        daemon: That turns.

    Attributes:
        step_s: The step; 0: time stands still.
        now_s: What it shows.
    """

    def __init__(self, daemon: PlayedDaemon) -> None:
        self.step_s = STEP_S
        self._daemon = daemon
        self.now_s = 1000.0

    def __call__(self) -> float:
        self._daemon.show()
        self.now_s += self.step_s
        return self.now_s

    def pass_by(self, seconds: float) -> None:
        """Wait until so much of it is over."""
        end_s = self.now_s + seconds
        wait_until(lambda: self.now_s > end_s)


class Peer:
    """A station at a UDP socket."""

    def __init__(self, port: int | None = None, key: bytes | None = None, system: int = 255) -> None:
        self.station = Station(key, system)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.02)
        self.to = None if port is None else ("127.0.0.1", port)

    @property
    def port(self) -> int:
        return int(self.socket.getsockname()[1])

    def send(self, data: bytes) -> None:
        assert self.to is not None
        self.socket.sendto(data, self.to)

    def receive(self) -> list[Any]:
        with contextlib.suppress(TimeoutError, ConnectionRefusedError):
            data, self.to = self.socket.recvfrom(65535)
            return self.station.hear(data)
        return []

    def until(self, name: str, limit_s: float = PATIENCE_S, is_so: Callable[[Any], bool] = lambda _: True) -> Any:
        """The next message of a kind."""
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            for item in of_type(name, self.receive()):
                if is_so(item):
                    return item
        raise AssertionError(f"no {name} within {limit_s} s")


@contextmanager
def linked(
    address: str,
    daemon: PlayedDaemon | None = None,
    clock: Callable[[], float] | None = None,
    **values: Any,
) -> Iterator[tuple[PlayedDaemon, GroundLink]]:
    """A link whose turns are short, and which tries anew at once.

    Args:
        address: Of its line.
        daemon: That it shows; None: one of its own.
        clock: What it goes by; None: its own turns.
        **values: Of its settings.
    """
    daemon = daemon or PlayedDaemon()
    settings = GroundSettings(address, FASTEST, **{"obeys_unsigned": True, **values})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(link_module, "TURN_S", 0.001)
        link = GroundLink(daemon.operations, settings, clock or Turns(daemon))
        patch.setattr(link, "_backoff", Backoff(0.01))
        link.start()
        try:
            yield daemon, link
        finally:
            link.stop()
            assert not link._thread.is_alive()
            assert not daemon.feed.is_watched


@contextmanager
def peer(*arguments: Any, **values: Any) -> Iterator[Peer]:
    found = Peer(*arguments, **values)
    with found.socket:
        yield found


def _port(link: GroundLink) -> int:
    wait_until(lambda: link.port is not None)
    assert link.port is not None
    return link.port


def test_a_station_that_is_called_sees_the_robot_and_arms_it() -> None:
    with peer() as station, linked(f"udpout:127.0.0.1:{station.port}") as (daemon, _):
        beat = station.until("HEARTBEAT")
        assert (beat.type, beat.get_srcSystem(), beat.get_srcComponent()) == (10, 1, 1)
        daemon.answers[Command.START] = ""
        station.send(station.station.heartbeat())
        station.send(station.station.command(400, 1.0))
        assert station.until("COMMAND_ACK").result == 0
        assert daemon.commands == [Command.START]
        wait_until(lambda: daemon.seen == 1)
        daemon.show(state=State.RUNNING)
        assert station.until("HEARTBEAT", is_so=lambda beat: bool(beat.base_mode & 128)).custom_mode == 10


def test_one_station_is_answered_and_another_may_stop() -> None:
    played = PlayedDaemon()
    turns = Turns(played)
    with (
        linked("udpin:127.0.0.1:0", played, turns) as (daemon, link),
        peer(_port(link)) as first,
        peer(_port(link), system=254) as second,
    ):
        first.send(first.station.heartbeat())
        first.until("HEARTBEAT")
        # The first one keeps its place meanwhile.
        turns.step_s = 0.0
        second.send(second.station.command(400, 1.0))
        second.send(second.station.command(400, 0.0))
        assert second.until("COMMAND_ACK").result == 0
        assert daemon.commands == [Command.STANDBY]
        assert {item.get_type() for item in second.station.heard} == {"COMMAND_ACK"}
        turns.step_s = STEP_S
        first.until("HEARTBEAT")


def test_when_a_station_is_gone_another_takes_its_place() -> None:
    with linked("udpin:127.0.0.1:0") as (_, link), peer(_port(link)) as first, peer(_port(link)) as second:
        first.send(first.station.heartbeat())
        first.until("HEARTBEAT")
        end_s = time.monotonic() + PATIENCE_S
        while not second.station.heard and time.monotonic() < end_s:
            second.send(second.station.heartbeat())
            second.receive()
        second.until("HEARTBEAT")


def test_garbage_takes_nobodys_place() -> None:
    with linked("udpin:127.0.0.1:0") as (_, link), peer(_port(link)) as station, peer(_port(link)) as other:
        for size in (1, 12, 300, 9000, 60_000):
            other.send(b"\xfd" * size)
            other.send(os.urandom(size))
        station.send(station.station.heartbeat())
        station.until("HEARTBEAT")
        assert other.receive() == []


def test_a_flood_of_datagrams_leaves_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """After bytes that waited already, a rest of twice the work on those before, and none that is long."""
    played = PlayedDaemon()
    turns = Turns(played)
    with linked("udpin:127.0.0.1:0", played, turns) as (daemon, link), peer(_port(link)) as station:
        station.send(station.station.heartbeat())
        station.until("HEARTBEAT")
        # From now on work alone takes time.
        turns.step_s = 0.0
        step, work_s, rested_s = link._session.step, 0.02, []

        def works(now_s: float, data: bytes = b"", **how: Any) -> bytes:
            turns.now_s += work_s if data else 0.0
            return step(now_s, data, **how)

        def rests(limit_s: float) -> bool:
            rested_s.append(round(limit_s, 6))
            return False

        monkeypatch.setattr(link._session, "step", works)
        monkeypatch.setattr(link._over, "wait", rests)
        evil = b"".join(station.station.command(410) for _ in range(100))
        for work_s in (0.02, 0.2):
            rested_s.clear()
            for _ in range(10):
                station.send(evil)
            wait_until(lambda: len(rested_s) == 10)
            assert set(rested_s) == {min(2 * work_s, 0.1)}
        assert daemon.orders == []


def test_signed(tmp_path: Path) -> None:
    (tmp_path / "key").write_bytes(KEY)
    signing = Signing(tmp_path / "key")
    with (
        linked("udpin:0.0.0.0:0", signing=signing, obeys_unsigned=False) as (daemon, link),
        peer(_port(link)) as stranger,
        peer(_port(link), key=KEY) as station,
    ):
        stranger.send(stranger.station.heartbeat())
        station.station.codec.signing.timestamp = signing.begin().timestamp()
        station.send(station.station.heartbeat())
        beat = station.until("HEARTBEAT")
        assert beat.get_signed()
        daemon.answers[Command.START] = ""
        station.send(station.station.command(400, 1.0))
        assert station.until("COMMAND_ACK").result == 0
        assert stranger.station.heard == []


def test_who_sends_our_own_packets_back_takes_nobodys_place(tmp_path: Path) -> None:
    played = PlayedDaemon()
    turns = Turns(played)
    (tmp_path / "key").write_bytes(KEY)
    signing = Signing(tmp_path / "key")
    with (
        linked("udpin:127.0.0.1:0", played, turns, signing=signing, obeys_unsigned=False) as (daemon, link),
        peer(_port(link)) as thief,
        peer(_port(link), key=KEY) as station,
    ):
        station.station.codec.signing.timestamp = signing.begin().timestamp()
        station.send(station.station.heartbeat())
        station.socket.settimeout(PATIENCE_S)
        for _ in range(3):
            # Overheard, while the station is silent for longer than its place is kept.
            packets = station.socket.recv(65535)
            turns.pass_by(STATION_LIMIT_S + 0.1)
            thief.send(packets)
        assert thief.receive() == []
        daemon.answers[Command.START] = ""
        station.send(station.station.command(400, 1.0))
        assert station.until("COMMAND_ACK").result == 0
        assert thief.station.heard == []


def test_a_server_that_goes_and_comes_again_is_found() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with linked(f"tcp:127.0.0.1:{port}"):
            for _ in range(2):
                server.settimeout(PATIENCE_S)
                connection, _ = server.accept()
                with connection:
                    connection.settimeout(PATIENCE_S)
                    station = Station()
                    connection.sendall(station.command(410))
                    while not of_type("COMMAND_ACK", station.heard):
                        station.hear(connection.recv(4096))


def test_nobody_there_is_told_once(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    tries: list[str] = []

    def counted(address: str, baud: int) -> Line:
        tries.append(address)
        return open_line(address, baud)

    monkeypatch.setattr(link_module, "open_line", counted)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with linked(f"tcp:127.0.0.1:{port}"):
        # With the third begun, two have failed.
        wait_until(lambda: len(tries) > 2)
    assert caplog.text.count("nobody serves there") == 1


def test_a_serial_line() -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    try:
        with linked(os.ttyname(theirs), baud=57600) as (daemon, _):
            station = Station()
            # What comes before the line is open is dropped: it is with the first heartbeat.
            station.hear(os.read(ours, 4096))
            os.write(ours, b"noise\xfd" + station.command(410) + station.command(400, 0.0))
            end_s = time.monotonic() + PATIENCE_S
            while len(of_type("COMMAND_ACK", station.heard)) < 2:
                assert time.monotonic() < end_s
                station.hear(os.read(ours, 4096))
            assert daemon.commands == [Command.STANDBY]
    finally:
        os.close(ours)
        os.close(theirs)


def test_a_lost_line_ends_driving_at_once() -> None:
    daemon = PlayedDaemon(is_layer=True)
    daemon.show(state=State.RUNNING)
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        # Time stands still: it is not silence that ends it.
        linked(f"tcp:127.0.0.1:{server.getsockname()[1]}", daemon, lambda: 1000.0),
    ):
        connection, _ = server.accept()
        station = Station()
        with connection:
            stick = station.codec.manual_control_encode(1, 500, 0, 0, 0, 0)
            connection.sendall(station.pack(stick))
            wait_until(lambda: len(daemon.told) == 2)
        wait_until(lambda: isinstance(daemon.told[-1], Detached))


def test_the_last_heartbeat_says_that_it_ends() -> None:
    with peer() as station:
        with linked(f"udpout:127.0.0.1:{station.port}") as (daemon, _):
            station.until("HEARTBEAT")
            daemon.show(state=State.OVER)
        while station.receive():
            pass
        assert of_type("HEARTBEAT", station.station.heard)[-1].system_status == 7


def test_an_error_inside_ends_nothing(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    with peer() as station, linked(f"udpout:127.0.0.1:{station.port}") as (_, link):
        station.until("HEARTBEAT")
        with monkeypatch.context() as patch:
            patch.setattr(link._session, "step", lambda *_, **__: 1 / 0)
            wait_until(lambda: "ZeroDivisionError" in caplog.text)
        station.until("HEARTBEAT")


def test_a_thread_that_ends_unexpectedly_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    class Over(BaseException):
        pass

    def end(*_: Any, **__: Any) -> bytes:
        raise Over

    ended: list[Any] = []
    monkeypatch.setattr(threading, "excepthook", ended.append)
    link = GroundLink(PlayedDaemon().operations, GroundSettings("udpin:127.0.0.1:0", FASTEST))
    monkeypatch.setattr(link._session, "step", end)
    link.start()
    wait_until(lambda: not link.is_alive)
    assert ended[0].exc_type is Over
    link.stop()
