"""Reports of any source: the robot, its status, its events. Plain values, ready for the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from robosc.execution.runtime.event_log import Entry
from robosc.execution.runtime.progress import Progress


class SourceKind(StrEnum):
    """Kind of source."""

    BRIDGE = "bridge"
    ROS2 = "ros2"
    LOG = "log"
    MODEL = "model"


@dataclass(frozen=True, slots=True)
class CommunicationInfo:
    """A communication of the model.

    Attributes:
        name: Name of the communication.
        component: Component that declares it.
        kind: `incoming message`, `outgoing message`, `service` or `action`.
        identifier: Name of its topic, service or action.
        channel: Channel that it is mapped to in a bridge; empty: unknown.
    """

    name: str
    component: str
    kind: str
    identifier: str
    channel: str = ""


@dataclass(frozen=True, slots=True)
class LogSpan:
    """The log that is replayed.

    Attributes:
        begin_s: Time of its first entry, in seconds since 1970-01-01 UTC.
        end_s: Time of its last entry.
        count: Number of its entries.
    """

    begin_s: float
    end_s: float
    count: int


@dataclass(frozen=True, slots=True)
class Notice:
    """A notice for a person."""

    code: str
    text: str
    holds_until_reset: bool = False


@dataclass(frozen=True, slots=True)
class Drive:
    """Report of the drive base.

    Attributes:
        pose: x and y in metres, heading in radians.
        linear_m_s: Forward speed.
        angular_rad_s: Yaw rate, counter-clockwise.
        battery_v: Battery voltage; None: not known.
        is_torque_on: True if the motors hold; None: not known.
    """

    pose: tuple[float, float, float]
    linear_m_s: float
    angular_rad_s: float
    battery_v: float | None
    is_torque_on: bool | None


@dataclass(frozen=True, slots=True)
class Status:
    """Status of the robot: what it is doing.

    Attributes:
        time_s: Time of the status, in seconds since 1970-01-01 UTC.
        state: State of the bridge; empty: there is none.
        problem: Fault that has stopped the robot; empty: none.
        reasons: Reasons why nothing moves.
        warnings: Warnings for a person that do not stop the robot.
        stops: Reasons why nothing is requested.
        devices: Devices, with True for each that works.
        components: State and variables of each component with a behaviour; empty: nothing is executed.
        communications: Location of services and actions, as far as they are known.
        enabled: Names of the communications that may be requested, as the executor reports; None: not reported.
        drive: Report of the drive base; None: none.
        age_s: Age of the status when it came, in seconds.
        last: Number of the transition that each component took last; unknown for components that are not named. None:
            it follows from the entries.
        latencies: Times that the bridge measures of itself: name, 50th and 99th percentile and maximum in milliseconds.
        progress: State of what the strategy aims at and assumes; None: there is no strategy, or it is not reported.
        cancelling: Actions whose goal was to be cancelled and has not ended.
    """

    time_s: float
    state: str = ""
    problem: str = ""
    reasons: Sequence[Notice] = ()
    warnings: Sequence[Notice] = ()
    stops: Sequence[str] = ()
    devices: Mapping[str, bool] = field(default_factory=dict)
    components: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    communications: Mapping[str, str] = field(default_factory=dict)
    enabled: Sequence[str] | None = None
    drive: Drive | None = None
    age_s: float = 0.0
    last: Mapping[str, int] | None = None
    latencies: Sequence[tuple[str, float, float, float]] = ()
    progress: Progress | None = None
    cancelling: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class RunReport:
    """Report of what was just done with a run that is stepped by hand.

    Attributes:
        kind: `step`, `unknown`, `finding`, `changed` (the model), `wrong` or `choose`; empty: nothing was done.
        lines: Sentences about it.
        choice: Choice that an event leaves open; None: none.
    """

    kind: str = ""
    lines: tuple[str, ...] = ()
    choice: "Choice | None" = None


@dataclass(frozen=True, slots=True)
class Choice:
    """Choice that an event of automata leaves open.

    Attributes:
        event: The event.
        line: The event with its data, as it was requested.
        ways: States that it can lead to, each by the values in which it differs from the others.
    """

    event: str
    line: str
    ways: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LaserScan:
    """A revolution of the LiDAR.

    Attributes:
        ranges_m: One a degree, counter-clockwise from the front; not finite: nothing was seen.
        pose: Pose of the robot at that time; None: not known.
    """

    ranges_m: Sequence[float]
    pose: tuple[float, float, float] | None


@dataclass(frozen=True, slots=True)
class EventBatch:
    """Entries of the event log.

    Attributes:
        entries: Entries in their order.
        lost: Number of entries before them that were lost.
    """

    entries: Sequence[Entry]
    lost: int = 0
