"""Generated code that tracks changes, so that a condition is evaluated again only if its value may have changed.

Every silent step has a bit, and so has every request of a robot with few of them. A bit of `_stale` is set when a step
writes another value to an attribute that decides whether that event is allowed; where there are many requests, their
numbers are put into the set `_doubtful` instead. Only the conditions of such events are evaluated again: of a request
by `changed_requests`, which then remembers the result; of a silent step by `enabled_silent`, which clears the bit if
the step is not allowed.
"""

from collections.abc import Mapping, Sequence

from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Sort,
    call,
    integer,
    literal,
    operation,
    variable,
)
from robosc.targets.code.python.expressions import constant
from robosc.targets.code.python.text import comment
from robosc.targets.code.statements import Assign, Do, Statement, when

ASKED_TOGETHER = 8
"""Up to so many requests it takes less time to ask all of them than to find out which may have changed."""


def stale_marks(
    requests: Sequence[str], silent: Sequence[str], read: Mapping[str, set[str]]
) -> dict[str, list[Statement]]:
    """For each attribute the statements that note another value of it, for the events whose permission reads it.

    Args:
        requests: The methods that say whether each request is allowed.
        silent: The methods that say whether each silent step is allowed.
        read: For each of these, and of those that they call, what its expressions read and call.
    """
    readers: dict[str, list[int]] = {}
    for number, allow in enumerate([*requests, *silent]):
        seen: set[str] = set()
        to_do = [f"self.{allow}"]
        while to_do:
            word = to_do.pop()
            if word not in seen:
                seen.add(word)
                to_do += read.get(word, ())
        for word in seen:
            readers.setdefault(word, []).append(number)
    first = bit_count(len(requests))
    marks: dict[str, list[Statement]] = {}
    for word, numbers in readers.items():
        doubtful = [] if first else [number for number in numbers if number < len(requests)]
        stale = sum(1 << number - len(requests) + first for number in numbers[len(doubtful) :])
        marks[word] = []
        if stale:
            marks[word].append(Assign(variable("self._stale"), literal(f"{stale:#x}", Sort.INTEGER), "|"))
        if doubtful:
            marks[word].append(Do(call("self._doubtful.update", constant(tuple(doubtful)))))
    return marks


def bit_count(requests: int) -> int:
    """Number of bits that so many requests have."""
    return requests if requests <= ASKED_TOGETHER else 0


def noted_change(place: Code, marks: Mapping[str, list[Statement]]) -> list[Statement]:
    """Statements that follow from another value of an attribute."""
    return [Assign(variable("self.changes"), integer(1), "+"), *marks.get(place.word, ())]


def noted_write(place: Code, value: Code, marks: Mapping[str, list[Statement]]) -> list[Statement]:
    """Statements that write an attribute; its value is a local variable or a constant.

    It is written also if nothing changes: of equal numbers, too, the new one counts, such as -0.0 after 0.0.
    """
    differs = operation("!=", place, value)
    if value in (TRUE_CODE, FALSE_CODE):
        differs = operation("not", place) if value == TRUE_CODE else place
    return [when(differs, *noted_change(place, marks)), Assign(place, value)]


def question_lines(requests: Sequence[str], silent: Sequence[str], allows: Sequence[str]) -> list[str]:
    """Statements of the constructor: what the two methods below ask, by bit.

    Args:
        requests: The methods that say whether each request is allowed.
        silent: The silent steps.
        allows: The methods that say whether each of those is allowed.
    """
    bits = [*requests[: bit_count(len(requests))], *allows]
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
    lines = [
        "self.changes += 1",
        f"self._stale = {(1 << bit_count(requests) + silent) - 1:#x}",
        f"self._allowed = [False] * {requests}",
    ]
    return lines if requests <= ASKED_TOGETHER else [*lines, f"self._doubtful = set(range({requests}))"]


def enabled_requests_method(allows: Sequence[str]) -> list[str]:
    """The method that gives the enabled requests: it asks all of them.

    Args:
        allows: The methods that say whether each request is allowed.
    """
    head = ["def enabled_requests(self):", '    """Return numbers of the requests that are allowed now."""']
    if not allows:
        return [*head, "    return ()"]
    if len(allows) <= ASKED_TOGETHER:
        return [*head, f"    return numbers_of(({_answers(allows)}))"]
    return [*head, "    return numbers_of([allow() for allow in self._allow_request])"]


def _answers(allows: Sequence[str]) -> str:
    return "".join(f"self.{allow}(), " for allow in allows).strip()


def changed_requests_method(allows: Sequence[str]) -> list[str]:
    """The method that gives the requests that are allowed now and were not before, or vice versa.

    Args:
        allows: The methods that say whether each request is allowed.
    """
    count = len(allows)
    head = ["def changed_requests(self):", '    """Return numbers of the requests that answer otherwise now."""']
    if not count:
        return [*head, "    return ()"]
    if count <= ASKED_TOGETHER:
        text = f"""\
    if not self._stale & {(1 << count) - 1:#x}:
        return ()
    before = self._allowed
    self._allowed = ({_answers(allows)})
    self._stale &= ~{(1 << count) - 1:#x}
    return turned(before, self._allowed)"""
    else:
        text = """\
    allowed = self._allowed
    changed = []
    for number in self._doubtful:
        now = self._allow_request[number]()
        if now is not allowed[number]:
            allowed[number] = now
            changed.append(number)
    self._doubtful.clear()
    return changed"""
    return [*head, *text.splitlines()]


def enabled_silent_method(requests: int, count: int) -> list[str]:
    """The method that gives the first enabled silent step, `count` of which the model has."""
    if not count:
        return [
            "def enabled_silent(self):",
            '    """Return the first silent step that is allowed now: there are none."""',
            "    return None",
        ]
    bits = bit_count(requests)
    shift = f" << {bits}" if bits else ""
    return f'''\
def enabled_silent(self):
    """Return the first silent step that is allowed now, or None; ask only what may be new."""
    stale = self._stale{shift.replace("<", ">")}
    while stale:
        bit = stale & -stale
        event, allow = self._allow_silent[bit.bit_length() - 1]
        if allow():
            return event
        stale ^= bit
        self._stale ^= bit{shift}
    return None'''.splitlines()
