"""Registers of a servo, against the worked answer of the manual."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol.servo import MEASUREMENT_LENGTH, Measurement, decode_measurement, encode_velocity

WORKED = "f4 ff 4c 00 00 00 00 08 00 00 4c 00 00 00 00 08 00 00 76 00 21"


def test_the_worked_answer_is_decoded() -> None:
    assert decode_measurement(bytes.fromhex(WORKED)) == Measurement(-12, 76, 2048, 11.8, 33)


@given(
    st.integers(-(2**15), 2**15 - 1),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(0, 2**16 - 1),
    st.integers(0, 255),
)
def test_every_register_is_where_the_table_has_it(
    load: int, velocity: int, ticks: int, voltage: int, heat: int
) -> None:
    memory = bytearray(b"\xa5" * 147)
    for address, code, value in (
        (126, "<h", load), (128, "<i", velocity), (132, "<i", ticks), (144, "<H", voltage), (146, "<B", heat),
    ):  # fmt: skip
        struct.pack_into(code, memory, address, value)
    assert decode_measurement(bytes(memory[126 : 126 + MEASUREMENT_LENGTH])) == Measurement(
        load, velocity, ticks, voltage / 10, heat
    )


def test_goals_are_signed() -> None:
    assert encode_velocity(-76).hex(" ") == "b4 ff ff ff"
    assert encode_velocity(177).hex(" ") == "b1 00 00 00"
