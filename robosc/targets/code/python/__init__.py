"""Python of a supervisor: its module, which the target `python` and packages in Python hold."""
