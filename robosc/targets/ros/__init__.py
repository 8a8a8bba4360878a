"""What the targets for ROS 2 and ROS 1 share: what a model means there, and modules that every node carries."""
