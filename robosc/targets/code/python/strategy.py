"""Generated methods of a strategy: its memory of goals and missions, and its choices."""

from robosc.automata.goal_memory import AimKind
from robosc.supervisor import Strategy
from robosc.targets.code.expressions import Sort, literal
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.strategy import choosing, observing, reached

_NOTHING = literal("None", Sort.INTEGER)


def forgetting_lines(writer: Writer) -> list[str]:
    """Statements that forget all that was remembered of goals and missions."""
    if writer.layout.supervisor.strategy is None:
        return []
    return [*(f"self.{attribute} = False" for attribute in writer.layout.memory.values()), "self._mode = 0"]


def mode_tables(strategy: Strategy) -> list[str]:
    """Statements of the constructor: the methods of each goal and visit."""
    numbers = range(1, len(strategy.modes) + 1)
    return [
        "self._is_reached = (" + "".join(f"self._is_reached_{number}, " for number in numbers).rstrip() + ")",
        "self._approach = (" + "".join(f"self._approach_{number}, " for number in numbers).rstrip() + ")",
    ]


def strategy_methods(writer: Writer, strategy: Strategy) -> list[list[str]]:
    """Return the methods of a strategy."""
    executable, scope = writer.layout.executable, writer.scope
    count = len(strategy.modes)
    methods = [
        method("observe", "Take in a stable state.", observing(executable, scope, PythonNamer())),
        f'''\
def choose(self):
    """Return the number of the request that the strategy chooses, None to wait."""
    for _ in range({count}):
        if not self._is_reached[self._mode]():
            return self._approach[self._mode]()
        self._mode = (self._mode + 1) % {count}
    return None'''.splitlines(),
    ]
    for number, aim in enumerate(executable.obligations.aims):
        body = choosing(executable, strategy, number, writer.conditions, _NOTHING)
        is_reached = reached(executable, number, scope)
        words = f"Return True if {aim.name} is true, or not wanted now."
        if aim.kind is AimKind.GOAL:
            words = f"Return True if {aim.name} is true."
        methods.append(method(f"_is_reached_{number + 1}", words, is_reached))
        methods.append(method(f"_approach_{number + 1}", f"Return the request that approaches {aim.name}.", body))
    return methods
