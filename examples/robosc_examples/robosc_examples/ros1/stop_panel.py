"""An emergency stop panel that reads lines (stop, resume, quit); when its input ends, it stops the robot."""

import os
import select
import sys

import rospy
from std_msgs.msg import Empty

from robosc_examples.ros1.program import EXIT_OK, Node, run

CHUNK = 4096
STANDARD_INPUT = 0


class StopPanel(Node):
    """Publishes on `/emergency_stop/stop` and `/emergency_stop/resume`."""

    def __init__(self) -> None:
        super().__init__()
        self._sent_to = {
            "stop": self.publisher("/emergency_stop/stop", Empty),
            "resume": self.publisher("/emergency_stop/resume", Empty),
        }
        self._unread = b""

    def tick(self) -> None:
        """Read what was typed."""
        if not select.select([STANDARD_INPUT], [], [], 0)[0]:
            return
        try:
            data = os.read(STANDARD_INPUT, CHUNK)
        except OSError:
            data = b""  # Its terminal is gone.
        if not data:
            rospy.logerr("the input has ended")
            self.exit_status = EXIT_OK
            return
        *lines, self._unread = (self._unread + data).split(b"\n")
        # A text without an end is no line.
        self._unread = self._unread[-CHUNK:]
        for line in lines:
            self._press(line.decode(errors="replace").strip().lower())

    def _press(self, name: str) -> None:
        if name == "quit":
            self.exit_status = EXIT_OK
        elif name in self._sent_to:
            self._sent_to[name].publish(Empty())
        elif name:
            # The panel stops when in doubt: people in a hurry miss the key.
            self.stop()
            rospy.logwarn(f"stop: {name!r:.40} is none of stop, resume, quit")

    def stop(self) -> None:
        """Stop the robot: nobody watches it any more."""
        self._sent_to["stop"].publish(Empty())


def main() -> int:
    """Run the node: the exit status."""
    return run("stop_panel", StopPanel)


if __name__ == "__main__":
    sys.exit(main())
