"""
The two borders of the executor: the controlled system below it, the middleware beside it.

A `ControlledSystem` is the supervisor as code: `robosc.execution.interpreter` interprets a
`Supervisor`, a target generates a class with the same methods. The `Executor` adds what semantics
part 3 says about time: batches, silent steps, decisions, release, safe stop, log. `Middleware` is
what it needs of ROS, a bridge or a test. The `Layer` does the same for requests of an existing
controller: its `RobotSide` is what it needs of the robot, its `LayerMiddleware` what it needs of
that controller.

This package's modules other than `interpreter` import nothing of RoboSC but each other and run on
Python 3.8 and later: generated packages carry copies of them.
"""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Optional, Protocol, Sequence, Tuple

OUTGOING = 'outgoing message'
"""The only kind of communication that has no request."""


class CommunicationInfo(NamedTuple):
    """
    Facts about a message, service or action that the executor must know.

    :ivar name: Its name in the model.
    :ivar component: The component that declares it.
    :ivar kind: `incoming message`, `outgoing message`, `service` or `action`.
    :ivar identifier: Topic, service or action name.
    :ivar package: ROS package of its interface, or None if it is not linked.
    :ivar interface: Type name of its interface, or None.
    :ivar requirement_count: Number of requirements on its request.
    :ivar conjunct_count: Number of top-level conjuncts of those requirements, all counted on.
    :ivar max_age_s: Seconds after which an outgoing message is stale, if the model says so.
    :ivar has_condition: True if an incoming message says with `when` which messages it is, in a
        supervision layer.
    """

    name: str
    component: str
    kind: str
    identifier: str
    package: Optional[str]
    interface: Optional[str]
    requirement_count: int
    conjunct_count: int
    max_age_s: Optional[float] = None
    has_condition: bool = False


class Description(NamedTuple):
    """
    The static part of a controlled system; all tuples in source order.

    :ivar name: The robot's name.
    :ivar deployment: `controller` or `layer`.
    :ivar bundle_sha256: Digest of the model's files.
    :ivar communications: Every communication.
    :ivar resets: Reset events of services and actions.
    :ivar taus: Tau events that can change something.
    :ivar silent_bound: More silent steps than this in a row can only be a run that does not end.
    :ivar has_strategy: True if the supervisor has a strategy that reaches the goals of the model.
    """

    name: str
    deployment: str
    bundle_sha256: str
    communications: Tuple[CommunicationInfo, ...]
    resets: Tuple[str, ...]
    taus: Tuple[str, ...]
    silent_bound: int
    has_strategy: bool = False


def requesting(infos: Sequence[CommunicationInfo]) -> Tuple[CommunicationInfo, ...]:
    """
    Return the communications that are requested, in source order.

    A request's number is its place among them.
    """
    return tuple(info for info in infos if info.kind != OUTGOING)


def batches(infos: Sequence[CommunicationInfo]) -> Dict[str, Tuple[Tuple[str, str], ...]]:
    """Return the model's messages that each received identifier stands for, with their events."""
    found: Dict[str, Tuple[Tuple[str, str], ...]] = {}
    for info in infos:
        if info.kind == OUTGOING:
            found[info.identifier] = (
                *found.get(info.identifier, ()),
                (info.name, info.name + '.response'),
            )
    return found


class Reading(NamedTuple):
    """
    Received data after conversion (enum rules, ranges), before anything changes.

    :ivar values: One value (None: unknown) for each datum that updates on the event read, as the
        system wants them.
    :ivar data: The same by name (`value.front`), for the log.
    :ivar unknown: Descriptions of what was unknown: an enum that fell to its default past an
        unknown rule, an integer that was clamped. Empty: nothing was.
    :ivar enum_unknown: True if an enum fell to its default although an earlier rule was unknown.
    """

    values: Any
    data: Dict[str, Any]
    unknown: Tuple[str, ...]
    enum_unknown: bool


class Match(NamedTuple):
    """
    Result of matching an existing controller's message with an incoming message of the model.

    :ivar holds: True if the condition `when` is true of it, or if there is none.
    :ivar unknown: Descriptions of what was unknown, as in a `Reading`.
    :ivar enum_unknown: The same as in a `Reading`.
    """

    holds: bool
    unknown: Tuple[str, ...]
    enum_unknown: bool


MATCHES = Match(True, (), False)
"""Any message is one that has no condition."""


