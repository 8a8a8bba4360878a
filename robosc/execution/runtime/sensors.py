"""Outgoing messages that must keep coming: those with a `max_age`."""

from __future__ import annotations

from typing import Dict, List, Mapping, Optional, Sequence, Tuple

from robosc.execution.runtime.calls import FOREVER


class _Sensor:
    """
    An outgoing message with a maximum age.

    :ivar identifier: Identifier on which it comes.
    :ivar max_age_s: Seconds after which it is stale.
    :ivar seen_s: Time when it came last, in seconds; before the first time, when the executor
        started.
    """

    __slots__ = ('identifier', 'max_age_s', 'name', 'seen_s')

    def __init__(self, name: str, identifier: str, max_age_s: float) -> None:
        self.name = name
        self.identifier = identifier
        self.max_age_s = max_age_s
        self.seen_s = 0.0


class Sensors:
    """
    Monitor of stale sensors. Several messages of the model may come on one identifier.

    :param messages: Name and identifier of every outgoing message, in source order, and its
        maximum age in seconds as the model has it, or None.
    :param max_age_s: Maximum age by identifier, from the deployment: it overrides the model's.
    """

    __slots__ = ('_sensors', '_unseen')

    def __init__(
        self, messages: Sequence[Tuple[str, str, Optional[float]]], max_age_s: Mapping[str, float]
    ) -> None:
        ages = [
            (name, identifier, max_age_s.get(identifier, age))
            for name, identifier, age in messages
        ]
        self._sensors: Dict[str, _Sensor] = {
            name: _Sensor(name, identifier, age)
            for name, identifier, age in ages
            if age is not None
        }
        # Those that have not come since the start, in source order.
        self._unseen = dict(self._sensors)

    def __bool__(self) -> bool:
        return bool(self._sensors)

    def start(self, now_s: float) -> None:
        """Start anew: no message has been seen."""
        for sensor in self._sensors.values():
            sensor.seen_s = now_s
        self._unseen = dict(self._sensors)

    def see(self, name: str, now_s: float) -> bool:
        """Take in a message; return True if it is one that is watched."""
        sensor = self._sensors.get(name)
        if sensor is None:
            return False
        sensor.seen_s = now_s
        self._unseen.pop(name, None)
        return True

    def are_all_seen(self) -> bool:
        """Return True if every sensor has sent at least one message."""
        return not self._unseen

    def unseen(self) -> Tuple[str, ...]:
        """Return identifiers of the sensors without a message since the start, each once."""
        return tuple(dict.fromkeys(item.identifier for item in self._unseen.values()))

    def stale(self, now_s: float) -> List[Tuple[str, str]]:
        """Name and identifier of the messages whose maximum age has passed."""
        return [
            (sensor.name, sensor.identifier)
            for sensor in self._sensors.values()
            if now_s >= sensor.seen_s + sensor.max_age_s
        ]

    def deadline_s(self, now_s: float) -> float:
        """Return the time, in seconds, at which the next fresh sensor becomes stale."""
        ages = (sensor.seen_s + sensor.max_age_s for sensor in self._sensors.values())
        return min((age for age in ages if age > now_s), default=FOREVER)
