"""`robosc-bridge ros2`: a program beside a bridge that publishes its readings as a ROS 2 node.

It watches the bridge over its service, like every other watcher, and gives no commands. A failure of ROS cannot affect
the process that drives the wheels, since that is another one. Only `node` uses rclpy, and only `messages` knows the
fields of messages.
"""
