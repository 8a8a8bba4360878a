"""Run against the surroundings: a person plays the controller, and a counter-strategy answers.

The user chooses a request that is allowed, or waits. Then the executor's silent steps are taken, and the surroundings
send what keeps some goal from coming true for ever, while each of their assumptions comes true again and again.
"""

from collections.abc import Collection, Iterator, Sequence
from itertools import chain, islice, repeat
from pathlib import Path
from random import Random
from typing import Any

from robosc.automata.compile import Data, State
from robosc.automata.inputs import valuations
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.certification.goals import GoalExplanation
from robosc.controller_properties.controller import Controller
from robosc.errors import InternalError, RoboscError
from robosc.execution.interpreter.missions import MissionOfSystem
from robosc.pipeline.files import FileAccessError, FileName, given_path
from robosc.pipeline.missions import MissionProgress, progress, visits_made
from robosc.pipeline.received_data import NO_DATA, RandomData
from robosc.pipeline.saved_runs import ModelOfTest
from robosc.pipeline.simulation import Run
from robosc.pipeline.steps import Step
from robosc.pipeline.walking import ALL_FINDINGS, WalkFinding, WalkFindingKind
from robosc.strategies.arena import Happening, message_cases
from robosc.strategies.counter_strategy import CounterPlayer, condition_of

WAIT = "wait"
"""Word for a turn in which nothing is requested."""

_TRIED = 5_000
"""Data that is tried for one event."""

_DRAWN = 500
"""Data that is drawn for one event, where none that was tried leads where it should."""

_Move = tuple[tuple[str, State, Data], ...]
"""Events of a move of the surroundings, each with the state that it leads to, and data if it cannot have any."""


class NoCounterStrategyError(RoboscError, ValueError):
    """A run against the surroundings that is not possible; the message says why."""


