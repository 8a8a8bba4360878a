"""Check of the properties of a controller: by its structure if that is enough, else by a search of its states."""

from collections.abc import Callable, Iterable

from robosc.automata.executable import ExecutableSystem
from robosc.automata.semantics import TooManyChoicesError
from robosc.controller_properties.confluence import ConfluenceSearch
from robosc.controller_properties.controller import Controller
from robosc.controller_properties.outcome import Properties
from robosc.controller_properties.search import search
from robosc.controller_properties.silent_steps import always_end, never_conflict, never_forbids, stays_nonblocking
from robosc.supervisor import AddedCondition, PropertyResult

DEFAULT_LIMIT = 10_000
"""Maximum number of stable states that a search visits."""

HOPELESS = 1_000
"""Factor between the states of the controlled system and the limit of a search from which no search is begun."""


def check_controller(
    system: ExecutableSystem,
    added: Iterable[AddedCondition],
    *,
    is_nonblocking: bool,
    states: int = 0,
    limit: int = DEFAULT_LIMIT,
    controller: Controller | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Properties:
    """Check the properties of a controller that synthesis does not guarantee; deterministic.

    They are finite response, confluence, nonblocking under control, and that every cancel is possible that the executor
    asks for. A property is 'passed' only if it is proved, and 'failed' only if a trace shows it.

    Args:
        system: Executable system of the robot.
        added: The conditions that synthesis adds.
        is_nonblocking: True if it is certain that the controlled system is nonblocking.
        states: Number of states of the controlled system, if it is known. If it is `HOPELESS` times as large as
            `limit`, there is no search for nonblocking alone, because only a complete search decides it.
        limit: Maximum number of stable states that the search visits.
        controller: The controller automaton, if it was made already.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    conditions = tuple(added)
    controller = controller or Controller(system, conditions)
    ends = always_end(controller.system, should_stop)
    is_confluent = ends and never_conflict(controller, conditions, should_stop)
    # Not without an end of silent steps: what comes after them would not.
    is_live = ends and is_nonblocking and stays_nonblocking(system.model, controller, conditions)
    proved = (ends, is_confluent, is_live)
    allows = never_forbids(controller, conditions)
    cancels: PropertyResult | None = "passed" if controller.goals else None
    if all(proved) and allows:
        return Properties("passed", "passed", "passed", "by the structure of silent steps", cancels=cancels)
    if ends and is_confluent and allows and states > HOPELESS * limit:
        how = f"not searched: more than {HOPELESS * limit} states in the controlled system"
        return Properties("passed", "passed", "not checked", _method(proved, how), cancels=cancels)
    try:
        orders = None if is_confluent else ConfluenceSearch(controller, limit)
        found = search(controller, limit=limit, confluence=orders, should_stop=should_stop)
    except TooManyChoicesError as error:
        finite_response, confluence, nonblocking = (_outcome(item, False, False) for item in proved)
        return Properties(
            finite_response,
            confluence,
            nonblocking,
            _method(proved, f"not searched: {error}"),
            cancels=cancels and _outcome(allows, False, False),
        )
    how = f"search of every stable state ({found.states})"
    if not found.is_complete:
        how = f"search given up after {found.states} stable states"
    is_searched = found.is_complete
    if orders is not None and orders.is_exhausted:
        is_searched = False
        how = f"{how}; too many orders of silent steps to follow them all: more than {limit} states on their way"
    return Properties(
        finite_response=_outcome(ends, found.livelock is not None, found.is_complete),
        confluence=_outcome(is_confluent, found.conflict is not None, is_searched),
        nonblocking=_outcome(is_live, found.blocking is not None, found.is_complete),
        method=_method(proved, how),
        livelock=found.livelock,
        conflict=found.conflict,
        blocking=found.blocking,
        cancels=cancels and _outcome(allows, bool(found.forbidden), found.is_complete),
        forbidden=tuple(found.forbidden.values()),
    )


def _outcome(is_proved: bool, has_failed: bool, is_complete: bool) -> PropertyResult:
    if has_failed:
        return "failed"
    return "passed" if is_proved or is_complete else "not checked"


def _method(proved: tuple[bool, bool, bool], how: str) -> str:
    names = ("finite response", "confluence", "nonblocking under control")
    found = [name for name, is_proved in zip(names, proved, strict=True) if is_proved]
    return f"{' and '.join(found)} by the structure of silent steps; {how}" if found else how
