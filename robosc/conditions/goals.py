"""Goals, visits and assumptions in the words of the language, and what a strategy chooses for each goal and visit."""

from collections.abc import Iterable

import msgspec

from robosc.conditions.rendering import Formulas, in_words
from robosc.expressions import Expression
from robosc.model.structure import Assumption, Goal, GoalForm, Model
from robosc.supervisor import Choice, DecisionDiagram, Supervisor
from robosc.supervisor.diagram import diagram_domains

Formula = tuple[str, DecisionDiagram, Expression | None]
"""Event with a condition on it, and the condition's formula where there is one that reads well."""


class GoalInWords(msgspec.Struct, frozen=True):
    """Goal, or visit of a mission, with what the strategy chooses to approach it.

    Attributes:
        name: Name, such as `goal 1` or `visit 2 of mission rounds`.
        text: The goal, or the visit's condition, as a user writes it.
        choices: Requests in the order in which they are tried, each with the condition for choosing it.
        meanwhile: Requests for other goals, tried after them, while this one waits for the surroundings.
    """

    name: str
    text: str
    choices: tuple[Formula, ...]
    meanwhile: tuple[Formula, ...]


def goal_text(goal: Goal) -> str:
    """Return a goal as a user writes it, without the word `goal`."""
    return _aim_text(goal)


def assumption_text(assumption: Assumption) -> str:
    """Return an assumption as a user writes it, without the word `assume`."""
    return f"{'allow ' if assumption.is_allowed else ''}{_aim_text(assumption)}"


def aims_in_words(supervisor: Supervisor) -> tuple[tuple[str, str], ...]:
    """Return name and words of each goal and visit of a supervisor's model, in the order of a strategy's modes."""
    return tuple(
        (aim.name, goal_text(supervisor.model.goals[aim.number]) if aim.visit is None else in_words(aim.visit, ()))
        for aim in supervisor.executable.obligations.aims
    )


def assumptions_in_words(model: Model) -> tuple[tuple[str, str], ...]:
    """Return name and words of each assumption of a model."""
    return tuple((f"assumption {number}", _aim_text(item)) for number, item in enumerate(model.assumptions, start=1))


def goals_in_words(supervisor: Supervisor) -> tuple[GoalInWords, ...]:
    """Return each goal and visit of a supervisor with what its strategy chooses; nothing where it has no strategy."""
    if supervisor.strategy is None:
        return ()
    formulas = Formulas(diagram_domains(supervisor.executable.remembering_automata))

    def written(mode: Iterable[Choice]) -> tuple[Formula, ...]:
        return tuple((choice.event, choice.condition, formulas.formula(choice.condition)) for choice in mode)

    return tuple(
        GoalInWords(
            name,
            words,
            written(choice for choice in mode if not choice.is_meanwhile),
            written(choice for choice in mode if choice.is_meanwhile),
        )
        for (name, words), mode in zip(aims_in_words(supervisor), supervisor.strategy.modes, strict=True)
    )


def goals_and_visits(supervisor: Supervisor) -> str:
    """Return a word for what the strategy of a supervisor approaches: goals, visits or both."""
    model = supervisor.model
    return " and ".join(word for word, items in (("goals", model.goals), ("visits", model.missions)) if items)


def _aim_text(aim: Goal | Assumption) -> str:
    condition = in_words(aim.condition, ())
    if aim.trigger is not None:
        return f"{in_words(aim.trigger, ())} {GoalForm.LEADS_TO} {condition}"
    return f"{aim.form} {condition}"
