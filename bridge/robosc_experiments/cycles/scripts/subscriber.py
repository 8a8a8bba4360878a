"""Takes velocities on a topic until it is ended; a program of its own, for Python 3.8 and later.

Usage: subscriber.py rclpy|rospy TOPIC
"""

import sys
from contextlib import suppress

from geometry_msgs.msg import Twist

kind, topic = sys.argv[1:]
if kind == "rclpy":
    import rclpy
    from rclpy.executors import ExternalShutdownException

    rclpy.init()
    node = rclpy.create_node("measured_subscriber")
    node.create_subscription(Twist, topic, lambda message: None, 10)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)
else:
    import rospy

    rospy.init_node("measured_subscriber")
    rospy.Subscriber(topic, Twist, lambda message: None, queue_size=10)
    rospy.spin()
