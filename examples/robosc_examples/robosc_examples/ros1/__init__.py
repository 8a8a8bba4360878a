"""The nodes that the example robots need on ROS 1 (rospy), for the Python that ROS 1 was installed for (3.10 or later).

They do what the nodes of the same name do on ROS 2; arithmetic is shared with those.
"""
