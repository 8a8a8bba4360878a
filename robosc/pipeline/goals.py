"""Goals and visits of a supervisor and what its strategy chooses for them, in the model's words."""

from collections.abc import Iterable
from dataclasses import dataclass

from robosc.conditions.goals import Formula, aims_in_words, assumptions_in_words, goals_in_words
from robosc.conditions.literals import Vocabulary
from robosc.conditions.summary import ELSEWHERE, MEANWHILE, condition_line, short_diagrams
from robosc.pipeline.conditions import Condition
from robosc.pipeline.results import GoalSummary
from robosc.supervisor import Supervisor
from robosc.supervisor.diagram import diagram_domains
from robosc.tables import html_table


@dataclass(frozen=True, slots=True, repr=False)
class Choice(Condition):
    """Request that a strategy chooses, with the condition for it: the first of a goal whose condition is true."""

    def __repr__(self) -> str:
        return f"<{self.event} where {self.text}>"


@dataclass(frozen=True, slots=True, repr=False)
class GoalApproach:
    """Goal, or visit of a mission, with what the strategy does to reach it.

    Attributes:
        name: Name: `goal 1`, `visit 2 of mission rounds`, `visit 1 of detour 1 of mission rounds`.
        goal: The goal, or the visit's condition, as a user writes it.
        choices: Choices in the order in which they are tried; where none applies, the controller waits.
        meanwhile: Choices for other goals, tried where it would wait for the surroundings.
    """

    name: str
    goal: str
    choices: tuple[Choice, ...]
    meanwhile: tuple[Choice, ...] = ()

    def __repr__(self) -> str:
        requests = ", ".join(item.event for item in (*self.choices, *self.meanwhile)) or "nothing"
        return f"<{self.title}: requests {requests}>"

    def __str__(self) -> str:
        return "\n".join([f"{self.title}:", *(f"  {event} {text}" for event, text in self.rows())])

    @property
    def is_visit(self) -> bool:
        """True for a visit of a mission or of a detour."""
        return self.name.startswith("visit ")

    @property
    def title(self) -> str:
        """The goal as a user writes it; of a visit also its name."""
        return f"{self.name}, {self.goal}" if self.is_visit else self.goal

    def rows(self) -> list[tuple[str, str]]:
        """Each choice with its condition, and at last when nothing is requested, if there is such a case."""
        every = (*self.choices, *self.meanwhile)
        short = short_diagrams(item.diagram for item in every if item.formula is None)
        rows: list[tuple[str, str]] = []
        for number, item in enumerate(every):
            has_text = item.formula is not None or item.diagram in short
            text = f"where {item if has_text else f'{item.text}{ELSEWHERE}'}"
            if number < len(self.choices):
                rows.append((item.event, ("otherwise" if rows else "always") if item.adds_nothing else text))
            else:
                rows.append((item.event, MEANWHILE if item.adds_nothing else f"{MEANWHILE}, {text}"))
        if not any(item.adds_nothing for item in every):
            rows.append(("nothing", "otherwise" if rows else "at all"))
        return rows


class Goals(tuple[GoalApproach, ...]):
    """The goals of a supervisor, then the visits of its missions, each with what its strategy chooses for it."""

    __slots__ = ()

    def __new__(cls, goals: Iterable[GoalApproach] = ()) -> "Goals":
        """Goals in their order."""
        return super().__new__(cls, tuple(goals))

    def __repr__(self) -> str:
        visits = sum(item.is_visit for item in self)
        counts = (("goal", len(self) - visits), ("visit", visits))
        found = [f"{count} {word}{'s' if count != 1 else ''}" for word, count in counts if count]
        return f"<{' and '.join(found) or 'no goals'}>"

    def __str__(self) -> str:
        return "\n".join(map(str, self)) or "no goals"

    def _repr_html_(self) -> str:
        rows = [(item.name, item.goal, event, text) for item in self for event, text in item.rows()]
        return html_table(("", "goal or visit", "the strategy requests", ""), rows)


def goals_of(supervisor: Supervisor) -> Goals:
    """Return the goals and visits of a supervisor with the choices of its strategy; empty where it has none."""
    components = frozenset(item.name for item in supervisor.model.components)
    found = goals_in_words(supervisor)
    if not found:
        return Goals()
    vocabulary = Vocabulary(diagram_domains(supervisor.executable.remembering_automata), components)

    def written(choices: Iterable[Formula]) -> tuple[Choice, ...]:
        return tuple(
            Choice(event, condition_line(diagram, formula, components), formula, diagram, vocabulary)
            for event, diagram, formula in choices
        )

    return Goals(GoalApproach(item.name, item.text, written(item.choices), written(item.meanwhile)) for item in found)


def goal_summary(supervisor: Supervisor) -> GoalSummary | None:
    """Return the goals of a supervisor's robot in figures and words; None where it has none."""
    aims = tuple(
        words if aim.mission is None else f"{words} ({name})"
        for aim, (name, words) in zip(supervisor.executable.obligations.aims, aims_in_words(supervisor), strict=True)
    )
    if not aims:
        return None
    assumptions = tuple(words for _, words in assumptions_in_words(supervisor.model))
    strategy = supervisor.strategy
    return GoalSummary(aims, assumptions, strategy is not None, 0 if strategy is None else len(strategy.modes))
