"""Modules that generated ROS packages carry copies of; none of them imports ROS."""
