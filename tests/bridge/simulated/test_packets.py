"""Protocol 2.0 on the device's side: dynamixel-sdk's routines are its twin; any bytes at all do no harm."""

from dynamixel_sdk import PacketHandler
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BODIES, OpenCr, ServoBus, Timebase, Walls, World, wheel_servos
from robosc_simulated.packets import Request, RequestParser, crc16, status
from support.effort import examples

SDK = PacketHandler(2.0)
# Bytes that make headers and stuffing likely.
TRICKY = st.lists(st.sampled_from([0xFF, 0xFF, 0xFD, 0x00, 0x01, 0xFE]) | st.integers(0, 255), max_size=40).map(bytes)
# An address that may be an item's, and one to eight bytes of data or a length behind it.
ADDRESSED = st.builds(
    lambda address, data: bytes((address, 0)) + data,
    st.sampled_from([7, 8, 10, 11, 12, 44, 63, 64, 68, 98, 100, 104, 108, 116, 126, 132, 149, 150])
    | st.integers(0, 150),
    st.sampled_from([b"\0", b"\1", b"\2", b"\3", b"\4\0", b"\x64\0\0\0"]) | st.binary(min_size=1, max_size=8),
)
PARAMETERS = TRICKY | ADDRESSED
INSTRUCTIONS = st.sampled_from([1, 2, 3, 4, 5, 6, 8, 0x10, 0x55, 0x82, 0x83, 0x92, 0x93]) | st.integers(0, 254)


def request(device_id: int, instruction: int, parameters: bytes) -> bytes:
    """An instruction packet, after the e-Manual."""
    body = bytearray()
    for byte in bytes((instruction,)) + parameters:
        body.append(byte)
        if bytes(body[-3:]) == b"\xff\xff\xfd":
            body.append(0xFD)
    packet = b"\xff\xff\xfd\x00" + bytes((device_id,)) + (len(body) + 2).to_bytes(2, "little") + bytes(body)
    return packet + crc16(packet).to_bytes(2, "little")


