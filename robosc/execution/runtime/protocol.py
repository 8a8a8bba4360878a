"""
The two interfaces of the executor: to the controlled system and to the middleware.

A `ControlledSystem` is the supervisor as code: `robosc.execution.interpreter` interprets a
`Supervisor`, a target generates a class with the same methods. The `Executor` adds the behaviour
in time: batches, silent steps, decisions, release, safe stop, log. It reaches
ROS, a bridge or a test through `Middleware`. The `Layer` does the same for requests of an existing
controller. It reaches the robot through `RobotSide`, and that controller through
`LayerMiddleware`.

This package's modules other than `interpreter` import nothing of RoboSC but each other and run on
Python 3.8 and later: generated packages carry copies of them.
"""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Optional, Protocol, Sequence, Tuple

OUTGOING = 'outgoing message'
"""The only kind of communication that has no request."""


class CommunicationInfo(NamedTuple):
    """
    Facts about a message, service or action that the executor needs.

    :ivar name: Its name in the model.
    :ivar component: The component that declares it.
    :ivar kind: `incoming message`, `outgoing message`, `service` or `action`.
    :ivar identifier: Topic, service or action name.
    :ivar package: ROS package of its interface, or None if it is not linked.
    :ivar interface: Type name of its interface, or None.
    :ivar requirement_count: Number of requirements on its request.
    :ivar conjunct_count: Number of top-level conjuncts of those requirements, all counted on.
    :ivar max_age_s: Seconds after which an outgoing message is stale, if the model says so.
    :ivar has_condition: True if it has a condition `when`, by which a supervision layer recognizes
        its requests.
    :ivar is_when_default: True if that condition is that a request is the all-default one.
    :ivar has_limits: True if there are limits of its request.
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
    is_when_default: bool = False
    has_limits: bool = False


class Aim(NamedTuple):
    """
    Condition that a strategy makes true again and again, or that it assumes to be made true.

    :ivar name: Its name, such as `goal 1` or `assumption 2`.
    :ivar words: The goal or assumption as a user writes it; of a visit its condition.
    :ivar mission: Name of the mission that it is a visit of; None: it is none.
    """

    name: str
    words: str
    mission: Optional[str] = None


class MissionInfo(NamedTuple):
    """
    A mission as aims, which follow each other: its own visits, then those of each detour.

    :ivar name: Its name.
    :ivar first: Number of the aim that is its first visit.
    :ivar visits: Number of its own visits.
    :ivar detours: Number of visits of each detour.
    """

    name: str
    first: int
    visits: int
    detours: Tuple[int, ...]


class Description(NamedTuple):
    """
    The static part of a controlled system; all tuples in source order.

    :ivar name: The robot's name.
    :ivar deployment: `controller` or `layer`.
    :ivar bundle_sha256: Digest of the model's files.
    :ivar communications: Every communication.
    :ivar resets: Reset events of services and actions.
    :ivar taus: Tau events that can change something.
    :ivar silent_bound: Maximum number of silent steps in a row of a run that ends.
    :ivar has_strategy: True if the supervisor has a strategy that reaches the goals of the model.
    :ivar aims: Aims of the strategy, in its order: the goals, then the visits of each mission.
    :ivar assumptions: Its assumptions about the surroundings, in source order.
    :ivar missions: Its missions, in source order.
    :ivar sure_updates: Updates that are never skipped by what was proved: the event, and the
        variable with its component. To skip one is a fault.
    """

    name: str
    deployment: str
    bundle_sha256: str
    communications: Tuple[CommunicationInfo, ...]
    resets: Tuple[str, ...]
    taus: Tuple[str, ...]
    silent_bound: int
    has_strategy: bool = False
    aims: Tuple[Aim, ...] = ()
    assumptions: Tuple[Aim, ...] = ()
    missions: Tuple[MissionInfo, ...] = ()
    sure_updates: Tuple[Tuple[str, str], ...] = ()


def requesting(infos: Sequence[CommunicationInfo]) -> Tuple[CommunicationInfo, ...]:
    """
    Return the communications that have a request, in source order.

    The number of a request is its place among them.
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


