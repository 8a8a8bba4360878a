"""Reports of an executor about itself: entries of the event log, and counters for diagnostics."""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Optional, Sequence

from robosc.execution.runtime.clock import Clock
from robosc.execution.runtime.event_log import EventLog
from robosc.execution.runtime.protocol import Aim, ControlledSystem


class Counters(NamedTuple):
    """
    Counts of what went wrong so far.

    :ivar unknown: Enums that got their default because a rule was unknown, received integers that
        were moved into their range, updates that were skipped, requests whose data was unknown or
        did not fit.
    :ivar unexpected: Events that the state could not accept, replies that match no request.
    :ivar faults: Faults.
    :ivar dropped: Entries that the event log lost.
    :ivar limited: Numbers of requests that were moved into the bounds of limits.
    """

    unknown: int
    unexpected: int
    faults: int
    dropped: int
    limited: int = 0


class Recorder:
    """
    Recorder that counts, and writes entries; nothing in it raises.

    :param system: System whose state stands in the entries of events.
    :param clock: Clock that gives the time of an entry.
    :param log: Log for the entries.
    :ivar began_s: Reading of the clock when the handling of the last message began: decision times
        count from here.
    """

    __slots__ = (
        '_clock',
        '_log',
        '_lost',
        '_system',
        'began_s',
        'faults',
        'limited_count',
        'unexpected_count',
        'unknown_count',
    )

    def __init__(self, system: ControlledSystem, clock: Clock, log: EventLog) -> None:
        self._system = system
        self._clock = clock
        self._log = log
        self._lost = 0
        self.unknown_count = 0
        self.limited_count = 0
        self.unexpected_count = 0
        self.faults = 0
        self.began_s = 0.0

    @property
    def is_active(self) -> bool:
        """Return True if the log keeps anything now."""
        return self._log.is_active

    def counters(self) -> Counters:
        """Return the counters now."""
        return Counters(
            self.unknown_count,
            self.unexpected_count,
            self.faults,
            self._lost + self._log.dropped,
            self.limited_count,
        )

    def event(self, event: str, is_controllable: bool, data: Any) -> None:
        """Record that an event was taken; needed only while the log is active."""
        took_us = (self._clock.monotonic() - self.began_s) * 1e6
        self._write(
            {
                'kind': 'event',
                'event': event,
                'controllable': is_controllable,
                'data': data,
                'state': self._system.state(),
                'decision_us': round(took_us, 1),
            }
        )

    def unexpected(self, entry: Dict[str, Any]) -> None:
        """Record a message or reply that was not expected."""
        self.unexpected_count += 1
        self._write({'kind': 'unexpected', **entry})

    def unknown(self, event: str, what: Sequence[str]) -> None:
        """Record that data was unknown at an event."""
        self.unknown_count += len(what)
        self._write({'kind': 'unknown', 'event': event, 'unknown': list(what)})

    def limited(self, event: str, moved: Sequence[str]) -> None:
        """Record that numbers of a request were moved into the bounds of limits."""
        self.limited_count += len(moved)
        self._write({'kind': 'limited', 'event': event, 'limited': list(moved)})

    def fault(self, what: str) -> None:
        """Note a fault."""
        self.faults += 1
        self._write({'kind': 'fault', 'what': what})

    def release(self, identifier: str) -> None:
        """Note that the default message goes out on an identifier."""
        self._write({'kind': 'release', 'identifier': identifier})

    def cancelling(self, action: str, why: str) -> None:
        """Note that the cancel of a goal was decided; its end is awaited."""
        self._write({'kind': 'cancelling', 'action': action, 'why': why})

    def cancel_overdue(self, action: str, asked_s: float) -> None:
        """Note that a goal has not ended in time after its cancel was decided."""
        asked = round(asked_s, 3)
        self._write({'kind': 'cancel_overdue', 'action': action, 'asked_s': asked})

    def blocked(self, identifier: str, why: str) -> None:
        """Note that a supervision layer held a request back."""
        self._write({'kind': 'blocked', 'identifier': identifier, 'why': why})

    def reached(self, aim: Aim, count: int) -> None:
        """Note that an aim was reached, and how often so far."""
        self._write({'kind': 'reached', 'aim': aim.name, 'count': count, 'what': aim.words})

    def approach(self, aim: Optional[Aim]) -> None:
        """Note that another aim is approached now; None: none is, since all of them are met."""
        if aim is None:
            self._write({'kind': 'approach', 'aim': None, 'what': 'all are met'})
        else:
            self._write({'kind': 'approach', 'aim': aim.name, 'what': aim.words})

    def owed(self, assumption: Aim, owed_s: float) -> None:
        """Note that an assumption has been owed for too long."""
        self._write_assumption('owed', assumption, owed_s)

    def met(self, assumption: Aim, owed_s: float) -> None:
        """Note that an assumption is met that was reported as owed."""
        self._write_assumption('met', assumption, owed_s)

    def _write_assumption(self, kind: str, assumption: Aim, owed_s: float) -> None:
        owed = round(owed_s, 3)
        what = assumption.words
        self._write({'kind': kind, 'assumption': assumption.name, 'owed_s': owed, 'what': what})

    def note(self, kind: str, what: str) -> None:
        """Note a stop, its end, or a restart."""
        self._write({'kind': kind, 'what': what})

    def _write(self, entry: Dict[str, Any]) -> None:
        if self.is_active:
            try:
                self._log.write({'time': self._clock.wall(), **entry})
            except Exception:
                # The log must never stop the robot's controller: the loss is counted, and the loop
                # goes on.
                self._lost += 1
