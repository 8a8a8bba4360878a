"""Supervisors of the Python API: the value of the core, with a display for notebooks and terminals."""

import os
from functools import cached_property
from typing import Any, Self

from robosc.automata import System
from robosc.conditions.summary import summary_json, summary_text
from robosc.errors import Diagnostic
from robosc.model.structure import Deployment, Model
from robosc.pipeline.conditions import Conditions, conditions_of
from robosc.pipeline.files import FileName, SupervisorFile, given_path, read_bounded
from robosc.pipeline.findings import Findings
from robosc.pipeline.goals import Goals, goal_summary, goals_of
from robosc.pipeline.results import Summary
from robosc.supervisor import AddedCondition, Certificate, Strategy, SupervisedModule
from robosc.supervisor import Supervisor as CoreSupervisor
from robosc.supervisor.codec import MAXIMUM_BYTES, decode, encode
from robosc.tables import html_table


class Supervisor(CoreSupervisor, SupervisorFile, frozen=True, dict=True):
    """A synthesized supervisor.

    Attributes:
        model: The checked model.
        deployment: Deployment that it was synthesized for.
        added: Decision diagrams that synthesis adds to events; `conditions` has them in words.
        certificate: Record of what was checked.
        strategy: Decision diagrams of what it chooses to reach the model's goals, or None; `goals` has them in words.
        modules: The modules of a modular synthesis; else none.
    """

    @classmethod
    def of(cls, supervisor: CoreSupervisor, diagnostics: tuple[Diagnostic, ...] | None = None) -> Self:
        """Take a supervisor of the core, with the findings about its model, or None if they are not known."""
        made = cls.supervising(
            supervisor.executable, supervisor.added, supervisor.certificate, supervisor.strategy, supervisor.modules
        )
        # No field: a supervisor's file does not hold them.
        made.__dict__["diagnostics"] = None if diagnostics is None else Findings(diagnostics)
        return made

    @classmethod
    def read(cls, file: FileName) -> Self:
        """Read a supervisor's file (`.rsup`); it is validated, but not verified against a model.

        Raises:
            FileAccessError: The file cannot be read.
            InvalidSupervisorError: The file holds no supervisor.
        """
        return cls.of(decode(read_bounded(given_path(file), MAXIMUM_BYTES)))

    def encode(self) -> bytes:
        """Return the content of the supervisor's file; raises UnsupportedModelError as `write`."""
        return encode(self)

    @cached_property
    def diagnostics(self) -> Findings | None:
        """The findings about its model; None if they are not known, as for a supervisor that was read from a file."""
        return None

    @cached_property
    def system(self) -> System:
        """The automata that it supervises."""
        return self.executable.automata

    @cached_property
    def conditions(self) -> Conditions:
        """Conditions that it adds to each controllable event, in the model's words."""
        components = frozenset(item.name for item in self.model.components)
        return conditions_of(self.added, self.system, components)

    @cached_property
    def goals(self) -> Goals:
        """The goals of the model with what the strategy chooses for each, in the model's words; empty: no strategy."""
        return goals_of(self)

    @property
    def states(self) -> int:
        """Reachable states of the controlled system, as the certificate says; 0 if nobody counted those of modules."""
        return int(self.certificate.states)

    @property
    def transitions(self) -> int | None:
        """Transitions between them; None if they were not counted."""
        return None if self.certificate.transitions is None else int(self.certificate.transitions)

    @cached_property
    def summary(self) -> Summary:
        """The supervisor in figures and words."""
        controllable = sum(event.is_controllable for event in self.system.events)
        return Summary(
            controllable_events=controllable,
            uncontrollable_events=len(self.system.events) - controllable,
            states=self.states,
            transitions=self.transitions,
            added=tuple((event, condition.text) for event, condition in self.conditions.items()),
            text=summary_text(self),
            goals=goal_summary(self),
        )

    def to_json(self) -> dict[str, object]:
        """The summary as JSON values, as `robosc synth --json` prints it."""
        return summary_json(self)

    def __str__(self) -> str:
        return str(self.summary)

    def _repr_html_(self) -> str:
        checks = ("safe", "controllable", "nonblocking", "maximally_permissive")
        found = [(name.replace("_", " "), getattr(self.certificate, name)) for name in checks]
        if self.certificate.goals is not None:
            found.append(("goals", self.certificate.goals))
        shown = html_table(("check", "outcome"), found, caption=repr(self).strip("<>")) + self.conditions._repr_html_()
        return shown + self.goals._repr_html_() if self.goals else shown

    def __reduce__(self) -> tuple[Any, ...]:
        fields = (self.model, self.deployment, self.added, self.certificate, self.strategy, self.modules)
        return _restored, (type(self), fields, None if self.diagnostics is None else tuple(self.diagnostics))


def _restored(
    kind: type[Supervisor],
    fields: tuple[
        Model, Deployment, tuple[AddedCondition, ...], Certificate, Strategy | None, tuple[SupervisedModule, ...]
    ],
    diagnostics: tuple[Diagnostic, ...] | None,
) -> Supervisor:
    return kind.of(CoreSupervisor(*fields), diagnostics)


type SupervisorLike = CoreSupervisor | bytes | FileName
"""Argument for a supervisor: the value itself, the content of its file as a server sends it, or the file's name."""


def supervisor_of(given: SupervisorLike) -> Supervisor:
    """The supervisor of an argument, which is read if it is a file's name or content.

    Raises:
        TypeError: The argument is none of these.
        FileAccessError: The file cannot be read.
        InvalidSupervisorError: The file holds no supervisor.
    """
    if isinstance(given, Supervisor):
        return given
    if isinstance(given, CoreSupervisor):
        return Supervisor.of(given)
    if isinstance(given, bytes):
        return Supervisor.of(decode(given))
    if isinstance(given, str | os.PathLike):
        return Supervisor.read(given)
    hint = ""
    if given is None:
        hint = ": no supervisor was made, print the result to see why"
    elif isinstance(given, System):
        hint = ": make it with robosc.synthesize(system).supervisor"
    raise TypeError(f"a supervisor is wanted, or the path of its file, not {type(given).__name__}{hint}")
