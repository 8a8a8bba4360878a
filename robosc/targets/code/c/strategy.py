"""Generated functions of a strategy: its memory of goals and missions, and its choices."""

from robosc.automata.goal_memory import MEMORY
from robosc.supervisor import Strategy
from robosc.targets.code.c.conditions import CConditions
from robosc.targets.code.c.layout import width
from robosc.targets.code.c.observation import IS_SEEN, observation, remembered_places
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.text import comment
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.expressions import FALSE_CODE, integer, variable
from robosc.targets.code.statements import Assign, Statement
from robosc.targets.code.strategy import choosing


def forgotten(unit: Unit) -> list[Statement]:
    """The assignments by which nothing is remembered of goals and missions."""
    scope, layout = Reading(unit), unit.layout
    places = (scope.variable_place(MEMORY, name) for name in remembered_places(layout))
    return [*(Assign(place, FALSE_CODE) for place in places), Assign(variable(f"s->{layout.mode}"), integer(0))]


def strategy_functions(unit: Unit, conditions: CConditions, strategy: Strategy) -> list[list[str]]:
    """Return the functions by which the engine calls the strategy.

    Args:
        unit: The file.
        conditions: Writer of its conditions.
        strategy: The strategy.
    """
    executable, mode = unit.layout.executable, f"s->{unit.layout.mode}"
    count = len(strategy.modes)
    found = [IS_SEEN, *observation(unit)]
    for number, aim in enumerate(executable.obligations.aims):
        body = [*unused("s"), *choosing(executable, strategy, number, conditions, integer(-1))]
        words = comment(f"the request that approaches {aim.name}, or -1 to wait")
        found.append([*words, *unit.definition(f"static int approach_{number + 1}(const state_t *s)", body)])
    lines = [
        "/* The request that the strategy chooses, or -1 to wait; `approached`: the aim in turn, -1: all are met. */",
        "static int choose_by_strategy(state_t *s, const uint32_t *seen, int *approached)",
        "{",
        f"    int aim = (int){mode};",
        f"    for (int tried = 1; tried < {count} && is_seen(seen, aim); tried++) {{",
        f"        aim = aim + 1 < {count} ? aim + 1 : 0;",
        "    }",
        "    *approached = is_seen(seen, aim) ? -1 : aim;",
        "    if (*approached < 0) {",
        "        return -1;",
        "    }",
        f"    {mode} = ({width(count)})aim;",
        "    switch (aim) {",
    ]
    for number in range(count):
        lines += [f"    case {number}:", f"        return approach_{number + 1}(s);"]
    lines += ["    default:", "        return -1;", "    }", "}"]
    return [*found, lines]
