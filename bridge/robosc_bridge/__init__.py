"""The bridge: runs a supervisor without ROS and talks to motors and scanners over serial lines.

Bytes are kept apart from their meaning: `transport` (bytes on a line) and `protocol` (frames: pure functions) are
below `devices` (drive bases and range scanners); `simulated` holds the other ends of the lines, which share no code
with them.
"""
