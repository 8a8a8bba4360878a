"""The twin behind ROS: the robot of `robosc_simulated` as the drivers of a TurtleBot3 show it to other nodes.

`ros2` serves it with rclpy; `ros1` with rospy, which runs under the system's Python and is therefore a process of its
own, `rospy_side`. What both share knows no ROS: `robot` says what is due and obeys velocities, `serving` is the loop.
"""
