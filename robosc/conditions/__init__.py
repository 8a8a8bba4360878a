"""Conditions of a supervisor in words: short formulas of decision diagrams, and the summary that shows them."""
