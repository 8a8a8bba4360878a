"""Parts of every node on ROS 1: checked parameters, an orderly end, one clear line for what goes wrong.

rospy's own shutdown lets callbacks go on while its hooks run, so that a velocity may follow the zero. So the signals
are ours, and after the last message a node sends nothing more.
"""

import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

import rospy

EXIT_OK = 0
EXIT_FAULT = 1
EXIT_USAGE = 2
DELIVERY_S = 0.2
QUEUE = 10
_TICK_S = 0.05


class ParameterError(Exception):
    """A parameter has a wrong value; says which and what it may be."""


class Node:
    """A node; rospy calls it back in many threads, one at a time through `alone`.

    Attributes:
        exit_status: None while it runs; a node that is done sets its exit status.
    """

    def __init__(self) -> None:
        self.exit_status: int | None = None
        self._lock = threading.RLock()
        self._has_ended = False

    def number(self, name: str, default: float, minimum: float, maximum: float) -> float:
        """The value of a private parameter that is a number.

        Raises:
            ParameterError: It is none, or out of its range.
        """
        value = rospy.get_param("~" + name, default)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not minimum <= value <= maximum:
            raise ParameterError(
                f"parameter '{name}' is {value!r}; it must be a number from {minimum:g} to {maximum:g}"
            )
        return float(value)

    def publisher(self, topic: str, kind: Any) -> Any:
        """Sends on a topic, without waiting for who receives."""
        return rospy.Publisher(topic, kind, queue_size=QUEUE, tcp_nodelay=True)

    def subscribe(self, topic: str, kind: Any, act: Callable[[Any], None]) -> None:
        """Calls with every message of a topic, one at a time, and no more after the end."""

        def called(message: Any) -> None:
            with self._lock:
                if not self._has_ended:
                    act(message)

        rospy.Subscriber(topic, kind, called, queue_size=QUEUE, tcp_nodelay=True)

    def tick(self) -> None:
        """Is called twenty times a second."""

    def stop(self) -> None:
        """Bring to rest what this node moves: the last that it does."""

    def live(self) -> None:
        """Have `tick` done."""
        with self._lock:
            self.tick()

    def end(self) -> None:
        """Do the last, and nothing from then on."""
        with self._lock:
            self._has_ended = True
            self.stop()


def run(name: str, make: Callable[[], Node]) -> int:
    """Run a node until a signal, its own end or an error.

    Args:
        name: Of the node.
        make: Makes it.

    Returns:
        The exit status: 0 after a signal, 1 after an error, 2 for wrong parameters, or what the node says.
    """
    # Not an event: who waits for one holds its lock now and then, and a handler that sets it then waits forever.
    received: list[int] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        received.append(number)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, handle)
    rospy.init_node(name, disable_signals=True)
    try:
        node = make()
    except ParameterError as error:
        sys.stderr.write(f"{name}: {error}\n")
        return EXIT_USAGE
    while not received and not rospy.is_shutdown() and node.exit_status is None:
        node.live()
        time.sleep(_TICK_S)
    node.end()
    time.sleep(DELIVERY_S)
    rospy.signal_shutdown("it has ended")
    return node.exit_status or EXIT_OK
