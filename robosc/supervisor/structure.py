"""The supervisor: one frozen value that holds all that a target or an executor needs.

It contains the checked model, the conditions that synthesis adds to controllable events, and the certificate. Its JSON
form (`robosc.supervisor.codec`) is untrusted input.
"""

from functools import cached_property
from typing import Annotated, Literal, Self

import msgspec

from robosc.automata.executable import ExecutableSystem
from robosc.automata.goal_memory import counted
from robosc.expressions.types import PartName
from robosc.model.structure import Deployment, Model

FORMAT = "robosc-supervisor"
FORMAT_VERSION = 1

Digest = Annotated[str, msgspec.Meta(pattern=r"^[0-9a-f]{64}\Z")]
Count = Annotated[int, msgspec.Meta(ge=0)]


class DecisionNode(msgspec.Struct, frozen=True):
    """A test of one automaton's location or variable.

    Attributes:
        automaton: Name of the automaton (a component, or `service s`, `action a`).
        variable: Its variable, or None for its location.
        starts: Ascending indices into the subject's domain, the first 0: where each branch begins.
        children: The branch taken from each start up to the next: 0 false, 1 true, n + 2 for node n.
            A node's children are smaller than its own number, so a diagram has no cycle.
    """

    automaton: PartName
    variable: PartName | None
    starts: tuple[Count, ...]
    children: tuple[Count, ...]


class DecisionDiagram(msgspec.Struct, frozen=True):
    """A state predicate as a shared, ordered decision diagram: its size is bounded where a formula's is not.

    Attributes:
        nodes: The nodes, children before parents.
        root: 0 false, 1 true, n + 2 for node n.
    """

    nodes: tuple[DecisionNode, ...]
    root: Count


class AddedCondition(msgspec.Struct, frozen=True):
    """Condition that the supervisor adds to a controllable event.

    It is simplified against plant, requirements and reachability. Events that are not listed get nothing added.
    """

    event: Annotated[str, msgspec.Meta(max_length=511)]
    condition: DecisionDiagram


class Choice(msgspec.Struct, frozen=True, omit_defaults=True):
    """Condition for choosing a request.

    Attributes:
        event: The request's event.
        condition: Condition over the state and the memory of goals.
        is_meanwhile: True if it is for other goals, while the goal of its mode waits for the surroundings.
    """

    event: Annotated[str, msgspec.Meta(max_length=511)]
    condition: DecisionDiagram
    is_meanwhile: bool = False


class Strategy(msgspec.Struct, frozen=True):
    """Choice among the requests that the supervisor enables, so that the goals of the model come true.

    Attributes:
        modes: For each goal of the model, in its order, then for each visit of its missions, the choices that approach
            it, then those that are taken along for others meanwhile: the first whose condition is true, else none. Once
            it is reached, the next one in turn is approached.
    """

    modes: tuple[tuple[Choice, ...], ...]


CheckResult = Literal["passed", "not checked"]


PropertyResult = Literal["passed", "failed", "not checked"]


class ControllerProperties(msgspec.Struct, frozen=True, omit_defaults=True):
    """Properties of supervisor and executor together, which synthesis does not guarantee.

    Attributes:
        finite_response: Result of checking that silent steps end.
        confluence: Result of checking that their order does not matter.
        nonblocking: Result of checking that a marked state stays reachable under control.
        method: Method by which this was found out, in words.
        cancels: Result of checking that the supervisor allows every cancel that the executor asks for; None if it asks
            for none, or if this was not checked.
    """

    finite_response: PropertyResult
    confluence: PropertyResult
    nonblocking: PropertyResult
    method: str
    cancels: PropertyResult | None = None


class Certificate(msgspec.Struct, frozen=True, omit_defaults=True):
    """Record of what was checked about the supervisor, how, and for which model.

    Attributes:
        engine_version: Version of RoboSC that synthesized it.
        bundle_sha256: SHA-256 of the canonical list of every file of the bundle.
        deployment: The deployment it was made for.
        method: Method of the check, in words.
        safe: No reachable bad state, no request against a requirement.
        controllable: No uncontrollable event that the plant enables is disabled.
        nonblocking: From every reachable state a marked state stays reachable.
        maximally_permissive: Nothing more is disabled than needed.
        states: Reachable states of the controlled system, exact; 0 where modules that share something were not
            counted together.
        transitions: Transitions between them, or None where they were not counted.
        controller: Properties of the controller, or None if they were not checked.
        goals: Under the strategy every goal comes true, and every mission goes on, while the assumptions come true;
            None where there is no strategy.
    """

    engine_version: str
    bundle_sha256: Digest
    deployment: Deployment
    method: str
    safe: CheckResult
    controllable: CheckResult
    nonblocking: CheckResult
    maximally_permissive: CheckResult
    states: str
    transitions: str | None
    controller: ControllerProperties | None = None
    goals: CheckResult | None = None


def certified_states(certificate: Certificate) -> str:
    """The states that a certificate states, in words."""
    return "states not counted" if certificate.states == "0" else f"{certificate.states} states"


class SupervisedModule(msgspec.Struct, frozen=True):
    """A module of a modular synthesis: it is safe, controllable and nonblocking by itself.

    Attributes:
        automata: Names of its automata.
        requirements: Numbers of the requirements on events that are in it, wholly or partly.
        invariants: Numbers of the requirements that must always (or never) hold.
        states: Reachable states under its own supervisor.
        group: Number of its group: modules of different groups share nothing, and modules of one group do not block
            each other.
    """

    automata: tuple[PartName, ...]
    requirements: tuple[Count, ...]
    invariants: tuple[Count, ...]
    states: str
    group: Annotated[int, msgspec.Meta(ge=1)]


class Supervisor(msgspec.Struct, frozen=True, dict=True, omit_defaults=True):
    """A synthesized supervisor.

    Attributes:
        model: The checked model (plants, requirements, data).
        deployment: Deployment that it was synthesized for.
        added: The conditions that synthesis adds, in source order of their events.
        certificate: Record of what was checked.
        strategy: Strategy that reaches the model's goals and visits; None where it has none, and in a layer.
        modules: The modules of a modular synthesis; else none.
    """

    model: Model
    deployment: Deployment
    added: tuple[AddedCondition, ...]
    certificate: Certificate
    strategy: Strategy | None = None
    modules: tuple[SupervisedModule, ...] = ()

    @classmethod
    def supervising(
        cls,
        system: ExecutableSystem,
        added: tuple[AddedCondition, ...],
        certificate: Certificate,
        strategy: Strategy | None = None,
        modules: tuple[SupervisedModule, ...] = (),
    ) -> Self:
        """The supervisor of a system that is built already."""
        made = cls(system.model, system.deployment, added, certificate, strategy, modules)
        # No field: a supervisor's file does not hold it.
        made.__dict__["executable"] = system
        return made

    @cached_property
    def executable(self) -> ExecutableSystem:
        """Executable system that it supervises, built once."""
        return ExecutableSystem(self.model, self.deployment)

    def added_condition(self, event: str) -> DecisionDiagram | None:
        """The condition added to an event, or None where nothing is added."""
        return next((item.condition for item in self.added if item.event == event), None)

    def __repr__(self) -> str:
        certificate = self.certificate
        strategy = "" if self.strategy is None else f", a strategy for {counted(self.executable.obligations.aims)}"
        modules = f", {len(self.modules)} modules" if self.modules else ""
        return (
            f"<supervisor of {self.model.name}: {self.deployment}, {certified_states(certificate)}{modules}, "
            f"conditions added to {len(self.added)} event{'s' if len(self.added) != 1 else ''}{strategy}>"
        )
