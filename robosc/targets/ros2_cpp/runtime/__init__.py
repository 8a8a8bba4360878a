"""The C++ headers that nodes on rclcpp run on."""
