"""Generated methods of a strategy: its memory of goals, and its choices."""

from robosc.supervisor import Strategy
from robosc.targets.code.expressions import Sort, literal
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.strategy import choosing, observing, reached

_NOTHING = literal("None", Sort.INTEGER)


def forgetting_lines(writer: Writer) -> list[str]:
    """Statements that forget all that was remembered of goals."""
    if writer.layout.supervisor.strategy is None:
        return []
    return [*(f"self.{attribute} = False" for attribute in writer.layout.memory.values()), "self._mode = 0"]


def mode_tables(strategy: Strategy) -> list[str]:
    """Statements of the constructor: the methods of each goal."""
    numbers = range(1, len(strategy.modes) + 1)
    return [
        "self._is_reached = (" + "".join(f"self._is_goal_{number}_reached, " for number in numbers).rstrip() + ")",
        "self._approach = (" + "".join(f"self._approach_goal_{number}, " for number in numbers).rstrip() + ")",
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
    for number in range(count):
        name = f"goal {number + 1}"
        body = choosing(executable, strategy, number, writer.conditions, _NOTHING)
        is_reached = reached(executable, number, scope)
        methods.append(method(f"_is_goal_{number + 1}_reached", f"Return True if {name} is true.", is_reached))
        methods.append(method(f"_approach_goal_{number + 1}", f"Return the request that approaches {name}.", body))
    return methods
