"""Subjects of explanations: automata of a model or of another origin, with the words for them and their remarks."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

from robosc.automata import System, SystemPlaces
from robosc.explanation.constraints import relaxable_constraints
from robosc.explanation.parts import Remark
from robosc.explanation.requests import ModelQuestionReader, Requests, SystemQuestionReader
from robosc.explanation.requirement_automata import as_conditions
from robosc.explanation.system_terms import SystemTerms
from robosc.explanation.terms import ModelTerms, Terms
from robosc.expressions import Expression
from robosc.model.places import Places
from robosc.model.structure import Deployment, Model
from robosc.source import Location
from robosc.synthesis.findings import findings, questions_about
from robosc.synthesis.questions import Answers, Questions, Restriction

_TOLD = frozenset({"never-enabled", "unused-requirement"})
"""The findings of `robosc synth` that belong to an explanation."""


class Words(Protocol):
    """Automata, with the words for them."""

    @property
    def is_of_automata(self) -> bool:
        """True if the automata come from no model."""

    @property
    def system(self) -> System:
        """The automata, all of them plants: what requirement automata forbid are conditions."""

    @property
    def terms(self) -> Terms:
        """Words for states and parts."""

    @property
    def requests(self) -> Requests:
        """Reader of what is asked."""

    @property
    def questions(self) -> Questions:
        """Questions about the controlled system, for `remarks`."""

    def remarks(self, answers: Answers) -> Iterator[Remark]:
        """Warnings that follow from the answers."""

    def locations(self) -> Iterator[tuple[str, str, Location | None]]:
        """Automata with the locations that cause a warning if they are never reached."""


@dataclass(frozen=True)
class ModelWords:
    """The words of a model.

    Attributes:
        model: The checked model.
        places: Places of its parts.
        system: Its automata.
        deployment: Deployment of the supervisor.
    """

    model: Model
    places: Places
    system: System
    deployment: Deployment

    @property
    def is_of_automata(self) -> bool:
        """False: the automata come from a model."""
        return False

    @cached_property
    def questions(self) -> Questions:
        """Questions about the controlled system, for `remarks`."""
        return questions_about(self.model, self.system, self.deployment)

    @cached_property
    def terms(self) -> Terms:
        """Words for states and parts."""
        constraints = relaxable_constraints(self.system, self.questions.restrictions)
        return ModelTerms(self.model, self.places, self.system, constraints)

    @property
    def requests(self) -> Requests:
        """Reader of what is asked."""
        return ModelQuestionReader(self.system, self.model)

    def remarks(self, answers: Answers) -> Iterator[Remark]:
        """Warnings that follow from the answers."""
        for item in findings(self.model, self.places, answers):
            if item.code in _TOLD:
                yield Remark(item.code, item.message, item.location)

    def locations(self) -> Iterator[tuple[str, str, Location | None]]:
        """Components with their states."""
        for component in self.model.components:
            for state in component.behaviour.states if component.behaviour else ():
                yield component.name, state.name, self.places.states[component.name, state.name]


@dataclass(frozen=True)
class SystemWords:
    """The words of automata that come from no model.

    Attributes:
        given: The automata.
        places: Places of their parts, as far as they are known.
    """

    given: System
    places: SystemPlaces = field(default_factory=SystemPlaces)

    @property
    def is_of_automata(self) -> bool:
        """True: the automata come from no model."""
        return True

    @cached_property
    def _conditions(self) -> tuple[System, dict[str, tuple[int, ...]]]:
        return as_conditions(self.given)

    @property
    def system(self) -> System:
        """The automata, all of them plants: what requirement automata forbid are conditions."""
        return self._conditions[0]

    @cached_property
    def _restrictions(self) -> tuple[Restriction, ...]:
        """Return the groups of conditions that belong together, because they are written in one place."""
        system, automata = self._conditions
        together = defaultdict[tuple[Location | int, Expression], list[int]](list)
        for place, item in enumerate(self.given.conditions):
            location = self.places.conditions[place] if place < len(self.places.conditions) else place
            together[location, item.condition].append(place)
        return (
            *(Restriction(conditions=tuple(places)) for places in together.values()),
            *(Restriction(conditions=places) for places in automata.values() if places),
            *(Restriction(invariants=(place,)) for place in range(len(system.invariants))),
        )

    @property
    def questions(self) -> Questions:
        """Questions about the controlled system, for `remarks`."""
        return Questions(
            events=tuple(event.name for event in self.system.events if not event.is_controllable),
            restrictions=self._restrictions,
        )

    @cached_property
    def terms(self) -> Terms:
        """Words for states and parts."""
        system, automata = self._conditions
        return SystemTerms(system, relaxable_constraints(system, self._restrictions), automata, self.places)

    @property
    def requests(self) -> Requests:
        """Reader of what is asked."""
        return SystemQuestionReader(self.system)

    def remarks(self, answers: Answers) -> Iterator[Remark]:
        """Warnings that follow from the answers."""
        for never in answers.never:
            yield Remark("never-enabled", f"{never.event} can never happen", None)
        if self.system.is_controlled:
            # That a supervisor need not do something is nothing to be told.
            return
        # These restrict by what they mark and by their ranges, too.
        more = {
            place
            for automaton in self.given.automata
            if not automaton.marked.issuperset(automaton.locations) or automaton.variables
            for place in self._conditions[1].get(automaton.name, ())
        }
        for number in answers.unused:
            item = self._restrictions[number]
            if more.intersection(item.conditions):
                continue
            part = (
                self.terms.invariant_part(item.invariants[0])
                if item.invariants
                else self.terms.condition_part(item.conditions[0])
            )
            yield Remark("unused-requirement", f"'{part.text}' never restricts anything", part.location)

    def locations(self) -> Iterator[tuple[str, str, Location | None]]:
        """Plants with their locations."""
        for automaton in self.given.automata:
            if len(automaton.locations) > 1:
                for location in automaton.locations:
                    yield automaton.name, location, self.places.automata.get(automaton.name)
