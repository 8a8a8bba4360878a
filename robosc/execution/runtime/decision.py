"""
Choice of the enabled request that is issued: all policies but `strategy`.

Requests have the numbers 0 to N - 1, in source order. Before a decision a policy is told which
requests have become enabled or disabled; so the time of a decision does not grow with N. Then
`choose` is called, and again after `withhold` if the request could not be issued; then `issued`,
and `close`.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from heapq import heappop, heappush
import random
from typing import Collection, Dict, List, Optional, Protocol, Sequence, Set


class Policy(Protocol):
    """
    Policy that decides between requests that are enabled together.

    :ivar enabled: The requests that it may choose.
    """

    @property
    def enabled(self) -> Collection[int]:
        """Return the requests that it may choose."""

    def enable(self, request: int) -> None:
        """Note that a request has become enabled, unless it was so before."""

    def disable(self, request: int) -> None:
        """Note that a request is not enabled any longer, if it was."""

    def choose(self, among: Optional[Sequence[int]] = None) -> Optional[int]:
        """
        Return one of the enabled requests, or of some of them; None if there is none.

        :param among: Enabled requests, ascending; None: all of them.
        """

    def withhold(self, request: int) -> None:
        """Leave out a chosen request until the decision ends: it could not be issued."""

    def issued(self, request: int) -> None:
        """Note that a chosen request was issued."""

    def close(self) -> None:
        """End the decision."""


class FairPolicy:
    """
    Newly enabled requests first, then never issued ones, then the one issued longest ago.

    Ties are decided by source order. A request is preferred for being new at most once in N
    decisions. So among any N decisions at which a request waits, the N - 1 other requests take at
    most N - 1 for being new. All other decisions go to the request issued longest ago, so no
    request starves.

    :param count: Number of requests, N.
    :param order: Requests that go before all others, most urgent first.
    """

    __slots__ = (
        '_count',
        '_decision',
        '_favoured',
        '_fresh',
        '_new',
        '_owners',
        '_queue',
        '_queued',
        '_turns',
        '_withheld',
        'enabled',
    )

    def __init__(self, count: int, order: Sequence[int] = ()) -> None:
        self._count = count
        self._decision = 0
        # The turn of each request: the one with the least goes first. It is the number of the
        # decision at which it was last issued, of those of the order a number below -N.
        self._turns: List[int] = [request - count for request in range(count)]
        for place, request in enumerate(order):
            if self._turns[request] >= -count:
                self._turns[request] = place - count - len(order)
        self._owners: Dict[int, int] = {turn: item for item, turn in enumerate(self._turns)}
        # Heap of turns, with that of each enabled request; others are left out as they come up.
        self._queue: List[int] = []
        self._queued: Set[int] = set()
        self._favoured: List[int] = [-count] * count
        # The requests that were not enabled at the last decision.
        self._fresh: List[int] = []
        self._withheld: List[int] = []
        self._new = False
        self.enabled: Set[int] = set()

    def enable(self, request: int) -> None:
        """Note that a request has become enabled, unless it was so before."""
        if request not in self.enabled:
            self._fresh.append(request)
            self._add(request)

    def disable(self, request: int) -> None:
        """Note that a request is not enabled any longer, if it was."""
        self.enabled.discard(request)

    def choose(self, among: Optional[Sequence[int]] = None) -> Optional[int]:
        """Return the first one in the order of the policy."""
        turns = self._turns
        self._new = False
        best = self._first() if among is None else min(among, key=turns.__getitem__, default=None)
        if self._fresh and best is not None and turns[best] >= -self._count:
            latest_favour = self._decision - self._count
            possible = self.enabled if among is None else among
            new = [
                request
                for request in self._fresh
                if self._favoured[request] <= latest_favour and request in possible
            ]
            if new:
                self._new = True
                return min(new, key=turns.__getitem__)
        return best

    def withhold(self, request: int) -> None:
        """Leave out a chosen request until the decision ends: it could not be issued."""
        self.enabled.discard(request)
        self._withheld.append(request)

    def issued(self, request: int) -> None:
        """Remember the time, and whether the request was chosen for being new."""
        turn = self._turns[request]
        if turn >= -self._count:
            del self._owners[turn]
            self._turns[request] = self._decision
            self._owners[self._decision] = request
            self._add(request)
            if self._new:
                self._favoured[request] = self._decision

    def close(self) -> None:
        """End the decision: what is enabled now is not new at the next one."""
        self._decision += 1
        if self._fresh:
            self._fresh = []
        if self._withheld:
            for request in self._withheld:
                self._add(request)
            self._withheld = []

    def _add(self, request: int) -> None:
        """Let a request take part with its turn."""
        self.enabled.add(request)
        turn = self._turns[request]
        if turn not in self._queued:
            self._queued.add(turn)
            heappush(self._queue, turn)

    def _first(self) -> Optional[int]:
        """Return the enabled request with the least turn."""
        queue, owners = self._queue, self._owners
        while queue:
            request = owners.get(queue[0])
            if request in self.enabled:
                return request
            self._queued.remove(heappop(queue))
        return None


class RandomPolicy:
    """
    Policy that takes any candidate with equal probability, the same sequence for the same seed.

    :param seed: Start of the sequence.
    """

    __slots__ = ('_random', '_withheld', 'enabled')

    def __init__(self, seed: int) -> None:
        # A choice between safe requests, no secret.
        self._random = random.Random(seed)  # noqa: S311
        self._withheld: List[int] = []
        # In ascending order.
        self.enabled: List[int] = []

    def enable(self, request: int) -> None:
        """Note that a request has become enabled, unless it was so before."""
        if not self._has(request):
            insort(self.enabled, request)

    def disable(self, request: int) -> None:
        """Note that a request is not enabled any longer, if it was."""
        if self._has(request):
            del self.enabled[bisect_left(self.enabled, request)]

    def choose(self, among: Optional[Sequence[int]] = None) -> Optional[int]:
        """Return a random one."""
        candidates = self.enabled if among is None else among
        return candidates[self._random.randrange(len(candidates))] if candidates else None

    def withhold(self, request: int) -> None:
        """Leave out a chosen request until the decision ends: it could not be issued."""
        self.disable(request)
        self._withheld.append(request)

    def issued(self, request: int) -> None:
        """Chance has no memory."""

    def close(self) -> None:
        """End the decision."""
        for request in self._withheld:
            insort(self.enabled, request)
        self._withheld = []

    def _has(self, request: int) -> bool:
        place = bisect_left(self.enabled, request)
        return place < len(self.enabled) and self.enabled[place] == request


def make_policy(policy: str, names: Sequence[str], priority: Sequence[str], seed: int) -> Policy:
    """
    Return a policy with no past.

    :param policy: `fair`, `priority` or `random`.
    :param names: Names of all requests' communications, in source order.
    :param priority: Names, most urgent first, for `priority`.
    :param seed: For `random`.
    """
    if policy == 'random':
        return RandomPolicy(seed)
    if policy == 'priority':
        return FairPolicy(len(names), [names.index(name) for name in priority])
    return FairPolicy(len(names))
