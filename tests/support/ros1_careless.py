"""An existing controller that knows of no supervision layer and cares for nothing: it drives, whatever happens.

Run by Debian's Python. It says on standard output what it received, one JSON document a line.
"""

import json
import threading
import time
from typing import Any

import rospy
from actionlib import ActionClient, CommState
from actionlib.msg import TestAction, TestGoal
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool

PERIOD_S = 0.02
SPEED = 0.3
TIMES = 30
PAUSE_S = 0.2

_writing = threading.Lock()


def report(what: str, data: Any) -> None:
    with _writing:
        print(json.dumps([what, data]), flush=True)


def ask() -> None:
    """Ask again and again: the answer to the first request may be lost, since connections are new then."""
    client = ActionClient("/count", TestAction)
    power = rospy.ServiceProxy("/power", SetBool)
    rospy.wait_for_service("/power")
    client.wait_for_server()
    for _ in range(TIMES):
        report("reply", power(True).success)
        ended = threading.Event()

        def changed(handle: Any, ended: threading.Event = ended) -> None:
            if handle.get_comm_state() == CommState.DONE:
                report("goal", handle.get_goal_status())
                ended.set()

        handle = client.send_goal(TestGoal(goal=3), changed)
        ended.wait()
        del handle
        time.sleep(PAUSE_S)


def main() -> None:
    rospy.init_node("careless")
    velocities = rospy.Publisher("cmd_vel", Twist, queue_size=10)
    rospy.Subscriber("/scan", LaserScan, lambda scan: report("scan", list(scan.ranges)))
    threading.Thread(target=ask, daemon=True).start()
    velocity = Twist()
    velocity.linear.x = SPEED
    rate = rospy.Rate(1.0 / PERIOD_S)
    while not rospy.is_shutdown():
        velocities.publish(velocity)
        rate.sleep()


if __name__ == "__main__":
    main()
