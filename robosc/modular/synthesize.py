"""Synthesis module by module, until the modules do not block each other.

Modular supervisors are correct by construction. Parts share only requirements, so the supervisor of each module allows
everything that the supervisor of the whole system allows. If the modular supervisors together are nonblocking, they
allow exactly the same. If they are not, two of the modules are merged into one. If that check would take too much work,
all modules that share something are merged.

Source: W. M. Wonham and P. J. Ramadge, "Modular supervisory control of discrete-event systems", Mathematics of Control,
Signals and Systems 1, 1988, pp. 13-30.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import prod
from operator import or_

from robosc.automata.structure import System
from robosc.conditions.multivalued import Effort, EffortExceededError, space_of
from robosc.errors import UnsupportedModelError
from robosc.modular.clusters import MAXIMUM_BITS, modules_of
from robosc.modular.controlled import ControlledModule, controlled_module, graphs_of
from robosc.modular.graphs import TooLargeError
from robosc.modular.nonconflict import is_nonconflicting
from robosc.modular.partition import Groups, Module, Partition, partition
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.diagram import diagram_domains
from robosc.synthesis import Questions, Statistics, SynthesisProgress, SynthesisResult, SynthesisStatus, synthesize
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.result import statistics_of

STATES = 10_000
"""Maximum number of states of a module, and of a composition, for the check whether modules block each other."""

JOINING_STEPS = 1_000_000
"""Maximum number of steps to combine the conditions of several modules on one event."""


@dataclass(frozen=True, slots=True)
class ModuleSupervisor:
    """Supervisor of one module.

    Attributes:
        module: The module.
        system: Its synthesis problem.
        result: The supervisor, or the reason why there is none.
    """

    module: Module
    system: System
    result: SynthesisResult

    @property
    def automata(self) -> tuple[str, ...]:
        """Names of its automata."""
        return tuple(item.name for item in self.system.automata)


@dataclass(frozen=True, slots=True)
class ModularResult:
    """Outcome of a modular synthesis.

    Attributes:
        partition: The system in parts.
        modules: The modules with their supervisors; if there is no supervisor, only the first module that has none.
        groups: Places of modules that share parts or events, and were found not to block each other.
        added: Conditions that the supervisors together add to events, in the system's order.
        initial: Condition on the initial states; None if the system may begin in all of them.
        states: Reachable states of the controlled system, if each group is one module; else None, because these states
            are never all computed.
    """

    partition: Partition
    modules: tuple[ModuleSupervisor, ...]
    groups: tuple[tuple[int, ...], ...] = ()
    added: tuple[AddedCondition, ...] = ()
    initial: DecisionDiagram | None = None
    states: int | None = None

    @property
    def unsolved(self) -> ModuleSupervisor | None:
        """The module without a supervisor; None if every module has one."""
        return next((item for item in self.modules if item.result.status is SynthesisStatus.EMPTY), None)

    @property
    def group_of(self) -> dict[int, int]:
        """Number of the group of each module, by its place."""
        return {place: number for number, group in enumerate(self.groups, start=1) for place in group}

    @property
    def statistics(self) -> Statistics:
        """Figures: sums or maxima over the modules; as states 0 if they were not counted."""
        return statistics_of([item.result.statistics for item in self.modules], states=self.states or 0)


def synthesize_modular(
    system: System,
    *,
    engine: str | EngineOptions = "auto",
    limit: int = STATES,
    module_bits: float = MAXIMUM_BITS,
    questions: Callable[[Partition, Module, System, bool], Questions] = lambda parts, module, system, is_alone: (
        Questions()
    ),
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> ModularResult:
    """Synthesize the supervisor of a system module by module.

    Args:
        system: The system.
        engine: Name of the engine for decision diagrams, or its options.
        limit: Maximum number of states of a module, or of a composition, for the check of mutual blocking.
        module_bits: Logarithm of the combinations of values up to which requirements share a module.
        questions: Questions about the states of a module under its supervisor, by the parts, the module, its synthesis
            problem, and whether it shares nothing with other modules.
        should_stop: Function called before each step of the work; once it returns true, the work ends.
        on_progress: Function called with the progress of the work, in words.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams of a module became larger than the options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: Synthesis does not support a module, or the combined conditions of several modules.
    """
    parts = partition(system)
    search = _Synthesis(parts, engine, limit, questions, should_stop, on_progress)
    return search.result(modules_of(parts, module_bits))


class _Synthesis:
    def __init__(
        self,
        parts: Partition,
        engine: str | EngineOptions,
        limit: int,
        questions: Callable[[Partition, Module, System, bool], Questions],
        should_stop: Callable[[], bool],
        on_progress: Callable[[str], None],
    ) -> None:
        self._partition = parts
        self._engine = engine
        self._limit = limit
        self._questions = questions
        self._should_stop = should_stop
        self._on_progress = on_progress
        self._systems: dict[Module, System] = {}
        self._made: dict[Module, ModuleSupervisor] = {}
        self._controlled: dict[Module, ControlledModule | None] = {}
        # Modules of which it is known that they do not block each other.
        self._fine: set[frozenset[Module]] = set()
        self._parts_of: dict[str, set[int]] = {}
        place_of = {name: place for place, names in enumerate(parts.parts) for name in names}
        for item in parts.system.automata:
            for event in item.alphabet if item.name in place_of else ():
                self._parts_of.setdefault(event, set()).add(place_of[item.name])

    def result(self, first: Sequence[Module]) -> ModularResult:
        """The supervisors of all modules, or the first module without one, from given initial modules."""
        modules = list(first)
        while True:
            groups = self._groups(modules)
            alone = {group[0] for group in groups if len(group) == 1}
            for number, module in enumerate(modules):
                what = f"module {number + 1} of {len(modules)}"
                made = self._supervisor(module, what, is_alone=number in alone)
                if made.result.status is SynthesisStatus.EMPTY:
                    return ModularResult(self._partition, (made,))
            merged: Sequence[Sequence[Module]] = ()
            for group in groups:
                members = [modules[place] for place in group]
                is_nonblocking = frozenset(members) in self._fine or self._is_nonblocking(members)
                if not is_nonblocking:
                    merged = [members] if is_nonblocking is None else self._blocking_pairs(members)
                    break
                self._fine.add(frozenset(members))
            if not merged:
                return self._joined(modules, groups)
            for together in merged:
                whole = reduce(or_, together)
                self._on_progress(f"{len(together)} modules become one, of {len(whole.parts)} parts")
                modules = [item for item in modules if item not in together]
                inside = [item for item in modules if item.parts <= whole.parts]
                modules = [*(item for item in modules if item not in inside), reduce(or_, inside, whole)]

    def _system(self, module: Module) -> System:
        if module not in self._systems:
            self._systems[module] = self._partition.system_of(module)
        return self._systems[module]

    def _supervisor(self, module: Module, what: str, *, is_alone: bool) -> ModuleSupervisor:
        # Modules that share something never come to share nothing, unless they become another module.
        if module not in self._made:
            system = self._system(module)

            def report(progress: SynthesisProgress) -> None:
                self._on_progress(f"{what}: {progress}")

            found = synthesize(
                system,
                engine=self._engine,
                questions=self._questions(self._partition, module, system, is_alone),
                should_stop=self._should_stop,
                on_progress=report,
            )
            self._made[module] = ModuleSupervisor(module, system, found)
        return self._made[module]

    def _groups(self, modules: Sequence[Module]) -> list[tuple[int, ...]]:
        """Places of modules that share parts or events, directly or by others."""
        groups = Groups(range(len(modules)))
        first: dict[object, int] = {}
        for place, module in enumerate(modules):
            for thing in (*module.parts, *(event.name for event in self._system(module).events)):
                groups.join((first.setdefault(thing, place), place))
        return [tuple(group) for group in groups]

    # Blocking

    def _is_nonblocking(self, modules: Sequence[Module]) -> bool | None:
        """Return True if modules do not block each other; None if the check needs too many states."""
        if len(modules) == 1:
            return True
        self._on_progress(f"nonblocking: {len(modules)} modules together")
        controlled = [self._states(module) for module in modules]
        known = [item for item in controlled if item is not None]
        if len(known) < len(controlled):
            return None
        try:
            graphs = graphs_of(known, self._parts_of)
            return is_nonconflicting(graphs, limit=self._limit, should_stop=self._should_stop)
        except TooLargeError:
            return None

    def _states(self, module: Module) -> ControlledModule | None:
        if module not in self._controlled:
            made = self._made[module]
            self._controlled[module] = controlled_module(
                self._partition,
                module,
                made.system,
                made.result.added,
                made.result.initial,
                limit=self._limit,
                should_stop=self._should_stop,
            )
        return self._controlled[module]

    def _blocking_pairs(self, modules: Sequence[Module]) -> list[tuple[Module, Module]]:
        """Disjoint pairs of modules that share something: those that block each other, or else any."""
        pairs: list[tuple[Module, Module]] = []
        users: dict[object, list[Module]] = {}
        for module in modules:
            things = (*module.parts, *(event.name for event in self._system(module).events))
            others = dict.fromkeys(other for thing in things for other in users.get(thing, ()))
            pairs += [(other, module) for other in others]
            for thing in things:
                users.setdefault(thing, []).append(module)
        pairs.sort(key=lambda pair: (-len(pair[0].parts & pair[1].parts), len(pair[0].parts | pair[1].parts)))
        blocking = []
        for pair in pairs:
            if frozenset(pair) not in self._fine:
                if self._is_nonblocking(pair) is False:
                    blocking.append(pair)
                else:
                    self._fine.add(frozenset(pair))
        found: list[tuple[Module, Module]] = []
        taken: set[Module] = set()
        for pair in blocking or pairs:
            if taken.isdisjoint(pair):
                found.append(pair)
                taken.update(pair)
        return found

    # The whole

    def _joined(self, modules: Sequence[Module], groups: Sequence[tuple[int, ...]]) -> ModularResult:
        made = tuple(self._made[module] for module in modules)
        by_event: dict[str, list[DecisionDiagram]] = {}
        for item in made:
            for added in item.result.added:
                by_event.setdefault(added.event, []).append(added.condition)
        initial = [item.result.initial for item in made if item.result.initial is not None]
        is_counted = all(len(group) == 1 for group in groups)
        return ModularResult(
            self._partition,
            made,
            tuple(groups),
            tuple(
                AddedCondition(event.name, self._all_of(by_event[event.name], event.name))
                for event in self._partition.system.events
                if event.name in by_event
            ),
            self._all_of(initial, "the initial state") if initial else None,
            prod(item.result.statistics.states for item in made) if is_counted else None,
        )

    def _all_of(self, diagrams: Sequence[DecisionDiagram], what: str) -> DecisionDiagram:
        """Return the conjunction of some diagrams.

        Raises:
            UnsupportedModelError: It becomes too large.
        """
        if len(diagrams) == 1:
            return diagrams[0]
        names = {node.automaton for diagram in diagrams for node in diagram.nodes}
        automata = tuple(item for item in self._partition.system.automata if item.name in names)
        domains = diagram_domains(System("", (), automata))
        try:
            space = space_of(list(diagrams), domains, Effort(JOINING_STEPS))
            return space.diagram(space.all_of(map(space.of, diagrams)))
        except EffortExceededError:
            raise UnsupportedModelError(
                f"{what}: the conditions that {len(diagrams)} modules add are too large as one"
            ) from None
