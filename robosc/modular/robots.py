"""Modular synthesis for models of robots: each module is a smaller model of its own, with words for what is in it.

What a module shows of the robot is a superset of what the robot does: other modules may allow less. So what never
happens in a module never happens in the robot, and a requirement that restricts nothing in its modules restricts
nothing. What can happen in a module is only told of the robot if it was tried there, or if the module shares nothing
with others.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import msgspec
from msgspec.structs import replace

from robosc.automata.compile import State
from robosc.automata.controlled import ControlledGraph, controlled_graph
from robosc.automata.decision import Decision
from robosc.automata.plants import communication_plant_name
from robosc.automata.semantics import Semantics, TooManyChoicesError
from robosc.automata.structure import System
from robosc.model.places import Places
from robosc.model.structure import Component, Deployment, Model
from robosc.modular.clusters import MAXIMUM_BITS
from robosc.modular.partition import Module, Partition
from robosc.modular.synthesize import STATES, ModularResult, synthesize_modular
from robosc.supervisor import AddedCondition
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import (
    Answers,
    EnabledTogether,
    EngineOptions,
    NeverEnabled,
    Questions,
    SynthesisResult,
    SynthesisStatus,
    questions_about,
)
from robosc.synthesis.controlled import MAXIMUM_TOGETHER

MAXIMUM_STATES = 1_000
"""Maximum number of states that a run tried in the whole robot may lead to."""


class RobotPart(msgspec.Struct, frozen=True):
    """A module of a robot as a model: its components and communications with the requirements on them.

    Attributes:
        model: The model; a requirement that stands in several modules has in each the communications of that module.
        places: Source locations of its parts.
        system: Its synthesis problem.
        requirements: Numbers of its requirements among those of the robot.
        invariants: Numbers of its invariants among those of the robot.
    """

    model: Model
    places: Places
    system: System
    requirements: tuple[int, ...]
    invariants: tuple[int, ...]

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components that it has something of."""
        return tuple(item.name for item in self.model.components)


class RobotParts:
    """Modules of a robot as models.

    Args:
        model: The robot.
        places: Source locations of its parts.
        system: Its automata.
        deployment: Deployment of its supervisor.
    """

    def __init__(self, model: Model, places: Places, system: System, deployment: Deployment) -> None:
        self.model = model
        self.deployment = deployment
        self._places = places
        self.questions = questions_about(model, system, deployment)
        self._communications = {communication_plant_name(item): item for item in model.communications}
        self._behaviours = {item.name: item.behaviour for item in model.components}
        self._requirement_of = {
            place: number
            for number in range(len(model.requirements))
            for place in self.questions.restrictions[number].conditions
        }

    def part(self, partition: Partition, module: Module, system: System) -> RobotPart:
        """Return a module of the robot, with its synthesis problem, as a model."""
        # Automata stand in the order of the model's text.
        order = [item.name for item in system.automata]
        names = set(order)
        restricted: dict[int, list[str]] = {}
        for place in partition.conditions_of(module):
            if place in self._requirement_of:
                communication = partition.system.conditions[place].event.rpartition(".")[0]
                restricted.setdefault(self._requirement_of[place], []).append(communication)
        requirements, invariants = tuple(sorted(restricted)), partition.invariants_of(module)
        communications = tuple(self._communications[item] for item in order if item in self._communications)
        owners = [self._communications[item].component if item in self._communications else item for item in order]
        model = replace(
            self.model,
            components=tuple(
                Component(name, self._behaviours[name] if name in names else None) for name in dict.fromkeys(owners)
            ),
            communications=communications,
            requirements=tuple(
                replace(self.model.requirements[number], communications=tuple(restricted[number]))
                for number in requirements
            ),
            invariants=tuple(self.model.invariants[number] for number in invariants),
        )
        places = replace(
            self._places,
            requirements=[self._places.requirements[number] for number in requirements],
            invariants=[self._places.invariants[number] for number in invariants],
        )
        return RobotPart(model, places, system, requirements, invariants)

    def questions_on(self, part: RobotPart, *, is_alone: bool) -> Questions:
        """Return the questions about a module; what other modules could prevent is not asked, but for rivals."""
        found = questions_about(part.model, part.system, self.deployment)
        return found if is_alone else replace(found, prompted=())


