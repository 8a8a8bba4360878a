"""Redaction: what names an owner is gone, and the drivers read the same as before."""

import json
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.captures.capture_file import Capture, CaptureError, Kind, LineInfo, Record, event, write_capture
from robosc_bridge.captures.commands import recorded_lines, replay
from robosc_bridge.captures.redaction import redacted
from robosc_bridge.configuration import parse
from robosc_bridge.main import main
from support.daemons import CONFIGURATION
from support.lidar_frames import lds01_frame, lds02_frame, lds03_frame

BEGIN_NS = 1_767_225_600_000_000_000


def capture(info: LineInfo, *pieces: bytes, kind: Kind = Kind.IN) -> Capture:
    records = [Record(BEGIN_NS + index * 1_000_000, info.name, kind, data) for index, data in enumerate(pieces)]
    return Capture({info.name: info}, tuple(records))


def packets(*makes: Any, key: bytes | None = None) -> list[bytes]:
    codec: Any = dialect.MAVLink(None, srcSystem=7, srcComponent=1)
    if key is not None:
        codec.signing.secret_key = key
        codec.signing.sign_outgoing = True
    return [bytes(make(codec).pack(codec)) for make in makes]


ROVER = LineInfo("base", "mavlink-rover", "", {"signing_key": "/home/ada/key", "system": 7}, "udpout:203.0.113.9:14550")
HEARTBEAT = lambda codec: codec.heartbeat_encode(10, 3, 128, 15, 4)  # noqa: E731
PLACE = lambda codec: codec.gps_raw_int_encode(1, 3, 481234567, 115678901, 5000, 1, 1, 1, 1, 9)  # noqa: E731
TEXT = lambda codec: codec.statustext_encode(6, b"fmuv3 0035002A 31365112 30333036")  # noqa: E731


def test_paths_addresses_keys_and_the_time_of_day_are_gone() -> None:
    found = redacted(capture(ROVER, *packets(HEARTBEAT)))
    assert found.lines == {"base": LineInfo("base", "mavlink-rover", "", {"system": 7})}
    assert found.begin_ns == 0


def test_problems_of_lines_keep_their_kind_alone() -> None:
    lost = Record(BEGIN_NS, "base", Kind.EVENTS, event("lost line", problem="/dev/serial/by-id/usb-A1 is gone"))
    opened = Record(BEGIN_NS + 1, "base", Kind.EVENTS, event("open", baud=57600))
    found = redacted(Capture({"base": ROVER}, (lost, opened)))
    assert [record.event for record in found.records] == [{"event": "lost line"}, {"event": "open", "baud": 57600}]


def test_places_and_texts_of_a_vehicle_are_gone_and_its_heartbeat_is_not() -> None:
    pieces = packets(HEARTBEAT, PLACE, TEXT, HEARTBEAT)
    found = redacted(capture(ROVER, *pieces))
    assert [record.data for record in found.records] == [pieces[0], pieces[3]]
    # However reads have cut them.
    whole = b"".join(pieces)
    found = redacted(capture(ROVER, *(whole[at : at + 7] for at in range(0, len(whole), 7))))
    assert b"".join(record.data for record in found.records) == pieces[0] + pieces[3]


def test_a_signed_packet_becomes_the_same_without_a_signature() -> None:
    (signed,), (plain,) = packets(HEARTBEAT, key=bytes(range(32))), packets(HEARTBEAT)
    assert len(signed) == len(plain) + 13
    assert [record.data for record in redacted(capture(ROVER, signed)).records] == [plain]


def lds01_frames(first: int) -> bytes:
    """Six frames of an LDS-01."""
    return b"".join(lds01_frame(index, [(1000, 500)] * 6) for index in range(first, first + 6))


def test_texts_between_frames_of_a_lidar_are_overwritten() -> None:
    data = lds01_frames(0) + b"\x00SN 2D4A-0071\x00" + lds01_frames(20)
    found = redacted(capture(LineInfo("scanner", "lds01"), data[:258], data[258:]))
    clean = b"".join(record.data for record in found.records)
    assert clean == data.replace(b"SN 2D4A-0071", b"x" * 12)
    assert [len(record.data) for record in found.records] == [258, len(data) - 258]


