"""Modules that are copied into generated packages, beside those of `robosc.execution.runtime`."""
