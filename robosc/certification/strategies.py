"""Check of a strategy of any size: position by position if these are few, else on sets of positions.

Where the search on sets is given up, more positions are looked at one by one.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import msgspec

from robosc.automata.executable import ExecutableSystem
from robosc.automata.state import subjects
from robosc.controller_properties import Controller, MissedGoal, check_strategy
from robosc.controller_properties.messages import MAXIMUM_CASES, PossibleData, choices_together
from robosc.model.structure import EventKind
from robosc.supervisor import AddedCondition, Strategy
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.verification import CheckOutcome, Limits

if TYPE_CHECKING:
    from robosc.verification.symbolic import Occurrence, StrategyVerification

BY_POSITION = "goals position by position"

_FIRST_DIVISOR = 10
"""Divisor of the limit of positions: without missions, so many are looked at before sets of positions are tried."""


class GoalCheck(msgspec.Struct, frozen=True):
    """Outcome of the check of a strategy.

    Attributes:
        outcome: The outcome.
        method: Description of what was done, in a few words.
        missed: A run that misses a goal, or None.
        put_off: Numbers of visits that the robot itself may put off for ever; empty where sets of positions were
            checked.
    """

    outcome: CheckOutcome
    method: str
    missed: MissedGoal | None = None
    put_off: tuple[int, ...] = ()


def verify_strategy(
    executable: ExecutableSystem,
    added: Sequence[AddedCondition],
    strategy: Strategy,
    limits: Limits,
    *,
    engine: str = "auto",
    controller: Controller | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> GoalCheck:
    """Check that under a strategy every goal comes true as long as the assumptions do.

    Args:
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        strategy: The strategy.
        limits: Limits of the check.
        engine: Engine of a symbolic search.
        controller: The controller automaton, if it was made already.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    # Visits that are put off are found only position by position, so that robots with missions get the whole limit.
    few = limits.positions if executable.model.missions else limits.positions // _FIRST_DIVISOR
    found = check_strategy(executable, added, strategy, limit=few, controller=controller, should_stop=should_stop)
    if found.result != "not checked":
        return GoalCheck(CheckOutcome(found.result), BY_POSITION, found.missed, found.put_off)
    reason = f"more than {few} positions" if found.positions >= few else "data with many values"
    missed = None
    if limits.work:
        check, is_exact = verify_on_sets(
            executable,
            added,
            strategy,
            limit=limits.work,
            engine=engine,
            should_stop=should_stop,
            on_progress=on_progress,
        )
        if check.fault is not None:
            width = len(subjects(executable.executed_automata))
            missed = MissedGoal(check.fault.goal, check.fault.trace, check.fault.state[:width])
        if check.outcome is not CheckOutcome.NOT_CHECKED and (missed is None or is_exact):
            return GoalCheck(check.outcome, f"goals by symbolic search ({reason})", missed)
    if few < limits.positions:
        found = check_strategy(
            executable, added, strategy, limit=limits.positions, controller=controller, should_stop=should_stop
        )
    if found.result != "not checked":
        return GoalCheck(CheckOutcome(found.result), BY_POSITION, found.missed, found.put_off)
    if found.positions >= limits.positions:
        reason = f"more than {limits.positions} positions"
    given_up = f"the symbolic search takes more than {limits.work} nodes"
    if missed is not None:
        given_up = f"the data of a message has more than {MAXIMUM_CASES} cases"
    return GoalCheck(CheckOutcome.NOT_CHECKED, f"goals not checked: {reason}, and {given_up}")


def verify_on_sets(
    executable: ExecutableSystem,
    added: Sequence[AddedCondition],
    strategy: Strategy,
    *,
    limit: int,
    engine: str = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> "tuple[StrategyVerification, bool]":
    """Return the check on sets of positions, and whether the surroundings do there no more than they can.

    Args:
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        strategy: The strategy.
        limit: Nodes of diagrams after which the check is given up.
        engine: Engine of the search.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    # Most strategies are small: the library of decision diagrams is loaded only where it is needed.
    from robosc.verification.symbolic import verify_strategy_symbolically

    system = executable.remembering_automata
    cases = [(batch, _cases(executable, batch)) for batch in executable.batches]
    modes = [[(item.event, state_predicate(system, item.condition)) for item in mode] for mode in strategy.modes]
    check = verify_strategy_symbolically(
        executable,
        state_predicates(executable.executed_automata, added),
        modes,
        [message for batch, found in cases for message in _messages(batch, found)],
        limit=limit,
        engine=engine,
        should_stop=should_stop,
        on_progress=on_progress,
    )
    return check, all(found is None or len(found) <= MAXIMUM_CASES for _, found in cases)


def _cases(
    executable: ExecutableSystem, batch: Sequence[str]
) -> tuple[tuple[tuple[PossibleData, ...], ...], ...] | None:
    """Return the data that the events of one message can carry together; None where every combination is possible."""
    if len(batch) == 1:
        return None
    messages = {item.event(EventKind.RESPONSE): item for item in executable.model.communications}
    return choices_together(executable.model, executable.executed_automata, [messages[event] for event in batch])


def _messages(
    batch: Sequence[str], cases: "Sequence[tuple[tuple[PossibleData, ...], ...]] | None"
) -> "Iterator[tuple[Occurrence, ...]]":
    """Yield the moves of the surroundings that are one message."""
    from robosc.verification.symbolic import Occurrence

    if cases is None or len(cases) > MAXIMUM_CASES:
        yield tuple(Occurrence(event, None, len(batch) > 1) for event in batch)
        return
    for case in cases:
        yield tuple(
            Occurrence(event, tuple(item.data for item in options), False)
            for event, options in zip(batch, case, strict=True)
        )
        # Under the setting `on_unknown: keep` an event does not happen whose enum is unknown.
        if any(item.may_be_left_out for options in case for item in options):
            yield tuple(
                Occurrence(
                    event,
                    tuple(item.data for item in options if not item.is_unknown),
                    any(item.may_be_left_out for item in options),
                )
                for event, options in zip(batch, case, strict=True)
            )
