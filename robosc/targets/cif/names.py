"""The CIF names of all parts of a synthesis problem, and the mapping from CIF names to these parts.

CIF has one name space for each automaton and one for the specification, and a name in an automaton hides the same name
in the specification. So each name is used only once among the names that are visible together: the first part gets it,
and later ones get it with `_2`, `_3` and so on.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from robosc.automata import System
from robosc.automata.inputs import connected_inputs
from robosc.automata.structure import Automaton, Event, InputVariable
from robosc.expressions import EnumType, EnumValue, Expression, IntegerType, PathStep, Type, leaves
from robosc.model.structure import EventKind, Model, is_tau
from robosc.targets.cif.text import escaped
from robosc.targets.code.naming import Namer

_EVENTS = {
    EventKind.REQUEST: "c_trigger",
    EventKind.RESET: "c_reset",
    EventKind.CANCEL: "c_cancel",
    EventKind.RESPONSE: "u_response",
    EventKind.ERROR: "u_error",
    EventKind.FEEDBACK: "u_feedback",
}
_LOCATIONS = {"service": {"waiting": "wait_for_response", "failed": "error"}, "action": {"failed": "error"}}

SUPERVISOR = "sup"
"""Name of the supervisor automaton."""

_DATA = "data"

NO_DATA = "none"
"""Location of a data plant where no statement has been chosen."""

Array = tuple[PathStep, ...]
"""Path of an array in received data."""


@dataclass(frozen=True, slots=True)
class Presence:
    """Number of elements that an array has, of those that synthesis reads.

    Attributes:
        name: Local name of the input that reports it.
        event: The event that carries the array.
        array: Its path.
        indices: The indices that are read, ascending; the element at `indices[n]` is there if the input exceeds n.
    """

    name: str
    event: str
    array: Array
    indices: tuple[int, ...]


class Names:
    """The CIF names of a model's synthesis problem.

    Args:
        model: The model.
        system: Its plants.

    Attributes:
        enums: CIF name of each enum type that synthesis uses, by name.
        plants: CIF name of each automaton; the data plant of communication m is called `data m` here.
        presences: Number of elements that arrays have, by event and array.
    """

    def __init__(self, model: Model, system: System) -> None:
        self._top = Namer()
        self.plants = {item.name: self._top.name(_plant_name(item.name)) for item in system.automata}
        self.provided = tuple(dict.fromkeys(item.communication for item in model.provides))
        self.plants |= {data_plant(name): self._top.name(f"data_{name}") for name in self.provided}
        self._top.name(SUPERVISOR)
        self.enum_types = {item.name: item for item in _enum_types(model, system)}
        self.enums = {name: self._top.name(name.replace(".", "_")) for name in self.enum_types}
        self._spaces = {name: Namer(hidden=(self._top.taken,)) for name in self.plants}
        self._owners = _event_owners(system)
        self.events = {item.name: self._event(item) for item in system.events}
        self.variables = {
            (automaton.name, variable.name): self._spaces[automaton.name].name(f"v_{variable.name}")
            for automaton in system.automata
            for variable in automaton.variables
        }
        self.inputs: dict[tuple[str, Array], str] = {}
        self.presences: dict[tuple[str, Array], Presence] = {}
        self._name_inputs(system)
        self.locations = {
            (automaton.name, location): self._spaces[automaton.name].name(_location_name(automaton.name, location))
            for automaton in system.automata
            for location in automaton.locations
        }
        self.provides = self._name_provides(model)
        self.literals = self._name_literals()

    def owner(self, event: str) -> str:
        """Name of the automaton that declares an event."""
        return self._owners[event]

    def diagram_node(self, number: int) -> str:
        """A free name in the specification for a node of a decision diagram."""
        locals_ = [space.taken for space in self._spaces.values()]
        return Namer(hidden=[self._top.taken, *locals_]).name(f"bdd_{number}")

    def reference(self, automaton: str, name: str, here: str | None) -> str:
        """Return the name of something of an automaton in the automaton `here`, or outside all of them."""
        if automaton == here:
            return escaped(name)
        return f"{escaped(self.plants[automaton])}.{escaped(name)}"

    def event_reference(self, event: str, here: str | None) -> str:
        """Return the name of an event in the automaton `here`, or outside all of them."""
        return self.reference(self._owners[event], self.events[event], here)

    def _event(self, event: Event) -> str:
        kind = event.name.rpartition(".")[2]
        wanted = f"c_{kind}" if is_tau(event.name) else _EVENTS[EventKind(kind)]
        return self._spaces[self._owners[event.name]].name(wanted)

    def _name_inputs(self, system: System) -> None:
        """Inputs stand in the plant of the communication whose event carries them."""
        for item in system.inputs:
            space = self._spaces[self._owners[item.event]]
            self.inputs[item.event, item.path] = space.name(_input_name(item.event, item.path))
        for event in dict.fromkeys(item.event for item in system.inputs):
            elements = [item for item in system.inputs if item.event == event and item.may_be_unknown]
            for group in connected_inputs(elements):
                for array, indices in _read_indices(group).items():
                    name = self._spaces[self._owners[event]].name(f"{_input_name(event, array)}_known")
                    self.presences[event, array] = Presence(name, event, array, indices)

    def _name_provides(self, model: Model) -> dict[str, tuple[tuple[str, str], ...]]:
        """For each communication with data the locations of its data plant, each with the event that leads there."""
        found: dict[str, tuple[tuple[str, str], ...]] = {}
        for name in self.provided:
            take = self._spaces[data_plant(name)].name
            numbers = range(1, len(model.provides_for(name)) + 1)
            wanted = (NO_DATA, *(f"provide_{number}" for number in numbers))
            events = [take(f"c_{location}") for location in wanted]
            found[name] = tuple(zip(map(take, wanted), events, strict=True))
        return found

    def _name_literals(self) -> dict[tuple[str, str], str]:
        """A value keeps its name if it can mean nothing else; the others are written `Enum_value`."""
        values = [(enum, value) for enum, type_ in self.enum_types.items() for value in type_.values]
        count: dict[str, int] = {}
        for _, value in values:
            count[value] = count.get(value, 0) + 1
        elsewhere = set[str]().union(*(space.taken for space in self._spaces.values()))

        def is_free(name: str) -> bool:
            return name not in elsewhere and name not in self._top.taken

        plain = {(enum, value) for enum, value in values if count[value] == 1 and is_free(value)}
        found = {(enum, value): self._top.name(value) for enum, value in values if (enum, value) in plain}
        self._top.hidden = (elsewhere,)
        for enum, value in values:
            if (enum, value) not in plain:
                found[enum, value] = self._top.name(f"{self.enums[enum]}_{value}")
        return found


def data_plant(communication: str) -> str:
    """Return the name of the data plant of a communication among the automata."""
    return f"{_DATA} {communication}"


def shift(type_: Type) -> int:
    """Return the offset of a variable's value to get the one that CIF stores: a negative range starts at 0 there."""
    return -type_.low if isinstance(type_, IntegerType) and type_.low is not None and type_.low < 0 else 0