class ControlledSystem(Protocol):
    """
    Plants, requirements and supervisor of one robot, with their current state.

    :ivar description: Its static part.
    :ivar changes: Grows whenever the state may have become another: while it stays the same, so
        does the state.
    """

    description: Description
    changes: int

    def restart(self) -> None:
        """Back to the initial state."""

    def enabled(self, event: str) -> bool:
        """
        Return True if a controllable event is allowed now.

        By plants, ranges, requirements and supervisor.

        A tau that would change nothing in the current state is not enabled.
        """

    def enabled_requests(self) -> Tuple[int, ...]:
        """
        Return the requests that are allowed now.

        Their numbers, from 0, among all requests in source order.
        """

    def enabled_silent(self) -> Optional[str]:
        """
        Return the first of the description's resets, then its taus, that is allowed now.

        None if none is.
        """

    def receive(
        self, identifier: str, data: Any
    ) -> Optional[Tuple[Tuple[str, Tuple[str, ...]], ...]]:
        """
        Convert what came on an identifier, and take its outgoing messages' events in source order.

        For the common case, in which no `Reading` need be looked at. The state accepts these
        events whatever it is.

        :returns: The events at which updates were skipped, with these (mostly empty), or None if
            something of the data is unknown; then nothing has changed, and each event is to be
            read and taken by itself.
        """

    def read(self, event: str, data: Any) -> Reading:
        """Convert what came with an uncontrollable event; change nothing, never raise."""

    def step(self, event: str, reading: Optional[Reading] = None) -> Optional[Tuple[str, ...]]:
        """
        Take an event: move and update, all at once.

        :returns: The updates that were skipped because their value is unknown, in words (mostly
            empty), or None if the state cannot accept the event; then nothing has changed.
        """

    def provide(self, communication: str) -> Tuple[bool, Any]:
        """
        Return data for a request in the current state: (is known, data).

        Data is a dict of properties (nested dicts), a plain value, or None for the middleware's
        default.
        """

    def matches(self, communication: str, data: Any) -> Match:
        """
        Tell whether a message is an incoming message, by its condition `when`.

        Never raises for any data.
        """

    def requirements(self, communication: str) -> Tuple[bool, ...]:
        """Tell of each requirement on a communication's request whether it holds, in order."""

    def conjuncts(self, communication: str) -> Tuple[bool, ...]:
        """For each top-level conjunct of those requirements: whether it holds now."""

    def location(self, communication: str) -> str:
        """Location of a service's or action's plant."""

    def state(self) -> Dict[str, Dict[str, Any]]:
        """Return {component: {"state": s, "variables": {v: value}}} for those with a behaviour."""

    def signature(self) -> Any:
        """Return a hashable value that tells states apart."""


class StrategicSystem(ControlledSystem, Protocol):
    """A controlled system with a strategy, which its description says."""

    def observe(self) -> None:
        """
        Take in a stable state, for what the strategy remembers of goals and assumptions.

        To observe a state again changes nothing.
        """

    def choose(self) -> Optional[int]:
        """
        Return the number of the request that the strategy chooses in this stable state.

        None if it waits. Goals that are true are noted.
        """


class RobotSide(Protocol):
    """
    Robot's side for an executor of either deployment.

    Replies come back through the executor's methods, later.
    """

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if a message of a request is the all-default one (its header apart)."""

    def publish(self, communication: str, message: Any) -> None:
        """Send an incoming message's message."""

    def publish_default(self, identifier: str) -> None:
        """Send the all-default message on an identifier that several communications may share."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Call a service without waiting; the executor's `on_reply` or `on_call_failed` comes."""

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Send an action's goal without waiting; `on_goal_accepted` or `on_goal_ended` follows."""

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Ask the server to cancel an accepted goal."""


class Middleware(RobotSide, Protocol):
    """Middleware for a controller's executor: the robot, and messages made of the model's data."""

    def prepare(self, communication: str, data: Any) -> Any:
        """
        Return the middleware's message for a request, from the model's data; None: the default.

        The data is not to be changed: it stands in the log, and may come again.

        :raises DataDoesNotFit: A value does not fit its field; the request is then not issued.
        """


class LayerMiddleware(Protocol):
    """
    Reports of a supervision layer to the existing controller, the caller.

    The ids of calls and goals here are the caller's own; the robot's side never sees them.
    """

    def pass_on(self, identifier: str, message: Any) -> None:
        """Pass on a message of the robot, unchanged, after the supervisor has seen it."""

    def blocked(self, identifier: str) -> None:
        """Tell that a request on an identifier was held back."""

    def answer(self, communication: str, call_id: Any, data: Any) -> None:
        """Pass on the service's reply to a call, unchanged."""

    def answer_default(self, communication: str, call_id: Any) -> None:
        """Give a default reply to a call that was held back or has failed."""

    def accept_goal(self, communication: str, goal_id: Any) -> None:
        """Accept a goal, which is let through. Exactly one `end_goal` follows."""

    def reject_goal(self, communication: str, goal_id: Any) -> None:
        """Reject a goal, which is held back."""

    def pass_feedback(self, communication: str, goal_id: Any, data: Any) -> None:
        """Feedback of a goal, unchanged."""

    def end_goal(self, communication: str, goal_id: Any, outcome: str, data: Any) -> None:
        """
        End an accepted goal for its caller.

        :param communication: The action.
        :param goal_id: Id of the goal.
        :param outcome: `succeeded`, `aborted` or `cancelled`.
        :param data: The server's result, unchanged; None for the default one.
        """


class DataDoesNotFit(Exception):
    """A value does not fit the middleware's field."""
