"""Pictures in shades of grey, one after the other in a stream of bytes, in the raw PGM format of Netpbm.

The format (J. Poskanzer and others, "PGM format specification", netpbm.sourceforge.net/doc/pgm.html) says by itself how
long a picture is, so that several may follow each other, and any tool can look at such a stream. Its magic number,
width, height and largest shade stand before the rows of a picture; comments and shades of two bytes are refused.
"""

import re
from dataclasses import dataclass

MAXIMUM_PIXELS = 4_194_304
"""Maximum number of pixels of one picture: more than any camera that follows a line has."""

_HEADER = re.compile(rb"P5\s{1,8}(\d{1,5})\s{1,8}(\d{1,5})\s{1,8}255\s")
_LONGEST_HEADER = 2 + 8 + 5 + 8 + 5 + 8 + 3 + 1


class NotPicturesError(ValueError):
    """Error that the data is no such stream; nothing of what follows can be understood."""


@dataclass(frozen=True)
class GreyPicture:
    """A picture.

    Attributes:
        width: Of a row, in pixels.
        height: Rows.
        pixels: One byte each, 0 is black; rows from above, each from the left.
    """

    width: int
    height: int
    pixels: bytes


def encoded(picture: GreyPicture) -> bytes:
    """A picture as it goes into a stream."""
    return b"P5\n%d %d\n255\n%b" % (picture.width, picture.height, picture.pixels)


class Decoder:
    """Finds pictures in the bytes of a stream, however these are split; holds at most one that is not complete."""

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> GreyPicture | None:
        """Return the newest picture that is complete with these bytes; None: none is.

        Args:
            data: Bytes that came next.

        Raises:
            NotPicturesError: This is no stream of pictures, or one is empty or too large.
        """
        self._held += data
        newest = None
        while header := _HEADER.match(self._held):
            width, height = int(header[1]), int(header[2])
            if not 0 < width * height <= MAXIMUM_PIXELS:
                raise NotPicturesError(f"a picture of {width} x {height} pixels")
            begin, end = header.end(), header.end() + width * height
            if len(self._held) < end:
                return newest
            newest = GreyPicture(width, height, bytes(self._held[begin:end]))
            # The match looks into these bytes, which cannot change their size before.
            del header
            del self._held[:end]
        if len(self._held) >= _LONGEST_HEADER:
            raise NotPicturesError("the stream does not hold grey pictures (PGM)")
        return newest