def array_steps(path: Array) -> tuple[tuple[Array, int], ...]:
    """The arrays that a path goes through, outermost first, with the index taken in each.

    What may be left out without being in an array counts as the only element of its own.
    """
    found = tuple((path[:place], step) for place, step in enumerate(path) if isinstance(step, int))
    return found or ((path, 0),)


def _read_indices(group: Iterable[InputVariable]) -> dict[Array, tuple[int, ...]]:
    found: dict[Array, set[int]] = {}
    for item in group:
        for array, index in array_steps(item.path):
            found.setdefault(array, set()).add(index)
    return {array: tuple(sorted(indices)) for array, indices in found.items()}


def _plant_name(automaton: str) -> str:
    """`component_<C>`, or e.g. `service_<s>` for `service s`."""
    return automaton.replace(" ", "_") if " " in automaton else f"component_{automaton}"


def _location_name(automaton: str, location: str) -> str:
    kind, _, name = automaton.partition(" ")
    return _LOCATIONS.get(kind, {}).get(location, location) if name else location


def _input_name(event: str, path: Array) -> str:
    return "_".join((f"i_{event.rpartition('.')[2]}", *map(str, path)))


def _event_owners(system: System) -> dict[str, str]:
    """The automaton that declares each event: the component of a tau, else the communication's plant."""
    plants = {item.name.partition(" ")[2]: item.name for item in system.automata if " " in item.name}
    return {
        item.name: item.name.partition(".")[0] if is_tau(item.name) else plants[item.name.partition(".")[0]]
        for item in system.events
    }


def _enum_types(model: Model, system: System) -> Iterator[EnumType]:
    """The enums that variables, received data and conditions have, each once, in the model's order."""
    types = [variable.type for automaton in system.automata for variable in automaton.variables]
    types += [item.type for item in system.inputs]
    used = {type_.name for type_ in types if isinstance(type_, EnumType)}
    for expression in synthesis_expressions(model, system):
        used.update(leaf.enum for leaf in leaves(expression) if isinstance(leaf, EnumValue))
    for enum in model.enums:
        if enum.name in used:
            yield EnumType(enum.name, enum.values)


def synthesis_expressions(model: Model, system: System) -> Iterator[Expression]:
    """Every expression of the synthesis problem, and the conditions of data."""
    for automaton in system.automata:
        for edge in automaton.edges:
            yield edge.guard
            yield from (update.expression for update in edge.updates)
    yield from (item.condition for item in system.conditions)
    yield from system.invariants
    yield from (item.condition for item in model.provides if item.condition is not None)


def declared_events(system: System, names: Names, automaton: Automaton) -> tuple[Event, ...]:
    """The events that an automaton declares, in the system's order."""
    return tuple(event for event in system.events if names.owner(event.name) == automaton.name)
