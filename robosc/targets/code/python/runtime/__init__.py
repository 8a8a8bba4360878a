"""Modules that generated packages carry copies of, beside those of `robosc.execution.runtime`."""
