"""A node that looks at pictures, and that says so when it sees nothing because none come."""

import math

from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

from robosc_examples.pictures import PictureError
from robosc_examples.program import HelperNode


class Camera(HelperNode):
    """Reads `/image`; one that cannot be read, and none for `image_timeout` seconds, count as blindness.

    Args:
        name: The node's name.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._timeout_s = self.number(
            "image_timeout", 0.5, 0.05, 60.0, "Seconds without a picture after which nothing is in sight."
        )
        self._seen_s = -math.inf
        self.create_subscription(Image, "/image", self._read, qos_profile_sensor_data)
        self.every(self._timeout_s / 2, self._watch)

    def look(self, message: Image) -> None:
        """Look at a picture.

        Raises:
            PictureError: It cannot be read.
        """
        raise NotImplementedError

    def be_blind(self) -> None:
        """Publish that nothing is in sight; called again and again."""
        raise NotImplementedError

    def stop(self) -> None:
        """Publish that no line is in sight any more."""
        self.be_blind()

    def _read(self, message: Image) -> None:
        try:
            self.look(message)
        except PictureError as error:
            self.get_logger().warning(f"a picture is left out: {error}", throttle_duration_sec=5.0)
            self.be_blind()
        else:
            self._seen_s = self.now_s()

    def _watch(self) -> None:
        if self.now_s() - self._seen_s > self._timeout_s:
            self.be_blind()
