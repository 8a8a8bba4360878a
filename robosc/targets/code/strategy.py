"""Memory and choices of a strategy, as statements that all languages share."""

from robosc.automata.executable import ExecutableSystem
from robosc.automata.goal_memory import MEMORY
from robosc.supervisor import Choice, Strategy
from robosc.targets.code.conditions import Diagrams
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import Code, integer
from robosc.targets.code.naming import Namer
from robosc.targets.code.statements import Assign, Block, Comment, Let, Return, Statement, when


def observing(executable: ExecutableSystem, scope: ExpressionWriter, namer: Namer) -> Block:
    """Return the statements that take in a stable state: all that is remembered changes at once."""
    places = executable.obligations.places
    held = [(place, scope.truth(place.update)) for place in places]
    kept = [(place, code.held_in(namer.name(f"kept_{number}"))) for number, (place, code) in enumerate(held, start=1)]
    found: list[Statement] = [Let(local, code) for (_, local), (_, code) in zip(kept, held, strict=True)]
    return [*found, *(Assign(scope.variable_place(MEMORY, place.name), local) for place, local in kept)]


def seen(executable: ExecutableSystem, scope: ExpressionWriter) -> list[Code]:
    """Return the conditions on a stable state that was taken in that executors keep account of.

    For each aim, then each assumption, that it is met; for each visit that its mission or detour is at it; for each
    mission that every visit of its own is true.
    """
    obligations = executable.obligations
    here = (aim.here for aim in obligations.aims if aim.here is not None)
    aims = (aim.condition for aim in obligations.aims)
    return [scope.truth(item) for item in (*aims, *obligations.assumptions, *here, *obligations.rounds)]


def choosing(executable: ExecutableSystem, strategy: Strategy, number: int, diagrams: Diagrams, nothing: Code) -> Block:
    """Return the statements that choose a request, by its number, so that a goal is approached.

    Args:
        executable: Executable system of the robot.
        strategy: Its strategy.
        number: Number of the goal or visit.
        diagrams: Writer of the conditions.
        nothing: Result where nothing is chosen.
    """
    found = [item for choice in strategy.modes[number] for item in _chosen(executable, choice, diagrams)]
    return [*found, Return(nothing)]


def _chosen(executable: ExecutableSystem, choice: Choice, diagrams: Diagrams) -> Block:
    words, condition = diagrams.described(choice.condition)
    request = executable.requests.index(choice.event)
    return [Comment(f"{choice.event}: {words}"), when(condition, Return(integer(request)))]
