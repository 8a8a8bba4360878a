"""Place of a line on the floor in a picture. Without ROS."""

import cv2
import numpy as np

from robosc_examples.line_runs import USUAL, LineSettings
from robosc_examples.pictures import Picture


def find_line(picture: Picture, settings: LineSettings = USUAL) -> float | None:
    """Return the distance of the line off the middle, to the left above zero, as a share of the width; None: no line.

    The line is the largest connected patch of its shade; its centre of mass is what counts.

    Args:
        picture: Picture in shades of grey.
        settings: Properties of a line.
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
