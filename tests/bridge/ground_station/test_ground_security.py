"""Tests of permissions: signatures, other computers, other stations."""

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from robosc_bridge.configuration import parse
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground_station.session import StationSession
from robosc_bridge.ground_station.settings import GroundSettings, GroundSettingsError, ground_settings, is_loopback
from robosc_bridge.protocol.mavlink_signing import Signing, SigningError
from support.ground import CONFIGURATION, KEY, PlayedDaemon, Station, joined_texts, of_type, reading_of

FASTEST = Velocity(0.2, 2.0)
BEGIN_S = 100.0
STOPS = [(400, (0.0,)), (176, (1.0, 4.0)), (193, (0.0,)), (185, (1.0,))]
CHANGES = [(400, (1.0,)), (193, (1.0,)), (176, (1.0, 10.0)), (246, (1.0,))]


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    found = tmp_path / "key"
    found.write_bytes(KEY)
    return found


def _session(settings: GroundSettings) -> tuple[PlayedDaemon, StationSession]:
    daemon = PlayedDaemon(is_layer=True)
    session = StationSession(daemon.operations, settings, BEGIN_S)
    session.step(BEGIN_S)
    return daemon, session


def _signed(key_file: Path) -> GroundSettings:
    return GroundSettings("udpin:0.0.0.0:0", FASTEST, signing=Signing(key_file))


def _fresh(station: Station, key_file: Path) -> Station:
    """With a time that counts."""
    station.codec.signing.timestamp = Signing(key_file).begin().timestamp()
    return station


@pytest.mark.parametrize(("number", "parameters"), STOPS)
def test_stopping_is_obeyed_whoever_asks(key_file: Path, number: int, parameters: tuple[float, ...]) -> None:
    for settings in (_signed(key_file), GroundSettings("udpin:0.0.0.0:0", FASTEST)):
        daemon, session = _session(settings)
        for station in (Station(), Station(bytes(32))):
            before = len(daemon.orders)
            session.step(BEGIN_S + before, station.command(number, *parameters))
            assert len(daemon.orders) == before + 1
        assert set(daemon.commands) <= {OperatorCommand.STOP, OperatorCommand.STANDBY}


@pytest.mark.parametrize("is_datagram", [True, False])
def test_a_station_that_speaks_mavlink_1_stops_the_robot_and_is_answered(
    key_file: Path, is_datagram: bool, caplog: pytest.LogCaptureFixture
) -> None:
    text = "This station speaks MAVLink 1: set it to MAVLink 2."
    daemon, session = _session(_signed(key_file))
    station, reader = Station(), _fresh(Station(KEY, system=9), key_file)
    library = station.codec
    stops = [station.old_command(number, *parameters) for number, parameters in STOPS]
    stops.append(station.old(library.set_mode_encode(1, 1, 4)))
    for stop in stops:
        before = len(daemon.orders)
        found = reader.hear(session.step(BEGIN_S, stop, is_datagram=is_datagram))
        assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
        assert len(daemon.orders) == before + 1
    assert joined_texts(reader.heard).count(text) == 1
    assert caplog.text.count("speaks MAVLink 1") == 1
    data = station.old_command(400, 1.0) + station.old(library.heartbeat_encode(6, 8, 0, 0, 4))
    found = reader.hear(session.step(BEGIN_S, data, is_datagram=is_datagram))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [2]
    assert (len(daemon.orders), daemon.seen, session.claims) == (len(stops), 0, 0)
    found = reader.hear(session.receive_from_other(BEGIN_S, stops[0]))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]


def test_without_a_key_mavlink_1_is_heard_like_mavlink_2() -> None:
    daemon, session = _session(GroundSettings("udpin:127.0.0.1:0", FASTEST, accepts_unsigned=True))
    station = Station()
    beat = station.old(station.codec.heartbeat_encode(6, 8, 0, 0, 4))
    session.step(BEGIN_S, beat + station.old_command(400, 1.0), is_datagram=True)
    assert (daemon.commands, daemon.seen, session.claims) == ([OperatorCommand.START], 1, 2)
    stick = station.old(station.codec.manual_control_encode(1, 500, 0, 0, 0, 0))
    session.step(BEGIN_S, stick + b"\xfe" + station.old_command(400, 0.0))
    assert daemon.commands == [OperatorCommand.START, OperatorCommand.STANDBY]
    assert session.claims == 3
    damaged = bytearray(station.old_command(400, 0.0))
    damaged[10] ^= 1
    session.step(BEGIN_S, bytes(damaged))
    assert len(daemon.orders) == 2


