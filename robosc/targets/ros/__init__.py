"""Common parts of the targets for ROS 2 and ROS 1: the meaning of a model there, and modules of every node."""
