"""The controller automaton: what a supervisor and its executor do together, state by state.

A state consists of a state of the system and the executor's memory of running goals: which requirements of an action
held in some stable state since its request, and whether the executor has asked for its cancel. The state is *stable* if
no silent step is enabled. Silent steps pre-empt everything else, in the executor's order: resets, taus. In a stable
state the environment may send a message or answer, and any enabled request may be issued.

- The executor asks for a cancel where one of the requirements that held does not hold any more, before each silent step
  and after the last one; once for each goal. Asking is no event. From then on the goal may end as cancelled, in any
  stable state: that is the event `cancel` if the supervisor allows it there, else `error`. The goal may as well end
  otherwise, or never. In a layer `cancel` is uncontrollable, a caller may ask at any time, and nothing is remembered.

- One step of the environment is one middleware message, a *batch*: the events that stand for it, in source
  order, with no silent step between them. Under the setting `on_unknown: keep` an event whose enum is unknown does
  not happen, so any part of a batch may happen as well; a *whole* batch can happen under every setting.
- Received data takes every value that matters. Events of one message carry data that the same fields can produce
  (`robosc.controller_properties.messages`). Code-only variables do not matter: no condition on events reads one.
  They only determine what is sent; a request whose data is unknown counts as possible.
- The controller automaton omits that an action cannot be requested again before a goal has ended that is lost to the
  model, as after a timeout. The end can become known in any state and changes nothing else, so the same states are
  reached.
- If two transitions on one event apply, the executor prefers the state's own to the behaviour's, and then the first
  one in source order.
"""

from collections.abc import Iterable, Iterator
from itertools import product

import msgspec

from robosc.automata import ExecutableSystem, System
from robosc.automata.compile import NO_DATA, Function, State, compile_expression, subjects_read
from robosc.automata.semantics import Semantics
from robosc.automata.state import Subject, subjects
from robosc.controller_properties.messages import Choice, choices_together
from robosc.model.structure import Deployment, EventKind
from robosc.supervisor import AddedCondition
from robosc.supervisor.predicates import state_predicates

Held = tuple[int, ...]
"""Bits for each action with requirements: one for each requirement that held in a stable state since its request.

Once the executor has asked for the cancel of a goal, the bit after these stands alone: nothing else matters any more.
"""

Node = tuple[State, Held]
"""A state of the controller automaton."""

Move = tuple[tuple[str, ...], bool, Node]
"""Events, True if this can happen under every setting, and the state before any silent step."""


class Goal(msgspec.Struct, frozen=True):
    """An action with requirements, whose goal the executor watches.

    Attributes:
        action: Its name.
        index: Its place in `Held`.
        cancel: Its cancel event.
        place: Place of its plant's location in a state.
        running: The location in which a goal runs.
        requirements: Its requirements.
        reads: Subjects that they read.
    """

    action: str
    index: int
    cancel: str
    place: int
    running: str
    requirements: tuple[Function, ...]
    reads: frozenset[Subject]

    @property
    def asked(self) -> int:
        """The bit that stands alone once the executor has asked for the cancel."""
        return 1 << len(self.requirements)

    def holding(self, state: State) -> int:
        """Bits of the requirements that hold."""
        return sum(1 << bit for bit, holds in enumerate(self.requirements) if holds(state, NO_DATA) is True)

    def judged(self, state: State, mask: int) -> int:
        """Return the bits in a state, before any silent step: is the cancel asked for?"""
        if not mask or state[self.place] != self.running:
            return 0
        return self.asked if mask & self.asked or mask & ~self.holding(state) else mask

    def observed(self, state: State, mask: int) -> int:
        """Return the bits after a stable state."""
        if state[self.place] != self.running or mask & self.asked:
            return self.judged(state, mask)
        return mask | self.holding(state)


class SilentRun(msgspec.Struct, frozen=True):
    """Silent steps in the executor's order, to the end.

    Attributes:
        events: The steps; if the run does not end, the steps before its cycle.
        cycle: The steps that repeat for ever; empty if the run ends.
        end: The stable state, after the executor has evaluated the requirements; None if the run does not end.
        is_marked: True if a state of the run, the first one included, is marked; if the run does not end, a state of
            its cycle.
        cycle_states: The states of the cycle; empty if the run ends.
    """

    events: tuple[str, ...]
    cycle: tuple[str, ...]
    end: Node | None
    is_marked: bool
    cycle_states: tuple[State, ...] = ()


