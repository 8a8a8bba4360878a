"""Tests of the data that the benchmark of reactions reads out of a record of both lines."""

import math
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "benchmarks" / "bridge"))

from reaction import Trial, commands, trials  # A folder of programs, not on the path of tests.

from robosc_simulated import Record
from support.lidar_frames import lds01_frame

# Packets of the fact sheets.
OPENCR_ZERO = bytes.fromhex("fffffd00c81d00039600" + 24 * "00" + "06a0")
OPENCR_MOVE = bytes.fromhex("fffffd00c81d000396000a000000" + 16 * "00" + "320000004d37")
SERVOS_MOVE = bytes.fromhex("fffffd00fe11008368000400013f000000023f000000ce56")
SERVOS_STOP = bytes.fromhex("fffffd00fe1100836800040001000000000200000000e4d0")
SERVOS_READ = bytes.fromhex("fffffd00fe0900827e00150001023e1e")


def revolution(time_s: float, distance_mm: int) -> list[Record]:
    """A turn of an LDS-01 whose last frame is sent then."""
    frames = [lds01_frame(index, [(100, distance_mm)] * 6) for index in range(60)]
    return [Record(time_s - (59 - index) / 300, "scanner", False, frame) for index, frame in enumerate(frames)]


def sent(time_s: float, data: bytes) -> Record:
    return Record(time_s, "base", True, data)


def in_order(*records: Record | list[Record]) -> list[Record]:
    found = [one for item in records for one in (item if isinstance(item, list) else [item])]
    return sorted(found, key=lambda record: record.time_s)


@pytest.mark.parametrize(("move", "stop"), [(OPENCR_MOVE, OPENCR_ZERO), (SERVOS_MOVE, SERVOS_STOP)])
def test_a_reaction_is_from_the_turns_last_byte_to_the_first_zero(move: bytes, stop: bytes) -> None:
    records = in_order(
        revolution(1.0, 3000), sent(1.1, stop), sent(1.2, move), revolution(2.0, 3000),
        revolution(3.0, 300), sent(3.001, move), sent(3.004, SERVOS_READ + stop), sent(3.02, stop), revolution(4.0,
        300),
    )  # fmt: skip
    assert trials(records, "lds01") == [Trial(3.0, 3.004)]


def test_a_command_counts_from_its_first_byte() -> None:
    records = [sent(1.0, SERVOS_READ + SERVOS_MOVE[:5]), sent(1.5, SERVOS_MOVE[5:]), sent(2.0, SERVOS_STOP)]
    assert list(commands(records)) == [(1.0, False), (2.0, True)]


def test_a_robot_that_does_not_stop_has_no_reaction_time() -> None:
    records = in_order(
        revolution(1.0, 3000),
        sent(1.2, SERVOS_MOVE),
        revolution(2.0, 300),
        revolution(3.0, 3000),
        sent(3.1, SERVOS_STOP),
    )
    assert trials(records, "lds01") == [Trial(2.0, math.inf)]


def test_a_robot_that_was_not_driving_is_no_trial() -> None:
    records = in_order(revolution(1.0, 3000), sent(1.2, SERVOS_STOP), revolution(2.0, 300), sent(2.1, SERVOS_STOP))
    assert trials(records, "lds01") == []
