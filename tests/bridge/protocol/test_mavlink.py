"""MAVLink packets byte for byte, and found in whatever comes."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.protocol.mavlink import Codec, Decoder, is_signed
from robosc_bridge.protocol.mavlink_messages import (
    Answer,
    Attitude,
    BatteryState,
    ChargeState,
    Heartbeat,
    LocalPosition,
    MavCommand,
    Message,
    Mode,
    MotionEstimate,
    ObstacleRing,
    SectorDistance,
    Text,
    arming,
    command,
    entering,
    own_heartbeat,
    vehicle_message,
    velocity_target,
)

HEARTBEAT = "fd 09 00 00 00 01 bf 00 00 00 00 00 00 00 12 08 00 04 03 ae c6"
ARM = "fd 20 00 00 00 ff be 4c 00 00 00 00 80 3f" + " 00" * 24 + " 90 01 01 bf e0 ee"
ACK = "fd 0a 00 00 07 01 bf 4d 00 00 90 01 00 00 00 00 00 00 ff be 90 1a"
PLAIN = "fd 06 00 00 01 01 bf fd 00 00 06 70 6c 61 69 6e 85 41"
TARGET = (
    "fd 35 00 00 00 ff be 54 00 00" + " 00" * 16 + " cd cc cc 3d" + " 00" * 24 + " 00 00 00 3f e7 05 01 01 08 d4 62"
)
KEY = bytes(range(32))


def _decoder() -> Decoder[Message]:
    return Decoder(Codec(255, 190), vehicle_message)


def _said(make: Any) -> Any:
    """Return the decoded content of a message."""
    (message,) = _decoder().feed(Codec(1, 1).encode(make))
    return message.content


def test_the_worked_packets_are_made() -> None:
    assert Codec(1, 191).encode(own_heartbeat).hex(" ") == HEARTBEAT
    assert Codec(255, 190).encode(command(1, 191, MavCommand.ARM_DISARM, 0, *arming(True))).hex(" ") == ARM
    # Turning left, which is a negative rate there.
    assert Codec(255, 190).encode(velocity_target(1, 1, 0, 0.1, -0.5)).hex(" ") == TARGET


def test_standing_still_has_no_negative_zero() -> None:
    still = Codec(255, 190).encode(velocity_target(1, 1, 0, -0.0, 0.0))
    assert still[10:-2].hex(" ").replace("00 ", "") == "e7 05 01 01 08"


def test_modes_and_forced_disarming_are_asked_for_with_their_numbers() -> None:
    codec = dialect.MAVLink(None)
    message = codec.decode(
        bytearray(Codec(255, 190).encode(command(1, 1, MavCommand.SET_MODE, 2, *entering(Mode.GUIDED))))
    )
    assert (message.command, message.confirmation, message.param1, message.param2) == (176, 2, 1.0, 15.0)
    message = codec.decode(
        bytearray(Codec(255, 190).encode(command(1, 1, MavCommand.ARM_DISARM, 0, *arming(False, True))))
    )
    assert (message.command, message.param1, message.param2) == (400, 0.0, 21196.0)


def test_the_sequence_goes_around() -> None:
    codec = Codec(255, 190)
    assert [codec.encode(own_heartbeat)[4] for _ in range(257)] == [*range(256), 0]


def test_the_worked_packets_are_understood() -> None:
    found = _decoder().feed(bytes.fromhex(HEARTBEAT + ACK + PLAIN))
    assert found == [
        Message(1, 191, Heartbeat(18, 8, False, 0)),
        Message(1, 191, Answer(400, 0, 255, 190)),
        Message(1, 191, Text(6, b"plain")),
    ]


def test_axes_are_those_of_the_robot() -> None:
    assert _said(lambda codec: codec.attitude_encode(1500, 0, 0, 0.5, 0, 0, -0.25)) == Attitude(1.5, -0.5, 0.25)
    assert _said(lambda codec: codec.local_position_ned_encode(1500, 1, 2, 3, 4, 5, 6)) == LocalPosition(
        1.5, 1, -2, 4, -5
    )
    half = math.sqrt(0.5)

    def odometry(codec: Any, frame: int = 20, child: int = 12) -> Any:
        speeds = (0.5, 0, 0, 0, 0, 0.25)
        return codec.odometry_encode(
            0, frame, child, 1, 2, 0, [half, 0, 0, half], *speeds, [math.nan] * 21, [math.nan] * 21, 7
        )

    message = _said(odometry)
    assert message.heading_rad == pytest.approx(-math.pi / 2)
    assert message == MotionEstimate(1, -2, message.heading_rad, 0.5, -0.25, 7)
    assert _said(lambda codec: odometry(codec, 1)) is not None
    assert _said(lambda codec: odometry(codec, 21)) is None
    assert _said(lambda codec: odometry(codec, 20, 8)) is None


def test_texts_are_whole_or_in_pieces() -> None:
    def text(data: bytes, number: int) -> Any:
        return _said(lambda codec: codec.statustext_encode(4, data, number, 1))

    assert text(b"warm", 0) == Text(4, b"warm", 0, 1)
    assert text("zu heiß, um zu fahren".encode(), 0).text == "zu heiß, um zu fahren"
    assert text(b"x" * 50, 0).is_last
    assert not text(b"x" * 50, 3).is_last
    assert text("ß".encode() * 24, 3).is_last
    assert text(b"\xff\xfe", 0).text


def test_batteries() -> None:
    def status(voltage_mv: int, percent: int) -> Any:
        return _said(lambda codec: codec.sys_status_encode(0, 0, 0, 0, voltage_mv, -1, percent, 0, 0, 0, 0, 0, 0))

    assert status(12100, 60) == BatteryState(True, 12.1, 0.6)
    assert status(65535, -1) == BatteryState(True, None, None)

    def pack(number: int, *cells_mv: int) -> Any:
        voltages = [*cells_mv, *(65535,) * (10 - len(cells_mv))]
        return _said(lambda codec: codec.battery_status_encode(number, 1, 1, 32767, voltages, -1, -1, -1, 55))

    assert pack(0, 4000, 4100, 3900) == BatteryState(False, 12.0, 0.55)
    assert pack(0) == BatteryState(False, None, 0.55)
    assert pack(1, 4000) == BatteryState(False, 4.0, 0.55, number=1)

    def judged(state: int) -> Any:
        voltages = [7400, *(65535,) * 9]
        words = {"charge_state": state}
        return _said(lambda codec: codec.battery_status_encode(0, 1, 1, 32767, voltages, -1, -1, -1, 55, **words))

    for state in ChargeState:
        assert judged(state) == BatteryState(False, 7.4, 0.55, state)


def test_cells_beyond_ten_are_in_the_extension() -> None:
    def pack(*more_mv: int) -> Any:
        more = [*more_mv, *(0,) * (4 - len(more_mv))]
        return _said(
            lambda codec: codec.battery_status_encode(0, 1, 1, 32767, [4200] * 10, -1, -1, -1, -1, voltages_ext=more)
        ).voltage_v

    assert pack() == 42.0
    assert pack(4200, 4200, 4200, 4200) == 58.8
    assert pack(4200) == 46.2
    assert pack(4200, 65535) == 46.2


@pytest.mark.parametrize(("quality", "is_valid"), [(0, True), (1, False), (2, True), (100, True)])
def test_a_distance_with_an_invalid_signal_is_marked(quality: int, is_valid: bool) -> None:
    words = {"signal_quality": quality}
    found = _said(lambda codec: codec.distance_sensor_encode(0, 5, 800, 123, 0, 1, 2, 255, **words))
    assert found.is_valid is is_valid


@pytest.mark.parametrize(
    ("quaternion", "quality"),
    [((0, 0, 0, 0), 0), ((0.5, 0, 0, 0), 0), ((2, 0, 0, 0), 0), ((math.nan, 0, 0, 0), 0), ((1, 0, 0, 0), -1)],
)
def test_an_odometry_without_attitude_or_that_has_failed_is_bad(quaternion: Any, quality: int) -> None:
    decoder = _decoder()
    rest = (0, 0, 0, 0, 0, 0, [math.nan] * 21, [math.nan] * 21)

    def encoded(q: Any, quality: int) -> bytes:
        return Codec(1, 1).encode(
            lambda codec: codec.odometry_encode(0, 20, 12, 1, 2, 0, list(q), *rest, quality=quality)
        )

    assert not decoder.feed(encoded(quaternion, quality))
    assert decoder.counts.bad_frames == 1
    # Slightly rounded, and of a quality that is not known.
    assert decoder.feed(encoded((0.999, 0, 0, 0.02), 0))


def test_obstacles() -> None:
    def ring(fine_deg: float, frame: int = 12) -> Any:
        distances = [*range(10, 80), 801, 65535]
        return lambda codec: codec.obstacle_distance_encode(0, 0, distances, 5, 5, 800, fine_deg, 2.5, frame)

    message = _said(ring(0.0))
    assert message == ObstacleRing((*range(10, 80), 801, 65535), 5.0, 2.5, 5, 800, True)
    assert _said(ring(-2.5, 0)).increment_deg == -2.5
    assert not _said(ring(1.0, 0)).is_body_fixed
    sensor = _said(lambda codec: codec.distance_sensor_encode(0, 5, 800, 123, 0, 1, 2, 255))
    assert sensor == SectorDistance(2, 123, 5, 800, 0.0, number=1)
    assert _said(ring(1.0)).kind == 0


@pytest.mark.parametrize(
    "make",
    [
        lambda codec: codec.attitude_encode(0, 0, 0, math.nan, 0, 0, 0),
        lambda codec: codec.local_position_ned_encode(0, math.inf, 0, 0, 0, 0, 0),
        lambda codec: codec.obstacle_distance_encode(0, 0, [1] * 72, 0, 5, 800, 0.0, 0.0, 12),
        lambda codec: codec.obstacle_distance_encode(0, 0, [1] * 72, 5, 5, 800, 1e-30, 0.0, 12),
        lambda codec: codec.obstacle_distance_encode(0, 0, [1] * 72, 5, 5, 800, 5.0, 1e30, 12),
    ],
)
def test_what_is_no_number_is_a_bad_packet(make: Any) -> None:
    decoder = _decoder()
    assert decoder.feed(Codec(1, 1).encode(make)) == []
    assert decoder.counts.bad_frames >= 1


def test_a_false_header_takes_no_packet_along() -> None:
    decoder = _decoder()
    # A header that promises 255 bytes, of a message that there is.
    noise = bytes.fromhex("fd ff 00 00 00 01 01 00 00 00")
    packets = bytes.fromhex(HEARTBEAT) * 15
    assert len(decoder.feed(noise + packets)) == 15
    assert decoder.counts.skipped_bytes == len(noise)


@given(
    st.lists(st.one_of(st.binary(max_size=40), st.sampled_from((0, 1, 2))), max_size=12), st.lists(st.integers(1, 60))
)
def test_an_idle_line_hides_no_whole_packet(parts: list[bytes | int], cuts: list[int]) -> None:
    packets = [bytes.fromhex(packet) for packet in (HEARTBEAT, ACK, PLAIN)]
    data = b"".join(packets[part] if isinstance(part, int) else part for part in parts)
    decoder = _decoder()
    found = []
    rest = data
    for cut in cuts:
        found += decoder.feed(rest[:cut])
        rest = rest[cut:]
    found += decoder.feed(rest) + decoder.idle()
    assert found == [_decoder().feed(packets[part])[0] for part in parts if isinstance(part, int)]
    assert decoder.idle() == []
    counts = decoder.counts
    assert counts.frames == len(found)
    length = sum(len(packets[part]) for part in parts if isinstance(part, int))
    assert counts.skipped_bytes + len(decoder._waiting) + length == len(data)


def test_packets_of_the_first_version_and_unknown_messages_are_skipped() -> None:
    old = dialect.MAVLink(None, 1, 1)
    data = bytes(old.heartbeat_encode(10, 3, 0, 0, 3).pack(old, force_mavlink1=True))
    unknown = bytes.fromhex("fd 01 00 00 00 01 01 ff ff ff 00 00 00")
    decoder = _decoder()
    assert decoder.feed(data + unknown + bytes.fromhex(HEARTBEAT)) == [Message(1, 191, Heartbeat(18, 8, False, 0))]
    assert decoder.counts.skipped_bytes == len(data) + len(unknown)


@given(st.lists(st.one_of(st.binary(max_size=40).filter(lambda data: b"\xfd" not in data), st.sampled_from((0, 1, 2)))),
       st.lists(st.integers(1, 30)))  # fmt: skip
def test_packets_are_found_in_noise_however_it_is_cut(parts: list[bytes | int], cuts: list[int]) -> None:
    packets = [bytes.fromhex(packet) for packet in (HEARTBEAT, ACK, PLAIN)]
    expected = [_decoder().feed(packets[part])[0] for part in parts if isinstance(part, int)]
    data = b"".join(packets[part] if isinstance(part, int) else part for part in parts)
    decoder = _decoder()
    found = []
    for cut in cuts:
        found += decoder.feed(data[:cut])
        data = data[cut:]
    found += decoder.feed(data)
    assert found == expected
    assert decoder.counts.frames == len(expected)


@given(st.binary(max_size=600))
def test_noise_raises_nothing_and_hides_nothing_for_long(noise: bytes) -> None:
    decoder = _decoder()
    found = decoder.feed(noise + bytes.fromhex(HEARTBEAT) * 15)
    assert len([message for message in found if message == Message(1, 191, Heartbeat(18, 8, False, 0))]) >= 2


@given(st.integers(0, 20), st.integers(1, 255))
def test_a_changed_byte_is_no_packet(at: int, change: int) -> None:
    data = bytearray.fromhex(HEARTBEAT)
    data[at] ^= change
    assert _decoder().feed(bytes(data)) == []


# Signing.


def test_a_signed_packet_is_longer_by_its_signature_and_counts_once() -> None:
    packet = Codec(1, 1, KEY, timestamp=1000).encode(own_heartbeat)
    assert len(packet) == 34
    assert packet[2] == 1
    decoder = Decoder(Codec(255, 190, KEY, timestamp=1000), vehicle_message)
    assert len(decoder.feed(packet)) == 1
    assert decoder.feed(packet) == []
    assert decoder.counts.bad_frames >= 1


@pytest.mark.parametrize("key", [None, bytes(32)])
def test_what_is_not_signed_with_the_key_does_not_count(key: bytes | None) -> None:
    decoder = Decoder(Codec(255, 190, KEY), vehicle_message)
    assert decoder.feed(Codec(1, 1, key).encode(own_heartbeat)) == []


def test_a_radio_has_no_key() -> None:
    status = Codec(51, 68).encode(lambda codec: codec.radio_status_encode(1, 2, 3, 4, 5, 6, 7))
    assert len(Decoder(Codec(255, 190, KEY), vehicle_message).feed(status)) == 1


def test_a_forged_packet_from_the_future_shuts_nobody_out() -> None:
    vehicle = Codec(1, 1, KEY, timestamp=1000)
    decoder = Decoder(Codec(255, 190, KEY, timestamp=1000), vehicle_message)
    assert decoder.feed(Codec(1, 1, bytes(32), timestamp=2**47).encode(own_heartbeat)) == []
    assert len(decoder.feed(vehicle.encode(own_heartbeat))) == 1
    damaged = bytearray(vehicle.encode(own_heartbeat))
    damaged[-8] ^= 0x40
    assert decoder.feed(bytes(damaged)) == []
    assert len(decoder.feed(vehicle.encode(own_heartbeat))) == 1


def test_time_goes_on_by_packets_by_the_clock_and_by_what_is_heard() -> None:
    codec = Codec(255, 190, KEY, timestamp=1000)
    codec.encode(own_heartbeat)
    assert codec.timestamp == 1001
    codec.not_before(5000)
    codec.not_before(4000)
    assert codec.timestamp == 5000
    Decoder(codec, vehicle_message).feed(Codec(1, 1, KEY, timestamp=9000).encode(own_heartbeat))
    assert codec.timestamp == 9000


def test_a_short_key_is_refused() -> None:
    with pytest.raises(ValueError, match="32 bytes, not 4"):
        Codec(1, 1, b"open")


def test_a_datagram_is_taken_packet_by_packet() -> None:
    old = bytes.fromhex("fe 09 00 ff be 00 00 00 00 00 06 08 00 00 03 00 00")
    unknown = bytes.fromhex("fd 01 00 00 00 01 01 ff ff ff 00 00 00")
    damaged = bytes.fromhex(HEARTBEAT)[:-1] + b"\0"
    good = bytes.fromhex(HEARTBEAT + ACK)
    decoder = _decoder()
    found = decoder.take_datagram(old + unknown + damaged + good + good[:15])
    assert found == [Message(1, 191, Heartbeat(18, 8, False, 0)), Message(1, 191, Answer(400, 0, 255, 190))]
    assert (decoder.counts.frames, decoder.counts.bad_frames) == (2, 3)
    assert decoder.counts.skipped_bytes == len(old + unknown + damaged) + 15
    # Noise is not searched through, and nothing is kept for the next one.
    assert decoder.take_datagram(b"x" + good) == []
    assert decoder.take_datagram(good[15:]) == []
    assert len(decoder.take_datagram(good)) == 2


@given(st.binary(max_size=400))
def test_every_byte_of_a_datagram_is_counted(data: bytes) -> None:
    decoder = _decoder()
    found = decoder.take_datagram(b"\xfd" + data)
    assert found == []
    assert decoder.counts.skipped_bytes == len(data) + 1


def test_what_may_come_unsigned_does_and_says_so() -> None:
    read: list[bool] = []

    def note(message: Any) -> bool:
        read.append(is_signed(message))
        return True

    codec = Codec(1, 1, KEY, timestamp=1000, unsigned=frozenset({76}))
    decoder = Decoder(codec, note)
    stop = command(1, 1, MavCommand.ARM_DISARM, 0, *arming(False))
    for key in (None, bytes(32)):
        assert decoder.feed(Codec(255, 190, key, timestamp=2**47).encode(stop)) == [True]
        assert decoder.feed(Codec(255, 190, key, timestamp=2**47).encode(own_heartbeat)) == []
    # Nor has the forged one from the future moved the time of the stream.
    assert decoder.feed(Codec(255, 190, KEY, timestamp=2000).encode(stop)) == [True]
    assert read == [False, False, True]