@pytest.mark.parametrize(("number", "parameters"), CHANGES)
@pytest.mark.parametrize("key", [None, bytes(32)])
def test_without_the_key_nothing_changes(
    key_file: Path, number: int, parameters: tuple[float, ...], key: bytes | None
) -> None:
    daemon, session = _session(_signed(key_file))
    reader = _fresh(Station(KEY, system=9), key_file)
    found = reader.hear(session.step(BEGIN_S, Station(key).command(number, *parameters)))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [2]
    assert "Only stopping is obeyed here without a valid signature." in joined_texts(found)
    assert daemon.orders == []


def test_with_the_key_everything_works_and_is_signed(key_file: Path) -> None:
    daemon, session = _session(_signed(key_file))
    station = _fresh(Station(KEY), key_file)
    daemon.answers[OperatorCommand.START] = ""
    data = session.step(BEGIN_S + 1.0, station.command(400, 1.0) + station.heartbeat())
    assert daemon.commands == [OperatorCommand.START]
    assert daemon.seen == 1
    found = station.hear(data)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
    assert len(of_type("HEARTBEAT", found)) == 1
    assert all(item.get_signed() for item in found)
    (beat,) = of_type("HEARTBEAT", found)
    assert len(beat.get_msgbuf()) == 34


def test_what_was_recorded_does_not_work_again(key_file: Path) -> None:
    daemon, session = _session(_signed(key_file))
    station = _fresh(Station(KEY), key_file)
    packet = station.command(400, 1.0)
    session.step(BEGIN_S, packet)
    assert daemon.commands == [OperatorCommand.START]
    daemon.orders[0].answer("")
    session.step(BEGIN_S, packet)
    assert daemon.commands == [OperatorCommand.START]
    # Nor after the bridge was started anew, beyond the minute of the protocol.
    daemon, session = _session(_signed(key_file))
    old = Station(KEY, system=7)
    old.codec.signing.timestamp = Signing(key_file).begin().timestamp() - 100 * 100_000
    session.step(BEGIN_S, old.command(400, 1.0))
    assert daemon.orders == []


def test_time_goes_on_across_restarts(key_file: Path) -> None:
    stamps = []
    for _ in range(3):
        _, session = _session(_signed(key_file))
        station = _fresh(Station(KEY), key_file)
        found = station.hear(session.step(BEGIN_S + 1.0))
        stamps += [int.from_bytes(bytes(item.get_msgbuf())[-12:-6], "little") for item in found]
    assert len(stamps) >= 3
    assert stamps == sorted(set(stamps))


