"""Detector of a line on the floor, without OpenCV: publishes how to steer along it, or that there is none."""

import math
import sys
import time
from typing import Any

import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Empty, Float32

from robosc_examples.line_runs import USUAL, LineSettings, find_line
from robosc_examples.motion import clamped
from robosc_examples.ros1.program import Node, ParameterError, run


class LineDetector(Node):
    """Turns `/image` (mono8) into `/line/correction` (radians a second, left above zero) or `/line/lost`."""

    def __init__(self) -> None:
        super().__init__()
        usual = USUAL
        self._settings = LineSettings(
            threshold=self.number("threshold", usual.threshold, 0, 255),
            top=self.number("top", usual.top, 0, 1),
            bottom=self.number("bottom", usual.bottom, 0, 1),
            smallest=self.number("smallest", usual.smallest, 0, 1),
            largest=self.number("largest", usual.largest, 0, 1),
        )
        for low, high in (("top", "bottom"), ("smallest", "largest")):
            first, second = getattr(self._settings, low), getattr(self._settings, high)
            if first >= second:
                raise ParameterError(f"parameter '{low}' is {first:g}; it must be below '{high}', which is {second:g}")
        self._gain = self.number("gain", 2.0, 0, 100)
        self._limit_rad_s = self.number("limit", 1.0, 0, 10)
        self._timeout_s = self.number("image_timeout", 0.5, 0.05, 60.0)
        self._seen_s = -math.inf
        self._correction = self.publisher("/line/correction", Float32)
        self._lost = self.publisher("/line/lost", Empty)
        self.subscribe("/image", Image, self._look)

    def _look(self, message: Any) -> None:
        fault = _fault(message)
        if fault:
            rospy.logwarn_throttle(5.0, f"a picture is left out: {fault}")
            self.stop()
            return
        self._seen_s = time.monotonic()
        aside = find_line(message.data, message.width, message.height, message.step, self._settings)
        if aside is None:
            self.stop()
        else:
            self._correction.publish(Float32(clamped(self._gain * aside, self._limit_rad_s)))

    def tick(self) -> None:
        """Without pictures nothing is in sight."""
        if time.monotonic() - self._seen_s > self._timeout_s:
            self.stop()

    def stop(self) -> None:
        """Publish that there is no line."""
        self._lost.publish(Empty())


def _fault(message: Any) -> str:
    """Return the reason why a picture cannot be read; empty: it can."""
    if message.encoding != "mono8":
        return f"encoding {message.encoding!r:.40}; this node reads mono8, such as image_proc's image_mono"
    if message.height < 1 or message.width < 1 or message.step < message.width:
        return f"a picture of {message.width} x {message.height} pixels in rows of {message.step} bytes"
    if len(message.data) != message.step * message.height:
        return f"{len(message.data)} bytes for {message.height} rows of {message.step} bytes"
    return ""


def main() -> int:
    """Run the node: the exit status."""
    return run("line_detector", LineDetector)


if __name__ == "__main__":
    sys.exit(main())
