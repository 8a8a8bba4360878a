"""Examination of a machine: what RoboSC needs there for a purpose, what is missing, and how to get it.

It reads files and starts programs with a time limit; it opens no serial line, starts no ROS node, and needs no package
beyond those that every command needs.
"""

from robosc.doctor.checks import Finding, Grade, Purpose, examine, is_ready
from robosc.doctor.machine import Machine, Output

__all__ = ["Finding", "Grade", "Machine", "Output", "Purpose", "examine", "is_ready"]
