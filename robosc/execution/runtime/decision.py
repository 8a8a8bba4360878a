"""
Choice of the enabled request that is issued: all policies but `strategy`.

Requests have the numbers 0 to N - 1, in source order. A decision calls `choose` with the
candidates, and again without those that could not be issued; then `issued` for the request that
was issued, and `close`.
"""

from __future__ import annotations

import random
from typing import List, Protocol, Sequence, Tuple

_NEVER = -1


class Policy(Protocol):
    """Policy that decides between requests that are enabled together."""

    def choose(self, candidates: Sequence[int]) -> int:
        """One of the candidates (at least one, ascending)."""

    def issued(self, request: int) -> None:
        """Note that a chosen request was issued."""

    def close(self, enabled: Tuple[int, ...]) -> None:
        """End the decision; `enabled` were the requests that were enabled at it."""


class FairPolicy:
    """
    Newly enabled requests first, then never issued ones, then the one issued longest ago.

    Ties are decided by source order. A request is preferred for being new at most once in N
    decisions. So among any N decisions at which a request waits, the N - 1 other requests take at
    most N - 1 for being new. All other decisions go to the request issued longest ago, so no
    request starves.

    :param count: Number of requests, N.
    """

    __slots__ = ('_count', '_decision', '_favoured', '_issued', '_new', '_previous')

    def __init__(self, count: int) -> None:
        self._count = count
        self._decision = 0
        self._previous: Tuple[int, ...] = ()
        # Number of the decision at which each request was last issued, or last issued for being
        # new.
        self._issued: List[int] = [_NEVER] * count
        self._favoured: List[int] = [-count] * count
        self._new = False

    def choose(self, candidates: Sequence[int]) -> int:
        """Return the first candidate in the order of the policy."""
        previous, issued = self._previous, self._issued
        if candidates is previous:
            # The very same tuple as at the last decision, so nothing is new.
            self._new = False
            return (
                candidates[0] if len(candidates) == 1 else min(candidates, key=issued.__getitem__)
            )
        latest_favour = self._decision - self._count
        new = [
            request
            for request in sorted(set(candidates).difference(previous))
            if self._favoured[request] <= latest_favour
        ]
        self._new = bool(new)
        return min(new or candidates, key=issued.__getitem__)

    def issued(self, request: int) -> None:
        """Remember the time, and whether the request was chosen for being new."""
        self._issued[request] = self._decision
        if self._new:
            self._favoured[request] = self._decision

    def close(self, enabled: Tuple[int, ...]) -> None:
        """Remember what was enabled."""
        self._previous = enabled
        self._decision += 1


class PriorityPolicy:
    """
    The first enabled request of a list; if none of them is enabled, fair.

    :param count: Number of requests.
    :param order: Requests, most urgent first.
    """

    __slots__ = ('_fair', '_listed', '_order')

    def __init__(self, count: int, order: Sequence[int]) -> None:
        self._fair = FairPolicy(count)
        self._order = tuple(order)
        self._listed = frozenset(order)

    def choose(self, candidates: Sequence[int]) -> int:
        """Return the most urgent candidate, else the fair one."""
        for request in self._order:
            if request in candidates:
                return request
        return self._fair.choose(candidates)

    def issued(self, request: int) -> None:
        """Pass a request that is not in the list to the fair policy."""
        if request not in self._listed:
            self._fair.issued(request)

    def close(self, enabled: Tuple[int, ...]) -> None:
        """End the decision."""
        self._fair.close(enabled)


class RandomPolicy:
    """
    Policy that takes any candidate with equal probability, the same sequence for the same seed.

    :param seed: Start of the sequence.
    """

    __slots__ = ('_random',)

    def __init__(self, seed: int) -> None:
        # A choice between safe requests, no secret.
        self._random = random.Random(seed)  # noqa: S311

    def choose(self, candidates: Sequence[int]) -> int:
        """Return a random one."""
        return candidates[self._random.randrange(len(candidates))]

    def issued(self, request: int) -> None:
        """Chance has no memory."""

    def close(self, enabled: Tuple[int, ...]) -> None:
        """Chance has no memory."""


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
        return PriorityPolicy(len(names), [names.index(name) for name in priority])
    return FairPolicy(len(names))
