"""Registers of OpenCR, against a memory that is filled one by one as the firmware's table has it."""

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol import opencr
from robosc_bridge.protocol.opencr import BLOCK_ADDRESS, BLOCK_LENGTH, Block, decode_block, encode_command

FLOATS = st.floats(width=32)
I32 = st.integers(-(2**31), 2**31 - 1)
U32 = st.integers(0, 2**32 - 1)
BITS = st.integers(0, 1)
# Address to the firmware's type and its values.
TABLE: dict[int, tuple[str, st.SearchStrategy[Any]]] = {
    10: ("I", U32), 18: ("b", st.sampled_from((0, -1))), 19: ("B", st.integers(0, 255)),
    26: ("B", BITS), 27: ("B", BITS), 28: ("B", BITS), 29: ("B", BITS),
    30: ("H", st.integers(0, 65535)), 34: ("I", U32), 38: ("f", FLOATS), 42: ("I", U32), 46: ("I", U32),
    **dict.fromkeys(range(60, 112, 4), ("f", FLOATS)),
    **dict.fromkeys(range(120, 144, 4), ("i", I32)),
    148: ("B", BITS), 149: ("B", BITS), 150: ("i", I32), 170: ("i", I32),
}  # fmt: skip
MOTION = {
    **dict(zip(("angular_velocity_x", "angular_velocity_y", "angular_velocity_z"), (60, 64, 68), strict=True)),
    **dict(zip(("linear_acceleration_x", "linear_acceleration_y", "linear_acceleration_z"), (72, 76, 80), strict=True)),
    **dict(zip(("magnetic_field_x", "magnetic_field_y", "magnetic_field_z"), (84, 88, 92), strict=True)),
    **dict(zip(("orientation_w", "orientation_x", "orientation_y", "orientation_z"), (96, 100, 104, 108), strict=True)),
}


def _decoded(values: dict[int, Any]) -> Block:
    memory = bytearray(b"\xa5" * 346)
    for address, value in values.items():
        struct.pack_into("<" + TABLE[address][0], memory, address, value)
    return decode_block(bytes(memory[BLOCK_ADDRESS : BLOCK_ADDRESS + BLOCK_LENGTH]))


@given(st.fixed_dictionaries({address: values for address, (_, values) in TABLE.items()}))
def test_every_register_is_where_the_firmware_has_it(values: dict[int, Any]) -> None:
    block = _decoded(values)
    assert (block.uptime_ms, block.device_status, block.heartbeat) == (values[10], values[18], values[19])
    assert block.buttons == {
        "button_1": bool(values[26]), "button_2": bool(values[27]),
        "bumper_1": bool(values[28]), "bumper_2": bool(values[29]),
    }  # fmt: skip
    assert (block.illumination, block.infrared) == (values[30], values[34])
    assert block.sonar_m == values[38] / 100 or math.isnan(values[38])
    assert block.battery_v == values[42] / 100
    assert block.battery_share == min(values[46] / 10_000, 1.0)
    assert block.motion == {name: values[at] for name, at in MOTION.items() if math.isfinite(values[at])}
    assert block.velocities_raw == (values[128], values[132])
    assert block.ticks == (values[136], values[140])
    assert (block.has_motors, block.is_torque_on) == (bool(values[148]), bool(values[149]))
    assert block.command == (values[150], values[170])


@pytest.mark.parametrize(
    ("words", "data"),
    [
        ((10, 50), "0a 00 00 00" + 16 * " 00" + " 32 00 00 00"),
        ((0, 0), "00" + 23 * " 00"),
        ((-25, -1), "e7 ff ff ff" + 16 * " 00" + " ff ff ff ff"),
    ],
)
def test_a_command_is_written_as_worked(words: tuple[int, int], data: str) -> None:
    assert encode_command(*words).hex(" ") == data


def _stuffed_in_place(data: bytes) -> bytes:
    """Return what is left of an answer's data: the byte behind a header within is copied over all that follows."""
    begin = data.find(b"\xff\xff\xfd")
    return data if begin < 0 else data[: begin + 3] + b"\xfd" * (len(data) - begin - 3)


@pytest.mark.parametrize("begin", range(opencr.BLOCK_LENGTH - 2))
def test_what_a_board_has_spoilt_is_found_where_it_begins(begin: int) -> None:
    data = bytearray(opencr.BLOCK_LENGTH)
    data[begin : begin + 3] = b"\xff\xff\xfd"
    found = opencr.spoilt_from(_stuffed_in_place(bytes(data)))
    # So few bytes may be right.
    assert found == (begin + 2 if opencr.BLOCK_LENGTH - begin - 2 >= 8 else None)
    if found is not None:
        assert "overwritten the end of its answer" in opencr.impossibility(_stuffed_in_place(bytes(data)))
    # A board that stuffs as it should has the same bytes without harm.
    assert opencr.spoilt_from(bytes(data)) is None


@pytest.mark.parametrize("data", [bytes(172), b"\xfd" * 172, b"\xff\xfd" * 86, bytes(160) + b"\xfd" * 12])
def test_bytes_without_a_header_before_them_are_not_spoilt(data: bytes) -> None:
    assert opencr.spoilt_from(data) is None


@pytest.mark.parametrize("address", [26, 27, 28, 29, 148, 149])
def test_a_truth_value_is_one_of_two(address: int) -> None:
    for value, problem in ((0, ""), (1, ""), (2, "a truth value is 2"), (253, "a truth value is 253")):
        data = bytearray(opencr.BLOCK_LENGTH)
        data[address - opencr.BLOCK_ADDRESS] = value
        assert opencr.impossibility(bytes(data)) == problem
