"""A process with an action and a service that may be killed, and says on standard output what it is asked for.

Its arguments are the name of its node and options in JSON:

    accepts_after_s     time until it has accepted a goal, during which it does nothing else
    ends_after_s        time after which a goal succeeds; it never does by default
    result              "kept", or "unknown" or "none": it does not know the goal then, or never answers
    brakes_s            time until a goal that is cancelled has ended
"""

import json
import sys
import time
from typing import Any

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

FOREVER = 1e6


def say(*words: object) -> None:
    print(*words, flush=True)


def main() -> None:
    """Serve until it is killed."""
    name, options = sys.argv[1], json.loads(sys.argv[2])
    rclpy.init()
    node = rclpy.create_node(name)
    group = ReentrantCallbackGroup()

    def decide(_: Any) -> Any:
        say("goal")
        time.sleep(options.get("accepts_after_s", 0.0))
        return GoalResponse.ACCEPT

    def cancel(_: Any) -> Any:
        say("cancel")
        return CancelResponse.ACCEPT

    def execute(handle: Any) -> Any:
        say("driving")
        end_s = time.monotonic() + options.get("ends_after_s", FOREVER)
        while time.monotonic() < end_s:
            if handle.is_cancel_requested:
                time.sleep(options.get("brakes_s", 0.0))
                handle.canceled()
                say("stands")
                return Fibonacci.Result()
            time.sleep(0.02)
        handle.succeed()
        say("arrived")
        return Fibonacci.Result()

    def reach(_: Any, response: Any) -> Any:
        say("called")
        time.sleep(FOREVER)
        return response

    server = ActionServer(
        node, Fibonacci, "/go", execute, callback_group=group, goal_callback=decide, cancel_callback=cancel
    )
    kind = options.get("result", "kept")
    if kind != "kept":
        handle_result = server._execute_get_result_request

        async def lose(header_and_request: Any) -> None:
            if kind == "unknown":
                header_and_request[1].goal_id.uuid = [0] * 16
                await handle_result(header_and_request)

        server._execute_get_result_request = lose
    node.create_service(SetBool, "/reach", reach, callback_group=group)
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    say("up")
    executor.spin()


if __name__ == "__main__":
    main()
