"""
Progress of a strategy: which aims and assumptions are met, since when not, and what is approached.

An aim is a condition that a strategy makes true again and again, such as a goal of the model. An
assumption that is not met is owed by the surroundings of the robot. Both are looked at in stable
states, and all times are those of the executor's clock.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

from robosc.execution.runtime.protocol import Aim, StrategicSystem
from robosc.execution.runtime.recorder import Recorder

NO_AIM = -1
"""Number instead of an aim's: none is approached, since all of them are met."""


class Standing(NamedTuple):
    """
    State of an aim or an assumption.

    :ivar name: Its name, such as `goal 1`.
    :ivar words: The aim or assumption as a user writes it.
    :ivar is_met: True if it is met in the last stable state.
    :ivar times: Number of times that it has become met since the start; what is met at the start
        counts only when it is met again.
    :ivar unmet_s: Seconds since when it is not met; None: it is met.
    """

    name: str
    words: str
    is_met: bool
    times: int
    unmet_s: Optional[float]


class Progress(NamedTuple):
    """
    State of what a strategy aims at and assumes.

    :ivar aims: Every aim, in the order of the strategy.
    :ivar assumptions: Every assumption, in source order; one that is not met is owed.
    :ivar overdue: Names of the assumptions that are owed for longer than the settings allow.
    :ivar is_followed: True if the strategy chooses the requests; False: another policy does.
    :ivar approached: Name of the aim that the last decision approached; None: all were met,
        another policy decides, or nothing was decided yet.
    :ivar chosen: Name of the communication that the strategy chose at the last decision; None: it
        waits, or likewise.
    """

    aims: Tuple[Standing, ...]
    assumptions: Tuple[Standing, ...]
    overdue: Tuple[str, ...]
    is_followed: bool
    approached: Optional[str]
    chosen: Optional[str]

    def plain(self) -> Dict[str, Any]:
        """Return it as values that JSON knows, by name."""
        found: Dict[str, Any] = {**self._asdict(), 'overdue': list(self.overdue)}
        for kind in ('aims', 'assumptions'):
            found[kind] = [
                {**item._asdict(), 'unmet_s': item.unmet_s and round(item.unmet_s, 3)}
                for item in found[kind]
            ]
        return found


def standing_text(item: Standing) -> str:
    """Return the state of an aim or assumption, in words."""
    if item.unmet_s is None:
        state = 'true' if item.is_met else 'not known'
    else:
        state = 'not for {:.0f} s'.format(item.unmet_s)
    return '{}, reached {} times: {}'.format(state, item.times, item.words)


def owed_texts(progress: Progress) -> List[str]:
    """Return in words for how long each assumption is owed that is owed for too long."""
    return [
        '{} has been owed for {:.0f} s: {}'.format(item.name, item.unmet_s or 0.0, item.words)
        for item in progress.assumptions
        if item.name in progress.overdue
    ]


