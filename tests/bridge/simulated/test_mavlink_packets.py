"""The simulated vehicle's packets: worked ones byte for byte, and all as pymavlink has them."""

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_simulated.mavlink_packets import BY_NAME, LAYOUTS, Encoder, Layout, Parser

KEY = bytes(range(32))
WORKED: dict[str, tuple[str, dict[str, Any]]] = {
    "fd 09 00 00 00 01 bf 00 00 00 00 00 00 00 12 08 00 04 03 ae c6": (
        "HEARTBEAT",
        {"type": 18, "autopilot": 8, "system_status": 4, "version": 3},
    ),
    "fd 06 00 00 01 01 bf fd 00 00 06 70 6c 61 69 6e 85 41": ("STATUSTEXT", {"severity": 6, "text": b"plain"}),
    "fd 0a 00 00 07 01 bf 4d 00 00 90 01 00 00 00 00 00 00 ff be 90 1a": (
        "COMMAND_ACK",
        {"command": 400, "target_system": 255, "target_component": 190},
    ),
}


@pytest.mark.parametrize("packet", WORKED)
def test_worked_packets(packet: str) -> None:
    name, values = WORKED[packet]
    encoder = Encoder(1, 191)
    data = bytes.fromhex(packet)
    for _ in range(data[4]):
        encoder.encode("HEARTBEAT")
    assert encoder.encode(name, **values) == data
    (found,) = Parser().feed(data)
    assert (found.system, found.component, found.name) == (1, 191, name)
    decoded = {key: value.rstrip(b"\0") if isinstance(value, bytes) else value for key, value in found.values.items()}
    assert {key: decoded[key] for key in values} == values


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_numbers_and_checksums_are_those_of_the_definition(layout: Layout) -> None:
    known = dialect.mavlink_map[layout.number]
    size = struct.calcsize(layout.format)
    assert (known.msgname, known.crc_extra, known.unpacker.size) == (layout.name, layout.extra, size)


@given(st.binary(min_size=1, max_size=240), st.sampled_from(LAYOUTS))
def test_any_payload_is_read_as_pymavlink_reads_it(payload: bytes, layout: Layout) -> None:
    values = layout.unpack(payload)
    data = Encoder(1, 1).encode(layout.name, **values)
    decoded = dialect.MAVLink(None).decode(bytearray(data))
    assert decoded.get_type() == layout.name
    flat: list[Any] = []
    for field in decoded.ordered_fieldnames:
        value = getattr(decoded, field)
        flat += value if isinstance(value, list) else [value]
    ours: list[Any] = []
    for value in values.values():
        ours += value if isinstance(value, tuple) else [value]
    for one, other in zip(flat, ours, strict=True):
        # Texts may be no UTF-8, and what they are then is the library's affair.
        if not isinstance(other, bytes):
            assert one == other or (math.isnan(one) and math.isnan(other))


@given(st.lists(st.one_of(st.binary(max_size=30), st.none()), max_size=12), st.integers(1, 40))
def test_packets_are_found_in_noise(parts: list[bytes | None], size: int) -> None:
    encoder = Encoder(1, 1)
    data = b"".join(
        encoder.encode("ATTITUDE", yaw=1.0) if part is None else part.replace(b"\xfd", b"") for part in parts
    )
    parser = Parser()
    found = [packet for begin in range(0, len(data), size) for packet in parser.feed(data[begin : begin + size])]
    assert len(found) == sum(part is None for part in parts)


def test_signatures_are_those_of_pymavlink() -> None:
    theirs = dialect.MAVLink(None, 255, 190)
    theirs.signing.secret_key = KEY
    theirs.signing.sign_outgoing = True
    theirs.signing.timestamp = 500
    packet = bytes(theirs.heartbeat_encode(6, 8, 0, 0, 4).pack(theirs))
    parser = Parser(KEY)
    assert [found.is_signed for found in parser.feed(packet)] == [True]
    # Once is enough, and another key or none is none.
    assert parser.feed(packet + packet[:-1] + b"\0" + Encoder(1, 1).encode("HEARTBEAT")) == []
    assert parser.rejected == 3
    ours = Encoder(1, 1, KEY)
    ours.timestamp = 600
    decoded = theirs.decode(bytearray(ours.encode("HEARTBEAT", type=10, autopilot=3)))
    assert decoded.get_signed()


def test_what_a_later_version_adds_is_not_looked_at() -> None:
    assert BY_NAME["COMMAND_ACK"].unpack(bytes(range(14))) == BY_NAME["COMMAND_ACK"].unpack(bytes(range(10)))
