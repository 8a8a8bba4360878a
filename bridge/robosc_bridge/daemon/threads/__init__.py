"""Threads of the devices, their steps, and their reports to the loop."""
