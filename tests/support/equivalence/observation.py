"""Observation of a controller after each action, and the one message about the difference from the reference."""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from robosc.execution.runtime.event_log import plain

MAXIMUM_FLOAT32 = 3.4028234663852886e38

Issued = tuple[str, str, Mapping[str, Any]]
"""Request to the robot, or report of a layer to its caller.

A request is `publish`, `default`, `call`, `goal` or `cancel`; then its subject (`default`: a topic); then the data
that was given, by path. A report is `pass` and `blocked` (a topic or identifier), `answer`, `no answer`, `accept`,
`reject`, `feedback` and `ended`; the caller's number of the call or goal is in the data. `refused` is what did not
happen, for lack of data.
"""

Entry = Mapping[str, Any]
"""An entry of the event log without its times."""

_TIMES = frozenset({"time", "decision_us"})


@dataclass(frozen=True)
class Observation:
    """Observation of a controller after an action; None: this target does not show it.

    Attributes:
        issued: Requests that it made to the world meanwhile, in order.
        log: Entries that it wrote into its event log meanwhile.
        state: The state of each component and its variables.
        enabled: Every controllable event that is allowed.
        locations: Location of each service and action.
        status: Activity of the executor, and True if it is faulty.
        counters: Counts of what was unknown, of what was unexpected, and of faults.
        cancelling: Actions whose goal is being cancelled, and those of them that should have ended by now.
        progress: Progress of the strategy.
    """

    issued: tuple[Issued, ...] = ()
    log: tuple[Entry, ...] = ()
    state: Mapping[str, Any] | None = None
    enabled: frozenset[str] | None = None
    locations: Mapping[str, str] | None = None
    status: tuple[str, bool] | None = None
    counters: tuple[int, int, int] | None = None
    cancelling: tuple[Sequence[str], Sequence[str]] | None = None
    progress: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Sight:
    """Extent of what a target shows.

    Attributes:
        topics: The topic of each message, for a target that does not show which of those on a topic was sent.
        names: The first of the services or actions on each identifier, for a target that does not show which was asked.
        is_exact: False for a target seen over a middleware, with `topics`. The given properties are not visible then,
            a field may have less precision than the model's number, and topics have no order between them.
        log_keys: Parts of an entry of the log that it reports; None: all.
        has_log: True if it writes a log.
        has_readings: True if the log reports, with an event of the environment, what the model reads of the data that
            came; else it reports the data as it came, which is not compared.
        has_requests: True if it reports, with a request, what the model knows of its data; a layer on a middleware
            reports the whole message, which is not compared. Nor are the numbers that limits moved: a plain value is
            the field of a message there.
    """

    topics: Mapping[str, str] | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    is_exact: bool = False
    log_keys: frozenset[str] | None = None
    has_log: bool = True
    has_readings: bool = True
    has_requests: bool = True


FULL = Sight()
NO_LOG = Sight(has_log=False)


def entry(found: Mapping[str, Any]) -> Entry:
    """An entry of an event log as JSON has it, without its times."""
    return {key: plain(value) for key, value in found.items() if key not in _TIMES}


def difference(target: str, number: int, what: str, expected: Observation, found: Observation, sight: Sight) -> str:
    """Return the first difference, in words; empty if there is none.

    Args:
        target: Its name.
        number: Number of the step.
        what: Description of what happened in it.
        expected: Observation of the reference.
        found: Observation of the target.
        sight: Extent of what the target shows.
    """
    pairs: list[tuple[str, Any, Any]] = [
        ("what it asks for", _seen(expected.issued, sight), _seen(found.issued, sight)),
    ]
    if sight.has_log:
        pairs.append(("the event log", _visible(expected.log, sight), _visible(found.log, sight)))
    for name in ("state", "locations", "enabled", "status", "counters", "cancelling", "progress"):
        if getattr(found, name) is not None:
            pairs.append((name, getattr(expected, name), getattr(found, name)))
    for name, left, right in pairs:
        if left != right:
            detail = _detail(left, right)
            return f"{target}, step {number}, {what[:300]}: {name} differs: {detail}"
    return ""


def _seen(issued: Sequence[Issued], sight: Sight) -> list[Any]:
    if sight.topics is None:
        return [list(item) for item in issued]
    if sight.is_exact:
        return [
            [kind, sight.topics.get(name, name) if kind == "publish" else name, data] for kind, name, data in issued
        ]
    found = []
    for kind, name, data in issued:
        if kind == "default":
            found.append(["publish", name, {}])
        else:
            kind = "answer" if kind == "no answer" else kind
            subject = sight.topics.get(name, name) if kind == "publish" else sight.names.get(name, name)
            found.append([kind, subject, {path: part for path, value in data.items() if (part := _on_wire(value))}])
    # A middleware keeps the order on each topic; between topics, the event log keeps it.
    return sorted(found, key=lambda item: item[:2])


def _on_wire(value: Any) -> Any:
    if not isinstance(value, float) or abs(value) > MAXIMUM_FLOAT32:
        return value
    return struct.unpack("f", struct.pack("f", value))[0]


def _visible(log: Sequence[Entry], sight: Sight) -> list[Entry]:
    for is_controllable, is_shown in ((False, sight.has_readings), (True, sight.has_requests)):
        if not is_shown:
            log = [{**item, "data": None} if item.get("controllable") is is_controllable else item for item in log]
    if not sight.has_requests:
        log = [{**item, "limited": None} if "limited" in item else item for item in log]
    if sight.log_keys is None:
        return list(log)
    return [{key: value for key, value in item.items() if key in sight.log_keys} for item in log]


def _detail(left: Any, right: Any) -> str:
    """Describe the expected and the found value of the first part that differs."""
    if isinstance(left, dict) and isinstance(right, dict):
        for key in [*left, *(key for key in right if key not in left)]:
            if key not in left or key not in right or left[key] != right[key]:
                return f"{key}: {_detail(left.get(key), right.get(key))}"
    if isinstance(left, list) and isinstance(right, list) and len(left) == len(right):
        number = next(number for number in range(len(left)) if left[number] != right[number])
        return f"{number + 1} of {len(left)}: {_detail(left[number], right[number])}"
    if isinstance(left, frozenset) and isinstance(right, frozenset):
        return f"expected also {sorted(left - right)}, found also {sorted(right - left)}"
    return f"expected {_text(left)}, found {_text(right)}"


def _text(value: Any) -> str:
    return json.dumps(value, default=list)[:600]