class Controller:
    """The controller automaton of a supervisor.

    Args:
        executable: Executable system of the robot.
        added: The conditions that synthesis adds.
        semantics: Semantics of its automata, if it was made already.

    Attributes:
        is_deterministic: True if no two transitions apply to one event in one state.
        system: The automata that are executed; their states are those of the model's automata.
        width: Number of places of a state.
        goals: The actions that the executor may cancel, in source order.
        silent: Resets, then taus that can change something, in the executor's order.
        batches: The events of each kind of step of the environment, in source order.
        requests: Events of requests, in source order.
    """

    def __init__(
        self,
        executable: ExecutableSystem,
        added: Iterable[AddedCondition],
        semantics: Semantics | None = None,
    ) -> None:
        self.system: System = executable.executed_automata
        self.is_deterministic = self.system is executable.automata
        # An executed system may have other automata than those that were given a meaning.
        self._semantics = semantics if semantics and self.is_deterministic else Semantics(self.system)
        model = executable.model
        self._added = state_predicates(self.system, added)
        places = {subject: place for place, subject in enumerate(subjects(self.system))}
        # In a layer a cancel is one of the environment's own steps.
        watches = executable.deployment is Deployment.CONTROLLER
        self.goals = tuple(_goals(executable, places)) if watches else ()
        self.width = len(places)
        self._start: Node = (self._semantics.initial, (0,) * len(self.goals))
        moving = {edge.event for item in self.system.automata for edge in item.edges if edge.source != edge.target}
        self.silent: tuple[str, ...] = tuple(event for event in executable.resets_and_taus if event in moving)
        self.batches = executable.batches
        messages = {item.event(EventKind.RESPONSE): item for item in model.communications}
        together = (
            (batch, choices_together(model, self.system, [messages[event] for event in batch]))
            for batch in self.batches
            if len(batch) > 1
        )
        self._choices = {batch: choices for batch, choices in together if choices is not None}
        self.requests = executable.requests
        self._runs: dict[Node, SilentRun] = {}
        self._moves: dict[Node, tuple[Move, ...]] = {}
        # Only where it is not marked everywhere, as a message's plant is.
        self._marked = tuple(
            (places[Subject(item.name)], item.marked)
            for item in self.system.automata
            if not item.marked.issuperset(item.locations)
        )
        self._sources = {event.name: tuple(_sources(self.system, event.name, places)) for event in self.system.events}

    @property
    def start(self) -> Node:
        """The state in which the executor starts; it may not be stable."""
        return self._start

    def is_marked(self, node: Node) -> bool:
        """Return True if every automaton is in a marked location."""
        state = node[0]
        return all(state[place] in marked for place, marked in self._marked)

    def after(self, state: State, event: str) -> State | None:
        """Return the state that a controllable event leads to, or None where it is not enabled."""
        if not self._has_edges(state, event):
            return None
        semantics = self._semantics
        if not semantics.condition(state, event):
            return None
        targets = semantics.targets(state, event)
        if not targets:
            return None
        condition = self._added.get(event)
        if condition is not None and not condition(state):
            return None
        return min(targets) if len(targets) > 1 else next(iter(targets))

    def _has_edges(self, state: State, event: str) -> bool:
        """Return True if every automaton of an event has an edge here: a quick check that excludes most events."""
        return all(state[place] in sources for place, sources in self._sources[event])

    def silent_steps(self, node: Node) -> Iterator[tuple[str, Node]]:
        """Every silent step that is enabled, with its target state; the executor's choice comes first."""
        state, held = node
        for event in self.silent:
            target = self.after(state, event)
            # A tau that would change nothing is not taken.
            if target is not None and target != state:
                yield event, (target, self.judged(target, held))

    def run(self, node: Node) -> SilentRun:
        """The silent steps that the executor takes from a state."""
        found = self._runs.get(node)
        if found is None:
            found = self._runs[node] = self._work_out(node)
        return found

    def _work_out(self, node: Node) -> SilentRun:
        places = {node: 0}
        visited = [node]
        events: list[str] = []
        while True:
            step = next(self.silent_steps(visited[-1]), None)
            if step is None:
                end = self.observed(visited[-1])
                return SilentRun(tuple(events), (), end, any(map(self.is_marked, visited)))
            event, target = step
            events.append(event)
            if target in places:
                first = places[target]
                again = visited[first:]
                is_marked = any(map(self.is_marked, again))
                states = tuple(state for state, _ in again)
                return SilentRun(tuple(events[:first]), tuple(events[first:]), None, is_marked, states)
            places[target] = len(visited)
            visited.append(target)

    def observed(self, node: Node) -> Node:
        """A stable state after the executor has evaluated the requirements of running goals."""
        state, held = node
        if not held:
            return node
        return state, tuple(goal.observed(state, mask) for goal, mask in zip(self.goals, held, strict=True))

    def asked(self, node: Node) -> tuple[Goal, ...]:
        """Return the goals whose cancel the executor has asked for."""
        return tuple(goal for goal, mask in zip(self.goals, node[1], strict=True) if mask & goal.asked)

    def forbidden(self, node: Node) -> tuple[Goal, ...]:
        """Return the goals whose cancel is asked for and forbidden in a stable state.

        Where every requirement holds again, there is nothing to cancel for: a goal that ends as cancelled has failed.
        """
        state = node[0]
        return tuple(
            goal
            for goal in self.asked(node)
            if goal.holding(state) != goal.asked - 1 and self.after(state, goal.cancel) is None
        )

    def moves(self, node: Node) -> tuple[Move, ...]:
        """Return the moves that can change a stable state: first requests, then the environment's, in source order.

        A state comes once for each request and once for each batch, as a whole batch if possible. Goals that end as
        cancelled come last.
        """
        found = self._moves.get(node)
        if found is None:
            found = self._moves[node] = tuple(self._moves_from(node))
        return found

    def _moves_from(self, node: Node) -> Iterator[Move]:
        state, held = node
        for event in self.requests:
            target = self.after(state, event)
            if target is not None and target != state:
                yield (event,), True, (target, self.judged(target, held))
        for batch in self.batches:
            for target, (events, is_whole) in sorted(
                self._joint_targets(state, batch).items(), key=lambda item: item[0]
            ):
                yield events, is_whole, (target, self.judged(target, held))
        for goal in self.asked(node):
            target = self.after(state, goal.cancel)
            if target is not None:
                yield (goal.cancel,), True, (target, self.judged(target, held))

    def _joint_targets(self, state: State, batch: tuple[str, ...]) -> dict[State, tuple[tuple[str, ...], bool]]:
        """Return the states that events of a batch lead to, with these events, and True if they are the whole batch."""
        if batch not in self._choices:
            return self._separate_targets(state, batch)
        found: dict[State, tuple[tuple[str, ...], bool]] = {}
        for choice, keeps in product(self._choices[batch], (False, True)):
            for target, (events, is_whole) in self._with_choice(state, batch, choice, keeps=keeps).items():
                if target not in found or (is_whole and not found[target][1]):
                    found[target] = events, is_whole
        found.pop(state, None)
        return found

    def _with_choice(
        self, state: State, batch: tuple[str, ...], choice: Choice, *, keeps: bool
    ) -> dict[State, tuple[tuple[str, ...], bool]]:
        """The same targets for one combination of the events' data, with or without `on_unknown: keep`."""
        found: dict[State, tuple[tuple[str, ...], bool]] = {state: ((), True)}
        for event, options in zip(batch, choice, strict=True):
            if not self._has_edges(state, event):
                continue
            further: dict[State, tuple[tuple[str, ...], bool]] = {}
            happening = [option for option in options if not (keeps and option.is_unknown)]
            for before, (events, is_whole) in found.items():
                for option in happening:
                    target = self._semantics.target_with(before, event, option.data)
                    is_sure = is_whole and not option.is_unknown
                    if target is not None and (target not in further or (is_sure and not further[target][1])):
                        further[target] = (*events, event), is_sure
            if keeps and any(option.may_be_left_out for option in options):
                for before, (events, _) in found.items():
                    further.setdefault(before, (events, False))
            found = further
        return found

    def _separate_targets(self, state: State, batch: tuple[str, ...]) -> dict[State, tuple[tuple[str, ...], bool]]:
        """The same targets if every combination of data counts as possible."""
        found: dict[State, tuple[tuple[str, ...], bool]] = {state: ((), True)}
        for event in batch:
            if not self._has_edges(state, event):
                # The locations that an answer needs are those of its own plant: nothing else moves them.
                continue
            further: dict[State, tuple[tuple[str, ...], bool]] = {}
            for before, (events, is_whole) in found.items():
                for target in self._semantics.targets(before, event):
                    if target not in further or (is_whole and not further[target][1]):
                        further[target] = (*events, event), is_whole
            # The batch is not whole without this event.
            for before, (events, _) in found.items():
                further.setdefault(before, (events, False))
            found = further
        found.pop(state, None)
        return found

    def judged(self, state: State, held: Held) -> Held:
        """Return the remembered bits in a state that an event led to: what is over is forgotten, what is due asked."""
        if not any(held):
            return held
        return tuple(goal.judged(state, mask) for goal, mask in zip(self.goals, held, strict=True))


def _sources(system: System, event: str, places: dict[Subject, int]) -> Iterator[tuple[int, frozenset[str]]]:
    """Yield place and edge sources of each automaton of an event, but for those with an edge in every location."""
    for automaton in system.automata:
        if event in automaton.alphabet:
            sources = frozenset(edge.source for edge in automaton.edges if edge.event == event)
            if len(sources) < len(automaton.locations):
                yield places[Subject(automaton.name)], sources


def _goals(executable: ExecutableSystem, places: dict[Subject, int]) -> Iterator[Goal]:
    index = 0
    for event in executable.events.values():
        if event.kind is EventKind.CANCEL and event.moves and event.communication:
            requirements = executable.model.requirements_on(event.communication.name)
            if requirements:
                (running,) = event.moves.targets
                yield Goal(
                    action=event.communication.name,
                    index=index,
                    cancel=event.name,
                    place=places[Subject(event.moves.plant)],
                    running=running,
                    requirements=tuple(compile_expression(rule.condition, places) for rule in requirements),
                    reads=frozenset().union(*(subjects_read(rule.condition) for rule in requirements)),
                )
                index += 1
