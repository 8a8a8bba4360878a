"""Builds and checks the goals and assumptions of a robot."""

from collections.abc import Iterable

from robosc.language import syntax
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.places import Places
from robosc.model.structure import Assumption, Goal, GoalForm


def build_goals(
    items: Iterable[syntax.Item], checker: ExpressionChecker, places: Places
) -> tuple[tuple[Goal, ...], tuple[Assumption, ...]]:
    """The goals and assumptions of the model that are sound, in source order; notes where they stand.

    Args:
        items: Definitions of the robot; imports bring no goals.
        checker: Checker that resolves expressions of the robot.
        places: Places to which those of the sound ones are added.
    """
    goals: list[Goal] = []
    assumptions: list[Assumption] = []
    for item in items:
        if not isinstance(item, syntax.Goal | syntax.Assumption):
            continue
        trigger = None if item.trigger is None else checker.condition(item.trigger)
        condition = checker.condition(item.condition)
        if condition is None or (trigger is None and item.trigger is not None):
            continue
        form = GoalForm(item.form)
        if isinstance(item, syntax.Goal):
            goals.append(Goal(form, condition, trigger))
            places.goals.append(item.location)
        else:
            assumptions.append(Assumption(form, condition, trigger, item.is_allowed))
            places.assumptions.append(item.location)
    return tuple(goals), tuple(assumptions)


__all__ = ["build_goals"]
