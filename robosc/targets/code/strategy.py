"""Memory and choices of a strategy, as statements that all languages share."""

from collections import Counter
from collections.abc import Collection, Iterable

from robosc.automata.executable import ExecutableSystem
from robosc.automata.goal_memory import MEMORY, Place, Tour
from robosc.supervisor import Choice, Strategy
from robosc.targets.code.conditions import Diagrams
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, integer, words_of
from robosc.targets.code.naming import Namer
from robosc.targets.code.statements import Assign, Block, Comment, Let, Return, when


def observing(
    executable: ExecutableSystem, scope: ExpressionWriter, namer: Namer, besides: Collection[str] = ()
) -> Block:
    """Return the statements that take in a stable state: all that is remembered changes at once.

    Args:
        executable: Executable system of the robot.
        scope: Writer of expressions over the state.
        namer: Namer of the function.
        besides: Names of places that other statements change.
    """
    obligations = executable.obligations
    locals_ = _Locals(namer)
    moving = {place for tour in obligations.tours for place in tour.places}
    kept = [
        (place, locals_.held("kept", scope.truth(place.update), always=True))
        for place in obligations.places
        if place not in moving and place.name not in besides
    ]
    kept += [item for tour in obligations.tours if tour.places for item in _moved(tour, scope, locals_)]
    assigned = [Assign(scope.variable_place(MEMORY, place.name), code) for place, code in kept]
    return [*locals_.read_by(code for _, code in kept), *assigned]


class _Locals:
    """Local variables, each with a value that is worked out once.

    Args:
        namer: Namer of the function.
    """

    def __init__(self, namer: Namer) -> None:
        self._namer = namer
        self._found: list[Let] = []
        self._numbers: Counter[str] = Counter()

    def held(self, word: str, code: Code, *, always: bool = False) -> Code:
        """Return the local variable that holds a condition; unless `always`, a constant stands for itself."""
        if code in (TRUE_CODE, FALSE_CODE) and not always:
            return code
        self._numbers[word] += 1
        local = code.held_in(self._namer.name(f"{word}_{self._numbers[word]}"))
        self._found.append(Let(local, code))
        return local

    def read_by(self, codes: Iterable[Code]) -> Block:
        """Return the declarations of those that some codes need: of others, compilers warn."""
        words = words_of(codes)
        needed: list[Let] = []
        for item in reversed(self._found):
            if item.place.word in words:
                needed.append(item)
                words |= words_of([item.value])
        return needed[::-1]


def _moved(tour: Tour, scope: ExpressionWriter, locals_: _Locals) -> list[tuple[Place, Code]]:
    """Return what the places of a tour become: the written-out updates would grow with the square of its length."""
    first, *later = (scope.truth(stage.here) for stage in tour.stages)
    here = [locals_.held("here", first), *later]
    passed = [locals_.held("passed", scope.truth(stage.is_passed)) for stage in tour.stages]
    asked = TRUE_CODE if tour.asked is None else locals_.held("asked", scope.truth(tour.asked))
    all_passed = TRUE_CODE if tour.stays else FALSE_CODE
    for item in passed:
        all_passed = scope.both(all_passed, item)
    stays = locals_.held("stays", all_passed)
    # The first round finds what comes from the last stage to the first one, the second one what comes to each stage.
    left = FALSE_CODE
    comes: list[Code] = []
    for _ in range(2):
        comes = []
        for is_here, is_passed in zip(here, passed, strict=True):
            comes.append(locals_.held("comes", scope.either(is_here, left)))
            left = scope.both(comes[-1], is_passed)
    found: list[tuple[Place, Code]] = []
    for number, place in enumerate(tour.places, start=1):
        ends = scope.both(comes[number], scope.negated(passed[number]))
        found.append((place, scope.both(asked, scope.either(ends, scope.both(here[number], stays)))))
    return found


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
