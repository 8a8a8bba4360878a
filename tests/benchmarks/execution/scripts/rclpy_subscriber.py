"""Takes what comes on /cmd_vel, until it is killed."""

import rclpy
from geometry_msgs.msg import Twist

rclpy.init()
node = rclpy.create_node("subscriber")
node.create_subscription(Twist, "/cmd_vel", lambda message: None, 10)
rclpy.spin(node)
