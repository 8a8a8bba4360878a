"""A middleware, in the place of rclpy's, that acknowledges at once and sends a little later, as Zenoh may.

    python late_middleware.py MODULE [ARGUMENTS ...]

It runs a module with it. What is still to be sent when the process ends is lost.
"""

import queue
import runpy
import sys
import threading
import time
from typing import Any

import rclpy.publisher
import rclpy.utilities
from rclpy.serialization import serialize_message

LATE_S = 0.15
"""Time from a publication until it is sent."""

IDENTIFIER = "rmw_zenoh_cpp"

_publish = rclpy.publisher.Publisher.publish
_waiting: queue.SimpleQueue[tuple[Any, bytes, float]] = queue.SimpleQueue()


def _publish_late(publisher: Any, message: Any) -> None:
    # The node reuses its messages.
    content = message if isinstance(message, bytes) else serialize_message(message)
    _waiting.put((publisher, content, time.monotonic() + LATE_S))


def _send() -> None:
    while True:
        publisher, content, due_s = _waiting.get()
        time.sleep(max(0.0, due_s - time.monotonic()))
        _publish(publisher, content)


if __name__ == "__main__":
    rclpy.publisher.Publisher.publish = _publish_late
    rclpy.publisher.Publisher.wait_for_all_acked = lambda publisher, timeout=None: True
    rclpy.utilities.get_rmw_implementation_identifier = lambda: IDENTIFIER
    threading.Thread(target=_send, daemon=True).start()
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
