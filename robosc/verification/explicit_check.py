"""Check of a supervisor by explicit forward search of the controlled system.

The controlled system is searched state by state under the plants, the requirements and the conditions that the
supervisor adds. The check covers one property after the other: safe, controllable, nonblocking. For maximally
permissive, a new explicit synthesis is compared with the supervisor.
"""

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum

import msgspec

from robosc.automata.compile import State
from robosc.automata.controlled import Added
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.automata.structure import System
from robosc.verification.packing import CodeTest, Packing
from robosc.verification.permissive import Allowed, allowed
from robosc.verification.search import Effort, Reached, blocking_state, search

DEFAULT_LIMIT = 200_000
"""States up to which the controlled system is searched."""

DEFAULT_PERMISSIVE_LIMIT = 100_000
"""States up to which the supervisor is recomputed."""


class CheckOutcome(StrEnum):
    """Outcome of the check of one property."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_CHECKED = "not checked"


class Failure(msgspec.Struct, frozen=True):
    """Reason why a property does not hold.

    Attributes:
        property: `safe`, `controllable`, `nonblocking` or `maximally permissive`.
        trace: Events of a shortest run from an initial state into the failure.
        state: The state that it leads to, in the order of `subjects`.
        reason: Fault in that state, in words.
        message: The same, and the state.
        is_shortest: True if there is certainly no shorter run; a symbolic search may have to do with any run.
    """

    property: str
    trace: tuple[str, ...]
    state: State
    reason: str
    message: str
    is_shortest: bool = True


class Verification(msgspec.Struct, frozen=True):
    """The outcome of a verification.

    Attributes:
        states: Reachable states of the controlled system, or None where the search was given up.
        transitions: Transitions between them, or None.
        safe: No reachable bad state.
        controllable: No uncontrollable event that the plant enables is disabled.
        nonblocking: From every reachable state a marked state is reachable.
        maximally_permissive: Nothing more is disabled than needed.
        failures: For each property that failed the first failure found, in the order above.
    """

    states: int | None
    transitions: int | None
    safe: CheckOutcome
    controllable: CheckOutcome
    nonblocking: CheckOutcome
    maximally_permissive: CheckOutcome
    failures: tuple[Failure, ...] = ()

    @property
    def trace(self) -> tuple[str, ...]:
        """Events into the first failure; none if nothing failed."""
        return self.failures[0].trace if self.failures else ()

    @property
    def message(self) -> str:
        """The first failure in words; empty if nothing failed."""
        return f"not {self.failures[0].property}: {self.failures[0].message}" if self.failures else ""


def verify_explicitly(
    system: System,
    added: Added,
    *,
    initial: Callable[[State], bool] | None = None,
    limit: int = DEFAULT_LIMIT,
    permissive_limit: int = DEFAULT_PERMISSIVE_LIMIT,
    semantics: Semantics | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Verification:
    """Check that a supervisor is safe, controllable, nonblocking and maximally permissive.

    Args:
        system: Plants and event conditions.
        added: For each event to which the supervisor adds a condition, that condition over states.
        initial: Test for the initial states in which the supervisor lets the system begin; None: in all of them.
        limit: Number of states of the controlled system beyond which nothing is checked.
        permissive_limit: Number of states that the plants reach under the event conditions beyond which
            permissiveness is not checked. Both count `TRANSITIONS_PER_STATE` transitions as a state, too.
        semantics: Semantics of the system, if it was made already.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        ValueError: A condition is added to something that is no event of the system.
    """
    require_known(system, added)
    packing = Packing(semantics or Semantics(system))
    begins = (lambda code: True) if initial is None else packing.condition(initial)
    found = search(packing, added, Effort(limit, should_stop, on_progress, "states"), begins)
    if found is None:
        skipped = CheckOutcome.NOT_CHECKED
        return Verification(None, None, skipped, skipped, skipped, skipped)
    search_ = _FailureSearch(found)
    failures = {"safe": search_.unsafe(), "controllable": search_.uncontrollable(), "nonblocking": search_.blocking()}
    # The controlled system's states are among those that a supervisor is recomputed on.
    if len(found.codes) <= permissive_limit:
        effort = Effort(permissive_limit, should_stop, on_progress, "states of the uncontrolled system")
        recomputed = allowed(packing, found.tables, effort)
        if recomputed is not None:
            failures["maximally permissive"] = search_.restrictive(recomputed, begins)
    return verification(len(found.codes), len(found.targets), failures)


def require_known(system: System, added: Iterable[str]) -> None:
    """Do nothing if conditions are added to events of the system only.

    Raises:
        ValueError: They are not.
    """
    unknown = sorted(set(added) - {event.name for event in system.events})
    if unknown:
        raise ValueError(f"conditions are added to events that the system does not have: {', '.join(unknown)}")


def verification(states: int | None, transitions: int | None, found: Mapping[str, Failure | None]) -> Verification:
    """The outcome, from the first failure (or None) of each property that was checked."""

    def outcome(name: str) -> CheckOutcome:
        if name not in found:
            return CheckOutcome.NOT_CHECKED
        return CheckOutcome.PASSED if found[name] is None else CheckOutcome.FAILED

    return Verification(
        states=states,
        transitions=transitions,
        safe=outcome("safe"),
        controllable=outcome("controllable"),
        nonblocking=outcome("nonblocking"),
        maximally_permissive=outcome("maximally permissive"),
        failures=tuple(failure for failure in found.values() if failure is not None),
    )


def failure(
    system: System, property_: str, trace: tuple[str, ...], state: State, reason: str, *, is_shortest: bool = True
) -> Failure:
    """The failure of a property in a state."""
    where = ", ".join(f"{subject} = {value}" for subject, value in zip(subjects(system), state, strict=True))
    return Failure(property_, trace, state, reason, f"{reason} in {where}", is_shortest)


class _FailureSearch(msgspec.Struct, frozen=True):
    """Looks for the first failure of each kind, nearest to the initial state."""

    found: Reached

    def unsafe(self) -> Failure | None:
        """A reachable bad state."""
        packing = self.found.packing
        broken = packing.broken_invariants()
        # Each table has seen every state, so most have no bad state at all.
        tables = [table for table in self.found.tables if table.bad]
        if not broken and not tables:
            return None
        for number, code in enumerate(self.found.codes):
            if any(test(code) for test in broken) or any(table.is_bad(code) for table in tables):
                reason = packing.semantics.bad_reason(packing.decode(code))
                return self._failure("safe", number, str(reason))
        return None

    def uncontrollable(self) -> Failure | None:
        """A reachable state where the supervisor stands in the way of an uncontrollable event."""
        for table in self.found.tables:
            if table.event.is_controllable or table.condition is None:
                continue
            for number, code in enumerate(self.found.codes):
                if not table.condition(code) and table.enabled(code):
                    return self._failure("controllable", number, f"the uncontrollable {table.event.name} is disabled")
        return None

    def blocking(self) -> Failure | None:
        """A reachable state from which no marked one is reachable."""
        number = blocking_state(self.found)
        return None if number is None else self._failure("nonblocking", number, "no marked state can be reached")

    def restrictive(self, recomputed: Allowed, begins: CodeTest) -> Failure | None:
        """A reachable state where a controllable event, or an initial one, is disabled that could be allowed."""
        packing = self.found.packing
        for code in packing.initial():
            if not begins(code) and recomputed.good[recomputed.numbers[code]]:
                reason = "the system may not begin here although it could"
                return failure(packing.system, "maximally permissive", (), packing.decode(code), reason)
        limited = [
            (place, table.event.name, table.condition)
            for place, table in enumerate(self.found.tables)
            if table.event.is_controllable and table.condition is not None
        ]
        for number, code in enumerate(self.found.codes):
            for place, event, condition in limited:
                if not condition(code) and recomputed.allows(code, place):
                    message = f"{event} is disabled although it could be allowed"
                    return self._failure("maximally permissive", number, message)
        return None

    def _failure(self, property_: str, number: int, reason: str) -> Failure:
        packing = self.found.packing
        state = packing.decode(self.found.codes[number])
        return failure(packing.system, property_, self.found.trace(number), state, reason)
