"""The robot of a bridge, shown to ROS 2; the supervisor keeps command of the wheels."""