@dataclass(frozen=True)
class RobotSynthesis:
    """Outcome of a modular synthesis of a robot.

    Attributes:
        result: The outcome for the whole robot.
        modular: The modules.
        parts: The modules as models, in the same order; without a supervisor only the first one that has none.
        robot: Maker of further modules.
    """

    result: SynthesisResult
    modular: ModularResult
    parts: tuple[RobotPart, ...]
    robot: RobotParts


def synthesize_robot(
    model: Model,
    places: Places,
    system: System,
    deployment: Deployment,
    *,
    engine: str | EngineOptions = "auto",
    limit: int = STATES,
    module_bits: float = MAXIMUM_BITS,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> RobotSynthesis:
    """Synthesize the supervisor of a robot module by module; arguments and errors as of `synthesize_modular`.

    Args:
        model: A checked robot.
        places: Source locations of its parts.
        system: Its automata.
        deployment: Deployment of its supervisor.
        engine: Name of the engine for decision diagrams, or its options.
        limit: Maximum number of states for the check of mutual blocking.
        module_bits: Logarithm of the combinations of values up to which requirements share a module.
        should_stop: Function called before each step of the work; once it returns true, the work ends.
        on_progress: Function called with the progress of the work, in words.
    """
    parts = RobotParts(model, places, system, deployment)
    made: dict[Module, RobotPart] = {}

    def questions(partition: Partition, module: Module, problem: System, is_alone: bool) -> Questions:
        made[module] = parts.part(partition, module, problem)
        return parts.questions_on(made[module], is_alone=is_alone)

    found = synthesize_modular(
        system,
        engine=engine,
        limit=limit,
        module_bits=module_bits,
        questions=questions,
        should_stop=should_stop,
        on_progress=on_progress,
    )
    shown = tuple(made[item.module] for item in found.modules)
    if found.unsolved is not None:
        return RobotSynthesis(found.unsolved.result, found, shown, parts)
    answers = _Answers(parts, system, found, shown).merged()
    independent = found.modules if found.states is not None and len(found.modules) > 1 else ()
    result = SynthesisResult(
        SynthesisStatus.SUPERVISOR,
        found.added,
        found.statistics,
        answers=answers,
        parts=tuple((item.system, item.result) for item in independent),
    )
    return RobotSynthesis(result, found, shown, parts)


class _Answers:
    """Answers about a robot, from those about its modules."""

    def __init__(self, parts: RobotParts, system: System, found: ModularResult, shown: tuple[RobotPart, ...]) -> None:
        self._model = parts.model
        self._questions = parts.questions
        self._found = found
        self._run = _Run(system, found.added)
        self._graphs: dict[int, ControlledGraph | None] = {}
        places: dict[str, set[int]] = {}
        for place, item in enumerate(found.modules):
            for event in item.system.events:
                places.setdefault(event.name, set()).add(place)
        self._places = {event: frozenset(item) for event, item in places.items()}
        alone = {group[0] for group in found.groups if len(group) == 1}
        self._modules = [
            (part, item.result.answers, place in alone)
            for place, (part, item) in enumerate(zip(shown, found.modules, strict=True))
        ]

    def merged(self) -> Answers:
        """The answers, in the order of the questions."""
        never = {item.event: item for item in self._never()}
        unreached = {item for _, answers, _ in self._modules for item in answers.unreached}
        unprompted = {item.event: item for _, answers, _ in self._modules for item in answers.unprompted}
        return Answers(
            never=tuple(never[event] for event in self._questions.events if event in never),
            unused=self._unused(),
            together=tuple(self._together()),
            unreached=tuple(item for item in self._questions.locations if item in unreached),
            unprompted=tuple(unprompted[event] for event in self._questions.prompted if event in unprompted),
        )

    def _never(self) -> Iterator[NeverEnabled]:
        for part, answers, _ in self._modules:
            for item in answers.never:
                yield replace(item, invariants=tuple(part.invariants[place] for place in item.invariants))

    def _unused(self) -> tuple[int, ...]:
        """The restrictions that each of their modules finds unused."""
        unused, used = set[int](), set[int]()
        for part, answers, _ in self._modules:
            count = len(self._model.requirements)
            mine = (*part.requirements, *(count + number for number in part.invariants))
            for place, number in enumerate(mine):
                (unused if place in answers.unused else used).add(number)
        return tuple(sorted(unused - used))

    def _together(self) -> Iterator[EnabledTogether]:
        """The rivals that are possible together, as far as the run that shows it is one of the robot."""
        found = {
            (item.first, item.second): (item, is_alone)
            for _, answers, is_alone in self._modules
            for item in answers.together
        }
        pairs = (
            (first, second)
            for group in self._questions.rivals
            for number, second in enumerate(group)
            for first in group[:number]
        )
        told = (self._told(*pair, *found.get(pair, (None, False))) for pair in pairs)
        yield from islice(filter(None, told), MAXIMUM_TOGETHER)

    def _told(self, first: str, second: str, item: EnabledTogether | None, is_alone: bool) -> EnabledTogether | None:
        """Two rivals with a run of the robot after which both are possible; None if none is known."""
        if item is not None and is_alone:
            return item
        runs = self._runs(first, second) if item is None else (item.trace,)
        run = next((run for run in runs if self._run.leads_to(run, (first, second))), None)
        return None if run is None else EnabledTogether(first, second, run)

    def _runs(self, first: str, second: str) -> Iterator[tuple[str, ...]]:
        """Runs that could lead to where two events of different modules are possible; none if one module has both."""
        if not self._places[first].isdisjoint(self._places[second]):
            return
        one, other = (self._local_run(event, min(self._places[event])) for event in (first, second))
        if one is not None and other is not None:
            yield from ((*one, *other), (*other, *one))

    def _local_run(self, event: str, place: int) -> tuple[str, ...] | None:
        """A shortest run of a module to where an event is possible; None if there is none, or too many states."""
        if place not in self._graphs:
            made = self._found.modules[place]
            predicates = state_predicates(made.system, made.result.added)
            self._graphs[place] = controlled_graph(Semantics(made.system), predicates, limit=MAXIMUM_STATES)
        graph = self._graphs[place]
        steps = () if graph is None else graph.steps
        number = next((number for number, found in enumerate(steps) if event in dict(found)), None)
        return None if graph is None or number is None else graph.trace(number)


class _Run:
    """The robot under its supervisor, where a run is tried."""

    def __init__(self, system: System, added: Iterable[AddedCondition]) -> None:
        self._system = system
        self._added = tuple(added)

    @cached_property
    def _semantics(self) -> Semantics:
        return Semantics(self._system)

    @cached_property
    def _predicates(self) -> dict[str, Decision]:
        return state_predicates(self._system, self._added)

    def leads_to(self, run: Iterable[str], events: Iterable[str]) -> bool:
        """Return True if a run is possible, and may lead to a state in which each of some events is possible."""
        states = frozenset(self._semantics.initial_states)
        try:
            for event in run:
                states = frozenset(target for state in states for target in self._targets(state, event))
                if len(states) > MAXIMUM_STATES:
                    return False
            return any(all(self._targets(state, event) for event in events) for state in states)
        except TooManyChoicesError:
            return False

    def _targets(self, state: State, event: str) -> frozenset[State]:
        condition = self._predicates.get(event)
        if not self._semantics.condition(state, event) or not (condition is None or condition(state)):
            return frozenset()
        return self._semantics.targets(state, event)