class CounterRun(Run):
    """A run in which the surroundings keep goals from coming true.

    Args:
        explanation: Explanation why the goals of a model cannot be reached: the `explanation` of its synthesis.

    Raises:
        NoCounterStrategyError: There is none, it is too large, or a server has sent the explanation.
    """

    def __init__(self, explanation: GoalExplanation) -> None:
        supervisor = explanation.supervisor
        if supervisor is None:
            raise NoCounterStrategyError("a server sends no counter-strategy: synthesize the model on this machine")
        if explanation.counter is None:
            raise NoCounterStrategyError(
                "the surroundings have no counter-strategy, or one that is too large to be played"
            )
        self._explanation = explanation
        executable = supervisor.executable
        owed, system = executable.obligations, executable.remembering_automata
        self._player = CounterPlayer.of(system, owed, explanation.counter)
        self._semantics = Semantics(executable.executed_automata)
        self._controller = Controller(executable, supervisor.added)
        self._batches = [message_cases(executable, executable.executed_automata, batch) for batch in executable.batches]
        self._inputs = executable.executed_automata.inputs
        # The interpreter knows no automata with one location, such as those of messages.
        self._order = [
            ((item.automaton, item.variable), value)
            for item, value in zip(subjects(executable.executed_automata), self._semantics.initial, strict=True)
        ]
        places = {subject: place for place, subject in enumerate(subjects(system))}
        self._updates = [condition_of(place.update, places) for place in owed.places]
        self._aims = owed.aims
        self._goals = [condition_of(aim.condition, places) for aim in owed.aims if aim.mission is None]
        self._missions = [MissionOfSystem(mission) for mission in executable.model.missions]
        self._places = tuple(mission.start for mission in self._missions)
        self._cancels = [(item.event, condition_of(item.may_end, places)) for item in owed.cancels]
        self._memory = (False,) * len(owed.places)
        # The assumption that comes next; how often each came true at a turn; the surroundings have sent part of a move.
        self._aim = 0
        self._came: tuple[int, ...] = (0,) * len(owed.assumptions)
        self._is_within = False
        self._is_answering = False
        super().__init__(supervisor)
        self._random_data = RandomData(supervisor.model)
        self._answer()

    # Views

    @property
    def explanation(self) -> GoalExplanation:
        """Explanation why the goals cannot be reached."""
        return self._explanation

    @property
    def came_true(self) -> tuple[int, ...]:
        """For each assumption, the number of turns of the controller at which it was true."""
        return self._came

    @property
    def denied(self) -> str | None:
        """Name of the goal or visit that the surroundings deny now, `goal 1`; None where silent steps do not end."""
        aim = self._player.denied(self._whole)
        return None if aim is None else self._aims[aim].name

    @property
    def denied_next(self) -> tuple[str, ...]:
        """Names of the goals and visits one of which they deny instead if that one comes true; else it never does."""
        return tuple(self._aims[aim].name for aim in self._player.denied_next(self._whole))

    @property
    def missions(self) -> tuple[MissionProgress, ...]:
        """Progress of each mission as of the last stable state."""
        return tuple(map(progress, self._model.missions, self._places))

    def actor(self, event: str) -> str:
        """Return whose event it is: `you`, `executor` (silent steps) or `surroundings`."""
        if event in self._request_events:
            return "you"
        return "executor" if self.is_controllable(event) and not self._ends_a_goal(event) else "surroundings"

    def _ends_a_goal(self, event: str) -> bool:
        """Return True if an event is the end of a goal that the executor wanted to be cancelled."""
        return any(event == cancel for cancel, _ in self._cancels)

    def event_called(self, name: str) -> str:
        """The event that a name stands for; `wait` stands for itself.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return WAIT if name == WAIT else super().event_called(name)

    def blocked(self) -> dict[str, tuple[str, ...]]:
        """Every event that the user cannot take now, with the reasons, one sentence each."""
        found = super().blocked()
        return {event: why if event in self._request_events else self._why_not(event) for event, why in found.items()}

    # Turns

    def step(self, event: str, data: object = NO_DATA, /, **fields: object) -> Step:
        """Take a request; then the executor and the surroundings take theirs, which `history` has.

        Args:
            event: The request, such as `move.request`.
            data: Nothing: requests carry no data from outside.
            fields: Nothing, too.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
            EventNotPossibleError: It is not allowed, or is for others to decide; the message says why.
        """
        self._require_event(event)
        self._require_possible(event)
        came, aim = self._after_turn()
        step = super().step(event, data, **fields)
        self._came, self._aim = came, aim
        self._answer()
        return step

    def wait(self) -> tuple[Step, ...]:
        """Request nothing at this turn; return what the executor and the surroundings do then."""
        before = len(self)
        self._came, self._aim = self._after_turn()
        self._answer()
        return self.history[before:]

    def undo(self) -> Step | None:
        """Take back the last request, with all that followed, and return it; None if there is none."""
        if not any(step.event in self._request_events for step in self.history):
            return None
        step = super().undo()
        while step is not None and step.event not in self._request_events:
            step = super().undo()
        return step

    def redo(self) -> Step | None:
        """Take again the request that was taken back last, with all that followed; None if there is none."""
        step = super().redo()
        while self.undone and self.undone[0].event not in self._request_events:
            super().redo()
        return step

    def restart(self) -> None:
        """Return to the beginning; the surroundings may begin."""
        super().restart()
        self._answer()

    def again(self) -> "CounterRun":
        """Return a run against the same surroundings, from the beginning."""
        return CounterRun(self._explanation)

    def walk(self, steps: int, seed: int = 0, *, strategy: bool = False) -> tuple[Step, ...]:
        """Request by chance, or wait, and let the surroundings answer; ends early if nothing can happen any more.

        Args:
            steps: Number of events; those that answer the last one come, too.
            seed: Seed of the random numbers: the same seed gives the same events.
            strategy: False: there is no strategy that could be followed.

        Raises:
            NoStrategyError: A strategy is to be followed.
        """
        self._lead(strategy)
        dice, before, idle = Random(seed), len(self), 0  # noqa: S311  # the same walk again, no secret
        while len(self) < before + steps:
            event = dice.choice([*self.enabled, WAIT])
            count = len(self)
            if event == WAIT:
                self.wait()
            else:
                self.step(event)
            idle = 0 if len(self) > count else idle + 1
            # After a wait for each assumption, nothing more comes by waiting.
            if idle > len(self._came) and not self.enabled:
                break
        return self.history[before:]

    def walk_until_finding(
        self,
        steps: int = 1000,
        seed: int = 0,
        kinds: Collection[WalkFindingKind] = ALL_FINDINGS,
        *,
        strategy: bool = False,
    ) -> WalkFinding | None:
        """Refuse to look for findings: the surroundings do not play by chance.

        Raises:
            NoCounterStrategyError: Always.
        """
        raise NoCounterStrategyError("findings are looked for where the world plays by chance, not in this run")

    def save(self, file: FileName, model: ModelOfTest | None = None) -> Path:
        """Write the events so far as an event log (`.jsonl`); return the file's path.

        Args:
            file: File to write.
            model: Not needed: no test can load the model, which has no supervisor.

        Raises:
            FileAccessError: The file cannot be written, or its name has another ending.
        """
        path = given_path(file)
        if path.suffix == ".py":
            raise FileAccessError(f"{path}: a test would load the model, which has no supervisor: save an event log")
        return super().save(path)

    # Answers

    def _after_turn(self) -> tuple[tuple[int, ...], int]:
        """Return how often each assumption has come true with this turn, and which one is next then."""
        holding = self._player.holding(self._whole)
        came = tuple(count + is_true for count, is_true in zip(self._came, holding, strict=True))
        return came, self._player.aim_after(self._whole, self._aim)

    def _answer(self) -> None:
        """Take silent steps and moves of the surroundings until they let the controller have its turn."""
        self._is_answering = True
        try:
            while self._settled():
                moves = list(self._moves())
                chosen = self._player.move(self._whole, [self._arrival(move[-1][1]) for move in moves], self._aim)
                if chosen is None:
                    return
                self._take_move(moves[chosen])
        finally:
            self._is_answering = self._is_within = False

    def _settled(self) -> bool:
        """Take silent steps; return False if they do not end."""
        met: set[Any] = set()
        while (event := self._system.enabled_silent()) is not None:
            key = self._state_tuple, self._memory
            if key in met:
                return False
            met.add(key)
            super().step(event)
        return True

    def _take_move(self, move: _Move) -> None:
        for place, (event, target, data) in enumerate(move, start=1):
            self._is_within = place < len(move)
            super().step(event, self._data_leading_to(event, target, data))

    def _moves(self) -> Iterator[_Move]:
        """Yield the moves of the surroundings that change the state, with as few events as possible."""
        here = self._state_tuple
        for cases in self._batches:
            found: dict[State, _Move] = {here: ()}
            for case in cases:
                for target, move in self._moves_of(case, here).items():
                    if target not in found or len(move) < len(found[target]):
                        found[target] = move
            del found[here]
            yield from found.values()
        for event, may_end in self._cancels:
            if may_end(self._whole):
                end = self._controller.after(here, event)
                if end is not None:
                    yield ((event, end, {}),)

    def _moves_of(self, case: Sequence[Happening], here: State) -> dict[State, _Move]:
        """Return what one message of a certain kind can bring about, by the state that it leads to."""
        found: dict[State, _Move] = {here: ()}
        for item in case:
            further: dict[State, _Move] = dict(found) if item.may_be_left_out else {}
            for before, move in found.items():
                reached = list(self._reached_by(item, before))
                # An event that cannot happen here changes nothing.
                for target, data in reached or [(before, {})]:
                    following = move if target == before else (*move, (item.event, target, data))
                    if target not in further or len(following) < len(further[target]):
                        further[target] = following
            found = further
        return found

    def _reached_by(self, item: Happening, before: State) -> Iterator[tuple[State, Data]]:
        """Yield the states that an event can lead to, each with data that it carries if only some is possible."""
        if item.options is None:
            yield from ((target, {}) for target in sorted(self._semantics.targets(before, item.event), key=repr))
            return
        for option in item.options:
            target = self._semantics.target_with(before, item.event, option.data)
            if target is not None:
                yield target, dict(option.data)

    def _arrival(self, state: State) -> State | None:
        """Return the position in which silent steps end, with the memory then; None if they do not end."""
        end = self._controller.run((state, self._controller.start[1])).end
        return None if end is None else self._observed(end[0])

    def _observed(self, state: State) -> State:
        whole = (*state, "only", *self._memory)
        return (*state, "only", *(update(whole) for update in self._updates))

    def _data_leading_to(self, event: str, target: State, first: Data) -> object:
        """Return data with which an event leads to a state.

        Args:
            event: The event.
            target: The state.
            first: Data that is tried first; what is not in it is unknown.

        Raises:
            InternalError: There is none.
        """
        inputs = [item for item in self._inputs if item.event == event]
        found = (_given(data) for data in islice(valuations(inputs), _TRIED)) if inputs else iter([NO_DATA])
        dice = Random(0)  # noqa: S311  # the same data again, no secret
        drawn = (self._random_data.draw(event, dice) for _ in range(_DRAWN))
        before = self._system.snapshot()
        for data in chain([_given(first)] if first else [], found, drawn):
            self._system.step(event, self._reading(event, data))
            is_there = self._state_tuple == target
            self._system.restore(before)
            if is_there:
                return data
        raise InternalError(f"no data of {event} leads to where the surroundings go")

    # Parts of a run

    @property
    def _state_tuple(self) -> State:
        state = self._system.snapshot().state
        return tuple(state.get(place, value) for place, value in self._order)

    @property
    def _whole(self) -> State:
        return (*self._state_tuple, "only", *self._memory)

    def _observe(self) -> tuple[tuple[int, ...], tuple[str, ...]]:
        if self._is_within or self._system.enabled_silent() is not None:
            return (), ()
        before, places = self._reached, self._places
        state = self._system.snapshot().state
        self._places = tuple(map(MissionOfSystem.after, self._missions, places, repeat(state)))
        whole = self._observed(self._state_tuple)
        self._memory = tuple(bool(item) for item in whole[len(self._order) + 1 :])
        self._reached = tuple(goal(whole) for goal in self._goals)
        pairs = zip(self._reached, before or [False] * len(self._reached), strict=True)
        moves = zip(self._model.missions, places, self._places, strict=True)
        return (
            tuple(place for place, (is_true, was_true) in enumerate(pairs, start=1) if is_true and not was_true),
            tuple(visit for mission, was, now in moves for visit in visits_made(mission, was, now)),
        )

    def _can_happen(self, event: str) -> bool:
        return (self._is_answering or event in self._request_events) and super()._can_happen(event)

    def _why_not(self, event: str) -> tuple[str, ...]:
        if event in self._request_events:
            return super()._why_not(event)
        return (
            ("the executor takes it by itself",) if self.actor(event) == "executor" else ("the surroundings decide it",)
        )

    def _snapshot(self) -> Any:
        return super()._snapshot(), self._memory, self._places, self._aim, self._came

    def _restore(self, snapshot: Any) -> None:
        before, self._memory, self._places, self._aim, self._came = snapshot
        super()._restore(before)

    def _begin(self) -> None:
        self._memory = (False,) * len(self._memory)
        self._places = tuple(mission.start for mission in self._missions)
        self._aim, self._came = 0, (0,) * len(self._came)
        super()._begin()


def _given(data: Data) -> object:
    """Return data by its paths in the form that a person would give it."""
    if () in data:
        return data[()]
    whole: dict[Any, Any] = {}
    for path, value in data.items():
        if value is not None:
            part = whole
            for step in path[:-1]:
                part = part.setdefault(step, {})
            part[path[-1]] = value
    return _listed(whole)


def _listed(part: Any) -> object:
    """Return the elements of arrays, which stand by their indices, as lists; those between are unknown."""
    if not isinstance(part, dict):
        return part
    if part and all(isinstance(step, int) for step in part):
        return [_listed(part.get(index)) for index in range(max(part) + 1)]
    return {step: _listed(item) for step, item in part.items()}
