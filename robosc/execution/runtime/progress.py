"""
Progress of a strategy: which aims and assumptions are met, since when not, and what is approached.

An aim is a goal of the model, or a visit of a mission or of one of its detours. A visit is made
when the mission or the detour moves on past it because it is true: where several are true in one
stable state, all of them are made, a whole round at most. An assumption that is not met is owed by
the surroundings of the robot. All of this is looked at in stable states, and all times are those
of the executor's clock.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Set, Tuple

from robosc.execution.runtime.protocol import Aim, Description, StrategicSystem
from robosc.execution.runtime.recorder import Recorder

NO_AIM = -1
"""Number instead of an aim's: none is approached, since all of them are met."""


class Standing(NamedTuple):
    """
    State of an aim or an assumption.

    :ivar name: Its name, such as `goal 1`.
    :ivar words: The aim or assumption as a user writes it; of a visit its condition.
    :ivar is_met: True if it is met in the last stable state; of a visit: if it was made in this
        round.
    :ivar times: Number of times that it has become met since the start; what is met at the start
        counts only when it is met again. Of a visit: number of times that it was made.
    :ivar unmet_s: Seconds since when it is not met; None: it is met. Of a visit: seconds since
        when it is to be made; None: nothing is to be done for it now.
    :ivar mission: Name of the mission that it is a visit of; None: it is none.
    """

    name: str
    words: str
    is_met: bool
    times: int
    unmet_s: Optional[float]
    mission: Optional[str] = None


