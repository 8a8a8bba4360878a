"""
Modules that generated ROS 1 packages carry copies of, beside those of all ROS packages.

None of them imports ROS.
"""