def test_the_time_of_packets_follows_the_clock_and_is_kept_ahead(
    key_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 1_700_000_000.0
    monkeypatch.setattr("time.time", lambda: now_s)
    _, session = _session(_signed(key_file))
    kept = key_file.with_name("key.timestamp")
    now_s += 3600.0
    session.step(BEGIN_S + 1.0)
    stamp = (1_700_003_600 - 1_420_070_400) * 100_000
    assert stamp <= session._codec.timestamp < stamp + 100
    # A session that is killed now has used nothing beyond it.
    assert session._codec.timestamp < int(kept.read_text()) <= stamp + 1_000_100
    session.end(BEGIN_S + 2.0)
    assert int(kept.read_text()) == session._codec.timestamp


def test_a_forged_stop_from_the_future_shuts_nobody_out(key_file: Path) -> None:
    daemon, session = _session(_signed(key_file))
    station = _fresh(Station(KEY), key_file)
    session.step(BEGIN_S, station.heartbeat())
    forged = Station(bytes(32))
    forged.codec.signing.timestamp = 2**47
    session.step(BEGIN_S, forged.command(400, 0.0))
    assert daemon.commands == [OperatorCommand.STANDBY]
    session.step(BEGIN_S, station.command(400, 1.0))
    assert daemon.commands == [OperatorCommand.STANDBY, OperatorCommand.START]


def test_who_does_not_sign_is_not_the_operator_and_learns_nothing(key_file: Path) -> None:
    daemon, session = _session(_signed(key_file))
    reader = _fresh(Station(KEY, system=9), key_file)
    station = Station()
    library = station.codec
    data = station.heartbeat() + station.pack(library.param_request_list_encode(1, 1))
    found = reader.hear(session.step(BEGIN_S, data))
    assert daemon.seen == 0
    assert of_type("PARAM_VALUE", found) == []
    found = reader.hear(session.step(BEGIN_S, station.command(512, 148)))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [2]
    assert of_type("AUTOPILOT_VERSION", found) == []
    assert session.accepted == 0


@pytest.mark.parametrize(("number", "parameters"), CHANGES)
def test_another_computer_without_a_key_may_look_and_stop(number: int, parameters: tuple[float, ...]) -> None:
    daemon, session = _session(GroundSettings("udpin:0.0.0.0:0", FASTEST))
    station = Station()
    daemon.show(state=State.RUNNING, reading=reading_of(BEGIN_S))
    found = station.hear(session.step(BEGIN_S, station.command(number, *parameters)))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [2]
    assert daemon.orders == []
    found = station.hear(session.step(BEGIN_S, station.command(512, 331)))
    assert len(of_type("ODOMETRY", found)) >= 1
    session.step(BEGIN_S, station.heartbeat())
    assert daemon.seen == 0
    stick = station.codec.manual_control_encode(1, 500, 0, 0, 0, 0)
    found = station.hear(session.step(BEGIN_S + 1.0, station.pack(stick)))
    assert daemon.received == []


def test_another_station_may_stop_and_nothing_more() -> None:
    daemon, session = _session(GroundSettings("udpin:127.0.0.1:0", FASTEST, accepts_unsigned=True))
    other = Station(system=254)
    found = other.hear(session.receive_from_other(BEGIN_S, other.command(400, 1.0) + other.command(512, 148)))
    assert found == []
    found = other.hear(session.receive_from_other(BEGIN_S, other.command(400, 0.0)))
    assert [(ack.result, ack.target_system) for ack in of_type("COMMAND_ACK", found)] == [(0, 254)]
    assert daemon.commands == [OperatorCommand.STANDBY]


def test_only_a_station_claims_the_line(key_file: Path) -> None:
    daemon, session = _session(_signed(key_file))
    ours = session.step(BEGIN_S + 1.0)
    assert ours
    session.step(BEGIN_S + 1.0, ours, is_datagram=True)
    assert (session.accepted, session.claims) == (0, 0)
    # A forged stop is obeyed, and no more; so is one that looks like our own.
    stranger = Station()
    session.step(BEGIN_S + 1.0, stranger.heartbeat() + stranger.command(400, 0.0))
    assert (session.accepted, session.claims) == (0, 0)
    assert session.receive_from_other(BEGIN_S + 1.0, Station(system=1, component=1).command(400, 0.0)) == b""
    # Another robot with the same key is heard, and is no station.
    robot = _fresh(Station(KEY, system=2, component=1), key_file)
    session.step(BEGIN_S + 1.0, robot.pack(robot.codec.heartbeat_encode(10, 0, 0, 0, 4)))
    assert (session.accepted, session.claims) == (1, 0)
    station = _fresh(Station(KEY), key_file)
    session.step(BEGIN_S + 1.0, station.heartbeat())
    session.step(BEGIN_S + 1.0, station.command(410))
    assert (session.accepted, session.claims) == (3, 2)
    assert daemon.commands == [OperatorCommand.STANDBY]


def test_a_key_that_cannot_be_used_is_reported_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(SigningError, match="cannot be read"):
        _session(_signed(tmp_path / "none"))
    short = tmp_path / "short"
    for data, what in (
        (b"abc", "3 hexadecimal digits"),
        (b"", "0 bytes"),
        (KEY[:16].hex().encode(), "32 hexadecimal digits"),
        (KEY[:16].hex().encode() + b"\n", "32 hexadecimal digits"),
        (KEY.hex().encode()[:63], "63 hexadecimal digits"),
        (KEY + b"\n", "33 bytes"),
    ):
        short.write_bytes(data)
        with pytest.raises(SigningError, match=f"is 32 bytes, or 64 hexadecimal digits, not {what}$"):
            _session(_signed(short))


@pytest.mark.parametrize("data", [KEY, KEY.hex().encode(), KEY.hex().upper().encode() + b"\r\n", b"0" * 31 + b"g"])
def test_keys(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "key"
    path.write_bytes(data)
    assert Signing(path).begin().key == (data if len(data) == 32 else KEY)


@pytest.mark.parametrize(
    ("mode", "is_reported"), [(0o600, False), (0o400, False), (0o640, True), (0o604, True), (0o620, True)]
)
def test_a_key_that_others_can_read_is_reported(
    key_file: Path, mode: int, is_reported: bool, caplog: pytest.LogCaptureFixture
) -> None:
    key_file.chmod(mode)
    Signing(key_file).begin()
    assert ("others than its owner can read or change the key" in caplog.text) == is_reported


def test_the_command_of_the_page_makes_a_key(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    page = (Path(__file__).parents[3] / "docs" / "bridge-mavlink.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^\(umask .*> /etc/robosc/mavlink\.key\)$", page, re.MULTILINE)
    path = tmp_path / "mavlink.key"
    subprocess.run(["sh", "-c", command.replace("/etc/robosc/mavlink.key", str(path))], check=True)
    assert len(Signing(path).begin().key) == 32
    assert len(path.read_bytes()) == 64
    assert caplog.text == ""


# Settings of a configuration.


def _settings(remote: str, scanner: str = "") -> GroundSettings | None:
    text = f"{CONFIGURATION}{scanner}\nremote: {{{remote}}}\n"
    return ground_settings(parse(text.encode(), "test.yaml").configuration, FASTEST)


@pytest.mark.parametrize(
    ("url", "address", "baud", "accepts_unsigned"),
    [
        ("udpout:192.168.1.2:14550", "udpout:192.168.1.2:14550", 57600, False),
        ("udpout:127.0.0.1:14550", "udpout:127.0.0.1:14550", 57600, True),
        ("udpin:0.0.0.0:14550", "udpin:0.0.0.0:14550", 57600, False),
        ("udpin:127.0.0.1:14550", "udpin:127.0.0.1:14550", 57600, True),
        ("tcp:localhost:5760", "tcp:localhost:5760", 57600, True),
        ("tcp:station.local:5760", "tcp:station.local:5760", 57600, False),
        ("/dev/ttyUSB0", "/dev/ttyUSB0", 57600, False),
        ("/dev/ttyUSB0,115200", "/dev/ttyUSB0", 115200, False),
    ],
)
def test_addresses(url: str, address: str, baud: int, accepts_unsigned: bool) -> None:
    found = _settings(f"mavlink_url: '{url}'")
    assert found is not None
    assert (found.address, found.baud, found.accepts_unsigned) == (address, baud, accepts_unsigned)
    assert is_loopback(address) == accepts_unsigned
    found = _settings(f"mavlink_url: '{url}', mavlink_unsigned_commands: true")
    assert found is not None
    assert found.accepts_unsigned


@pytest.mark.parametrize(
    "url",
    [
        "udpin:14550", "udpout:host", "udpout:host:0", "udpout:host:70000", "udpout::14550", "udpbcast:1.2.3.4:14550",
        "udp:1.2.3.4:14550", "tcpin:0.0.0.0:5760", "COM3", "ttyUSB0", "/dev/ttyUSB0,fast", "/dev/ttyUSB0,0", "host:1",
    ],
)  # fmt: skip
def test_other_addresses_are_one_clear_error(url: str) -> None:
    with pytest.raises(GroundSettingsError, match=r"remote\.mavlink_url: '.*' cannot be used; it is udpin:HOST:PORT"):
        _settings(f"mavlink_url: '{url}'")


def test_everything_else_of_a_configuration(key_file: Path) -> None:
    assert _settings("") is None
    url = "mavlink_url: 'udpin:127.0.0.1:0'"
    found = _settings(f"{url}, mavlink_key: {key_file}, mavlink_link_id: 3, mavlink_system: 7, mavlink_interval_s: 0.5")
    assert found is not None
    assert (found.signing, found.system, found.component, found.interval_s) == (Signing(key_file, 3), 7, 1, 0.5)
    assert (found.fastest, found.range_m) == (FASTEST, (0.05, 100.0))
    found = _settings(url, "scanner: {driver: lds01, port: /dev/x}")
    assert found is not None
    assert found.range_m == (0.12, 3.5)
    with pytest.raises(GroundSettingsError, match="only signed commands are obeyed"):
        _settings(f"{url}, mavlink_key: {key_file}, mavlink_unsigned_commands: true")
    assert replace(found, baud=9600, address="/dev/x").bytes_per_s == pytest.approx(640.0)
    assert found.bytes_per_s == 60_000
