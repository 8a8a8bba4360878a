"""Promela names for the places of a state: readable, distinct, and never a keyword, since each has a prefix of ours."""

from robosc.automata.state import Subject, subject_domain, subject_type, subjects
from robosc.automata.structure import System
from robosc.expressions import EnumType
from robosc.targets.code.naming import Namer


class Names:
    """The names of one system.

    Args:
        system: The system.

    Attributes:
        new: Gives a name that nothing else has, as close as possible to what is asked for.
        places: Name of what holds each place of a state; locations of automata that have only one are missing.
        locations: Predicates that say whether an automaton is in a location.
        values: Names for the values of enums, by enum and value.
        numbers: Number that stands for a value of an enum, by its name here.
    """

    def __init__(self, system: System) -> None:
        self.new = Namer().name
        self.places: dict[Subject, str] = {}
        self.locations: dict[tuple[str, str], str] = {}
        self.values: dict[tuple[str, str], str] = {}
        self.numbers: dict[str, int] = {}
        for subject in subjects(system):
            short = subject.automaton.rpartition(" ")[2]
            if subject.variable is not None:
                self.places[subject] = self.new(f"v_{short}_{subject.variable}")
                type_ = subject_type(system, subject)
                if isinstance(type_, EnumType):
                    self._add_values(type_)
                continue
            if len(subject_domain(system, subject)) > 1:
                self.places[subject] = self.new(f"at_{short}")
            for location in system.automaton(subject.automaton).locations:
                self.locations[subject.automaton, location] = self.new(f"in_{short}_{location}")
        for item in system.inputs:
            if isinstance(item.type, EnumType):
                self._add_values(item.type)

    def _add_values(self, type_: EnumType) -> None:
        """Name the values of an enum, if they have no names yet."""
        for number, value in enumerate(type_.values):
            if (type_.name, value) not in self.values:
                name = self.values[type_.name, value] = self.new(f"value_{type_.name}_{value}")
                self.numbers[name] = number
