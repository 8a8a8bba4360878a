"""Registers of OpenCR, against a memory that is filled one by one as the firmware's table has it."""

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

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
