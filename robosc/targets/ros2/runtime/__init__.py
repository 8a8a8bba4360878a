"""Modules that generated ROS 2 packages carry copies of; none of them imports ROS."""
