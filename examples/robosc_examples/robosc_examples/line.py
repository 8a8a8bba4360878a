"""Where a line on the floor runs in a picture. Without ROS."""

from typing import NamedTuple

import cv2
import numpy as np

from robosc_examples.pictures import Picture


class LineSettings(NamedTuple):
    """What counts as a line.

    Attributes:
        threshold: Shade that parts the line from the floor, 0 (black) to 255.
        is_dark: Whether the line is the darker of the two.
        top: Where the rows that are looked at begin, as a share of the height from above.
        bottom: Where they end.
        smallest: Smallest share of the looked-at pixels that is a line.
        largest: Largest; a picture that is dark all over shows no line.
    """

    threshold: float = 100.0
    is_dark: bool = True
    top: float = 0.6
    bottom: float = 1.0
    smallest: float = 0.005
    largest: float = 0.6


USUAL = LineSettings()


def find_line(picture: Picture, settings: LineSettings = USUAL) -> float | None:
    """How far the line is off the middle, to the left above zero, as a share of the width; None without a line.

    The line is the largest connected patch of its shade; its centre of mass is what counts.

    Args:
        picture: In shades of grey.
        settings: What counts as a line.
    """
    height, width = int(picture.shape[0]), int(picture.shape[1])
    # At least one row, however small the picture.
    first = min(int(settings.top * height), height - 1)
    rows = picture[first : max(first + 1, round(settings.bottom * height))]
    kind = cv2.THRESH_BINARY_INV if settings.is_dark else cv2.THRESH_BINARY
    _, mask = cv2.threshold(rows, settings.threshold, 255, kind)
    count, _, figures, centres = cv2.connectedComponentsWithStats(np.asarray(mask, np.uint8))
    if count < 2:
        return None
    # The first is the floor.
    largest = 1 + int(np.argmax(figures[1:, cv2.CC_STAT_AREA]))
    share = float(figures[largest, cv2.CC_STAT_AREA]) / rows.size
    if not settings.smallest <= share <= settings.largest:
        return None
    middle = float(centres[largest][0])
    return 0.5 - (middle + 0.5) / width
