"""The page of the documentation states the limits that hold, and every call."""

import re
from pathlib import Path

from robosc_api.v1 import bridge_pb2
from robosc_bridge.remote import data, endpoint, operator_presence, service, session, watchers
from robosc_bridge.remote.convert import MAXIMUM_TEXT
from robosc_bridge.terminal import teleop
from robosc_bridge.terminal.commands import ADDRESS, NAMES

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "bridge-remote.md").read_text(encoding="utf-8")


def test_the_limits() -> None:
    streams = f"| {service.MAXIMUM_WATCHERS}; {service.MAXIMUM_PROGRAMS}; {service.MAXIMUM_COMMANDS} |"
    connections = f"| {endpoint.MAXIMUM_CONNECTIONS}; {endpoint._HANDSHAKE_LIMIT_S:g} s; {endpoint.IDLE_S:g} s |"
    calls = f"| {endpoint.MAXIMUM_CALLS}; {endpoint.REQUEST_LIMIT_S:g} s |"
    reflection = f"of a reflection stream | {endpoint.REFLECTION_IDLE_S:g} s |"
    message = f"| {endpoint.MAXIMUM_REQUEST_BYTES // 1024} KiB; {endpoint.MAXIMUM_METADATA_BYTES // 1024} KiB |"
    values = f"| {data.MAXIMUM_DEPTH} and {data.MAXIMUM_VALUES:,}; {data.MAXIMUM_NAME} |"
    events = f"| {watchers.MAXIMUM_EVENTS}, or {watchers.MAXIMUM_BYTES // 2**20} MiB |"
    megabytes = session.MAXIMUM_WAITING_BYTES // 1_000_000
    waiting = f"wait for a program | {session.MAXIMUM_WAITING}, or {megabytes} MB of data |"
    turn = f"next snapshot | {session.MESSAGES_PER_CYCLE}, or {session.BYTES_PER_CYCLE // 1024} KiB |"
    silence = f"| {endpoint.PING_S + endpoint.PING_LIMIT_S:g} s with a ping"
    operator = (
        f"in a second | {operator_presence.MESSAGES_A_S} | no sign of life; after {operator_presence.FLOOD_S} such"
    )
    limits = (operator, streams, connections, calls, reflection, message, values, events, waiting, turn, silence)
    for text in (*limits, f"| {MAXIMUM_TEXT} characters"):
        assert text in PAGE, text


def test_the_calls() -> None:
    methods = [method.name for method in bridge_pb2.DESCRIPTOR.services_by_name["BridgeService"].methods]
    assert sorted(re.findall(r"^\| `(\w+)` \| (?:`\w+`|any) \|", PAGE, re.MULTILINE)) == sorted(methods)


def test_the_commands() -> None:
    assert all(name in PAGE for name in NAMES)
    assert ADDRESS in PAGE
    words = " ".join(PAGE.split())
    assert f"{teleop.STEP_M_S:g} m/s" in words
    assert f"{teleop.STEP_RAD_S:g} rad/s" in words
    assert f"expires {teleop.EXPIRY_S:g} s after" in words


def test_the_page_is_listed() -> None:
    listed = (DOCS / "README.md").read_text(encoding="utf-8")
    assert "(bridge-remote.md)" in listed
    assert "(security.md)" in listed
