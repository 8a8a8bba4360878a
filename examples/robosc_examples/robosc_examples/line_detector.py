"""Detector of a line on the floor: publishes how to steer along it, or that there is none."""

import sys
from collections.abc import Sequence

from sensor_msgs.msg import Image
from std_msgs.msg import Empty, Float32

from robosc_examples.camera import Camera
from robosc_examples.line import find_line
from robosc_examples.line_runs import USUAL, LineSettings
from robosc_examples.motion import clamped
from robosc_examples.pictures import grey_picture
from robosc_examples.program import ParameterError, run


class LineDetector(Camera):
    """Turns `/image` into `/line/correction` (radians a second, to the left above zero) or `/line/lost`."""

    def __init__(self) -> None:
        super().__init__("line_detector")
        usual = USUAL
        shade = self.text("line", "dark", "Whether the line is darker or lighter than the floor.", ("dark", "light"))
        self._settings = LineSettings(
            threshold=self.number("threshold", usual.threshold, 0, 255, "Shade that parts line from floor."),
            is_dark=shade == "dark",
            top=self.number("top", usual.top, 0, 1, "Where to begin to look, as a share of the height from above."),
            bottom=self.number("bottom", usual.bottom, 0, 1, "Where to end."),
            smallest=self.number("smallest", usual.smallest, 0, 1, "Smallest share of the looked-at pixels."),
            largest=self.number("largest", usual.largest, 0, 1, "Largest share of the looked-at pixels."),
        )
        for low, high in (("top", "bottom"), ("smallest", "largest")):
            first, second = getattr(self._settings, low), getattr(self._settings, high)
            if first >= second:
                raise ParameterError(f"parameter '{low}' is {first:g}; it must be below '{high}', which is {second:g}")
        self._gain = self.number("gain", 2.0, 0, 100, "Radians a second for a line at the picture's edge, doubled.")
        self._limit_rad_s = self.number("limit", 1.0, 0, 10, "Largest correction in radians a second.")
        self._correction = self.create_publisher(Float32, "/line/correction", 10)
        self._lost = self.create_publisher(Empty, "/line/lost", 10)

    def look(self, message: Image) -> None:
        """Publish how to steer along the line in a picture."""
        aside = find_line(grey_picture(message), self._settings)
        if aside is None:
            self.be_blind()
        else:
            self._correction.publish(Float32(data=clamped(self._gain * aside, self._limit_rad_s)))

    def be_blind(self) -> None:
        """Publish that there is no line."""
        self._lost.publish(Empty())


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("line_detector", LineDetector, args)


if __name__ == "__main__":
    sys.exit(main())
