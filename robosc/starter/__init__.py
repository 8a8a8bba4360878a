"""The first files of a new robot: a model that teaches the language, its library, and a text on the next steps."""

from robosc.starter.starter import MAXIMUM_STEM, InvalidNameError, Starter, make_starter

__all__ = ["MAXIMUM_STEM", "InvalidNameError", "Starter", "make_starter"]
