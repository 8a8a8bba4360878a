"""Common parts of the Python generator: the names, the scope of expressions, the conditions."""

from dataclasses import dataclass, field

from robosc.automata import System
from robosc.automata.goal_memory import MEMORY
from robosc.expressions import BooleanType, Type
from robosc.model.structure import Model
from robosc.supervisor import Supervisor
from robosc.targets.code.python.conditions import PythonConditions
from robosc.targets.code.python.expressions import Scope
from robosc.targets.code.python.layout import Layout, make_layout
from robosc.targets.code.statements import Statement


@dataclass(slots=True)
class Writer:
    """The state of one run of the generator.

    Attributes:
        layout: Names.
        system: The automata, for the domains of decision diagrams.
        used: Functions of the runtime modules that the generated code calls.
        scope: Scope for writing expressions over the state.
        conditions: Writer of conditions over the state.
        marks: For each attribute what notes another value of it, once that is known.
        skipping: Events whose step may skip an update, so far.
        whole: Events whose step does all that a message on their identifier stands for, so far.
    """

    layout: Layout
    system: System
    used: set[str] = field(default_factory=set)
    scope: Scope = field(init=False)
    conditions: PythonConditions = field(init=False)
    marks: dict[str, list[Statement]] = field(default_factory=dict)
    skipping: set[str] = field(default_factory=set)
    whole: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.scope = Scope(self.used.add, self.model, self._variable, self._location)
        self.conditions = PythonConditions(self.layout, self.system, self.scope)

    @property
    def model(self) -> Model:
        """The model."""
        return self.layout.model

    def _variable(self, component: str, variable: str) -> tuple[str, Type]:
        if component == MEMORY:
            return f"self.{self.layout.memory[variable]}", BooleanType()
        attribute, type_ = self.layout.variables[component, variable]
        return f"self.{attribute}", type_

    def _location(self, automaton: str) -> str:
        if automaton in self.layout.locations:
            return f"self.{self.layout.locations[automaton]}"
        return repr(self.system.automaton(automaton).initial[0])  # A message's plant has one location.


def make_writer(supervisor: Supervisor) -> Writer:
    """A writer for one supervisor."""
    executable = supervisor.executable
    system = executable.automata if supervisor.strategy is None else executable.remembering_automata
    return Writer(make_layout(supervisor), system)
