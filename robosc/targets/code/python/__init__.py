"""Python code of a supervisor: its module, for the target `python` and for packages in Python."""
