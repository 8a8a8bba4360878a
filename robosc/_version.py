"""The version of the distribution, and its year, stated once for the package, its files and its services."""

__version__ = "0.1.0"

YEAR = "2026"
"""Year of this version, which generated files name instead of the clock's: they never change by themselves."""
