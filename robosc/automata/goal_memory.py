"""Memory that a strategy keeps beside the state: what has been judged in stable states so far.

Each place of it is a truth value. In every stable state it becomes a function of itself and of that state; the
executor and the game observe it at the same moments. Observing a state twice changes nothing.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING

import msgspec

from robosc.automata.compile import subjects_read
from robosc.automata.state import Subject
from robosc.automata.structure import Automaton, DiscreteVariable, System
from robosc.expressions import FALSE, TRUE, Binary, BooleanType, Expression, StateTest, Unary, VariableRead, conjunction
from robosc.model.structure import Assumption, Detour, EventKind, Goal, GoalForm, Mission

if TYPE_CHECKING:
    from robosc.automata.executable import ExecutableSystem

MEMORY = "goal memory"
"""Name of the automaton whose variables are the memory: no component can be called so."""


class Place(msgspec.Struct, frozen=True):
    """A truth value that is remembered.

    Attributes:
        name: Its name, unique in the memory: words that say that it is true, with `is` or `was` in them.
        update: Its value after a stable state, as a condition over that state and the memory before.
    """

    name: str
    update: Expression

    @property
    def read(self) -> Expression:
        """The condition that it is true."""
        return VariableRead(MEMORY, self.name)

    @property
    def judged(self) -> Expression:
        """A condition that reads it with all that decides about it."""
        return Binary("and", self.read, self.update)


class Judgement(msgspec.Struct, frozen=True):
    """A goal or an assumption as a condition that is to be true again and again.

    Attributes:
        condition: Condition over the state and the memory.
        place: Place of the memory that it needs, or None.
    """

    condition: Expression
    place: Place | None = None


def judgement(item: Goal | Assumption, name: str) -> Judgement:
    """Return a goal or an assumption as a condition that is to be true again and again.

    `P leads to E` waits for an answer from a stable state in which P is true up to one in which E is true.

    Args:
        item: The goal or assumption.
        name: Its name, such as `goal 1`.
    """
    condition = holds(item.condition)
    if item.form is GoalForm.ALWAYS_EVENTUALLY:
        return Judgement(condition)
    if item.form is GoalForm.ONCE:
        name = f"{name} was reached"
        place = Place(name, Binary("or", VariableRead(MEMORY, name), condition))
        return Judgement(place.read, place)
    name = f"{name} is owed"
    trigger = TRUE if item.trigger is None else holds(item.trigger)
    waiting = Binary("and", Binary("or", VariableRead(MEMORY, name), trigger), Unary("not", condition))
    place = Place(name, waiting)
    return Judgement(Unary("not", place.read), place)


def holds(condition: Expression) -> Expression:
    """Return the condition that another one is true, and not unknown."""
    return Unary("holds", condition)


class Cancel(msgspec.Struct, frozen=True):
    """A cancel that the executor asks for by itself, where a requirement held since the request and does not any more.

    Asking is no event. The goal may end as cancelled from then on: that is the cancel event, if the supervisor allows
    it, and a move of the surroundings. What is remembered is exact in stable states. Where silent steps can change what
    a requirement reads, it may have fallen before them and hold again: that is not remembered, but counted as possible.

    Attributes:
        event: The cancel event.
        held: For each requirement of the action, the place that remembers that it held since the request; of no
            requirement once the cancel was asked for.
        asked: Place that remembers that the cancel was asked for.
        passing: For each requirement, True if silent steps can change what it reads.
    """

    event: str
    held: tuple[Place, ...]
    asked: Place
    passing: tuple[bool, ...]

    @property
    def places(self) -> tuple[Place, ...]:
        """Its places of the memory."""
        return (*self.held, self.asked)

    @property
    def may_end(self) -> Expression:
        """Condition over a stable state and the memory that the cancel may have been asked for."""
        unseen = [place.read for place, passes in zip(self.held, self.passing, strict=True) if passes]
        return _any((self.asked.read, *unseen))


def own_cancels(executable: "ExecutableSystem") -> Iterator[Cancel]:
    """Yield the cancels that the executor may ask for, in source order."""
    changed = _changed_silently(executable)
    for event in executable.events.values():
        if event.kind is not EventKind.CANCEL or not event.moves or not event.communication:
            continue
        requirements = executable.model.requirements_on(event.communication.name)
        if not requirements:
            continue
        (location,) = event.moves.targets
        running = StateTest(event.moves.plant, location)
        action = event.communication.name
        conditions = [holds(item.condition) for item in requirements]
        names = [f"requirement {number} of {action} was met" for number, _ in enumerate(conditions, start=1)]
        pairs = list(zip(map(_remembered, names), conditions, strict=True))
        fallen = _any(Binary("and", held, Unary("not", condition)) for held, condition in pairs)
        name = f"the cancel of {action} was asked for"
        is_asked = Binary("or", _remembered(name), fallen)
        going_on = Binary("and", running, Unary("not", is_asked))
        yield Cancel(
            event.name,
            tuple(
                Place(place, Binary("and", going_on, Binary("or", held, condition)))
                for place, (held, condition) in zip(names, pairs, strict=True)
            ),
            Place(name, Binary("and", running, is_asked)),
            tuple(not changed.isdisjoint(subjects_read(condition)) for condition in conditions),
        )


def _changed_silently(executable: "ExecutableSystem") -> set[Subject]:
    """Return what resets and taus can change."""
    silent = set(executable.resets_and_taus)
    found: set[Subject] = set()
    for automaton in executable.executed_automata.automata:
        for edge in automaton.edges:
            if edge.event in silent:
                found.update(Subject(automaton.name, update.variable) for update in edge.updates)
                if edge.source != edge.target:
                    found.add(Subject(automaton.name))
    return found


def remembering(system: System, places: Sequence[Place]) -> System:
    """Return a system with a memory beside it, which no event moves."""
    variables = tuple(DiscreteVariable(place.name, BooleanType(), (False,)) for place in places)
    memory = Automaton(MEMORY, ("only",), ("only",), frozenset({"only"}), frozenset(), (), variables)
    return replace(system, automata=(*system.automata, memory))


class AimKind(StrEnum):
    """Kind of an aim."""

    GOAL = "goal"
    VISIT = "visit"
    DETOUR_VISIT = "visit of a detour"


class Aim(msgspec.Struct, frozen=True):
    """A goal, or a visit of a mission or of one of its detours: the strategy has one mode for each.

    Attributes:
        name: Name in words, unique in the model: `goal 1`, `visit 2 of mission rounds`.
        kind: Kind.
        condition: Condition over the state and the memory that is to be true again and again.
        number: Number of the goal from 0; of a visit in its mission, where those of detours follow its own.
        mission: Number of the mission from 0; None for a goal.
        visit: Condition that the visit is about, as it is written; None for a goal.
        here: Condition over the state and the memory that the mission or detour is at the visit; None for a goal.
        interruption: Condition over the state and the memory under which the visit is not asked for: its mission is
            not, or a detour is under way. None if there is no such case.
        occasions: Conditions over the state that bring interruptions about: that the mission is not asked for, and what
            begins its detours.
        made: Condition over a stable state and the memory before it under which the visit is made there; None for a
            goal.
    """

    name: str
    kind: AimKind
    condition: Expression
    number: int
    mission: int | None = None
    visit: Expression | None = None
    here: Expression | None = None
    interruption: Expression | None = None
    occasions: tuple[Expression, ...] = ()
    made: Expression | None = None


def counted(aims: Collection[Aim]) -> str:
    """Return the number of goals and visits in words: `1 goal and 3 visits`."""
    goals = sum(item.kind is AimKind.GOAL for item in aims)
    counts = (("goal", goals), ("visit", len(aims) - goals))
    return " and ".join(f"{count} {word}{'s' if count > 1 else ''}" for word, count in counts if count)


class Stage(msgspec.Struct, frozen=True):
    """Stage of a mission or a detour.

    Attributes:
        here: Condition that it is the one that the mission or detour is at.
        is_passed: Condition on a stable state under which it is left at once for the next one.
    """

    here: Expression
    is_passed: Expression


class Tour(msgspec.Struct, frozen=True):
    """The stages of a mission or a detour, round and round: each stable state moves it on to one that is not passed.

    Attributes:
        stages: The stages. The first one is that of a mission at its first visit, or of an idle detour.
        places: For each later stage the place of the memory that says that it is the current one. At most one is true
            at a time; at the first stage none is.
        asked: Condition without which it is at its first stage; None where there is none.
        stays: True if it stays at its stage where every stage is passed, as a mission does; a detour is idle then.
    """

    stages: tuple[Stage, ...]
    places: tuple[Place, ...]
    asked: Expression | None
    stays: bool

    def made(self, number: int) -> Expression:
        """Return the condition on a stable state that a stage is passed there, be it one of several.

        Args:
            number: Number of the stage.
        """
        wanted = () if self.asked is None else (self.asked,)
        return conjunction(*wanted, _comes(self.stages, number), self.stages[number].is_passed)


class Journey(msgspec.Struct, frozen=True):
    """A mission as aims.

    Attributes:
        aims: Its visits, then those of each detour.
        tours: Memory that it needs: that of the mission, then of each detour.
        is_round: Condition over the state that the mission is asked for and every visit of its own is true.
    """

    aims: tuple[Aim, ...]
    tours: tuple[Tour, ...]
    is_round: Expression


def journey(mission: Mission, number: int) -> Journey:
    """Return a mission as aims, with the memory that it needs.

    Each update takes in, at once, that any number of visits are passed in one stable state: its size is proportional to
    the number of visits.

    Args:
        mission: The mission.
        number: Its number in the model, from 0.
    """
    name = f"mission {mission.name}"
    asked = None if mission.condition is None else holds(mission.condition)
    visits = [holds(item) for item in mission.visits]
    names = [f"{name} is at visit {visit}" for visit in range(2, len(visits) + 1)]
    later = [_remembered(item) for item in names]
    at = [_negated(_any(later)), *later]
    stages = tuple(Stage(*item) for item in zip(at, visits, strict=True))
    # One whole round at most: where every visit is true, it stays.
    tours = [_tour(stages, names, asked, stays=True)]
    aims: list[Aim] = []
    wanted = () if asked is None else (asked,)
    idle = None if asked is None else _negated(asked)
    under_way: list[Expression] = []
    for order, detour in enumerate(mission.detours, start=1):
        title = f"detour {order} of {name}"
        tour = _detour_tour(detour, title, asked)
        tours.append(tour)
        under_way += [item.read for item in tour.places]
        for visit, (condition, place) in enumerate(zip(detour.visits, tour.places, strict=True), start=1):
            target = _negated(place.read)
            place_number = len(mission.visits) + len(aims)
            words = f"visit {visit} of {title}"
            aims.append(
                Aim(
                    *(words, AimKind.DETOUR_VISIT, target, place_number, number, condition, place.read, idle),
                    occasions=tuple(map(_negated, wanted)),
                    made=tour.made(visit),
                )
            )
    interrupted = [*map(_negated, wanted), *under_way]
    occasions = (*map(_negated, wanted), *(holds(item.trigger) for item in mission.detours))
    own = [
        Aim(
            f"visit {visit + 1} of {name}",
            AimKind.VISIT,
            _any([*map(_negated, wanted), _negated(at[visit]), visits[visit], *under_way]),
            visit,
            number,
            condition,
            conjunction(*wanted, at[visit]),
            _any(interrupted) if interrupted else None,
            occasions,
            tours[0].made(visit),
        )
        for visit, condition in enumerate(mission.visits)
    ]
    return Journey((*own, *aims), tuple(tours), conjunction(*wanted, *visits))


def _detour_tour(detour: Detour, title: str, asked: Expression | None) -> Tour:
    """Return the tour of a detour, which has a place for each visit.

    Args:
        detour: The detour.
        title: Its name.
        asked: Condition of its mission, if it has one.
    """
    names = [f"{title} is at visit {visit}" for visit in range(1, len(detour.visits) + 1)]
    at = [_remembered(name) for name in names]
    # Being idle is a stage, too, which is passed where the detour is wanted.
    idle = Stage(_negated(_any(at)), holds(detour.trigger))
    stages = (idle, *(Stage(here, holds(visit)) for here, visit in zip(at, detour.visits, strict=True)))
    return _tour(stages, names, asked, stays=False)


def _tour(stages: tuple[Stage, ...], names: Iterable[str], asked: Expression | None, *, stays: bool) -> Tour:
    """Return a tour with its places, whose updates have the meaning of `Tour`; names are those of the places."""
    wanted = () if asked is None else (asked,)
    passed = [stage.is_passed for stage in stages]
    places = []
    for number, name in enumerate(names, start=1):
        moved = _arrives(stages, number)
        if stays:
            moved = Binary("or", moved, conjunction(stages[number].here, *passed))
        places.append(Place(name, conjunction(*wanted, moved)))
    return Tour(stages, tuple(places), asked, stays)


def _arrives(stages: Sequence[Stage], place: int) -> Expression:
    """Return the condition that a stage is the first one that is not passed, from the current one on, round and round.

    Args:
        stages: The stages, in their order.
        place: Place of the stage among them.
    """
    return Binary("and", _comes(stages, place), _negated(stages[place].is_passed))


def _comes(stages: Sequence[Stage], place: int) -> Expression:
    """Return the condition that a stage is the current one, or all from the current one up to it are passed."""
    # Before it come those behind it, the farthest first. Chains lean to the left, so that they may be long.
    found: Expression | None = None
    for stage in (*stages[place + 1 :], *stages[:place]):
        comes = stage.here if found is None else Binary("or", found, stage.here)
        found = Binary("and", comes, stage.is_passed)
    here = stages[place].here
    return here if found is None else Binary("or", found, here)


def _remembered(name: str) -> Expression:
    return VariableRead(MEMORY, name)


def _negated(condition: Expression) -> Expression:
    return TRUE if condition == FALSE else FALSE if condition == TRUE else Unary("not", condition)


def _any(conditions: Iterable[Expression]) -> Expression:
    found: Expression = FALSE
    for item in conditions:
        found = item if found == FALSE else found if item == FALSE else Binary("or", found, item)
    return found


class Obligations(msgspec.Struct, frozen=True):
    """Aims and assumptions of a robot, with the memory that judging them needs.

    Attributes:
        aims: Aims: the goals, then the visits of each mission, those of its detours behind its own.
        assumptions: Condition of each assumption, true again and again.
        cancels: Cancels that the executor asks for by itself, in source order.
        places: Places of the memory: of the cancels, of the assumptions, of the goals, of the missions.
        tours: Tours of the missions and their detours; of the places of each, at most one is true at a time.
        rounds: For each mission, the condition that it is asked for and every visit of its own is true.
    """

    aims: tuple[Aim, ...]
    assumptions: tuple[Expression, ...]
    cancels: tuple[Cancel, ...]
    places: tuple[Place, ...]
    tours: tuple[Tour, ...]
    rounds: tuple[Expression, ...]


def obligations(executable: "ExecutableSystem") -> Obligations:
    """Return the aims and assumptions of an executable system's model."""
    cancels = tuple(own_cancels(executable))
    model = executable.model
    owed = [judgement(item, f"assumption {number}") for number, item in enumerate(model.assumptions, start=1)]
    names = [f"goal {number}" for number, _ in enumerate(model.goals, start=1)]
    wanted = [judgement(item, name) for item, name in zip(model.goals, names, strict=True)]
    goals = (
        Aim(name, AimKind.GOAL, item.condition, number)
        for number, (name, item) in enumerate(zip(names, wanted, strict=True))
    )
    journeys = [journey(mission, number) for number, mission in enumerate(model.missions)]
    tours = tuple(tour for item in journeys for tour in item.tours)
    judged = (item.place for item in (*owed, *wanted))
    return Obligations(
        (*goals, *(aim for item in journeys for aim in item.aims)),
        tuple(item.condition for item in owed),
        cancels,
        (
            *(place for cancel in cancels for place in cancel.places),
            *(place for place in judged if place),
            *(place for tour in tours for place in tour.places),
        ),
        tours,
        tuple(item.is_round for item in journeys),
    )
