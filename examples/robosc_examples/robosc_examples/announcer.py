"""Announces what a robot has done: a service that says a text."""

import sys
from collections.abc import Sequence

from std_msgs.msg import String
from std_srvs.srv import Trigger

from robosc_examples.program import HelperNode, ParameterError, run


class Announcer(HelperNode):
    """Answers `/announce` and says its text on the console and on `/announcement`."""

    def __init__(self) -> None:
        super().__init__("announcer")
        self._text = self.text("text", "found it", "What to say.")
        if not self._text:
            raise ParameterError("parameter 'text' is empty; there must be something to say")
        self._announcement = self.create_publisher(String, "/announcement", 10)
        self.create_service(Trigger, "/announce", self._announce)

    def _announce(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.get_logger().info(self._text)
        self._announcement.publish(String(data=self._text))
        response.success, response.message = True, self._text
        return response


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("announcer", Announcer, args)


if __name__ == "__main__":
    sys.exit(main())
