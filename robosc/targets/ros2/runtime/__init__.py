"""
Modules that generated ROS 2 packages carry copies of, beside those of all ROS packages.

None of them imports ROS.
"""
