"""The command line: one module for each command, and modules for their common arguments and output."""