class ProgressAccount:
    """
    Account of a strategy's progress, which costs time only when something changes.

    :param system: System with a strategy.
    :param recorder: Recorder that gives the time and writes the entries.
    :param requests: Names of all requests' communications, by number.
    :param timeout_s: Seconds after which an assumption that is owed is reported; 0: never.
    :ivar observe: Take in a stable state, and return what is met in it.
    :ivar met: For each aim and assumption, whether it was met in the last stable state; empty
        before the first.
    :ivar is_followed: True if the strategy chooses the requests.
    :ivar due_s: Time at which the next assumption is to be reported.
    :ivar wake: Called with that time when it has come nearer.
    """

    __slots__ = (
        '_approached',
        '_chosen',
        '_count',
        '_counts',
        '_is_reported',
        '_items',
        '_recorder',
        '_requests',
        '_since_s',
        '_system',
        '_timeout_s',
        'due_s',
        'is_followed',
        'met',
        'observe',
        'wake',
    )

    def __init__(
        self,
        system: StrategicSystem,
        recorder: Recorder,
        requests: Tuple[str, ...],
        timeout_s: float,
    ) -> None:
        self._system = system
        self.observe = system.observe
        self._recorder = recorder
        self._requests = requests
        self._timeout_s = timeout_s if timeout_s > 0 else math.inf
        description = system.description
        self._count = len(description.aims)
        # The aims, then the assumptions.
        self._items: Tuple[Aim, ...] = description.aims + description.assumptions
        self.is_followed = False
        self.wake: Callable[[float], None] = lambda due_s: None
        self.restart()

    def restart(self) -> None:
        """Forget everything: the system is in its initial state again."""
        number = len(self._items)
        self.met: Tuple[bool, ...] = ()
        self._counts = [0] * number
        self._since_s = [0.0] * number
        self._is_reported = [False] * number
        self._approached: Optional[int] = None
        self._chosen: Optional[int] = None
        self.due_s = math.inf

    def change(self, met: Tuple[bool, ...]) -> None:
        """Take in what is met in this stable state, if that is something else than `met`."""
        # This is written out for speed: the cycle time of the controller.
        before, self.met = self.met, met
        now_s = self._recorder.began_s
        number = -1
        for is_met in met:
            number += 1
            if before and is_met is before[number]:
                continue
            if not is_met:
                self._since_s[number] = now_s
                if number >= self._count and now_s + self._timeout_s < self.due_s:
                    # One that was to be reported earlier may be met by now: that costs a look.
                    self.due_s = now_s + self._timeout_s
                    self.wake(self.due_s)
            elif before:
                self._counts[number] += 1
                if self._recorder.is_active or self._is_reported[number]:
                    self._report_met(number)

    def decide(self) -> Optional[int]:
        """Return the number of the request that the strategy chooses in this stable state."""
        chosen = self._chosen = self._system.choose()
        approached = self._system.mode
        if chosen is None and False not in self.met[: self._count]:
            approached = NO_AIM
        if approached != self._approached:
            self._approached = approached
            if self._recorder.is_active:
                self._recorder.approach(None if approached == NO_AIM else self._items[approached])
        return chosen

    def expire(self, now_s: float) -> None:
        """Report each assumption that is owed for too long by now, once."""
        for number in self._owed():
            # The sum is the deadline: their difference may be rounded to less.
            if now_s >= self._since_s[number] + self._timeout_s and not self._is_reported[number]:
                self._is_reported[number] = True
                self._recorder.owed(self._items[number], now_s - self._since_s[number])
        waiting = [self._since_s[it] for it in self._owed() if not self._is_reported[it]]
        self.due_s = min(waiting, default=math.inf) + self._timeout_s

    def at(self, now_s: float) -> Progress:
        """Return the progress at a time."""
        standings = [self._standing(number, now_s) for number in range(len(self._items))]
        approached, chosen = self._approached, self._chosen
        return Progress(
            aims=tuple(standings[: self._count]),
            assumptions=tuple(standings[self._count :]),
            overdue=tuple(
                self._items[number].name for number in self._owed() if self._is_reported[number]
            ),
            is_followed=self.is_followed,
            approached=None if approached in (None, NO_AIM) else self._items[approached].name,
            chosen=None if chosen is None else self._requests[chosen],
        )

    def _standing(self, number: int, now_s: float) -> Standing:
        name, words = self._items[number]
        is_met = bool(self.met) and self.met[number]
        # Before the first stable state, nothing is known.
        is_unmet = bool(self.met) and not is_met
        unmet_s = max(now_s - self._since_s[number], 0.0) if is_unmet else None
        return Standing(name, words, is_met, self._counts[number], unmet_s)

    def _report_met(self, number: int) -> None:
        if number < self._count:
            self._recorder.reached(self._items[number], self._counts[number])
        elif self._is_reported[number]:
            self._is_reported[number] = False
            owed_s = self._recorder.began_s - self._since_s[number]
            self._recorder.met(self._items[number], owed_s)

    def _owed(self) -> List[int]:
        """Return the numbers of the assumptions that are owed."""
        met = self.met
        return [number for number in range(self._count, len(met)) if not met[number]]
