"""The pipeline as a Python API: what `import robosc` offers, one function for each command.

A thin layer: it loads models, passes them to the stages and gives back values that show themselves to people. The
commands (`robosc.cli`) stand on it where both need the same, and its results are those of `robosc_client`, too. Its
names are offered by `robosc` itself, which imports their modules on use.
"""
