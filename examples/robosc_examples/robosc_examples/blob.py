"""Place of a thing of a colour in a picture. Without ROS."""

import math
from typing import NamedTuple

import cv2
import numpy as np

from robosc_examples.pictures import Picture


class Colour(NamedTuple):
    """Colours that count: hues as OpenCV counts them, 0 to 179; from above to means across red.

    Attributes:
        hue_from: The first.
        hue_to: The last.
        saturation: Least saturation, 0 to 255.
        brightness: Least brightness, 0 to 255.
    """

    hue_from: float
    hue_to: float
    saturation: float = 100.0
    brightness: float = 60.0


class Blob(NamedTuple):
    """Patch that was found.

    Attributes:
        aside: Distance of its middle from the picture's, to the left above zero, as a share of the width.
        size: Its width, as a share of the picture's.
        confidence: Filled share of a disc or a rectangle as large as it is, 0 to 1.
    """

    aside: float
    size: float
    confidence: float


class Place(NamedTuple):
    """Metres ahead and to the left."""

    ahead_m: float
    left_m: float


def find_blob(picture: Picture, colour: Colour, smallest: float) -> Blob | None:
    """Return the largest connected patch of a colour; None if there is none.

    Args:
        picture: Picture in blue, green and red.
        colour: Colour of the patch.
        smallest: Smallest share of all pixels that a patch must fill.
    """
    hues = cv2.cvtColor(picture, cv2.COLOR_BGR2HSV)
    hue = hues[..., 0]
    above, below = hue >= colour.hue_from, hue <= colour.hue_to
    fits = (above & below) if colour.hue_from <= colour.hue_to else (above | below)
    mask = fits & (hues[..., 1] >= colour.saturation) & (hues[..., 2] >= colour.brightness)
    count, _, figures, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count < 2:
        return None
    largest = 1 + int(np.argmax(figures[1:, cv2.CC_STAT_AREA]))
    left, _, wide, high, area = (int(figure) for figure in figures[largest])
    if area < smallest * mask.size:
        return None
    width = mask.shape[1]
    return Blob(0.5 - (left + wide / 2) / width, wide / width, min(1.0, area / (math.pi / 4 * wide * high)))


def place_of(blob: Blob, real_width_m: float, field_of_view_rad: float) -> Place:
    """Return the place of a thing of known width, seen by a camera that looks straight ahead."""
    ahead_m = real_width_m / (2.0 * blob.size * math.tan(field_of_view_rad / 2.0))
    return Place(ahead_m, real_width_m * blob.aside / blob.size)
