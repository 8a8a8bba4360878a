"""Captures of robots: whatever lies in `recorded/` is replayed to the drivers' decoders.

A capture of an owner is redacted, put there, and its summary beside it (`robosc-bridge replay FILE --summary --json`).
Without a summary, it has to be understood as a whole: no problem, and something read on each line.
"""

import io
import json
from dataclasses import asdict, replace
from pathlib import Path
from random import Random

import pytest

from robosc_bridge.captures.capture_file import Capture, CaptureError, Kind, read_capture
from robosc_bridge.captures.commands import replay
from robosc_bridge.captures.players import Summary

RECORDED = sorted((Path(__file__).parent / "recorded").glob("*.mcap"))


def summaries(capture: Capture) -> dict[str, Summary]:
    found: dict[str, Summary] = {}
    for item in replay(capture, found):
        assert item.time_s >= 0.0
    return found


def test_there_is_one_of_each_drive_base_and_lidar() -> None:
    drivers = {info.driver for file in RECORDED for info in read_capture(file).lines.values()}
    assert drivers >= {"opencr", "dynamixel", "mavlink-rover", "lds01", "lds02", "lds03"}


@pytest.mark.parametrize("file", RECORDED, ids=lambda file: file.stem)
def test_a_capture_is_understood_as_it_was(file: Path) -> None:
    capture = read_capture(file)
    found = {name: asdict(summary) for name, summary in summaries(capture).items()}
    expected = file.with_suffix(".json")
    if expected.exists():
        wanted = json.loads(expected.read_text())
        assert (found, capture.is_whole) == (wanted["lines"], wanted["is_whole"])
    else:
        assert all(line["readings"] or line["scans"] for line in found.values()), found
        assert not any(line["problems"] for line in found.values()), found


@pytest.mark.parametrize("file", RECORDED, ids=lambda file: file.stem)
def test_a_capture_names_nobody(file: Path) -> None:
    capture = read_capture(file)
    assert capture.begin_ns == 0
    assert [info.port for info in capture.lines.values()] == [""] * len(capture.lines)


@pytest.mark.parametrize("file", RECORDED, ids=lambda file: file.stem)
def test_damaged_bytes_are_counted_and_never_an_exception(file: Path) -> None:
    capture, dice = read_capture(file), Random(7)

    def damaged(data: bytes) -> bytes:
        found = bytearray(data)
        found[dice.randrange(len(found))] ^= 1 << dice.randrange(8)
        return bytes(found)

    records = tuple(
        replace(record, data=damaged(record.data)) if record.kind is not Kind.EVENTS and dice.random() < 0.1 else record
        for record in capture.records
    )
    sound, found = summaries(capture), summaries(replace(capture, records=records))
    for name, summary in found.items():
        assert 0 < summary.frames < sound[name].frames
        assert summary.bad_frames > sound[name].bad_frames
        assert summary.skipped_bytes > sound[name].skipped_bytes


def test_a_capture_that_ends_anywhere_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    data, cut = RECORDED[0].read_bytes(), tmp_path / "cut.mcap"
    whole, dice = read_capture(RECORDED[0]), Random(3)
    for length in (0, 5, 8, *(dice.randrange(len(data)) for _ in range(20))):
        cut.write_bytes(data[:length])
        try:
            capture = read_capture(cut)
        except CaptureError as error:
            assert "cut.mcap: not a capture" in str(error)
        else:
            assert capture.records == whole.records[: len(capture.records)]
            assert not capture.is_whole or capture.records == whole.records


@pytest.mark.parametrize("content", [b"", b"#!/bin/sh\n", bytes(1000)])
def test_another_file_is_no_capture(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "other.mcap"
    file.write_bytes(content)
    with pytest.raises(CaptureError, match="it is no MCAP file"):
        read_capture(file)


def test_an_mcap_file_of_others_is_no_capture(tmp_path: Path) -> None:
    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    writer.add_message(writer.register_channel("/odom", "cdr", 0), 0, b"", 0)
    writer.finish()
    file = tmp_path / "odom.mcap"
    file.write_bytes(stream.getvalue())
    with pytest.raises(CaptureError, match="not a capture of `robosc-bridge run --record`"):
        read_capture(file)
