"""Packets of protocol 2.0: stuffing, checksums and answers, by the SDK's handler with its faults put right."""

import itertools
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol.dynamixel import PacketHandler, StatusPacket, status_of, stuffed, unstuffed
from support import peer

HEADERS = st.lists(st.sampled_from((0xFF, 0xFD, 0x00, 0x55)), max_size=12)


class _Port:
    """Bytes in memory; enough of a port for one packet."""

    def __init__(self, incoming: bytes = b"") -> None:
        self.is_using = False
        self.sent = b""
        self._incoming = incoming

    def clearPort(self) -> None:
        pass

    def writePort(self, packet: Sequence[int]) -> int:
        self.sent += bytes(packet)
        return len(packet)

    def readPort(self, length: int) -> bytes:
        taken, self._incoming = self._incoming[:length], self._incoming[length:]
        return taken

    def setPacketTimeout(self, length: int) -> None:
        pass

    def isPacketTimeout(self) -> bool:
        return not self._incoming


def _received(data: bytes) -> StatusPacket | None:
    packet, result = PacketHandler().rxPacket(_Port(data), False)
    return status_of(packet) if result == 0 else None


def test_a_payload_with_a_header_goes_out_stuffed() -> None:
    port = _Port()
    PacketHandler().writeTxOnly(port, 1, 104, 4, [0xFF, 0xFF, 0xFD, 0xFF])
    assert port.sent.hex(" ") == "ff ff fd 00 01 0a 00 03 68 00 ff ff fd fd ff e0 78"


def test_an_answer_with_a_header_is_unstuffed() -> None:
    found = _received(bytes.fromhex("ff ff fd 00 01 0d 00 55 00 ff ff ff ff fd fd 00 00 00 0f 3e"))
    assert found == StatusPacket(1, 0, False, bytes.fromhex("ff ff ff ff fd 00 00 00"))


@pytest.mark.parametrize("length", [4, 5, 6])
def test_every_payload_of_header_bytes_comes_back_as_it_was_sent(length: int) -> None:
    for payload in itertools.product((0xFF, 0xFD, 0x00), repeat=length):
        found = _received(peer.status(1, bytes(payload)))
        assert found == StatusPacket(1, 0, False, bytes(payload)), bytes(payload).hex(" ")


@given(HEADERS)
def test_a_stuffed_body_has_no_header_and_can_be_unstuffed(body: list[int]) -> None:
    found = stuffed(body)
    assert unstuffed(found) == body
    assert bytes(found) == bytes(body).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


@given(st.integers(0, 252), st.integers(0, 255), st.binary(max_size=64))
def test_any_answer_is_read_as_it_was_sent(device: int, error: int, data: bytes) -> None:
    assert _received(peer.status(device, data, error)) == StatusPacket(device, error & 0x7F, error >= 0x80, data)


@pytest.mark.parametrize(
    ("answer", "number", "is_alert"),
    [
        ("ff ff fd 00 01 04 00 55 00 a1 0c", 0, False),
        ("ff ff fd 00 01 04 00 55 07 b0 8c", 7, False),
        ("ff ff fd 00 01 04 00 55 04 ba 8c", 4, False),
        ("ff ff fd 00 01 04 00 55 06 b5 0c", 6, False),
        ("ff ff fd 00 01 04 00 55 80 a2 8f", 0, True),
        ("ff ff fd 00 01 04 00 55 87 b3 0f", 7, True),
    ],
)
def test_an_empty_answer_has_no_data(answer: str, number: int, is_alert: bool) -> None:
    assert _received(bytes.fromhex(answer)) == StatusPacket(1, number, is_alert, b"")


def test_refusals_are_reported_in_words() -> None:
    assert StatusPacket(1, 7, False, b"").refusal == "no access to this address"
    assert StatusPacket(1, 99, False, b"").refusal == "error 99"


@given(st.binary(max_size=60))
def test_no_bytes_raise(data: bytes) -> None:
    _received(data)
    _received(b"\xff\xff\xfd\x00" + data)


@pytest.mark.parametrize("length", range(4))
def test_a_sound_packet_that_is_too_short_is_none(length: int) -> None:
    head = bytes((0xFF, 0xFF, 0xFD, 0x00, 1, length, 0, 0x55))[: 5 + length]
    data = head + peer.crc(head).to_bytes(2, "little")
    assert _received(data + bytes(11 - len(data))) is None