@pytest.mark.parametrize("driver", ["lds01", "lds02", "lds03"])
def test_a_text_within_a_frame_is_chance_and_stays(driver: str) -> None:
    data = {
        "lds01": b"".join(lds01_frame(index, [(0x4241, 0x4443)] * 6) for index in range(8)),
        "lds02": b"".join(lds02_frame(800 * n, 800 * n + 700, [(0x4241, 0x43)] * 12) for n in range(8)),
        "lds03": b"".join(lds03_frame(10.0 * n, 10.0 * n + 9, [(4000 + n, 16)] * 10) for n in range(8)),
    }[driver]
    found = redacted(capture(LineInfo("scanner", driver), data))
    assert b"".join(record.data for record in found.records) == data


def test_servos_are_kept_byte_for_byte() -> None:
    data = b"\xff\xff\xfd\x00\xc8\x07\x00\x02ABCDEFGHI"
    found = redacted(capture(LineInfo("base", "opencr", "burger"), data, kind=Kind.OUT))
    assert [record.data for record in found.records] == [data]


def test_a_driver_that_nobody_knows_is_refused_unless_it_is_left_out() -> None:
    foreign, base = LineInfo("scanner", "laser-x"), LineInfo("base", "opencr", "burger")
    both = Capture({"scanner": foreign, "base": base}, (Record(0, "base", Kind.OUT, b"\xff"),))
    with pytest.raises(CaptureError, match=r"'laser-x' reveals about the owner; leave it out with --without scanner"):
        redacted(both)
    assert set(redacted(both, ["scanner"]).lines) == {"base"}
    with pytest.raises(CaptureError, match="the capture has no line 'camera'; it has scanner, base"):
        redacted(both, ["camera"])
    with pytest.raises(CaptureError, match="no line of the capture would be left"):
        redacted(both, ["scanner", "base"])


def test_the_key_s_file_is_not_recorded_at_all() -> None:
    text = CONFIGURATION.replace("drive: {", "drive: {options: {signing_key: /home/ada/key}, ")
    lines = recorded_lines(parse(text.encode(), "test.yaml").configuration)
    assert [info.options for info in lines.values() if info.name == "base"] == [{}]


def test_the_commands_redact_and_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    raw, clean = tmp_path / "raw.mcap", tmp_path / "clean.mcap"
    found = capture(ROVER, *packets(HEARTBEAT, TEXT))
    write_capture(raw, found.lines, found.records)
    assert main(["redact", str(raw), "-o", str(clean)]) == 0
    assert capsys.readouterr().out == f"{clean}: 1 records of base\n"
    assert b"ada" not in clean.read_bytes()
    assert main(["replay", str(clean), "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[0]["values"] == {"event": "heartbeat", "mode": 15, "is_armed": True}
    assert (lines[-1]["kind"], lines[-1]["lines"]["base"]["frames"]) == ("summary", 1)
    assert main(["replay", str(raw)]) == 0
    out = capsys.readouterr().out
    assert "base: mavlink-rover at udpout:203.0.113.9:14550\n" in out
    assert 'text="fmuv3 0035002A 31365112 30333036"' in out
    # No file is overwritten, and the mistake is one line.
    assert main(["redact", str(raw), "-o", str(clean)]) == 2
    assert main(["replay", str(raw), "--line", "scanner"]) == 2
    assert "no line 'scanner'; it has base" in capsys.readouterr().err


def test_problems_are_reported_and_are_the_exit_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = bytes.fromhex("fffffd00c8040055001 92d".replace(" ", ""))
    found = capture(LineInfo("base", "opencr", "burger"), answer)
    assert [item.kind for item in replay(found, {})] == ["problem"]
    write_capture(tmp_path / "odd.mcap", found.lines, found.records)
    assert main(["replay", str(tmp_path / "odd.mcap"), "--summary"]) == 1
    assert "1 x an answer that nobody waits for" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--record", "run.bin"], "its name ends with .mcap"),
        (["--record", "run.mcap", "--record-mib", "0"], "a whole number of MiB, 1 or more"),
    ],
)
def test_a_recording_that_cannot_be_is_refused(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["run", "--model", "m.rscd", "--config", "c.yaml", *arguments])
    assert problem in capsys.readouterr().err
