"""Strategies: what a controller does next, of what its supervisor allows, so that the goals of its model come true.

The names are imported on use: a model without goals needs next to nothing of it.
"""

from typing import TYPE_CHECKING

from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc.strategies.blame import GoalBlame, blame_goals
    from robosc.strategies.counter_strategy import CounterPlayer, CounterStrategy
    from robosc.strategies.findings import goal_findings, goals_and_missions, layer_goal_findings, put_off_findings
    from robosc.strategies.synthesize import StrategyResult, synthesize_strategy

_HOMES = {
    "CounterPlayer": "counter_strategy",
    "CounterStrategy": "counter_strategy",
    "GoalBlame": "blame",
    "StrategyResult": "synthesize",
    "blame_goals": "blame",
    "goal_findings": "findings",
    "goals_and_missions": "findings",
    "layer_goal_findings": "findings",
    "put_off_findings": "findings",
    "synthesize_strategy": "synthesize",
}

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

if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)
