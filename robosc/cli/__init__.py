"""The command line: one module per command, and what they print in common."""
