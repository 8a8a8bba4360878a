"""Parts of every helper node: checked parameters, an orderly end, one clear line for what goes wrong.

rclpy's own answer to a signal is to make its context invalid, before any code of ours runs: a zero velocity could not
be published any more, and the robot would go on. So the signals are ours: they end the loop, the node brings its robot
to rest, and only then the context goes.
"""

import difflib
import signal
import sys
import time
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import get_rmw_implementation_identifier

SPIN_S = 0.1
DELIVERY_S = 0.5
ACKNOWLEDGING = ("rmw_fastrtps", "rmw_cyclonedds", "rmw_connextdds")
"""Middlewares that say when a message has arrived; Zenoh says so at once, and others are not known."""
UNACKNOWLEDGED_S = 0.3
EXIT_OK = 0
EXIT_FAULT = 1
EXIT_USAGE = 2


class ParameterError(Exception):
    """A parameter has a wrong value; says which and what it may be."""


class HelperNode(Node):  # type: ignore[misc]  # rclpy has no types
    """A node with checked parameters.

    Args:
        name: Its name.

    Attributes:
        exit_status: None while it runs; a node that is done sets its exit status.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.exit_status: int | None = None
        # Steady: a jump of the computer's time must not make a sensor young again.
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)

    def number(self, name: str, default: float, minimum: float, maximum: float, meaning: str) -> float:
        """The value of a parameter that is a number.

        Raises:
            ParameterError: It is none, or out of its range.
        """
        value = self._declared(name, default, meaning)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not minimum <= value <= maximum:
            raise ParameterError(
                f"parameter '{name}' is {value!r}; it must be a number from {minimum:g} to {maximum:g}"
            )
        return float(value)

    def count(self, name: str, default: int, minimum: int, maximum: int, meaning: str) -> int:
        """The value of a parameter that is a whole number.

        Raises:
            ParameterError: It is none, or out of its range.
        """
        value = self.number(name, default, minimum, maximum, meaning)
        if not value.is_integer():
            raise ParameterError(f"parameter '{name}' is {value:g}; it must be a whole number")
        return int(value)

    def text(self, name: str, default: str, meaning: str, choices: Sequence[str] = ()) -> str:
        """The value of a parameter that is a text, one of the choices if there are any.

        Raises:
            ParameterError: It is none, or none of the choices.
        """
        value = self._declared(name, default, meaning)
        if not isinstance(value, str) or (choices and value not in choices):
            wanted = "one of " + ", ".join(repr(choice) for choice in choices) if choices else "a text"
            raise ParameterError(f"parameter '{name}' is {value!r}; it must be {wanted}")
        return value

    def texts(self, name: str, default: Sequence[str], meaning: str) -> list[str]:
        """The value of a parameter that is a list of texts; empty texts count for nothing.

        Raises:
            ParameterError: It is none.
        """
        # An empty list has no type that ROS 2 knows.
        value = self._declared(name, list(default) or [""], meaning)
        if not isinstance(value, list | tuple) or not all(isinstance(item, str) for item in value):
            raise ParameterError(f"parameter '{name}' is {value!r}; it must be a list of texts")
        return [item for item in value if item]

    def _declared(self, name: str, default: object, meaning: str) -> Any:
        # Dynamic: a wrong type gets our one line, and 1 is as good as 1.0.
        descriptor = ParameterDescriptor(description=meaning, dynamic_typing=True, read_only=True)
        return self.declare_parameter(name, default, descriptor).value

    def warn_of_unknown_parameters(self) -> None:
        """A misspelt parameter would leave a default in force; one file may serve several nodes, so it is no error."""
        known = list(self._parameters)
        for name in sorted(self._parameter_overrides):
            if name not in known and not name.startswith("qos_overrides."):
                near = difflib.get_close_matches(name, known, n=1)
                hint = f"; did you mean '{near[0]}'?" if near else ""
                self.get_logger().warning(f"there is no parameter '{name}'{hint}")

    def now_s(self) -> float:
        """Seconds on the steady clock."""
        return float(self.steady.now().nanoseconds) / 1e9

    def every(self, period_s: float, act: Callable[[], None]) -> None:
        """Call something again and again, on the steady clock."""
        self.create_timer(period_s, act, clock=self.steady)

    def stop(self) -> None:
        """Bring to rest what this node moves: the last that it does."""

    def wait_until_delivered(self) -> None:
        """Give what was sent last the time to arrive."""
        for publisher in self.publishers:
            publisher.wait_for_all_acked(Duration(seconds=DELIVERY_S))
        if not get_rmw_implementation_identifier().startswith(ACKNOWLEDGING):
            time.sleep(UNACKNOWLEDGED_S)


class Signals:
    """Signals end the loop instead of the process, also where the terminal is closed."""

    def __init__(self) -> None:
        self.have_come = False
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, self._handle)

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self.have_come = True


def _complain(name: str, text: object) -> None:
    sys.stderr.write(f"{name}: {' '.join(str(text).split())}\n")


def run(name: str, make: Callable[[], HelperNode], args: Sequence[str] | None = None) -> int:
    """Run a node until a signal, its own end or an error.

    Args:
        name: Name of the node in error lines.
        make: Function that makes the node.
        args: The command line; None for the program's own.

    Returns:
        The exit status: 0 after a signal, 1 after an error, 2 for wrong parameters, or what the node says.
    """
    signals = Signals()
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
        node.warn_of_unknown_parameters()
    except ParameterError as error:
        _complain(name, error)
        rclpy.try_shutdown()
        return EXIT_USAGE
    except Exception as error:
        _complain(name, f"cannot start: {error}")
        rclpy.try_shutdown()
        return EXIT_USAGE
    spinner = SingleThreadedExecutor()
    spinner.add_node(node)
    status = EXIT_OK
    try:
        while not signals.have_come and node.exit_status is None:
            spinner.spin_once(timeout_sec=SPIN_S)
        status = node.exit_status or EXIT_OK
    except Exception as error:
        _complain(name, f"{type(error).__name__}: {error}")
        status = EXIT_FAULT
    try:
        node.stop()
        node.wait_until_delivered()
    except Exception as error:
        _complain(name, f"{type(error).__name__}: {error}")
        status = EXIT_FAULT
    spinner.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return status
