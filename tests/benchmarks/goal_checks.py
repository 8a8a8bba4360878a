"""Time of checking that a strategy reaches its goals: position by position, and on sets of positions."""

import time

from figures import text_table

ROOMS = (4, 5, 6, 7, 8)

POSITIONS = 20_000
"""Positions that `robosc synth` looks at one by one at most."""

WORK = 5_000_000
"""Nodes that it spends at most."""

HEADER = ("rooms", "states", "positions", "one by one, s", "visited", "on sets, s")


def measured(rooms_count: int) -> list[str]:
    """Figures of one robot."""
    from robosc.automata import ExecutableSystem
    from robosc.certification.strategies import verify_on_sets
    from robosc.controller_properties import check_strategy
    from robosc.model.structure import Deployment
    from robosc.strategies import synthesize_strategy
    from robosc.synthesis import synthesize
    from support.models import model_of
    from support.rooms import rooms

    executable = ExecutableSystem(model_of(rooms(rooms_count)), Deployment.CONTROLLER)
    result = synthesize(executable.automata)
    strategy = synthesize_strategy(executable, result.added).strategy
    assert strategy is not None
    times_s = [time.process_time()]
    visited = check_strategy(executable, result.added, strategy, limit=POSITIONS)
    times_s.append(time.process_time())
    found, _ = verify_on_sets(executable, result.added, strategy, limit=WORK)
    times_s.append(time.process_time())
    assert found.outcome == "passed" and found.positions is not None
    return [
        str(rooms_count),
        f"{result.statistics.states:,}",
        f"{found.positions:,}",
        f"{times_s[1] - times_s[0]:.2f}",
        f"{visited.positions:,}{'' if visited.result == 'passed' else ', given up'}",
        f"{times_s[2] - times_s[1]:.2f}",
    ]


def table() -> str:
    """One line a robot."""
    title = "goal-checks: whether a strategy reaches its goals, of rooms with a caller and a door each"
    return text_table(title, HEADER, [measured(count) for count in ROOMS])
