"""Check of a strategy on sets of positions: no run that is fair to the assumptions misses a goal for ever.

In a mode whose goal is not true the controller stays in that mode, and it passes over no goal that is not true. So a
goal is missed for ever exactly where a fair cycle stays in one mode: it has turns of the controller on it at which each
assumption is true, and none at which the goal of the mode is. Such cycles are looked for, mode by mode, as the greatest
set in which from each position another turn of each kind is reached without leaving the set. Source: E. A. Emerson and
C.-L. Lei, "Efficient model checking in fragments of the propositional mu-calculus", LICS 1986, pp. 267-278.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.automata.compile import State
from robosc.automata.decision import Decision
from robosc.automata.executable import ExecutableSystem
from robosc.verification.explicit_check import CheckOutcome
from robosc.verification.symbolic.closed_loop import Choices, ClosedLoop, Message
from robosc.verification.symbolic.work import TooMuchWorkError, Work


@dataclass(frozen=True, slots=True)
class StrategyFault:
    """Run under a strategy that misses a goal for ever.

    Attributes:
        goal: Number of the goal or visit, from 0; None where silent steps do not end, or a chosen request is not
            enabled.
        trace: Events that lead to where it begins.
        state: The state there, of the automata with their memory.
    """

    goal: int | None
    trace: tuple[str, ...]
    state: State


@dataclass(frozen=True, slots=True)
class StrategyVerification:
    """Outcome of a check on sets of positions.

    Attributes:
        outcome: The outcome.
        positions: Number of positions that can be reached, each with its mode; None where the check was given up.
        fault: A run that misses a goal, or None.
    """

    outcome: CheckOutcome
    positions: int | None = None
    fault: StrategyFault | None = None


def verify_strategy_symbolically(
    executable: ExecutableSystem,
    added: Mapping[str, Decision],
    modes: Sequence[Choices],
    messages: Sequence[Message],
    *,
    limit: int,
    engine: str = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> StrategyVerification:
    """Check that a strategy chooses enabled requests, and reaches every goal while the assumptions come true.

    Args:
        executable: Executable system of the robot.
        added: For each event to which the supervisor adds a condition, that condition, over the executed automata.
        modes: For each goal and visit the choices of the strategy, over the automata with their memory.
        messages: All moves of the surroundings.
        limit: Nodes of diagrams, each counted whenever it is made, after which the check is given up.
        engine: `autoref` for decision diagrams in plain Python; else the fastest installed are used.
        should_stop: Function called again and again; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    try:
        loop = ClosedLoop(executable, added, modes, messages, engine, Work(limit, should_stop, on_progress))
        loop.explore()
        fault = _fault(loop)
    except TooMuchWorkError:
        return StrategyVerification(CheckOutcome.NOT_CHECKED)
    outcome = CheckOutcome.PASSED if fault is None else CheckOutcome.FAILED
    return StrategyVerification(outcome, loop.positions(), fault)


def _fault(loop: ClosedLoop) -> StrategyFault | None:
    run = loop.endless_run() or loop.disabled_run()
    if run is not None:
        return StrategyFault(None, *run)
    for mode in range(len(loop.turns)):
        missing = _missing(loop, mode)
        if missing != loop.variables.manager.false:
            return StrategyFault(mode, *loop.run(missing, mode))
    return None


def _missing(loop: ClosedLoop, mode: int) -> Any:
    """Return the positions of a mode in which a fair cycle begins that misses the goal of the mode."""
    manager, work = loop.variables.manager, loop.variables.work
    turn = loop.turns[mode]
    found, before = loop.reached[mode], manager.false
    owed = work.count(found & ~loop.goals[mode])
    assumptions = loop.assumptions or (manager.true,)
    while found != before and found != manager.false:
        before = found
        for assumption in assumptions:
            landed = loop.arrival.backward(found)
            staying = found & turn.waits
            for move, where in turn.requests:
                staying = work.count(staying | (where & move.backward(loop.variables, landed)))
            found = _leading(loop, mode, found, staying & owed & assumption)
    return found


def _leading(loop: ClosedLoop, mode: int, within: Any, target: Any) -> Any:
    """Return the positions from which moves lead to some positions, without a turn at which the goal is true.

    Args:
        loop: The closed loop.
        mode: The mode.
        within: Positions that are not left.
        target: The positions to get to.
    """
    work, false = loop.variables.work, loop.variables.manager.false
    owed = within & ~loop.goals[mode]
    moves = [(move, within) for move in loop.moves]
    moves += [(move, owed & where) for move, where in loop.turns[mode].requests]
    found = fresh = within & target
    while fresh != false:
        landed, following = loop.arrival.backward(fresh), false
        for move, where in moves:
            following = following | (where & move.backward(loop.variables, landed))
        fresh = work.count(following & ~found)
        found = found | fresh
    return found
