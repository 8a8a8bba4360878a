"""The files that a new robot begins with: a model that teaches the language, its library, and what to do next."""

from robosc.starter.starter import MAXIMUM_STEM, InvalidNameError, Starter, make_starter

__all__ = ["MAXIMUM_STEM", "InvalidNameError", "Starter", "make_starter"]
