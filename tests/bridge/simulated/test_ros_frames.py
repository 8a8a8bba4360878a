"""Frames between the twin and its rospy side: they come through whole, and nothing else does."""

import itertools
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_simulated.ros.rospy_side import frames as frames_module
from robosc_simulated.ros.rospy_side.frames import MOST_DATA, MOST_HEAD, Decoder, Frame, FrameError, encode

VALUES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8)
HEADS = st.builds(
    lambda kind, rest: {**rest, "kind": kind},
    st.text(max_size=8),
    st.dictionaries(st.text(max_size=4), VALUES | st.lists(VALUES, max_size=2), max_size=3),
)


@given(
    st.lists(st.tuples(HEADS, st.binary(max_size=100)), max_size=4),
    st.lists(st.integers(1, 60), min_size=1, max_size=8),
)
def test_frames_come_through_in_whatever_pieces(sent: list[tuple[dict[str, Any], bytes]], sizes: list[int]) -> None:
    stream = b"".join(encode(head, payload) for head, payload in sent)
    decoder = Decoder()
    found: list[Frame] = []
    for size in itertools.cycle(sizes):
        found += decoder.feed(stream[:size])
        stream = stream[size:]
        if not stream:
            break
    assert found == [Frame(head, payload) for head, payload in sent]


@pytest.mark.parametrize(
    "wrong",
    [
        struct.pack(">II", MOST_HEAD + 1, 0),
        struct.pack(">II", 2, MOST_DATA + 1),
        struct.pack(">II", 3, 0) + b"[1]",
        struct.pack(">II", 2, 0) + b"{}",
        struct.pack(">II", 10, 0) + b'{"kind":1}',
        struct.pack(">II", 2, 0) + b"\xff\xff",
        struct.pack(">II", 60_000, 0) + b"[" * 60_000,
    ],
)
def test_what_is_no_frame_is_refused(wrong: bytes) -> None:
    with pytest.raises(FrameError):
        list(Decoder().feed(wrong))


@given(st.binary(max_size=200))
def test_noise_ends_in_nothing_or_in_a_refusal(noise: bytes) -> None:
    try:
        for frame in Decoder().feed(noise):
            assert isinstance(frame.head["kind"], str)
    except FrameError:
        pass


def test_what_is_too_large_is_not_sent() -> None:
    with pytest.raises(FrameError):
        encode({"kind": "scan", "text": "x" * MOST_HEAD})
    with pytest.raises(FrameError):
        encode({"kind": "picture"}, bytes(MOST_DATA + 1))


def test_the_other_side_needs_nothing_but_the_standard_library() -> None:
    folder = Path(frames_module.__file__).parents[1]
    code = "import rospy_side.frames as f, sys; print(any(n.startswith(('robosc', 'numpy')) for n in sys.modules))"
    environment = {"PYTHONPATH": str(folder)}
    found = subprocess.run(
        [sys.executable, "-S", "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert found.stdout == "False\n"
