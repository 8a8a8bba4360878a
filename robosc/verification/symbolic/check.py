"""Check that a supervisor is safe, controllable and nonblocking, on sets of states."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from robosc.automata.decision import Decision
from robosc.automata.structure import System
from robosc.verification.explicit_check import CheckOutcome, Failure, Verification, failure, require_known, verification
from robosc.verification.symbolic.reach import Reachability
from robosc.verification.symbolic.relations import Relations
from robosc.verification.symbolic.variables import Variables
from robosc.verification.symbolic.work import TooMuchWorkError, Work

DEFAULT_WORK = 10_000_000
"""Work after which a check is given up: some seconds with the engine in C."""


def verify_symbolically(
    system: System,
    added: Mapping[str, Decision],
    *,
    initial: Decision | None = None,
    limit: int = DEFAULT_WORK,
    engine: str = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Verification:
    """Check that a supervisor is safe, controllable and nonblocking; what it permits is compared with nothing.

    Args:
        system: Plants and event conditions.
        added: For each event to which the supervisor adds a condition, that condition.
        initial: Condition on the initial states in which the supervisor lets the system begin; None: in all of them.
        limit: Nodes of diagrams, each counted whenever it is made, after which nothing more is checked. The same
            work counts alike with every engine.
        engine: `autoref` for decision diagrams in plain Python; else the fastest installed are used.
        should_stop: Function called again and again; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        ValueError: A condition is added to something that is no event of the system.
    """
    require_known(system, added)
    try:
        return _Check(system, added, initial, engine, Work(limit, should_stop, on_progress)).verification()
    except TooMuchWorkError:
        skipped = CheckOutcome.NOT_CHECKED
        return Verification(None, None, skipped, skipped, skipped, skipped)


class _Check:
    """One check: its decision diagrams live and end with it."""

    def __init__(
        self, system: System, added: Mapping[str, Decision], initial: Decision | None, engine: str, work: Work
    ) -> None:
        self._system = system
        self._variables = Variables(system, engine, work)
        relations = Relations(self._variables, dict(added))
        self._invariant = relations.holds(system.invariants)
        self._relations = [relations.relation(event) for event in system.events]
        self._reachability = Reachability(self._variables, self._relations)
        begins = [*self._variables.initial(), relations.holds([system.initial, *system.plant_invariants])]
        if initial is not None:
            begins.append(self._variables.decision(initial))
        self._initial = self._variables.all_of(begins)
        self._marked = self._variables.all_of([*self._variables.marked(), relations.holds([system.marker])])
        self._reachable = self._reachability.reachable(self._initial)

    def verification(self) -> Verification:
        """The outcome; where the work for one property is too much, that property counts as not checked."""
        found = {"safe": self._unsafe(), "controllable": self._uncontrollable()}
        with suppress(TooMuchWorkError):
            found["nonblocking"] = self._blocking()
        return verification(self._variables.count(self._reachable), None, found)

    def _unsafe(self) -> Failure | None:
        """A reachable bad state."""
        false = self._variables.manager.false
        bad = self._variables.any_of([~self._invariant, *(item.bad for item in self._relations)])
        found = self._failure("safe", self._reachable & bad, "an invariant is not true")
        if found is None:
            return None
        # The explicit semantics would give a better reason, but a state of this system may have too many successors.
        at = self._variables.states([found.state])
        for item in self._relations:
            if at & self._invariant != false and at & item.bad != false:
                whose = "the supervisor" if self._system.is_controlled else "its requirement"
                reason = f"{item.event.name} can happen against {whose} or take a variable out of its range"
                return failure(self._system, "safe", found.trace, found.state, reason, is_shortest=found.is_shortest)
        return found

    def _uncontrollable(self) -> Failure | None:
        """A reachable state where the supervisor stands in the way of an uncontrollable event."""
        for relation in self._relations:
            if not relation.event.is_controllable:
                disabled = self._reachable & (relation.enabled & ~relation.allowed)
                found = self._failure("controllable", disabled, f"the uncontrollable {relation.event.name} is disabled")
                if found is not None:
                    return found
        return None

    def _blocking(self) -> Failure | None:
        """A reachable state from which no marked one is reachable."""
        reaching = self._reachability.reaching(self._marked)
        blocking = self._reachable & ~reaching
        return self._failure("nonblocking", blocking, "no marked state can be reached")

    def _failure(self, property_: str, wanted: Any, reason: str) -> Failure | None:
        """The failure of a property in the first of some states, or None if there are none."""
        if wanted == self._variables.manager.false:
            return None
        run = self._reachability.run(self._initial, wanted)
        return failure(self._system, property_, run.trace, run.state, reason, is_shortest=run.is_shortest)
