"""
Modules that are copied into generated ROS 1 packages, in addition to those of all ROS packages.

None of them imports ROS. `defaults`, `remapping`, `servers` and `goals` have siblings for ROS 2,
which stay apart: how messages tell the types of their fields, what an action is made of, and how
goals and calls are kept, differs with the client library.
"""
