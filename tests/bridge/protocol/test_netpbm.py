"""Streams of PGM pictures: whatever is in them, and however they are split."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol.netpbm import MAXIMUM_PIXELS, Decoder, GreyPicture, NotPicturesError, encoded

SMALL = GreyPicture(3, 2, b"\x00\x01\x02\xfd\xfe\xff")


def fed(parts: list[bytes]) -> list[GreyPicture]:
    decoder = Decoder()
    return [picture for part in parts if (picture := decoder.feed(part))]


def test_a_picture_is_as_netpbm_says() -> None:
    assert encoded(SMALL) == b"P5\n3 2\n255\n\x00\x01\x02\xfd\xfe\xff"


@pytest.mark.parametrize("head", [b"P5 3 2 255\n", b"P5\n3\t2\r255 ", b"P5\n\n  3 2\n255\n"])
def test_any_white_space_parts_the_words(head: bytes) -> None:
    assert fed([head + SMALL.pixels]) == [SMALL]


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(1, 9), st.integers(0, 255))), st.data())
def test_however_a_stream_is_split_every_picture_is_found(
    sizes: list[tuple[int, int, int]], data: st.DataObject
) -> None:
    # Shades that look like a head's words and white space are among them.
    pictures = [GreyPicture(w, h, bytes((shade + k) % 256 for k in range(w * h))) for w, h, shade in sizes]
    stream = b"".join(map(encoded, pictures))
    cuts = sorted(data.draw(st.sets(st.integers(0, len(stream)))))
    parts = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    found = fed(parts)
    # The newest of several pictures that one part completes.
    ends = [sum(len(encoded(each)) for each in pictures[: k + 1]) for k in range(len(pictures))]
    expected, at = [], 0
    for part in parts:
        done = [picture for picture, end in zip(pictures, ends, strict=True) if at < end <= at + len(part)]
        expected += done[-1:]
        at += len(part)
    assert found == expected
    assert [picture for k in range(len(stream)) for picture in fed([stream[: k + 1]])][-1:] == pictures[-1:]


@pytest.mark.parametrize(
    "data",
    [
        b"P6\n3 2\n255\n" + bytes(60),
        b"P5\n3 2\n65535\n" + bytes(60),
        b"P5\n3 -2\n255\n" + bytes(60),
        b"P5\n# by a program\n3 2\n255\n" + bytes(60),
        b"GET / HTTP/1.1\r\nHost: localhost\r\nUser-Agent: none\r\n\r\n",
        b"P5\n0 9\n255\n",
        b"P5\n%d %d\n255\n" % (MAXIMUM_PIXELS // 64, 65),
        b"P5\n99999 99999\n255\n",
        encoded(SMALL) + bytes(60),
    ],
)
def test_what_is_no_stream_of_pictures_is_reported(data: bytes) -> None:
    with pytest.raises(NotPicturesError):
        Decoder().feed(data)


def test_the_largest_picture_is_taken() -> None:
    large = GreyPicture(2048, MAXIMUM_PIXELS // 2048, bytes(MAXIMUM_PIXELS))
    assert fed([encoded(large)]) == [large]


@given(st.lists(st.binary(max_size=200), max_size=20))
def test_noise_is_refused_or_waits_within_bounds(parts: list[bytes]) -> None:
    decoder = Decoder()
    for part in parts:
        try:
            assert decoder.feed(part) is None
        except NotPicturesError:
            return
