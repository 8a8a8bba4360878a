"""Generated functions of a strategy: its memory of goals and missions, and its choices."""

from robosc.automata.goal_memory import MEMORY
from robosc.supervisor import Strategy
from robosc.targets.code.c.conditions import CConditions
from robosc.targets.code.c.naming import CNamer
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.text import comment
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.expressions import FALSE_CODE, integer, variable
from robosc.targets.code.statements import Assign, Statement
from robosc.targets.code.strategy import choosing, observing, seen


def forgotten(unit: Unit) -> list[Statement]:
    """The assignments by which nothing is remembered of goals and missions."""
    scope, layout = Reading(unit), unit.layout
    places = (scope.variable_place(MEMORY, place.name) for place in layout.executable.obligations.places)
    return [*(Assign(place, FALSE_CODE) for place in places), Assign(variable(f"s->{layout.mode}"), integer(0))]


def strategy_functions(unit: Unit, conditions: CConditions, strategy: Strategy) -> list[list[str]]:
    """Return the functions by which the engine calls the strategy.

    Args:
        unit: The file.
        conditions: Writer of its conditions.
        strategy: The strategy.
    """
    executable, scope, mode = unit.layout.executable, Reading(unit), f"s->{unit.layout.mode}"
    count = len(strategy.modes)
    taken = observing(executable, scope, CNamer(frozenset({"s", "seen"})))
    judged = (Assign(variable(f"seen[{number}]"), code) for number, code in enumerate(seen(executable, scope)))
    head = "static void observe_for_strategy(state_t *s, bool *seen)"
    found = [unit.definition(head, [*unused("s"), *taken, *judged])]
    for number, aim in enumerate(executable.obligations.aims):
        body = [*unused("s"), *choosing(executable, strategy, number, conditions, integer(-1))]
        words = comment(f"the request that approaches {aim.name}, or -1 to wait")
        found.append([*words, *unit.definition(f"static int approach_{number + 1}(const state_t *s)", body)])
    following = f"{mode} + 1 < {count} ? {mode} + 1 : 0"
    lines = [
        "/* The request that the strategy chooses in a stable state, or -1 to wait; `approached`: the aim in turn. */",
        "static int choose_by_strategy(state_t *s, const bool *seen, int *approached)",
        "{",
        f"    for (int tried = 0; tried < {count}; tried++) {{",
        f"        *approached = (int){mode};",
        f"        if (!seen[{mode}]) {{",
        "            break;",
        "        }",
        f"        {mode} = ({following});" if count > 1 else f"        {mode} = 0;",
        "    }",
        "    if (seen[*approached]) {",
        "        return -1;",
        "    }",
        "    switch (*approached) {",
    ]
    for number in range(count):
        lines += [f"    case {number}:", f"        return approach_{number + 1}(s);"]
    lines += ["    default:", "        return -1;", "    }", "}"]
    return [*found, lines]
