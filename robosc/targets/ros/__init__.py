"""Common parts of the targets for ROS 2 and ROS 1: meaning of a model there, and modules that every node carries."""
