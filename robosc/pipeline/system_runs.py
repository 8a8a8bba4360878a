"""Manual simulation of automata under their supervisor, on their explicit semantics (`robosc.automata.Semantics`).

Automata may be nondeterministic: an uncontrollable event may have several edges, received data may have any value, and
there may be several initial states. The run never chooses by itself: its caller chooses, or gets an error that lists
the choices.
"""

from collections.abc import Iterable, Mapping, Sequence
from random import Random
from typing import Any

from robosc.automata import InputVariable, Semantics, System, composed
from robosc.automata.compile import Path, State
from robosc.automata.inputs import valuations
from robosc.automata.semantics import TooManyChoicesError
from robosc.automata.state import subject_domain, subject_type, subjects
from robosc.certification.supervisor_file import StateInWords, state_in_words
from robosc.errors import RoboscError, UnknownNameError, UnsupportedModelError
from robosc.explanation.disabled import Disabled
from robosc.explanation.notation import value_text
from robosc.expressions import EnumType, Received, Type, Value
from robosc.expressions.inference import has_type
from robosc.expressions.text import cif_type_text, expression_text, literal_named
from robosc.model.findings import did_you_mean
from robosc.pipeline.conditions import unknown_event
from robosc.pipeline.manual_run import ManualRun
from robosc.pipeline.received_data import NO_DATA, DataError, DataField, data_field, one_datum
from robosc.pipeline.steps import Step
from robosc.pipeline.systems import SystemSupervisor
from robosc.pipeline.walking import Walker, WalkFinding, WalkFindingKind
from robosc.supervisor.predicates import state_predicates

_MAXIMUM_WAYS = 4
"""Maximum number of states that an error lists."""

_MAXIMUM_VALUES = 8
"""Maximum number of values that an error lists."""


class ChoiceError(RoboscError, ValueError):
    """An open choice in automata: several states are possible, or no possible state fits the given parts.

    Attributes:
        problem: Description of the choice, without the way to make it.
        example: Parts that choose one of several states; empty if there is none.
    """

    def __init__(self, problem: str, example: Mapping[str, Value] | None = None, keyword: str = "") -> None:
        choose = f"; choose one, for instance with {keyword}={example}" if example else ""
        super().__init__(f"{problem}{choose}")
        self.problem = problem
        self.example = example or {}


def state_parts(system: System, text: str) -> dict[str, Value]:
    """The parts of a state that a text names, such as `Buffer = full, Buffer.count = 2`.

    Raises:
        UnknownNameError: There is no such part; the message names the nearest one.
        ChoiceError: A part has no such value, or the text gives none.
    """
    found: dict[str, Value] = {}
    known = {str(subject): subject for subject in subjects(system)}
    for part in text.split(","):
        name, _, value = (item.strip() for item in part.partition("="))
        if name not in known:
            raise UnknownNameError(unknown_event(name, known, "part of the state"))
        subject = known[name]
        values = {value_text(item): item for item in subject_domain(system, subject)}
        type_ = None if subject.variable is None else subject_type(system, subject)
        if isinstance(type_, EnumType):
            value = literal_named(type_, value)
        if value not in values:
            shown = ", ".join([*list(values)[:_MAXIMUM_VALUES], *(["..."] if len(values) > _MAXIMUM_VALUES else [])])
            raise ChoiceError(f"{name} is never {value!r:.100}: it is one of {shown}")
        found[name] = values[value]
    return found


def initial_states_in_words(supervisor: SystemSupervisor) -> tuple[StateInWords, ...]:
    """The initial states of automata under their supervisor, in the order of their values.

    Raises:
        UnsupportedModelError: There are too many to enumerate.
    """
    semantics = Semantics(composed(supervisor.system))
    return tuple(state_in_words(supervisor.system, None, state) for state in _initial_states(semantics, supervisor))


def _initial_states(semantics: Semantics, supervisor: SystemSupervisor) -> list[State]:
    try:
        return [item for item in semantics.initial_states if supervisor.may_begin(item)]
    except TooManyChoicesError as error:
        raise UnsupportedModelError(f"{supervisor.system.name} cannot be simulated: {error}") from None


