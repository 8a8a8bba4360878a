"""An emergency stop panel in a terminal: keys that stop the robot, let it go on, and press its buttons.

Without a terminal it reads lines (stop, resume, or the name of a button). When its terminal or its input ends, it stops
the robot: nobody could any more.
"""

import contextlib
import os
import re
import select
import sys
import termios
import tty
from collections.abc import Sequence
from typing import Any

from std_msgs.msg import Empty

from robosc_examples.program import EXIT_FAULT, EXIT_OK, HelperNode, ParameterError, run

POLL_S = 0.05
WAIT_S = 10.0
CHUNK = 4096
STANDARD_INPUT = 0
_BUTTON = re.compile(r"([a-z][a-z0-9_]*)=(/[A-Za-z_][A-Za-z0-9_/]*)\Z")
_RESERVED = ("stop", "resume", "quit")


class StopPanel(HelperNode):
    """Publishes on `/emergency_stop/stop`, `/emergency_stop/resume` and the topics of its buttons.

    With the parameter `command` it does that one thing as soon as somebody listens, and ends.
    """

    def __init__(self) -> None:
        super().__init__("stop_panel")
        self._topics = {"stop": "/emergency_stop/stop", "resume": "/emergency_stop/resume"}
        for item in self.texts("buttons", (), "More buttons, each as name=/topic; the name's first letter is the key."):
            self._add_button(item)
        command = self.text("command", "", "Do one thing and end, such as resume; empty to read keys or lines.")
        if command and command not in self._topics:
            raise ParameterError(f"parameter 'command' is '{command}'; it must be one of {', '.join(self._topics)}")
        self._keys = {name[0]: name for name in self._topics} | {" ": "stop", "q": "quit"}
        self._sent_to: dict[str, Any] = {
            name: self.create_publisher(Empty, topic, 10) for name, topic in self._topics.items()
        }
        self._command = command
        self._since_s = self.now_s()
        self._unread = b""
        self._before = None if command else self._take_terminal()
        self.every(POLL_S, self._send_command if command else self._read)

    def _add_button(self, item: str) -> None:
        match = _BUTTON.match(item)
        if match is None:
            raise ParameterError(f"parameter 'buttons' has '{item}'; it must be name=/topic, such as go=/button")
        name, topic = match.groups()
        taken = {word[0] for word in (*self._topics, *_RESERVED)}
        if name[0] in taken:
            raise ParameterError(f"parameter 'buttons' has '{item}', but the key '{name[0]}' is taken")
        self._topics[name] = topic

    def _take_terminal(self) -> list[Any] | None:
        """Read single keys from a terminal: how it was before; None for another input."""
        if not os.isatty(STANDARD_INPUT):
            return None
        before = termios.tcgetattr(STANDARD_INPUT)
        tty.setcbreak(STANDARD_INPUT)
        keys = ", ".join(f"{'space' if key == ' ' else key}: {name}" for key, name in self._keys.items())
        sys.stdout.write(f"{keys}\n")
        sys.stdout.flush()
        return before

    def _send_command(self) -> None:
        publisher = self._sent_to[self._command]
        if publisher.get_subscription_count() > 0:
            publisher.publish(Empty())
            self.exit_status = EXIT_OK
        elif self.now_s() - self._since_s > WAIT_S:
            self.get_logger().error(f"nobody listens to {self._topics[self._command]}")
            self.exit_status = EXIT_FAULT

    def _read(self) -> None:
        try:
            if not select.select([STANDARD_INPUT], [], [], 0)[0]:
                return
            data = os.read(STANDARD_INPUT, CHUNK)
        except OSError:
            data = b""  # It was closed, or its terminal is gone.
        if not data:
            self.get_logger().error("the input has ended")
            self.exit_status = EXIT_OK
        elif self._before is not None:
            for key in data.decode(errors="replace"):
                self._press(self._keys.get(key.lower(), key))
        else:
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
            self.get_logger().info(name)
        elif name:
            # The panel stops when in doubt: people in a hurry miss the key.
            self._sent_to["stop"].publish(Empty())
            self.get_logger().warning(f"stop: {name!r:.40} is not one of {', '.join(self._sent_to)}, quit")

    def stop(self) -> None:
        """Stop the robot, since nobody watches it any more, and give the terminal back."""
        if not self._command:
            self._sent_to["stop"].publish(Empty())
        if self._before is not None:
            with contextlib.suppress(termios.error):  # The terminal is gone.
                termios.tcsetattr(STANDARD_INPUT, termios.TCSADRAIN, self._before)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("stop_panel", StopPanel, args)


if __name__ == "__main__":
    sys.exit(main())
