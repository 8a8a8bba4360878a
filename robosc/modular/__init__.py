"""Modular synthesis: supervisors of parts of a system, which together are the supervisor of the whole system.

A part is a group of plants that share events or read each other. A module has the parts that some requirements are
about. Clusters of a dependency structure matrix form a tree, whose nodes are the modules. Each module has a supervisor
of its own. Abstractions show whether the modules block each other; modules that do are merged into one.
"""
