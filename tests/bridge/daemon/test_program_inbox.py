"""Tests of the bounds, in number and in memory, on the messages of each program that wait for the loop."""

import random
import tracemalloc
from typing import Any

import pytest

from robosc_bridge.daemon.programs import inbox as program_inbox
from robosc_bridge.daemon.programs.inbox import (
    MAXIMUM_WAITING,
    MAXIMUM_WAITING_BYTES,
    Arrived,
    Overflowed,
    ProgramInbox,
    Unreadable,
)
from robosc_bridge.daemon.programs.items import Detached, FromProgram, MessageReceived, Program
from robosc_bridge.daemon.programs.plain_data import weight_bytes
from robosc_bridge.daemon.programs.request_checker import InvalidRequestError


def program(name: str = "a program") -> Program:
    return Program(name, lambda item: None)


def as_it_is(item: FromProgram) -> FromProgram:
    return item


def inbox() -> ProgramInbox:
    return ProgramInbox(lambda: None, as_it_is)


def numbers(count: int = 19_990) -> list[float]:
    return [random.random() for _ in range(count)]


def taken(box: ProgramInbox) -> list[Arrived]:
    found = []
    while (item := box.take()) is not None:
        found.append(item)
    assert box.is_empty
    return found


@pytest.mark.parametrize(
    "data",
    [
        lambda: numbers(1999),
        lambda: {"a": [[random.random()] for _ in range(600)]},
        lambda: ["x" * 6000 + str(number) for number in range(30)],
        lambda: {f"{number:060}": {} for number in range(900)},
    ],
)
def test_the_memory_of_what_waits_is_bounded(data: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    limit = MAXIMUM_WAITING_BYTES // 10
    monkeypatch.setattr(program_inbox, "MAXIMUM_WAITING_BYTES", limit)
    box, sender = inbox(), program()
    tracemalloc.start()
    try:
        for _ in range(20):
            box.put(MessageReceived(sender, "/mood", data()))
        # The messages have data of another type.
        assert tracemalloc.get_traced_memory()[0] < 1.3 * limit + 50_000
    finally:
        tracemalloc.stop()
    *kept, last = taken(box)
    assert 1 <= len(kept) < 20
    assert last == Overflowed(sender, lost=20 - len(kept))
    # Room is free again.
    box.put(MessageReceived(sender, "/mood", data()))
    assert isinstance(box.take(), MessageReceived)


def test_data_weighs_what_it_takes() -> None:
    tracemalloc.start()
    try:
        data = {f"name {number}": [random.random(), "text" * number] for number in range(100, 400)}
        grown = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert abs(weight_bytes(data) - grown) < 0.15 * grown


def test_one_message_waits_whatever_its_size() -> None:
    box, sender = inbox(), program()
    large = MessageReceived(sender, "/mood", ["x" * 60_000] * 50)
    assert weight_bytes(large.data) > MAXIMUM_WAITING_BYTES
    box.put(large)
    box.put(MessageReceived(sender, "/mood", None))
    assert taken(box) == [large, Overflowed(sender)]


def test_after_something_is_lost_nothing_is_kept_before_that_is_reported() -> None:
    # Else a motion could come after the word that all has ended, and the stop that follows it be lost.
    box, sender, other = inbox(), program(), program("another")
    for number in range(MAXIMUM_WAITING + 1):
        box.put(MessageReceived(sender, "/mood", number))
    for _ in range(5):
        box.take()
    box.put(MessageReceived(sender, "/mood", "go"))
    box.put(MessageReceived(other, "/mood", "fine"))
    box.put(Detached(sender))
    found = [item for item in taken(box) if not (isinstance(item, MessageReceived) and item.program is sender)]
    assert found == [MessageReceived(other, "/mood", "fine"), Overflowed(sender, lost=2), Detached(sender)]
    box.put(MessageReceived(sender, "/mood", "go"))
    assert taken(box) == [MessageReceived(sender, "/mood", "go")]


def test_what_makes_no_sense_takes_no_room() -> None:
    def look(item: FromProgram) -> FromProgram:
        raise InvalidRequestError("no")

    box, sender = ProgramInbox(lambda: None, look), program()
    for _ in range(MAXIMUM_WAITING):
        box.put(MessageReceived(sender, "/mood", numbers(2000)))
    assert taken(box) == [Unreadable(sender, "no")] * MAXIMUM_WAITING
