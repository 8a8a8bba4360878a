"""A process with a service and an action that ends in an orderly way in the middle of what it was asked for."""

import rclpy
from rclpy.action import ActionServer
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci


class _Dying(Exception):
    pass


def main() -> None:
    """Serve until the first request."""
    rclpy.init()
    node = rclpy.create_node("dying_server")
    goals: list[object] = []

    def die(*_: object) -> None:
        raise _Dying

    node.create_service(SetBool, "/power", die)
    # Accepted, and never executed.
    ActionServer(node, Fibonacci, "/count", die, handle_accepted_callback=goals.append)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not goals:
            executor.spin_once(timeout_sec=0.1)
    except _Dying:
        pass
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
