"""Finds a line on the floor in pictures of a camera, and computes how to steer along it. Needs OpenCV and numpy."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from robosc_bridge.skills.settings import LineSettings

Picture = NDArray[np.uint8]
"""Rows of pixels from above: shades of grey, or blue, green and red."""


@dataclass(frozen=True, slots=True)
class Line:
    """Line that a picture shows.

    Attributes:
        correction_rad_s: Yaw rate to keep on it, counter-clockwise above zero; None: no line is in sight.
    """

    correction_rad_s: float | None


LOST = Line(None)


class LineDetector:
    """Detector that computes a correction from each picture, and reports the line as lost if no pictures come.

    Args:
        settings: Settings of what counts as a line, and how to steer.
        time_s: Current time, in seconds.
    """

    def __init__(self, settings: LineSettings, time_s: float) -> None:
        self._settings = settings
        self._seen_s = time_s

    def update(self, picture: Picture | None, time_s: float) -> Line | None:
        """Return the line that the model receives now; None: nothing new.

        Args:
            picture: Picture that came since the last call; None: there was none.
            time_s: Current time, in seconds.
        """
        if picture is not None:
            self._seen_s = time_s
            aside = line_offset(picture, self._settings)
            return LOST if aside is None else Line(self._correction_rad_s(aside))
        if time_s - self._seen_s < self._settings.timeout_s:
            return None
        # Reported again after each timeout, so that a model that starts anew learns of the lost line.
        self._seen_s = time_s
        return LOST

    def _correction_rad_s(self, aside: float) -> float:
        limit = self._settings.limit_rad_s
        return max(-limit, min(limit, self._settings.gain_rad_s * aside))


def line_offset(picture: Picture, settings: LineSettings) -> float | None:
    """Return the line's offset to the left of the middle as a share of the width (-0.5 to 0.5); None: no line.

    The line is the largest connected patch of its shade within the rows that are looked at, unless it is too small or
    too large; what counts is its centre of mass.

    Args:
        picture: Picture of any size; an empty one, or one that is no picture, shows no line.
        settings: Settings of what counts as a line.
    """
    grey = _grey(picture)
    if grey is None:
        return None
    height, width = int(grey.shape[0]), int(grey.shape[1])
    first = min(int(height * settings.top), height - 1)
    # At least one row, however small the picture.
    rows = grey[first : max(first + 1, round(height * settings.bottom))]
    is_line = rows <= settings.threshold if settings.shade == "dark" else rows > settings.threshold
    largest = _largest_patch(is_line)
    if largest is None:
        return None
    area, middle = largest
    if not settings.smallest <= area / rows.size <= settings.largest:
        return None
    return 0.5 - (middle + 0.5) / width


def _grey(picture: Picture) -> NDArray[Any] | None:
    if picture.size == 0 or picture.dtype != np.uint8:
        return None
    match picture.shape:
        case (_, _):
            return picture
        case (_, _, 1):
            return picture[:, :, 0]
        case (_, _, 3):
            return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    return None


def _largest_patch(mask: NDArray[np.bool_]) -> tuple[int, float] | None:
    """Area and middle column of the largest patch, the pixels of which touch at edges or corners."""
    count, _, figures, middles = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    if count < 2:  # The first one is all that is not line.
        return None
    best = 1 + int(figures[1:, cv2.CC_STAT_AREA].argmax())
    return int(figures[best, cv2.CC_STAT_AREA]), float(middles[best][0])
