"""The rospy side of the twin: run by the Python that ROS 1 was installed for, not by that of `robosc_bridge`.

It stands on rospy, its messages and the standard library alone, and on Python 3.8.
"""