class MissionStanding(NamedTuple):
    """
    State of a mission.

    :ivar name: Its name.
    :ivar visit: Number of the visit that it is at, from 1 on; 0: it is not asked for.
    :ivar is_round: True if every visit is true, so that none is left to be made.
    :ivar rounds: Number of times that its last visit was made.
    :ivar detours: For each detour the number of the visit that it is at, from 1 on; 0: it is idle.
    """

    name: str
    visit: int
    is_round: bool
    rounds: int
    detours: Tuple[int, ...]


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
    :ivar missions: Every mission, in source order; empty as long as nothing is known of them.
    """

    aims: Tuple[Standing, ...]
    assumptions: Tuple[Standing, ...]
    overdue: Tuple[str, ...]
    is_followed: bool
    approached: Optional[str]
    chosen: Optional[str]
    missions: Tuple[MissionStanding, ...] = ()

    def plain(self) -> Dict[str, Any]:
        """Return it as values that JSON knows, by name."""
        found: Dict[str, Any] = {**self._asdict(), 'overdue': list(self.overdue)}
        found['missions'] = [
            {**item._asdict(), 'detours': list(item.detours)} for item in self.missions
        ]
        for kind in ('aims', 'assumptions'):
            found[kind] = [
                {**item._asdict(), 'unmet_s': item.unmet_s and round(item.unmet_s, 3)}
                for item in found[kind]
            ]
        return found


def standing_text(item: Standing) -> str:
    """Return the state of an aim or assumption, in words."""
    if item.unmet_s is not None:
        state = ('not for {:.0f} s' if item.mission is None else 'wanted for {:.0f} s').format(
            item.unmet_s
        )
    elif item.mission is None:
        state = 'true' if item.is_met else 'not known'
    else:
        state = 'made in this round' if item.is_met else 'not wanted now'
    return '{}, reached {} times: {}'.format(state, item.times, item.words)


def mission_text(mission: MissionStanding, words: Dict[str, str]) -> str:
    """
    Return where a mission is, in words.

    :param mission: The mission.
    :param words: Conditions of visits, by their names.
    """
    title = 'mission {}'.format(mission.name)
    if mission.visit == 0:
        return 'not asked for'
    if mission.is_round:
        parts = ['every visit is true']
    else:
        parts = [_at_visit(mission.visit, title, words)]
    for number, visit in enumerate(mission.detours, start=1):
        if visit > 0:
            where = _at_visit(visit, 'detour {} of {}'.format(number, title), words)
            parts.append('detour {} under way, {}'.format(number, where))
    return '; '.join(parts)


def _at_visit(visit: int, title: str, words: Dict[str, str]) -> str:
    condition = words.get('visit {} of {}'.format(visit, title), '')
    return 'at visit {}, {}'.format(visit, condition)


def mission_texts(progress: Progress) -> Dict[str, str]:
    """Return where each mission is, and how many rounds were made, in words by its title."""
    words = {item.name: item.words for item in progress.aims}
    return {
        'mission {}'.format(item.name): '{}; rounds made: {}'.format(
            mission_text(item, words), item.rounds
        )
        for item in progress.missions
    }


def owed_texts(progress: Progress) -> List[str]:
    """Return in words for how long each assumption is owed that is owed for too long."""
    return [
        '{} has been owed for {:.0f} s: {}'.format(item.name, item.unmet_s or 0.0, item.words)
        for item in progress.assumptions
        if item.name in progress.overdue
    ]


class _Tour(NamedTuple):
    """
    The visits of a mission, or of one of its detours.

    :ivar first: Number of the aim that is its first visit.
    :ivar visits: Number of its visits.
    :ivar here: Place in what is seen of whether it is at its first visit; the others follow.
    """

    first: int
    visits: int
    here: int


class _Mission(NamedTuple):
    """
    A mission.

    :ivar name: Its name.
    :ivar tours: Its own tour, then those of its detours.
    :ivar whole_round: Place in what is seen of whether every visit of its own is true.
    """

    name: str
    tours: Tuple[_Tour, ...]
    whole_round: int


def _missions(description: Description) -> Tuple[_Mission, ...]:
    found: List[_Mission] = []
    here = len(description.aims) + len(description.assumptions)
    visits = sum(aim.mission is not None for aim in description.aims)
    for number, info in enumerate(description.missions):
        tours: List[_Tour] = []
        first = info.first
        for count in (info.visits, *info.detours):
            tours.append(_Tour(first, count, here + first - (len(description.aims) - visits)))
            first += count
        found.append(_Mission(info.name, tuple(tours), here + visits + number))
    return tuple(found)


def _size(mission: _Mission) -> int:
    return sum(tour.visits for tour in mission.tours)


def _tour_made(tour: _Tour, first: int, made: int) -> Iterator[int]:
    """Yield the aims of visits of a tour that were made; fewer than none: it went round."""
    for visit in range(first, first + (made + tour.visits if made < 0 else made)):
        yield tour.first + visit % tour.visits


def _place(tour: _Tour, seen: Tuple[bool, ...]) -> Optional[int]:
    """Return the number of the visit that a tour is at, from 0 on; None: it is at none."""
    for visit in range(tour.visits):
        if seen[tour.here + visit]:
            return visit
    return None


MAXIMUM_CHANGES = 4096
"""Number of changes that are remembered at once, so that they need not be found again."""

_MAXIMUM_OPEN = 256
"""Number of changes at which the account is brought up to date, though nobody asks for it."""


class _Memory:
    """
    Memory of a strategy after a stable state.

    :ivar seen: Result of `observe` in that state; empty before the first.
    :ivar remembered: Everything that the system remembers.
    :ivar known: Known changes from there to the next stable state, by that state's situation.
    """

    __slots__ = ('known', 'remembered', 'seen')

    def __init__(self, seen: Tuple[bool, ...], remembered: Any) -> None:
        self.seen = seen
        self.remembered = remembered
        self.known: Dict[Any, _Change] = {}


class _Change:
    """
    Change from what is remembered of one stable state to what is of the next.

    :ivar after: Memory after it.
    :ivar known: Known changes from there on.
    :ivar unmet: Numbers of the aims and assumptions that are not met from now on.
    :ivar reached: Numbers of those that are met from now on, then of the visits that are made.
    :ivar is_owed: True if an assumption is not met from now on.
    :ivar times: Number of times that it came about and is not in the account yet.
    :ivar at_s: Time at which it came about last.
    :ivar choice: Choice of the strategy after it; None: it was not asked yet.
    """

    __slots__ = ('after', 'at_s', 'choice', 'is_owed', 'known', 'reached', 'times', 'unmet')

    def __init__(
        self, after: _Memory, unmet: Tuple[int, ...], reached: Tuple[int, ...], is_owed: bool
    ) -> None:
        self.after = after
        self.known = after.known
        self.unmet = unmet
        self.reached = reached
        self.is_owed = is_owed
        self.times = 0
        self.at_s = 0.0
        self.choice: Optional[_Choice] = None


class _Choice(NamedTuple):
    """
    Choice of a strategy in a stable state.

    :ivar request: Number of the chosen request; None: it waits.
    :ivar approached: Number of the aim that it approaches.
    :ivar after: Memory after the choice.
    """

    request: Optional[int]
    approached: int
    after: _Memory


class ProgressAccount:
    """
    Account of a strategy's progress.

    All of it depends on what is remembered and on the situation of the next stable state alone,
    of which robots are in the same few again and again. So the account is a table of changes that
    grows as they come about, like the automaton of a regular expression by lazy transition
    evaluation (A. V. Aho, R. Sethi, J. D. Ullman: Compilers, 1986). A change that is known takes
    the same short time for a robot with few aims and one with many. How often each aim was
    reached, and since when it is not met, is worked out of the changes when somebody asks.

    :param system: System with a strategy; what it remembers is not used while changes are known.
    :param recorder: Recorder that gives the time and writes the entries.
    :param requests: Names of all requests' communications, by number.
    :param timeout_s: Seconds after which an assumption that is owed is reported; 0: never.
    :ivar is_followed: True if the strategy chooses the requests.
    :ivar due_s: Time at which the next assumption is to be reported.
    :ivar wake: Called with that time when it has come nearer.
    """

    __slots__ = (
        '_approached',
        '_change',
        '_chosen',
        '_count',
        '_counts',
        '_items',
        '_known',
        '_known_count',
        '_memories',
        '_memory',
        '_missions',
        '_numbers',
        '_open',
        '_recorder',
        '_reported',
        '_requests',
        '_since_s',
        '_situation',
        '_system',
        '_timeout_s',
        '_visits',
        'due_s',
        'is_followed',
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
        self._situation = system.situation
        self._recorder = recorder
        self._requests = requests
        self._timeout_s = timeout_s if timeout_s > 0 else math.inf
        description = system.description
        self._count = len(description.aims)
        # The aims, then the assumptions.
        self._items: Tuple[Aim, ...] = description.aims + description.assumptions
        self._numbers = range(len(self._items))
        self._missions = _missions(description)
        self._visits = range(self._count - sum(map(_size, self._missions)), self._count)
        self._memories: Dict[Any, _Memory] = {}
        self._known_count = 0
        # Changes that came about and are not in the counts and times yet.
        self._open: List[_Change] = []
        self.is_followed = False
        self.wake: Callable[[float], None] = lambda due_s: None
        self.restart()

    def restart(self) -> None:
        """Forget what happened: the system is in its initial state again."""
        number = len(self._items)
        self._counts = [0] * number
        self._since_s = [0.0] * number
        for change in self._open:
            change.times = 0
        self._open.clear()
        self._reported: Set[int] = set()
        self._memory = self._remember(())
        self._change = _Change(self._memory, (), (), is_owed=False)
        self._known = self._memory.known
        self._approached: Optional[int] = None
        self._chosen: Optional[int] = None
        self.due_s = math.inf

    @property
    def seen(self) -> Tuple[bool, ...]:
        """Return what the system saw in the last stable state; empty before the first."""
        return self._memory.seen

    def observe(self) -> None:
        """Take in a stable state."""
        # This is written out for speed: the cycle time of the controller.
        change = self._known.get(self._situation())
        if change is None:
            change = self._learn()
        self._change = change
        self._memory = change.after
        self._known = change.known
        if change.reached or change.unmet:
            now_s = change.at_s = self._recorder.began_s
            if change.times:
                change.times += 1
            else:
                self._begin(change)
            if change.is_owed and now_s + self._timeout_s < self.due_s:
                # One that was to be reported earlier may be met by now: that costs a look.
                self.due_s = now_s + self._timeout_s
                self.wake(self.due_s)
            if change.reached and (self._reported or self._recorder.is_active):
                self._report(change.reached)

    def _learn(self) -> _Change:
        """Return the change to this stable state, which is not known."""
        before = self._memory.seen
        self._system.recall(self._memory.remembered)
        seen = self._system.observe()
        changed = [it for it in self._numbers if not before or seen[it] is not before[it]]
        unmet = tuple(number for number in changed if not seen[number])
        reached: List[int] = []
        if before:
            reached += [it for it in changed if seen[it] and it not in self._visits]
            reached += self._visits_made(before, seen)
        is_owed = any(number >= self._count for number in unmet)
        change = _Change(self._remember(seen), unmet, tuple(reached), is_owed)
        if self._known_count < MAXIMUM_CHANGES:
            self._known[self._situation()] = change
            self._known_count += 1
        return change

    def decide(self) -> Optional[int]:
        """Return the number of the request that the strategy chooses in this stable state."""
        choice = self._change.choice
        if choice is None:
            choice = self._change.choice = self._choose()
        chosen, approached, memory = choice
        self._chosen = chosen
        self._memory = memory
        self._known = memory.known
        if approached != self._approached:
            self._approached = approached
            if self._recorder.is_active:
                self._recorder.approach(None if approached == NO_AIM else self._items[approached])
        return chosen

    def _choose(self) -> _Choice:
        """Ask the strategy; what it remembered may be of another state."""
        system = self._system
        system.recall(self._memory.remembered)
        seen = system.observe()
        chosen = system.choose()
        approached = system.mode
        if chosen is None and False not in seen[: self._count]:
            approached = NO_AIM
        return _Choice(chosen, approached, self._remember(seen))

    def _remember(self, seen: Tuple[bool, ...]) -> _Memory:
        """Return the memory of a state in which this was seen."""
        key = seen, self._system.remembered()
        memory = self._memories.get(key)
        if memory is None:
            memory = _Memory(*key)
            if self._known_count < MAXIMUM_CHANGES:
                self._memories[key] = memory
        return memory

    def _begin(self, change: _Change) -> None:
        """Note a change that is to get into the account."""
        change.times = 1
        self._open.append(change)
        if len(self._open) >= _MAXIMUM_OPEN:
            self._update()

    def _update(self) -> None:
        """Bring the account up to date."""
        counts, since_s = self._counts, self._since_s
        for change in self._open:
            for number in change.reached:
                counts[number] += change.times
            for number in change.unmet:
                since_s[number] = max(since_s[number], change.at_s)
            change.times = 0
        self._open.clear()

    def expire(self, now_s: float) -> None:
        """Report each assumption that is owed for too long by now, once."""
        self._update()
        for number in self._owed():
            # The sum is the deadline: their difference may be rounded to less.
            if now_s >= self._since_s[number] + self._timeout_s and number not in self._reported:
                self._reported.add(number)
                self._recorder.owed(self._items[number], now_s - self._since_s[number])
        waiting = [self._since_s[it] for it in self._owed() if it not in self._reported]
        self.due_s = min(waiting, default=math.inf) + self._timeout_s

    def at(self, now_s: float) -> Progress:
        """Return the progress at a time."""
        self._update()
        made = self._made()
        standings = [self._standing(number, now_s, made) for number in self._numbers]
        approached, chosen = self._approached, self._chosen
        count = self._count
        return Progress(
            aims=tuple(standings[:count]),
            assumptions=tuple(standings[count:]),
            overdue=tuple(
                self._items[number].name for number in self._owed() if number in self._reported
            ),
            is_followed=self.is_followed,
            approached=None if approached in (None, NO_AIM) else self._items[approached].name,
            chosen=None if chosen is None else self._requests[chosen],
            missions=tuple(map(self._mission_standing, self._missions)) if self.seen else (),
        )

    def _standing(self, number: int, now_s: float, made: Set[int]) -> Standing:
        name, words, mission = self._items[number]
        is_met = bool(self.seen) and self.seen[number]
        # Before the first stable state, nothing is known.
        is_unmet = bool(self.seen) and not is_met
        unmet_s = max(now_s - self._since_s[number], 0.0) if is_unmet else None
        if mission is not None:
            is_met = number in made
        return Standing(name, words, is_met, self._counts[number], unmet_s, mission)

    def _mission_standing(self, mission: _Mission) -> MissionStanding:
        visit, *detours = (_place(tour, self.seen) for tour in mission.tours)
        own = mission.tours[0]
        return MissionStanding(
            mission.name,
            0 if visit is None else visit + 1,
            self.seen[mission.whole_round],
            self._counts[own.first + own.visits - 1],
            tuple(0 if place is None else place + 1 for place in detours),
        )

    def _made(self) -> Set[int]:
        """Return the numbers of the visits that were made in this round."""
        made: Set[int] = set()
        for mission in self._missions if self.seen else ():
            for tour in mission.tours:
                is_round = tour is mission.tours[0] and self.seen[mission.whole_round]
                number = tour.visits if is_round else _place(tour, self.seen) or 0
                made.update(range(tour.first, tour.first + number))
        return made

    def _visits_made(self, before: Tuple[bool, ...], seen: Tuple[bool, ...]) -> Iterator[int]:
        """Yield the numbers of the visits that are made between two stable states."""
        for mission in self._missions:
            own = mission.tours[0]
            place = _place(own, seen)
            if place is None:
                # Not asked for: its detours have been given up, too.
                continue
            # All visits were made at once where every one was true already.
            if not before[mission.whole_round]:
                was, is_round = _place(own, before) or 0, seen[mission.whole_round]
                yield from _tour_made(own, was, own.visits if is_round else place - was)
            for tour in mission.tours[1:]:
                begun, now = _place(tour, before), _place(tour, seen)
                if begun is None and now is None:
                    continue
                first = begun or 0
                # A detour that is before where it was has ended, and has begun again.
                yield from _tour_made(tour, first, (tour.visits if now is None else now) - first)

    def _report(self, reached: Tuple[int, ...]) -> None:
        self._update()
        for number in reached:
            if number < self._count:
                self._recorder.reached(self._items[number], self._counts[number])
            elif number in self._reported:
                self._reported.remove(number)
                owed_s = self._recorder.began_s - self._since_s[number]
                self._recorder.met(self._items[number], owed_s)

    def _owed(self) -> List[int]:
        """Return the numbers of the assumptions that are owed."""
        seen, count = self.seen, self._count
        return [number for number in self._numbers[count:] if seen and not seen[number]]
