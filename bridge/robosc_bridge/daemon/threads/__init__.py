"""Threads of the devices, the steps that they take, and what they report to the loop."""
