"""Strategies: what a controller does next, of what its supervisor allows, so that the goals of its model come true."""

from robosc.strategies.blame import GoalBlame, blame_goals
from robosc.strategies.counter_strategy import CounterPlayer, CounterStrategy
from robosc.strategies.findings import goal_findings, goals_and_missions, layer_goal_findings, put_off_findings
from robosc.strategies.synthesize import StrategyResult, synthesize_strategy

__all__ = [
    "CounterPlayer",
    "CounterStrategy",
    "GoalBlame",
    "StrategyResult",
    "blame_goals",
    "goal_findings",
    "goals_and_missions",
    "layer_goal_findings",
    "put_off_findings",
    "synthesize_strategy",
]
