"""Generated code that tracks changes, so that a condition is evaluated again only if its value may have changed.

Every request and every silent step has a bit, requests first. A bit of `_stale` is set when a step writes another value
to an attribute that decides whether that event is allowed. Only the conditions of such events are evaluated again: of a
request by `enabled_requests`, which then remembers the result; of a silent step by `enabled_silent`, which clears the
bit if the step is not allowed.
"""

from collections.abc import Mapping, Sequence

from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, Sort, integer, literal, operation, variable
from robosc.targets.code.python.text import comment
from robosc.targets.code.statements import Assign, Statement, when

ASKED_TOGETHER = 8
"""Up to so many requests it takes less time to ask all of them than to find out which may have changed."""


def stale_bits(allows: Sequence[str], read: Mapping[str, set[str]]) -> dict[str, int]:
    """For each attribute the bits of the events whose permission reads it, itself or through another method.

    Args:
        allows: The methods that say whether an event is allowed; the first one's bit is the lowest.
        read: For each of these, and of those that they call, what its expressions read and call.
    """
    bits: dict[str, int] = {}
    for number, allow in enumerate(allows):
        seen: set[str] = set()
        to_do = [f"self.{allow}"]
        while to_do:
            word = to_do.pop()
            if word not in seen:
                seen.add(word)
                to_do += read.get(word, ())
        for word in seen:
            bits[word] = bits.get(word, 0) | 1 << number
    return bits


def noted_change(place: Code, bits: Mapping[str, int]) -> list[Statement]:
    """Statements that follow from another value of an attribute."""
    stale = bits.get(place.word, 0)
    marked = [Assign(variable("self._stale"), literal(f"{stale:#x}", Sort.INTEGER), "|")] if stale else []
    return [Assign(variable("self.changes"), integer(1), "+"), *marked]


def noted_write(place: Code, value: Code, bits: Mapping[str, int]) -> list[Statement]:
    """Statements that write an attribute; its value is a local variable or a constant.

    It is written also if nothing changes: of equal numbers, too, the new one counts, such as -0.0 after 0.0.
    """
    differs = operation("!=", place, value)
    if value in (TRUE_CODE, FALSE_CODE):
        differs = operation("not", place) if value == TRUE_CODE else place
    return [when(differs, *noted_change(place, bits)), Assign(place, value)]


def question_lines(requests: Sequence[str], silent: Sequence[str], allows: Sequence[str]) -> list[str]:
    """Statements of the constructor: what the two methods below ask, by bit.

    Args:
        requests: The methods that say whether each request is allowed.
        silent: The silent steps.
        allows: The methods that say whether each of those is allowed.
    """
    bits = [*requests, *allows]
    lines = (
        comment(f"Bits of _stale, from the lowest: who may now answer otherwise: {', '.join(bits)}.") if bits else []
    )
    if len(requests) > ASKED_TOGETHER:
        lines += ["self._allow_request = (", *(f"    self.{allow}," for allow in requests), ")"]
    if silent:
        pairs = zip(silent, allows, strict=True)
        lines += ["self._allow_silent = (", *(f"    ({event!r}, self.{allow})," for event, allow in pairs), ")"]
    return lines


def restart_lines(requests: int, silent: int) -> list[str]:
    """Statements that forget what was remembered, for so many requests and silent steps."""
    allowed = "()" if requests <= ASKED_TOGETHER else f"[False] * {requests}"
    return [
        "self.changes += 1",
        f"self._stale = {(1 << requests + silent) - 1:#x}",
        f"self._allowed = {allowed}",
        "self._enabled = ()",
    ]


def enabled_requests_method(allows: Sequence[str]) -> list[str]:
    """The method that gives the enabled requests.

    Args:
        allows: The methods that say whether each request is allowed.
    """
    count = len(allows)
    if not count:
        return [
            "def enabled_requests(self):",
            '    """Return numbers of the requests that are allowed now: there are none."""',
            "    return ()",
        ]
    if count <= ASKED_TOGETHER:
        answers = "".join(f"self.{allow}(), " for allow in allows).strip()
        return f'''\
def enabled_requests(self):
    """Return numbers of the requests that are allowed now; ask only if one may be new."""
    if self._stale & {(1 << count) - 1:#x}:
        allowed = ({answers})
        self._stale &= ~{(1 << count) - 1:#x}
        if allowed != self._allowed:
            self._allowed = allowed
            self._enabled = numbers_of(allowed)
    return self._enabled'''.splitlines()
    return f'''\
def enabled_requests(self):
    """Return numbers of the requests that are allowed now; ask only what may be new."""
    stale = self._stale & {(1 << count) - 1:#x}
    if stale:
        self._stale ^= stale
        allowed = self._allowed
        changed = []
        while stale:
            number = stale.bit_length() - 1
            stale ^= 1 << number
            now = self._allow_request[number]()
            if now is not allowed[number]:
                allowed[number] = now
                changed.append(number)
        if changed:
            self._enabled = numbers_after(self._enabled, allowed, changed)
    return self._enabled'''.splitlines()


def enabled_silent_method(requests: int, count: int) -> list[str]:
    """The method that gives the first enabled silent step, `count` of which the model has."""
    if not count:
        return [
            "def enabled_silent(self):",
            '    """Return the first silent step that is allowed now: there are none."""',
            "    return None",
        ]
    return f'''\
def enabled_silent(self):
    """Return the first silent step that is allowed now, or None; ask only what may be new."""
    stale = self._stale >> {requests}
    while stale:
        bit = stale & -stale
        event, allow = self._allow_silent[bit.bit_length() - 1]
        if allow():
            return event
        stale ^= bit
        self._stale ^= bit << {requests}
    return None'''.splitlines()
