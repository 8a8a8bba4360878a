"""The version of the distribution, stated once for the package, its files and its services."""

__version__ = "0.1.0"
