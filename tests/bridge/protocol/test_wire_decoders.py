"""Tests that the fuzzer's demands on the decoders also hold for some bytes at each run of the tests."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_bridge.protocol import lds02
from support.effort import examples
from support.wire_decoders import SEEDS, TARGETS, judge


@pytest.mark.parametrize("name", TARGETS)
@settings(max_examples=examples(40))
@given(data=st.data())
def test_nothing_is_owed_for_any_bytes(name: str, data: st.DataObject) -> None:
    seed = data.draw(st.sampled_from(SEEDS[name]))
    begin, end = (data.draw(st.integers(0, len(seed))) for _ in range(2))
    judge(name, data.draw(st.binary(max_size=200)) + seed[begin:end] + data.draw(st.binary(max_size=100)))


@pytest.mark.parametrize("name", TARGETS)
def test_sound_bytes_and_many_of_them(name: str) -> None:
    for seed in SEEDS[name]:
        judge(name, seed * 20)


def test_a_decoder_that_holds_what_it_should_not_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    class Hoarder(lds02.Decoder):
        def feed(self, data: bytes) -> list[Any]:
            self.all = getattr(self, "all", b"") + data * 1000
            return super().feed(data)

    monkeypatch.setattr(lds02, "Decoder", Hoarder)
    with pytest.raises(AssertionError, match="it allocates"):
        judge("lds02", SEEDS["lds02"][0])


def test_a_decoder_that_is_lost_after_noise_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    class Sulker(lds02.Decoder):
        def feed(self, data: bytes) -> list[Any]:
            return [] if self.counts.bad_frames > 3 else super().feed(data)

    monkeypatch.setattr(lds02, "Decoder", Sulker)
    with pytest.raises(AssertionError, match="two frames later"):
        judge("lds02", b"\0" + (b"\x54\x2c" + bytes(45)) * 5)
