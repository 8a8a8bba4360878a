"""The pipeline as a Python API: what `import robosc` offers, one function for each command.

A thin layer: it loads models, passes them to the stages, and returns values that notebooks and terminals display. The
commands (`robosc.cli`) use it for everything that both need, and `robosc_client` returns the same results. The package
`robosc` exports its names, and imports their modules on use.
"""