class MissingData(ValueError):
    """
    Data of an event that lacks what every message has.

    A boolean, an integer with a range, and an enum cannot be unknown by their types, and nothing
    was proved about an event without them: so it does not happen.
    """


class Reading(NamedTuple):
    """
    Received data after conversion (enum rules, ranges), before the state changes.

    :ivar values: One value (None: unknown) for each datum that updates on the event read, in the
        form that the system needs.
    :ivar data: The same values by name (`value.front`), for the log.
    :ivar unknown: Descriptions of unknown data: an enum that got its default because a rule was
        unknown, an integer that was clamped. Empty: nothing was unknown.
    :ivar enum_unknown: True if an enum got its default although an earlier rule was unknown.
    """

    values: Any
    data: Dict[str, Any]
    unknown: Tuple[str, ...]
    enum_unknown: bool


class Match(NamedTuple):
    """
    Result of matching an existing controller's message with an incoming message of the model.

    :ivar holds: True if the condition `when` is true for the message, or if there is none.
    :ivar unknown: Descriptions of unknown data, as in a `Reading`.
    :ivar enum_unknown: The same as in a `Reading`.
    """

    holds: bool
    unknown: Tuple[str, ...]
    enum_unknown: bool


MATCHES = Match(True, (), False)
"""Result for an incoming message without a condition: every message matches."""


class ControlledSystem(Protocol):
    """
    Plants, requirements and supervisor of one robot, with their current state.

    :ivar description: Its static part.
    :ivar changes: Number that grows whenever the state may have changed: while the number stays
        the same, so does the state.
    """

    description: Description
    changes: int

    def restart(self) -> None:
        """Return to the initial state."""

    def enabled(self, event: str) -> bool:
        """
        Return True if a controllable event is allowed now.

        Plants, ranges, requirements and the supervisor must allow it. A tau that would change
        nothing in the current state is not enabled.
        """

    def enabled_requests(self) -> Tuple[int, ...]:
        """
        Return the numbers of the requests that are allowed now.

        All requests are numbered from 0 in source order.
        """

    def changed_requests(self) -> Sequence[int]:
        """
        Return the numbers of the requests that are allowed now and were not before, or vice versa.

        That is since the last call; the first time, and after `restart`, those that are allowed.
        An executor calls it in each stable state, so it takes no longer than what has changed.
        """

    def enabled_silent(self) -> Optional[str]:
        """
        Return the silent step that is allowed now, or None if none is.

        Resets come before taus, each in the order of the description.
        """

    def receive(
        self, identifier: str, data: Any
    ) -> Optional[Tuple[Tuple[str, Tuple[str, ...]], ...]]:
        """
        Convert a received message, and take the events of its outgoing messages in source order.

        This is for the common case, in which no data is unknown. Every state accepts these events.

        :returns: The events with skipped updates, and these updates (mostly empty); or None if
            some data is unknown. Then nothing has changed, and the caller must read and take each
            event by itself.
        :raises MissingData: As `read`. Then nothing has changed.
        """

    def read(self, event: str, data: Any) -> Reading:
        """
        Convert the data of an uncontrollable event; change nothing.

        :raises MissingData: A part is missing that cannot be unknown by its type; nothing else is
            raised, whatever the data is.
        """

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

    def limits(self, communication: str) -> Sequence[Tuple[Tuple[str, ...], float, float]]:
        """
        Return the bounds of numbers of a request that apply in the current state.

        Each has the properties that lead to the number, a lower and an upper bound.
        """

    def matches(self, communication: str, data: Any) -> Match:
        """
        Return whether a request is a communication's, by its condition `when`.

        Never raises for any data.
        """

    def requirements(self, communication: str) -> Tuple[bool, ...]:
        """Return for each requirement on a communication's request whether it holds, in order."""

    def conjuncts(self, communication: str) -> Tuple[bool, ...]:
        """Return for each top-level conjunct of those requirements whether it holds now."""

    def location(self, communication: str) -> str:
        """Location of a service's or action's plant."""

    def state(self) -> Dict[str, Dict[str, Any]]:
        """Return {component: {"state": s, "variables": {v: value}}} for those with a behaviour."""

    def signature(self) -> Any:
        """Return a hashable value that differs between states."""


