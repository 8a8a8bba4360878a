"""Generated methods of a strategy: its memory of goals and missions, and its choices."""

from collections.abc import Sequence

from robosc.supervisor import Strategy
from robosc.targets.code.expressions import FALSE_CODE, Code, Sort, literal
from robosc.targets.code.python.expressions import code_text
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.strategy import choosing, observing, seen
from robosc.targets.text import indent

_NOTHING = literal("None", Sort.INTEGER)
_OBSERVE = "Take in a stable state; return what is met, and where missions are."


def forgetting_lines(writer: Writer) -> list[str]:
    """Statements that forget all that was remembered of goals and missions."""
    if writer.layout.supervisor.strategy is None:
        return []
    memory = (f"self.{attribute} = False" for attribute in writer.layout.memory.values())
    nothing = _tuple([FALSE_CODE] * len(seen(writer.layout.executable, writer.scope)))
    return [*memory, "self.mode = 0", f"self._seen = {nothing}"]


def mode_tables(strategy: Strategy) -> list[str]:
    """Statements of the constructor: the methods of each goal and visit."""
    numbers = range(1, len(strategy.modes) + 1)
    return ["self._approach = (" + "".join(f"self._approach_{number}, " for number in numbers).rstrip() + ")"]


def strategy_methods(writer: Writer, strategy: Strategy) -> list[list[str]]:
    """Return the methods of a strategy."""
    executable, scope = writer.layout.executable, writer.scope
    count = len(strategy.modes)
    methods = [
        [
            *method("observe", _OBSERVE, observing(executable, scope, PythonNamer())),
            *indent([f"seen = self._seen = {_tuple(seen(executable, scope))}", "return seen"]),
        ],
        f'''\
def choose(self):
    """Return the number of the request that the strategy chooses, None to wait."""
    seen = self._seen
    for _ in range({count}):
        mode = self.mode
        if not seen[mode]:
            return self._approach[mode]()
        self.mode = (mode + 1) % {count}
    return None'''.splitlines(),
    ]
    for number, aim in enumerate(executable.obligations.aims):
        body = choosing(executable, strategy, number, writer.conditions, _NOTHING)
        methods.append(method(f"_approach_{number + 1}", f"Return the request that approaches {aim.name}.", body))
    return methods


def _tuple(items: Sequence[Code]) -> str:
    return "(" + "".join(f"{code_text(item)}, " for item in items).rstrip() + ")"
