"""Things that all parts of the Python generator share: the names, the scope of expressions, the diagrams."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from robosc.automata import System
from robosc.errors import InternalError
from robosc.expressions import PathStep, Type
from robosc.model.structure import Model
from robosc.supervisor import Supervisor
from robosc.targets.code.expressions import Code
from robosc.targets.python.diagrams import Diagrams
from robosc.targets.python.expressions import Scope
from robosc.targets.python.layout import Layout, make_layout


def _no_received(path: Sequence[PathStep]) -> Code:
    raise InternalError("a condition on the state reads received data")


def _no_type(*path: object) -> Type:
    raise InternalError("a condition on the state looks into an array")


@dataclass(slots=True)
class Writer:
    """The state of one run of the generator.

    Attributes:
        layout: Names.
        system: The automata, for the domains of decision diagrams.
        used: Functions of the runtime modules that the generated code calls.
        scope: Scope for writing expressions over the state.
        diagrams: Writer of the supervisor's added conditions.
        reads: For each method that tells whether an event is allowed, or helps one, what it reads and calls, so far.
        stale: For each attribute the bits of the events whose permission reads it, once that is known.
        skipping: Events whose step may skip an update, so far.
    """

    layout: Layout
    system: System
    used: set[str] = field(default_factory=set)
    scope: Scope = field(init=False)
    diagrams: Diagrams = field(init=False)
    reads: dict[str, set[str]] = field(default_factory=dict)
    stale: dict[str, int] = field(default_factory=dict)
    skipping: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.scope = Scope(self._variable, self._location, _no_received, self.used.add, _no_type, _no_type)
        self.diagrams = Diagrams(
            self.system, self.scope, frozenset(item.name for item in self.model.components), self.reads
        )

    @property
    def model(self) -> Model:
        """The model."""
        return self.layout.model

    def _variable(self, component: str, variable: str) -> tuple[str, Type]:
        attribute, type_ = self.layout.variables[component, variable]
        return f"self.{attribute}", type_

    def _location(self, automaton: str) -> str:
        if automaton in self.layout.locations:
            return f"self.{self.layout.locations[automaton]}"
        return repr(self.system.automaton(automaton).initial[0])  # A message's plant has one location.


def make_writer(supervisor: Supervisor) -> Writer:
    """A writer for one supervisor."""
    return Writer(make_layout(supervisor), supervisor.executable.automata)
