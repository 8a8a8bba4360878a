"""Verification of a supervisor of any size: state by state if it is small enough, else on sets of states."""

from collections.abc import Callable, Mapping

import msgspec

from robosc.automata.controlled import TRANSITIONS_PER_STATE
from robosc.automata.decision import Decision
from robosc.automata.semantics import Semantics
from robosc.automata.structure import System
from robosc.expressions import Expression
from robosc.expressions.text import expression_text
from robosc.verification.explicit_check import CheckOutcome, Verification, verify_explicitly

DEFAULT_STATES = 200_000
"""States up to which the controlled system is searched one by one: some seconds."""


class Limits(msgspec.Struct, frozen=True):
    """Limits of a check; all is counted, so that it ends alike on every machine.

    Attributes:
        states: States up to which the controlled system is searched one by one.
        recomputed: States of the uncontrolled system up to which the supervisor is recomputed.
        work: Nodes of decision diagrams up to which larger systems are searched symbolically.
        positions: Positions under a strategy up to which they are searched one by one.
    """

    states: int
    recomputed: int
    work: int
    positions: int = 0

    @classmethod
    def of(cls, states: int) -> "Limits":
        """Limits under which each part takes about as long as searching so many states."""
        return cls(states, states // 4, 25 * states, states // 10)


class VerificationReport(msgspec.Struct, frozen=True):
    """Findings of a check, and their method.

    Attributes:
        verification: The outcomes.
        method: Description of what was done, in one line.
    """

    verification: Verification
    method: str

    @property
    def is_complete(self) -> bool:
        """True if all was checked but permissiveness."""
        found = self.verification
        return CheckOutcome.NOT_CHECKED not in (found.safe, found.controllable, found.nonblocking)


def verify(
    system: System,
    added: Mapping[str, Decision],
    limits: Limits,
    *,
    initial: Decision | None = None,
    expected_states: int = 0,
    engine: str = "auto",
    semantics: Semantics | None = None,
    text: Callable[[Expression], str] = expression_text,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> VerificationReport:
    """Check whether a supervisor is safe, controllable, nonblocking and, where feasible, maximally permissive.

    Args:
        system: Plants and event conditions.
        added: For each event to which the supervisor adds a condition, that condition.
        limits: Limits of the check.
        initial: Condition on the initial states in which the supervisor lets the system begin; None: in all of them.
        expected_states: States that the controlled system is said to have: where these are too many, the search one
            by one is not even begun.
        engine: Engine of the symbolic search: see `verify_symbolically`.
        semantics: Semantics of the system, if it was made already.
        text: Function that writes a condition of the system, for what fails.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        ValueError: A condition is added to something that is no event of the system.
    """
    if expected_states <= limits.states:
        found = verify_explicitly(
            system,
            added,
            initial=initial,
            limit=limits.states,
            permissive_limit=0 if system.is_controlled else limits.recomputed,
            semantics=semantics or Semantics(system, text),
            should_stop=should_stop,
            on_progress=on_progress,
        )
        if found.states is not None:
            return VerificationReport(found, f"explicit forward search; {_permissiveness(system, found, limits)}")
        reason = f"more than {limits.states} states, or {TRANSITIONS_PER_STATE * limits.states} transitions"
    else:
        reason = f"more than {limits.states} states"
    # Most systems are small: who only searches them one by one need not load what works on sets of states.
    from robosc.verification.symbolic import verify_symbolically

    found = verify_symbolically(
        system,
        added,
        initial=initial,
        limit=limits.work,
        engine=engine,
        should_stop=should_stop,
        on_progress=on_progress,
    )
    if found.states is None:
        method = f"not checked: {reason}, and the symbolic search takes more than {limits.work} nodes"
    elif CheckOutcome.NOT_CHECKED in (found.safe, found.controllable, found.nonblocking):
        method = f"symbolic search ({reason}), given up after {limits.work} nodes; permissiveness not recomputed"
    else:
        method = f"symbolic search ({reason}); permissiveness not recomputed"
    return VerificationReport(found, method)


def _permissiveness(system: System, found: Verification, limits: Limits) -> str:
    if system.is_controlled:
        return "permissiveness not checked, because the model has no requirements beside the supervisor"
    if found.maximally_permissive is CheckOutcome.NOT_CHECKED:
        return (
            f"permissiveness not recomputed: more than {limits.recomputed} states, or "
            f"{TRANSITIONS_PER_STATE * limits.recomputed} transitions"
        )
    return "permissiveness by explicit recomputation"
