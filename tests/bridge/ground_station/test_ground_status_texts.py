"""Texts in chunks, against a receiver that puts them together; how often they are sent."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.ground_station.status_texts import (
    BURST,
    LONGEST,
    MOST_WAITING,
    RATE_PER_S,
    Severity,
    StatusTexts,
    chunks,
    plain_text,
)
from robosc_bridge.protocol.mavlink import Codec
from support.ground import Station, joined_texts


def _received(text: str) -> str:
    """Return the text that a station puts together: a chunk that is not full ends a text."""
    parts = b""
    for place, chunk in enumerate(chunks(text, 7)):
        assert (chunk.number, chunk.place) in ((0, 0), (7, place))
        chunk.data.decode("utf-8")
        assert len(chunk.data) <= 50
        parts += chunk.data
        is_last = chunk.number == 0 or len(chunk.data) < 50
        assert is_last == (place == len(chunks(text, 7)) - 1)
    return parts.decode("utf-8")


@pytest.mark.parametrize(
    ("length", "sizes"),
    [(0, [0]), (49, [49]), (50, [50]), (51, [50, 1]), (100, [50, 50, 0]), (149, [50, 50, 49]), (150, [50] * 3 + [0])],
)
def test_a_text_that_fills_its_chunks_has_one_more(length: int, sizes: list[int]) -> None:
    found = chunks("x" * length, 7)
    assert [len(chunk.data) for chunk in found] == sizes
    assert {chunk.number for chunk in found} == ({0} if len(sizes) == 1 else {7})


def test_a_character_is_never_cut() -> None:
    text = "x" * 49 + "äöü" * 20
    assert [len(chunk.data) for chunk in chunks(text, 7)][:2] == [50, 50]
    assert _received(text).replace(" ", "") == text


@given(st.text(alphabet=st.characters(exclude_characters="\0 ", codec="utf-8"), max_size=300))
def test_a_station_reads_what_was_said(text: str) -> None:
    assert _received(text).replace(" ", "") == text


@given(st.text(max_size=600))
def test_any_text_is_made_plain(text: str) -> None:
    plain = plain_text(text)
    assert len(plain.encode()) <= LONGEST
    assert plain.isprintable()


def test_a_long_text_is_cut() -> None:
    assert plain_text("ä" * 300).endswith("ä...")
    assert plain_text("a\nb\0c") == "a b c"


def _sent(texts: StatusTexts, now_s: float) -> list[str]:
    codec = Codec(1, 1)
    return joined_texts(Station().hear(b"".join(codec.encode(make) for make in texts.take(now_s))))


def test_the_same_is_not_sent_again_and_again() -> None:
    texts = StatusTexts()
    found = []
    for tick in range(300):
        texts.say(tick / 10, Severity.ERROR, "warm")
        found += _sent(texts, tick / 10)
    assert found == ["warm"] * 2
    texts.say(30.0, Severity.ERROR, "warm", again_s=0.0)
    assert _sent(texts, 30.0) == ["warm"]


def test_what_holds_is_sent_every_twenty_seconds_and_when_it_comes_again() -> None:
    texts = StatusTexts()
    sent = {}
    for tick in range(450):
        holds = tick < 410 or 415 <= tick < 420 or tick >= 435
        texts.repeat(tick / 10, [(Severity.ERROR, "cold")] if holds else [])
        if found := _sent(texts, tick / 10):
            sent[tick / 10] = found
    assert list(sent) == [0.0, 20.0, 40.0, 43.5]


def test_there_are_never_too_many_a_second() -> None:
    texts = StatusTexts()
    count = 0
    for tick in range(1000):
        for number in range(5):
            texts.say(tick / 100, Severity.INFO, f"{tick} {number}")
        count += len(texts.take(tick / 100))
        assert len(texts._waiting) <= MOST_WAITING
        assert len(texts._recent) <= 200
    assert count <= BURST + 10.0 * RATE_PER_S + 1


def test_who_listens_anew_receives_all_again() -> None:
    texts = StatusTexts()
    texts.repeat(0.0, [(Severity.ERROR, "cold")])
    assert _sent(texts, 0.0) == ["cold"]
    texts.forget()
    texts.repeat(1.0, [(Severity.ERROR, "cold")])
    assert _sent(texts, 1.0) == ["cold"]


def test_nonsense_keeps_no_news_from_being_sent() -> None:
    texts = StatusTexts()
    for number in range(500):
        texts.say(0.0, Severity.WARNING, f"A parameter cannot be {number}.", again_s=0.0, asked_by=(255, number % 250))
    texts.say(0.0, Severity.ERROR, "Fault: hot", again_s=0.0)
    texts.repeat(0.0, [(Severity.CRITICAL, "empty")])
    texts.say(0.0, Severity.NOTICE, "Standby")
    assert _sent(texts, 0.0)[:3] == ["empty", "Fault: hot", "Standby"]
    assert sum(len(item.pieces) for item in texts._waiting) <= MOST_WAITING


def test_the_grave_makes_others_wait_and_what_was_dropped_is_reported_later() -> None:
    texts = StatusTexts()
    for number in range(60):
        texts.say(0.0, Severity.NOTICE, f"notice {number}")
    for number in range(25):
        texts.say(0.0, Severity.CRITICAL, f"critical {number}")
    # Graver texts stay; a text that was never sent is sent when it is said again.
    texts.say(0.0, Severity.NOTICE, "too much")
    texts.say(0.0, Severity.NOTICE, "notice 25")
    found = []
    for tick in range(80):
        found += _sent(texts, tick / 10)
    assert found == [f"critical {number}" for number in range(25)] + [f"notice {number}" for number in range(5)]
    texts.say(8.0, Severity.NOTICE, "notice 25")
    assert _sent(texts, 8.0) == ["notice 25"]


def test_answers_to_one_sender_have_one_place() -> None:
    texts = StatusTexts()
    for text in ("first", "second", "third"):
        texts.say(0.0, Severity.WARNING, text, again_s=0.0, asked_by=(255, 190))
    texts.say(0.0, Severity.WARNING, "other", again_s=0.0, asked_by=(254, 190))
    assert _sent(texts, 0.0) == ["third", "other"]
    for _ in range(3):
        texts.say(0.0, Severity.WARNING, "the same", again_s=0.0)
    assert _sent(texts, 0.0) == ["the same"]


def test_a_text_that_has_begun_is_sent_to_its_end() -> None:
    texts = StatusTexts()
    texts.say(0.0, Severity.INFO, "x" * 49)
    for number in range(10):
        texts.say(0.0, Severity.INFO, f"{number}")
    texts.say(0.0, Severity.INFO, "y" * 120)
    sent = [texts.take(0.0)]
    texts.say(0.0, Severity.CRITICAL, "grave")
    sent += [texts.take(tick / 10) for tick in range(1, 20)]
    codec = Codec(1, 1)
    found = joined_texts(Station().hear(b"".join(codec.encode(make) for makes in sent for make in makes)))
    assert found[-2:] == ["y" * 120, "grave"]