def well_formed(packet: bytes) -> tuple[int, int, bytes]:
    """ID, error and parameters of a status packet, or a failure."""
    assert packet[:4] == b"\xff\xff\xfd\x00"
    assert int.from_bytes(packet[5:7], "little") == len(packet) - 7
    assert packet[7] == 0x55
    assert SDK.updateCRC(0, packet, len(packet) - 2) == int.from_bytes(packet[-2:], "little")
    assert b"\xff\xff\xfd" not in packet[7:-2].replace(b"\xff\xff\xfd\xfd", b"|")
    body = packet[8:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
    return packet[4], body[0], body[1:]


def test_the_check_value_of_the_crc() -> None:
    assert crc16(b"123456789") == 0xFEE8


@given(TRICKY)
def test_the_crc_is_the_sdks(data: bytes) -> None:
    assert crc16(data) == SDK.updateCRC(0, data, len(data))


@given(st.integers(0, 252), st.integers(0, 255), TRICKY)
def test_a_status_packet_is_what_the_sdk_reads(device_id: int, error: int, parameters: bytes) -> None:
    assert well_formed(status(device_id, error, parameters)) == (device_id, error, parameters)


@given(
    st.lists(st.tuples(st.integers(0, 254), INSTRUCTIONS, TRICKY), max_size=4),
    st.lists(st.integers(1, 30), min_size=1, max_size=20),
)
@example([(1, 3, b"\xff\xff\xfd"), (1, 3, b"\xff\xff\xfd\xfd\xff\xff\xfd")], [1])
def test_packets_are_found_however_they_are_cut(packets: list[tuple[int, int, bytes]], cuts: list[int]) -> None:
    data = b"".join(request(*packet) for packet in packets)
    parser = RequestParser()
    found: list[Request] = []
    while data:
        for cut in cuts:
            found += parser.feed(data[:cut], 0.0)
            data = data[cut:]
    assert found == [Request(*packet) for packet in packets]


@given(st.lists(TRICKY, max_size=20))
def test_noise_is_survived_and_a_packet_after_a_pause_is_heard(pieces: list[bytes]) -> None:
    parser = RequestParser()
    for piece in pieces:
        parser.feed(piece, 0.0)
    assert parser.feed(request(1, 1, b""), 1.0)[-1] == Request(1, 1, b"")


def test_what_was_given_up_in_its_middle_is_forgotten() -> None:
    parser = RequestParser()
    assert parser.feed(request(1, 3, bytes(1000))[:100], 0.0) == []
    assert parser.feed(request(1, 1, b""), 0.05) == []
    assert parser.feed(request(2, 1, b""), 0.2) == [Request(2, 1, b"")]


def test_a_packet_behind_one_that_was_cut_off_is_heard() -> None:
    parser = RequestParser()
    cut = request(1, 3, bytes(8))[:12]
    found = parser.feed(cut + request(2, 1, b""), 0.0)
    assert [(one.device_id, one.is_intact) for one in found] == [(1, False), (2, True)]


def bus() -> ServoBus:
    world = World(BODIES["waffle"], Walls(()), Timebase(ManualClock()))
    return ServoBus(wheel_servos(world))


@settings(max_examples=examples(60))
@given(st.lists(st.tuples(st.sampled_from([1, 2]), INSTRUCTIONS, PARAMETERS), max_size=12), st.integers(0, 200))
def test_a_servo_answers_whatever_it_is_asked(requests: list[tuple[int, int, bytes]], pause_ms: int) -> None:
    servos = bus()
    time = servos.servos[0].time
    for device_id, instruction, parameters in requests:
        listening = [
            servo.device_id == device_id and servo.table["baud rate"] == 3 and servo.answers for servo in servos.servos
        ]
        level = min(servo.table["status return level"] for servo in servos.servos)
        answers = [
            well_formed(sending.data)
            for sending in servos.receive(request(device_id, instruction, parameters), 1_000_000)
        ]
        if instruction != 0x55 and level == 2:
            assert [answer[0] for answer in answers] == [device_id] * sum(listening)
        assert all(answer[1] & 0x7F <= 7 for answer in answers)
        time.advance(pause_ms / 1000)
        servos.update()
    # They live.
    time.advance(1.0)
    for servo in servos.servos:
        assert servo.answers
        assert servo.read(0, 2) == (0, b"\x06\x04")


@settings(max_examples=examples(60))
@given(st.lists(st.integers(0, 150), max_size=60), st.lists(TRICKY, max_size=20))
def test_random_writes_never_leave_a_register_beyond_its_bounds(addresses: list[int], data: list[bytes]) -> None:
    servo = bus().servos[0]
    for address, piece in zip(addresses, data, strict=False):
        servo.write(address, piece)
        for item in servo.table.model.items:
            if item.lowest is not None and item.name != "bus watchdog":
                assert item.lowest <= servo.table[item.name] <= item.highest, item.name


@settings(max_examples=examples(60))
@given(st.lists(st.tuples(st.sampled_from([200, 1, 254]), INSTRUCTIONS, PARAMETERS), max_size=12), st.integers(0, 200))
def test_opencr_answers_three_instructions_and_no_others(requests: list[tuple[int, int, bytes]], pause_ms: int) -> None:
    world = World(BODIES["burger"], Walls(()), Timebase(ManualClock()))
    opencr = OpenCr(world, *wheel_servos(world), calibration_s=0.0)
    for device_id, instruction, parameters in requests:
        found = list(opencr.receive(request(device_id, instruction, parameters), 0))
        world.time.advance(pause_ms / 1000)
        # The end of a calibration that was asked for.
        found += opencr.update()
        is_long = instruction == 2 and len(parameters) == 4 and int.from_bytes(parameters[2:], "little") > 2037
        is_answered = device_id == 200 and instruction in (1, 2, 3) and not is_long
        assert [well_formed(sending.data)[0] for sending in found] == [200] * is_answered
    assert opencr.receive(request(200, 1, b""), 0)


def test_the_parser_holds_no_more_than_a_packet() -> None:
    parser = RequestParser()
    for _ in range(1000):
        parser.feed(b"\x00\xff\xff\xfd\x00\x01\xff\xff" * 20, 0.0)
        assert len(parser._held) < 4096
