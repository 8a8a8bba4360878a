"""Looks for a thing of a colour: an object, a ball, a goal."""

import sys
from collections.abc import Sequence

from geometry_msgs.msg import Point
from sensor_msgs.msg import Image

from robosc_examples.blob import Colour, find_blob, place_of
from robosc_examples.camera import Camera
from robosc_examples.pictures import colour_picture
from robosc_examples.program import run


class BlobDetector(Camera):
    """Turns `/image` into a `geometry_msgs/Point` on `/blob`, whose z says how sure it is; remap the topic.

    With `width` 0, x is how far the thing is off the picture's middle (to the left above zero) and y how wide it is,
    both as a share of the picture's width. With its real width in metres, x is metres ahead and y metres to the left.
    """

    def __init__(self) -> None:
        super().__init__("blob_detector")
        self._colour = Colour(
            self.number("hue_from", 170, 0, 179, "First hue that counts, 0 to 179; above hue_to means across red."),
            self.number("hue_to", 10, 0, 179, "Last hue that counts."),
            self.number("saturation", 100, 0, 255, "Least saturation."),
            self.number("brightness", 60, 0, 255, "Least brightness."),
        )
        self._smallest = self.number("smallest", 0.0005, 0, 1, "Smallest share of the picture that counts.")
        self._width_m = self.number("width", 0.0, 0, 100, "Its real width in metres; 0 for shares of a picture.")
        self._view_rad = self.number("field_of_view", 1.085, 0.1, 3.0, "The camera's horizontal view in radians.")
        self._blob = self.create_publisher(Point, "/blob", 10)

    def look(self, message: Image) -> None:
        """Publish where the thing is in a picture."""
        blob = find_blob(colour_picture(message), self._colour, self._smallest)
        if blob is None:
            self.be_blind()
        elif self._width_m > 0.0:
            place = place_of(blob, self._width_m, self._view_rad)
            self._blob.publish(Point(x=place.ahead_m, y=place.left_m, z=blob.confidence))
        else:
            self._blob.publish(Point(x=blob.aside, y=blob.size, z=blob.confidence))

    def be_blind(self) -> None:
        """Publish that the thing is not in sight."""
        self._blob.publish(Point())


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("blob_detector", BlobDetector, args)


if __name__ == "__main__":
    sys.exit(main())
