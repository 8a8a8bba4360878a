"""The page of the documentation says what the code does."""

import math
import re
from pathlib import Path

from robosc_bridge.daemon.states import State
from robosc_bridge.devices.interface import STANDSTILL
from robosc_bridge.ground_station import (
    command_handler,
    commands,
    driving,
    session,
    settings,
    status_texts,
    stream,
    values,
)
from robosc_bridge.protocol.mavlink_messages import Mode, Telemetry
from support.ground import PlayedDaemon

DOCS = Path(__file__).parents[3] / "docs"
PAGE = " ".join((DOCS / "bridge-mavlink.md").read_text(encoding="utf-8").split())


def test_the_page_is_listed() -> None:
    assert "(bridge-mavlink.md)" in (DOCS / "README.md").read_text(encoding="utf-8")


def test_states_and_modes_have_their_numbers() -> None:
    assert ", ".join(f"{place} {state}" for place, state in enumerate(State)) in PAGE
    for mode in (Mode.INITIALISING, Mode.AUTO, Mode.GUIDED, Mode.HOLD):
        assert f"| {mode.value} {mode.name} |" in PAGE


def test_times_and_limits() -> None:
    for text in (
        f"has not run for {stream.STALE_S:g} s",
        f"after {stream.GONE_S:g} s the heartbeat ends",
        f"A scan is sent for {stream.SCAN_LIMIT_S:g} s, a reading of the motors for {stream.READING_LIMIT_S:g} s",
        f"between {commands.SHORTEST_INTERVAL_S * 1000:g} ms and an hour",
        f"with a confirmation count within {command_handler.REPEATED_S:g} s",
        f"not answered within {command_handler.ANSWER_LIMIT_S:g} s",
        f"Without one for {driving.SILENCE_S:g} s",
        f"After {session.STATION_LIMIT_S:g} s without a heartbeat, a text",
        f"has been idle for {session.IDLE_S * 1000:g} ms",
        f"of more than {status_texts.MOST_WAITING} chunks that wait",
        f"At most {session.MESSAGES_PER_S:g} messages a second",
        f"At most {status_texts.RATE_PER_S:g} chunks a second",
        f"every {status_texts.REPEAT_S:g} s",
        f"longer than {status_texts.LONGEST} it is cut",
        f"more than {values.MOST_VALUES} values",
        f"at most {values.NAME_BYTES} bytes",
        f"with {settings.BAUD} baud",
        f"below {settings.NETWORK_BYTES_PER_S // 1000} kB a second",
    ):
        assert text in PAGE, text
    assert commands.LONGEST_INTERVAL_S == 3600.0


def test_what_is_told_stands_there() -> None:
    made = stream.Stream(PlayedDaemon().operations, settings.GroundSettings("/dev/x", STANDSTILL), 0.0)
    names = {"LOCAL_POSITION": "LOCAL_POSITION_NED"}
    for message in made.schedule._defaults:
        name = Telemetry(message).name
        assert re.search(rf"\| [^|]*{names.get(name, name)}[^|]* \|", PAGE), name
    assert math.isinf(made.schedule.interval_s(Telemetry.ATTITUDE))