class SystemRun(ManualRun):
    """A run of automata under their supervisor.

    In its states, `components` has the location of each automaton, and `communications` is empty.

    Args:
        supervisor: Supervisor of the automata.
        initial: Parts of the initial state; None if there is only one.
    """

    def __init__(self, supervisor: SystemSupervisor, initial: Mapping[str, Value] | None = None) -> None:
        system = composed(supervisor.system)
        self._supervisor = supervisor
        self._semantics = Semantics(system)
        self._added = state_predicates(system, supervisor.added)
        self._disabled = Disabled(system, self._added)
        self._subjects = tuple(map(str, subjects(system)))
        # The value of an input variable has its name, and not the only location of its automaton.
        self._places = {name: place for place, name in enumerate(self._subjects)}
        self._inputs: dict[str, list[InputVariable]] = {}
        for item in system.inputs:
            self._inputs.setdefault(item.event, []).append(item)
        ways = _initial_states(self._semantics, supervisor)
        self._first = self._now = self._only(ways, initial or {}, system.name, "begin in", "initial")
        super().__init__(system.name, {event.name: event.is_controllable for event in system.events})

    @property
    def supervisor(self) -> SystemSupervisor:
        """The supervisor of the automata."""
        return self._supervisor

    @property
    def state(self) -> StateInWords:
        """The current state: location and variables of each automaton."""
        return self._in_words(self._now)

    @property
    def is_marked(self) -> bool:
        """True if the state is marked: every automaton is in a marked location, and the marker condition is true."""
        return self._semantics.is_marked(self._now)

    def data_fields(self, event: str) -> tuple[DataField, ...]:
        """The parts of the data of an event that a caller can give.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        inputs = self._inputs.get(self._require_event(event), ())
        return tuple(
            data_field(tuple(map(str, item.path)), item.type, is_read=True, is_required=False, text=cif_type_text)
            for item in inputs
        )

    def choices(self, event: str, data: object = NO_DATA, /) -> tuple[StateInWords, ...]:
        """Return the states that an event can lead to now, in the order of their values; none if it cannot happen.

        Args:
            event: The event.
            data: Data that it carries, as of `step`.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
            DataError: It does not carry such data.
        """
        given = self._given(self._require_event(event), data)
        return tuple(map(self._in_words, self._targets(event, given))) if self._can_happen(event) else ()

    def step(
        self, event: str, data: object = NO_DATA, /, *, to: Mapping[str, Value] | None = None, **fields: object
    ) -> Step:
        """Take an event; if that is not possible, nothing changes.

        Data that is left out may have any value; None means unknown. If the event can lead to several states, its data
        or parts of the target state choose one of them.

        Args:
            event: The event.
            data: Data that it carries: one value, or a mapping of its parts.
            to: Parts of the state that it leads to, such as `{"Buffer": "full", "Buffer.count": 2}`.
            fields: Parts of the data, instead of `data`.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
            UnknownNameError: The state has no such part; the message names the nearest one.
            EventNotPossibleError: The event cannot happen in the current state; the message says why.
            ChoiceError: The event can lead to several such states, or to none.
            DataError: The event does not carry such data.
        """
        self._require_event(event)
        given = one_datum(event, data, fields)
        read = self._given(event, given)
        self._require_possible(event)
        target = self._only(self._targets(event, read), to or {}, f"'{event}'", "lead to", "to")
        return self._reach(event, target, read, given)

    def _reach(self, event: str, target: State, read: Mapping[Path, Value | None], given: object) -> Step:
        before, self._now = self._now, target
        data = {expression_text(Received(path)): value for path, value in read.items()}
        is_controllable = self._events[event]
        return self._take(Step(event, data, self.state, is_controllable=is_controllable, given=given), before)

    # The automata

    def _in_words(self, state: State) -> StateInWords:
        return state_in_words(self._semantics.system, None, state)

    def _targets(self, event: str, given: Mapping[Path, Value | None]) -> list[State]:
        try:
            return sorted(self._semantics.targets(self._now, event, given))
        except TooManyChoicesError as error:
            raise UnsupportedModelError(f"{event} cannot be simulated: {error}") from None

    def _can_happen(self, event: str) -> bool:
        if self._events[event] and not self._semantics.condition(self._now, event):
            return False
        is_added = self._added.get(event)
        return bool(self._targets(event, {})) and (is_added is None or is_added(self._now))

    def _why_not(self, event: str) -> tuple[str, ...]:
        return self._disabled.reasons(self._now, event)

    def _snapshot(self) -> State:
        return self._now

    def _restore(self, snapshot: State) -> None:
        self._now = snapshot

    def _begin(self) -> None:
        self._now = self._first

    def _make_walker(self) -> Walker:
        return _SystemWalker(self)

    # Choices

    def _only(self, states: Sequence[State], wanted: Mapping[str, Value], what: str, verb: str, keyword: str) -> State:
        """The one state that has some parts.

        Raises:
            UnknownNameError: There is no such part.
            ChoiceError: There are several such states, or none.
        """
        for name in wanted:
            if name not in self._places:
                raise UnknownNameError(unknown_event(name, self._places, "part of the state"))
        found = [state for state in states if all(state[self._places[name]] == part for name, part in wanted.items())]
        if len(found) == 1:
            return found[0]
        offered = self._alternatives(found or states)
        if not found:
            asked = ", ".join(f"{name} = {value_text(part)}" for name, part in wanted.items())
            with_what = f" with {asked}" if asked else ""
            raise ChoiceError(f"{what} cannot {verb} a state{with_what}; it can {verb}: {offered or 'none'}")
        example = {self._subjects[place]: found[0][place] for place in _varying(found)}
        raise ChoiceError(f"{what} can {verb} {len(found)} states: {offered}", example, keyword)

    def _alternatives(self, states: Sequence[State]) -> str:
        """Text that lists states by the values in which they differ; the first ones if there are very many."""
        places = _varying(states) if len(states) > 1 else self._places.values()
        offered = [
            ", ".join(f"{self._subjects[place]} = {value_text(state[place])}" for place in places)
            for state in states[:_MAXIMUM_WAYS]
        ]
        return "; ".join([*offered, *(["..."] if len(states) > _MAXIMUM_WAYS else [])])

    # Data

    def _given(self, event: str, data: object) -> dict[Path, Value | None]:
        """The given data of an event, by path.

        Raises:
            DataError: The event does not carry such data.
        """
        found: dict[Path, Value | None] = {}
        if data is not NO_DATA:
            inputs = {item.path: item for item in self._inputs.get(event, ())}
            if not inputs:
                raise DataError(f"'{event}' carries no data, and was given {data!r:.100}")
            _read(event, inputs, (), data, found)
            if next(valuations([inputs[path] for path in found], found), None) is None:
                raise DataError(f"the data of '{event}' cannot be so: of an array, all is unknown from some element on")
        return found


def _read(
    event: str, inputs: Mapping[Path, InputVariable], path: Path, data: Any, found: dict[Path, Value | None]
) -> None:
    """Put data at its path."""
    place = f"{expression_text(Received(path))} of '{event}'"
    if path in inputs:
        type_ = inputs[path].type
        if isinstance(type_, EnumType) and isinstance(data, str):
            data = literal_named(type_, data)
        if data is None and inputs[path].may_be_unknown:
            found[path] = None
        elif data is None or not has_type(data, type_):
            raise DataError(
                f"{place} is {'unknown' if data is None else f'{data!r:.100}'}, and must be {_type_words(type_)}"
            )
        else:
            found[path] = data
        return
    steps = list(dict.fromkeys(other[len(path)] for other in inputs if other[: len(path)] == path))
    if isinstance(data, Mapping):
        for name in data:
            if name not in steps:
                near = did_you_mean(str(name), list(map(str, steps)))
                hint = f"did you mean '{near}'?" if near else f"there are {', '.join(map(str, steps))}"
                raise DataError(f"{place} has no part '{name}'; {hint}")
            _read(event, inputs, (*path, name), data[name], found)
        return
    is_array = all(isinstance(step, int) for step in steps)
    if data is not None and not (is_array and isinstance(data, list | tuple)):
        wanted = "a list" if is_array else f"a mapping with {', '.join(map(str, steps))}"
        raise DataError(f"{place} is {data!r:.100}, and must be {wanted}")
    # Elements of unknown lists are unknown, and so are those beyond the end of a list.
    elements: Sequence[object] = data if isinstance(data, list | tuple) else ()
    for step in steps:
        inside = elements[step] if isinstance(step, int) and step < len(elements) else None
        _read(event, inputs, (*path, step), inside, found)


def _type_words(type_: Type) -> str:
    return f"one of {', '.join(type_.values)}" if isinstance(type_, EnumType) else cif_type_text(type_)


def _varying(states: Sequence[State]) -> list[int]:
    """The places at which states differ."""
    return [place for place in range(len(states[0])) if len({state[place] for state in states}) > 1] if states else []


class _SystemWalker(Walker):
    """Walker of automata: all possible events are equally likely, and so are all target states of an event."""

    def __init__(self, run: SystemRun) -> None:
        super().__init__(run)
        self._run: SystemRun = run

    def _in_state(self, count: int) -> WalkFinding | None:
        # Steps that the plants do by themselves are nothing to wait for.
        return None if self._run.possible else super()._in_state(count)

    def _candidates(self) -> Iterable[str]:
        return self._run.possible

    def _forbidden(self) -> Iterable[str]:
        run = self._run
        return [
            event
            for event in run.events
            if run.is_controllable(event) and not run._can_happen(event) and run._targets(event, {})
        ]

    def _is_issued(self, event: str) -> bool:
        return True

    def _take(self, event: str, dice: Random) -> Step:
        return self._run._reach(event, dice.choice(self._run._targets(event, {})), {}, NO_DATA)

    def _at_event(self, event: str, count: int) -> WalkFinding | None:
        why = self._run.reasons(event)
        return WalkFinding(WalkFindingKind.BLOCKED, event, why, count) if why else None
