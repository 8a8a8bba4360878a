"""Modular synthesis: supervisors of parts of a system, which together are the supervisor of all of it.

A part is what shares events or reads each other; a module has the parts that some requirements are about. The modules
are those of a tree that clusters of a dependency structure matrix make, each has a supervisor of its own, and whether
these block each other is found out on abstractions. Modules that do become one.
"""
