"""
Modules that are copied into generated ROS 2 packages, in addition to those of all ROS packages.

None of them imports ROS.
"""
