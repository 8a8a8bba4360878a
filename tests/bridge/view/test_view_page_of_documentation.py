"""The page of the documentation states the limits that hold, and is listed."""

from pathlib import Path

from robosc.explanation.blocked import MAXIMUM_REASONS
from robosc_bridge.daemon.view_settings import ADDRESS
from robosc_bridge.remote.convert import MAXIMUM_SUPERVISOR_BYTES
from robosc_view import broadcaster, graphs, playground, remote_bridge, requests, ros2_topic, server

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "live-view.md").read_text(encoding="utf-8")
WORDS = " ".join(PAGE.split())


def test_the_limits() -> None:
    assert f"| {server.MAXIMUM_VIEWERS}; {server.MAXIMUM_CONNECTIONS} |" in PAGE
    strangers = server.MAXIMUM_VIEWERS - server.RESERVED_VIEWERS
    assert f"| {strangers}; {server.VIEWERS_OF_HOST} |" in PAGE
    assert f"time for a request | {server.REQUEST_LIMIT_S:g} s |" in PAGE
    assert f"| {requests.MAXIMUM_BYTES} bytes; {server.REQUESTS_A_S:g}, {server.BURST} in a burst |" in PAGE
    assert f"that plays with a model | {requests.MAXIMUM_LED_BYTES} bytes |" in PAGE
    steps = f"{requests.MAXIMUM_WALK}; {playground.MAXIMUM_STEPS}; {playground.MAXIMUM_WAITING}"
    assert f"commands of it that wait | {steps} |" in PAGE
    assert f"about {playground.MAXIMUM_LINK} characters" in (DOCS / "playing.md").read_text(encoding="utf-8")
    assert f"wait for an answer | {server.MAXIMUM_WAITING} |" in PAGE
    assert f"| {broadcaster.MAXIMUM_EVENTS}, or {broadcaster.MAXIMUM_BYTES // 2**20} MiB |" in PAGE
    assert f"updates a second | {1 / broadcaster.UPDATE_S:g} |" in PAGE
    assert (
        f"answers no ping, sent after {server.PING_S:g} s without a word of it | {server.PING_S / 2:g} s after" in PAGE
    )
    assert f"has no room for its next message | {server.SEND_LIMIT_S:g} s |" in PAGE
    assert f"one each {remote_bridge.FOLLOW_S:g} s until it answers" in PAGE
    assert f"| {graphs.MAXIMUM_STATES} and {graphs.MAXIMUM_EDGES} |" in PAGE
    assert f"after {broadcaster.FIRST_PAUSE_S:g} s at first and {broadcaster.LONGEST_PAUSE_S:g} s at most" in WORDS
    assert f"nothing comes for {ros2_topic.SILENCE_S:g} s" in WORDS
    assert f"at most {MAXIMUM_REASONS}:" in WORDS
    assert f"at most {MAXIMUM_SUPERVISOR_BYTES // 2**20} MiB" in WORDS
    assert ADDRESS in PAGE


def test_the_page_is_listed() -> None:
    assert "(live-view.md)" in (DOCS / "README.md").read_text(encoding="utf-8")
