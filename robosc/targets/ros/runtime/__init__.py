"""Modules that are copied into generated ROS packages; none of them imports ROS."""
