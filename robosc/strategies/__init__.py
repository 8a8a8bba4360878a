"""Strategies: what a controller does next, of what its supervisor allows, so that the goals of its model come true."""

from robosc.strategies.synthesize import StrategyResult, synthesize_strategy

__all__ = ["StrategyResult", "synthesize_strategy"]