class StrategicSystem(ControlledSystem, Protocol):
    """
    A controlled system with a strategy, which its description says.

    What it makes of a stable state depends on that state's situation and on what it remembers, so
    that an executor need not ask again what it asked before.

    :ivar mode: Number of the aim whose turn it is: the one that the last choice approached, unless
        all of them were met.
    """

    mode: int

    def situation(self) -> Any:
        """
        Return the part of the state that `observe` and `choose` depend on, as a hashable value.

        Everything else that they depend on is remembered.
        """

    def remembered(self) -> Any:
        """Return what is remembered of goals and missions, with `mode`, as a hashable value."""

    def recall(self, remembered: Any) -> None:
        """Remember what `remembered` has returned, and nothing else."""

    def observe(self) -> Tuple[bool, ...]:
        """
        Take in a stable state, for what the strategy remembers of goals and assumptions.

        To observe a state again changes nothing.

        :returns: For each aim, then for each assumption, whether it is met in this state; a visit
            is where nothing is to be done for it. Then for each visit, in the order of the aims,
            whether its mission or detour is at it now; then for each mission, whether every visit
            of its own is true.
        """

    def choose(self) -> Optional[int]:
        """
        Return the number of the request that the strategy chooses in this stable state.

        The state has been observed. None if the strategy waits. Goals that are true are noted.
        """


class RobotSide(Protocol):
    """
    Robot's side for an executor of either deployment.

    Replies come back through the executor's methods, later.
    """

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if a message of a request is the all-default one (its header apart)."""

    def publish(self, communication: str, message: Any) -> None:
        """Send the message of an incoming message."""

    def publish_default(self, identifier: str) -> None:
        """Send the all-default message on an identifier that several communications may share."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Call a service without waiting; the executor's `on_reply` or `on_call_failed` comes."""

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Send an action's goal without waiting; `on_goal_accepted` or `on_goal_ended` follows."""

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Ask the server to cancel an accepted goal."""


class Middleware(RobotSide, Protocol):
    """Middleware for a controller's executor: it also makes messages from the model's data."""

    def prepare(self, communication: str, data: Any) -> Any:
        """
        Return the middleware's message for a request, from the model's data; None: the default.

        The data must not be changed: the log keeps it, and it may be passed again.

        :raises DataDoesNotFit: A value does not fit its field; the request is then not issued.
        """


class LayerMiddleware(Protocol):
    """
    Reports of a supervision layer to the existing controller, the caller.

    The ids of calls and goals here are the caller's own; the robot's side never sees them.
    """

    def pass_on(self, identifier: str, message: Any) -> None:
        """Pass on a message of the robot, unchanged, after the supervisor has seen it."""

    def blocked(self, identifier: str, why: str) -> None:
        """Report that a request on an identifier was held back, and why."""

    def answer(self, communication: str, call_id: Any, data: Any) -> None:
        """Pass on the service's reply to a call, unchanged."""

    def answer_default(self, communication: str, call_id: Any, why: str) -> None:
        """
        Give a default reply to a call that was held back or has failed.

        The reason stands in the reply where its type has a text for that.
        """

    def accept_goal(self, communication: str, goal_id: Any) -> None:
        """Accept a goal that is let through. Exactly one `end_goal` follows."""

    def reject_goal(self, communication: str, goal_id: Any, why: str) -> None:
        """Reject a goal that is held back, and say why if the middleware can."""

    def pass_feedback(self, communication: str, goal_id: Any, data: Any) -> None:
        """Feedback of a goal, unchanged."""

    def end_goal(
        self, communication: str, goal_id: Any, outcome: str, data: Any, why: str
    ) -> None:
        """
        End an accepted goal for its caller.

        :param communication: The action.
        :param goal_id: Id of the goal.
        :param outcome: `succeeded`, `aborted` or `cancelled`.
        :param data: The server's result, unchanged; None for the default one, in which the reason
            stands where its type has a text for that.
        :param why: Reason why it ends otherwise than its server or its caller wanted; else empty.
        """


class DataDoesNotFit(Exception):
    """A value does not fit the middleware's field."""
