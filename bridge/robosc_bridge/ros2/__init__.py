"""`robosc-bridge ros2`: a program beside a bridge that publishes its readings as a ROS 2 node.

It watches the bridge over its service, as every other watcher does, and commands nothing: what happens to ROS happens
in another process than the one that drives the wheels. Only `node` knows rclpy, only `messages` the messages' fields.
"""
