"""Content of an event log as messages of ROS 2: topics, types, and the messages over time.

All types are of packages that every ROS 2 has, so that its tools show them without anything of RoboSC:

    /robosc/events                   diagnostic_msgs/msg/DiagnosticArray  each event with its data
    /robosc/blocked                  diagnostic_msgs/msg/DiagnosticArray  each request that a layer held back, and why
    /robosc/log                      rcl_interfaces/msg/Log               every entry in words
    /robosc/state/COMPONENT          std_msgs/msg/String                  a component's state, whenever it changes
    /robosc/variables/COMPONENT/NAME std_msgs/msg/Bool, Int64, Float64 or String, by its values, whenever it changes
    /robosc/pose, /robosc/velocity   geometry_msgs/msg/PoseStamped and TwistStamped, of a record of motion
    /robosc/path, /tf                nav_msgs/msg/Path, the whole way; tf2_msgs/msg/TFMessage, `map` to `base_link`
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from robosc.event_logs.entries import LogEntry
from robosc.event_logs.reading import LogError, LogReader
from robosc.event_logs.values import Kind, Path, as_kind, common_kind, kind_of, leaves, text_of
from robosc.interfaces import nested_types, parse_definition
from robosc.interfaces.distributions import JAZZY
from robosc.motion_record import Motion

EVENTS, BLOCKED, LOG = "/robosc/events", "/robosc/blocked", "/robosc/log"
POSE, VELOCITY, PATH, TF = "/robosc/pose", "/robosc/velocity", "/robosc/path", "/tf"
WORLD, ROBOT = "map", "base_link"

MAXIMUM_TOPICS = 10_000
"""Topics beyond which a log is refused: no tool could show them."""

_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_TYPES = {
    EVENTS: _DIAGNOSTICS,
    BLOCKED: _DIAGNOSTICS,
    LOG: "rcl_interfaces/msg/Log",
    POSE: "geometry_msgs/msg/PoseStamped",
    VELOCITY: "geometry_msgs/msg/TwistStamped",
    PATH: "nav_msgs/msg/Path",
    TF: "tf2_msgs/msg/TFMessage",
}
_FURTHER = {"tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms"}
"""Definitions beside those that come with RoboSC."""

_SECONDS_END = 1 << 31
"""The first second that builtin_interfaces/Time cannot represent."""

_LONGEST_TOKEN = 80
_MOST_POSES = 2000
_INFO, _WARN, _ERROR = 20, 30, 40
_TOLD = ("event", "release", "resume", "restart", "reached", "approach", "met", "cancelling")
_LEVELS = {"fault": _ERROR, "cancel_overdue": _ERROR, **dict.fromkeys(_TOLD, _INFO)}
_WORDS = ("identifier", "action", "aim", "assumption", "what", "why", "unknown", "count")


class Message(NamedTuple):
    """A message at a time.

    Attributes:
        time_ns: Its time, in nanoseconds since 1970-01-01 UTC.
        topic: Its topic.
        content: Its fields.
    """

    time_ns: int
    topic: str
    content: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class LogTopics:
    """Content of a log, as far as it determines the topics.

    Attributes:
        entries: Number of its entries.
        begin_s: Earliest time of an entry, in seconds since 1970-01-01 UTC; 0 if there is none.
        end_s: Latest time of an entry; 0 if there is none.
        states: Topic of each component's state, by the component.
        variables: Topic and kind of each variable, by component and path of names.
        has_blocked: True if a request was held back.
    """

    entries: int
    begin_s: float
    end_s: float
    states: Mapping[str, str]
    variables: Mapping[Path, tuple[str, Kind]]
    has_blocked: bool

    def types(self, motion: Motion | None) -> dict[str, str]:
        """Return the type of each topic.

        Args:
            motion: Motion of the robot, or None.
        """
        names = [EVENTS, LOG, *([BLOCKED] if self.has_blocked else ())]
        names += [POSE, VELOCITY, PATH, TF] if motion is not None else []
        found = {name: _TYPES[name] for name in names}
        found |= dict.fromkeys(self.states.values(), "std_msgs/msg/String")
        return found | {topic: f"std_msgs/msg/{kind.value}" for topic, kind in self.variables.values()}


def definition_text(type_: str) -> str:
    """Return the definition of a message with those of all that it holds, as `ros2msg` schemas have it.

    Args:
        type_: Its name, such as `std_msgs/msg/Bool`.
    """
    texts, waiting = {}, [type_]
    while waiting:
        name = waiting.pop(0)
        if name not in texts:
            package, _, _ = name.split("/")
            texts[name] = _FURTHER.get(name) or JAZZY.definitions[name]
            nested = sorted(nested_types(parse_definition(texts[name], package)))
            waiting += [each.replace("/", "/msg/") for each in nested]
    first, *further = texts
    line = "=" * 80
    return "\n".join([texts[first], *(f"{line}\nMSG: {name.replace('/msg/', '/')}\n{texts[name]}" for name in further)])


def topics_of(reader: LogReader, name: str) -> LogTopics:
    """Go through a log, and return its topics.

    Args:
        reader: The log.
        name: Its name, for messages.

    Raises:
        LogError: It is no event log, or has what no message can hold.
        OSError: It cannot be read.
    """
    components: dict[str, Any] = {}
    kinds: dict[Path, set[Kind]] = {}
    count, begin_s, end_s, has_blocked = 0, math.inf, -math.inf, False
    for entry in reader:
        count += 1
        begin_s, end_s = min(begin_s, entry.time_s), max(end_s, entry.time_s)
        has_blocked |= entry.kind == "blocked"
        if not 0 <= entry.time_s < _SECONDS_END:
            raise LogError(
                f"{name}, line {entry.line}: its 'time' is before 1970 or after 2038, which messages cannot represent"
            )
        for component, part in entry.state.items():
            if components.get(component) is not part:
                components[component] = part
                for path, value in leaves(part["variables"], (component,)):
                    kinds.setdefault(path, set()).add(kind_of(value))
        if len(components) + len(kinds) > MAXIMUM_TOPICS:
            raise LogError(f"{name}, line {entry.line}: more than {MAXIMUM_TOPICS} components and variables")
    taken: set[str] = set()
    states = {component: _topic(("state", component), taken) for component in components}
    variables = {path: (_topic(("variables", *path), taken), common_kind(found)) for path, found in kinds.items()}
    return LogTopics(count, begin_s if count else 0.0, end_s if count else 0.0, states, variables, has_blocked)


def log_messages(entries: Iterable[LogEntry], topics: LogTopics, name: str) -> Iterator[Message]:
    """Return the messages of a log.

    Args:
        entries: Its entries.
        topics: Its topics.
        name: Name of the log, which stands in the messages.
    """
    components: dict[str, Any] = {}
    published: dict[str, Any] = {}
    for entry in entries:
        time_ns = _nanoseconds(entry.time_s)
        stamp = _stamp(time_ns)
        yield Message(time_ns, LOG, _log(entry, stamp, name))
        if entry.kind == "blocked":
            yield Message(
                time_ns, BLOCKED, _diagnostics(stamp, 1, entry.text("identifier"), entry.text("why"), name, [])
            )
        if entry.kind != "event":
            continue
        who = "controllable" if entry.is_controllable else "uncontrollable"
        values = [*_pairs(entry.data), *_pairs(entry.document.get("decision_us"), "decision_us")]
        yield Message(time_ns, EVENTS, _diagnostics(stamp, 0, entry.event, who, name, values))
        for component, part in entry.state.items():
            before = components.get(component)
            if before is part:
                continue
            components[component] = part
            if before is None or before["state"] != part["state"]:
                yield Message(time_ns, topics.states[component], {"data": part["state"]})
            for path, value in leaves(part["variables"], (component,)):
                topic, kind = topics.variables[path]
                converted = as_kind(value, kind)
                if topic not in published or published[topic] != converted:
                    published[topic] = converted
                    yield Message(time_ns, topic, {"data": converted})


def motion_messages(motion: Motion) -> Iterator[Message]:
    """Return the messages of a robot's motion, but for what happened.

    Raises:
        LogError: A time of it cannot be reported.
    """
    if any(not 0 <= sample.time < _SECONDS_END for sample in motion.samples):
        raise LogError("a time of the record of motion is before 1970 or after 2038, which messages cannot represent")
    step = -(-len(motion.samples) // _MOST_POSES)
    for number, sample in enumerate(motion.samples):
        time_ns = _nanoseconds(sample.time)
        header = {"stamp": _stamp(time_ns), "frame_id": WORLD}
        place = {"x": sample.x_m, "y": sample.y_m, "z": 0.0}
        turn = _quaternion(sample.heading_rad)
        if not number:
            # At the begin, so that the whole way is seen at any time.
            chosen = [*motion.samples[:-1:step], motion.samples[-1]]
            poses = [
                {
                    "header": {"stamp": _stamp(_nanoseconds(each.time)), "frame_id": WORLD},
                    "pose": {
                        "position": {"x": each.x_m, "y": each.y_m, "z": 0.0},
                        "orientation": _quaternion(each.heading_rad),
                    },
                }
                for each in chosen
            ]
            yield Message(time_ns, PATH, {"header": header, "poses": poses})
        yield Message(time_ns, POSE, {"header": header, "pose": {"position": place, "orientation": turn}})
        twist = {"linear": {"x": sample.linear_m_s}, "angular": {"z": sample.angular_rad_s}}
        yield Message(time_ns, VELOCITY, {"header": {**header, "frame_id": ROBOT}, "twist": twist})
        transform = {"translation": place, "rotation": turn}
        yield Message(
            time_ns, TF, {"transforms": [{"header": header, "child_frame_id": ROBOT, "transform": transform}]}
        )


def happening_messages(motion: Motion, name: str) -> Iterator[Message]:
    """Return what happened in a record of motion, in words: collisions, the goal, obstacles that were moved.

    Args:
        motion: The record.
        name: Name of the log, which stands in the messages.
    """
    for number, event in enumerate(motion.happenings, 1):
        time_ns = _nanoseconds(event.time)
        where = f"at x = {event.x_m:g} m, y = {event.y_m:g} m"
        text = " ".join(filter(None, (event.happening, event.name, where)))
        level = _WARN if event.happening == "collision" else _INFO
        yield Message(time_ns, LOG, _log_fields(_stamp(time_ns), level, event.happening, text, name, "motion", number))


def _topic(names: Iterable[str], taken: set[str]) -> str:
    """Return a name that ROS accepts and that is not taken yet, and take it."""
    tokens = [re.sub(r"[^A-Za-z0-9_]", "_", each)[:_LONGEST_TOKEN] or "_" for each in names]
    topic = "/".join(["/robosc", *("_" + token if token[0].isdigit() else token for token in tokens)])
    found, number = topic, 1
    while found in taken:
        number += 1
        found = f"{topic}_{number}"
    taken.add(found)
    return found


def _pairs(value: Any, name: str = "data") -> list[dict[str, str]]:
    """The parts of data, as names and texts."""
    return [{"key": ".".join(path[1:]) or name, "value": text_of(part)} for path, part in leaves(value, (name,))]


def _diagnostics(
    stamp: Mapping[str, int], level: int, name: str, message: str, log: str, values: list[dict[str, str]]
) -> dict[str, Any]:
    status = {"level": level, "name": name, "message": message, "hardware_id": log, "values": values}
    return {"header": {"stamp": stamp, "frame_id": ""}, "status": [status]}


def _log(entry: LogEntry, stamp: Mapping[str, int], name: str) -> dict[str, Any]:
    level = _LEVELS.get(entry.kind, _WARN)
    words = [_words(entry.document[field]) for field in _WORDS if entry.document.get(field) is not None]
    words += [f"{pair['key']} = {pair['value']}" for pair in _pairs(entry.data)]
    subject = entry.event if entry.kind == "event" else f"{entry.kind} {entry.event}".strip()
    text = f"{subject}: {', '.join(words)}" if words else subject
    return _log_fields(stamp, level, entry.event or entry.kind, text, name, entry.kind, entry.line)


def _words(value: Any) -> str:
    return ", ".join(map(text_of, value)) if isinstance(value, list) else text_of(value)


def _log_fields(
    stamp: Mapping[str, int], level: int, name: str, text: str, file: str, function: str, line: int
) -> dict[str, Any]:
    return {
        "stamp": stamp, "level": level, "name": name, "msg": text, "file": file, "function": function, "line": line,
    }  # fmt: skip


def _nanoseconds(time_s: float) -> int:
    # A double holds today's time to a quarter of a microsecond: more digits would be made up.
    return round(time_s * 1e6) * 1000


def _stamp(time_ns: int) -> dict[str, int]:
    sec, nanosec = divmod(time_ns, 1_000_000_000)
    return {"sec": sec, "nanosec": nanosec}


def _quaternion(heading_rad: float) -> dict[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(heading_rad / 2), "w": math.cos(heading_rad / 2)}
