"""The C++ headers that every generated node runs on; `robot_` stands for the robot's prefix."""
