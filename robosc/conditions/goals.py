"""Goals and assumptions in the words of the language, and what a strategy chooses for each goal."""

from dataclasses import dataclass

from robosc.conditions.rendering import Formulas, in_words
from robosc.expressions import Expression
from robosc.model.structure import Assumption, Goal, GoalForm, Model
from robosc.supervisor import DecisionDiagram, Supervisor
from robosc.supervisor.diagram import diagram_domains

Formula = tuple[str, DecisionDiagram, Expression | None]
"""Event with a condition on it, and the condition's formula where there is one that reads well."""


@dataclass(frozen=True, slots=True)
class GoalInWords:
    """Goal with what the strategy chooses to approach it.

    Attributes:
        text: The goal, as a user writes it.
        choices: Requests in the order in which they are tried, each with the condition for choosing it.
    """

    text: str
    choices: tuple[Formula, ...]


def goal_text(goal: Goal) -> str:
    """Return a goal as a user writes it, without the word `goal`."""
    return _aim_text(goal)


def assumption_text(assumption: Assumption) -> str:
    """Return an assumption as a user writes it, without the word `assume`."""
    return f"{'allow ' if assumption.is_allowed else ''}{_aim_text(assumption)}"


def aims_in_words(model: Model) -> tuple[tuple[str, str], ...]:
    """Return name and words of what the strategy of a model aims at, in the order of its modes."""
    return tuple((f"goal {number}", goal_text(goal)) for number, goal in enumerate(model.goals, start=1))


def assumptions_in_words(model: Model) -> tuple[tuple[str, str], ...]:
    """Return name and words of each assumption of a model."""
    return tuple((f"assumption {number}", _aim_text(item)) for number, item in enumerate(model.assumptions, start=1))


def goals_in_words(supervisor: Supervisor) -> tuple[GoalInWords, ...]:
    """Return each goal of a supervisor with what its strategy chooses; nothing where it has no strategy."""
    if supervisor.strategy is None:
        return ()
    formulas = Formulas(diagram_domains(supervisor.executable.remembering_automata))
    return tuple(
        GoalInWords(
            goal_text(goal),
            tuple((choice.event, choice.condition, formulas.formula(choice.condition)) for choice in mode),
        )
        for goal, mode in zip(supervisor.model.goals, supervisor.strategy.modes, strict=True)
    )


def _aim_text(aim: Goal | Assumption) -> str:
    condition = in_words(aim.condition, ())
    if aim.trigger is not None:
        return f"{in_words(aim.trigger, ())} {GoalForm.LEADS_TO} {condition}"
    return f"{aim.form} {condition}"
