"""Generated methods of a strategy: its memory of goals and missions, and its choices."""

from collections.abc import Iterable, Sequence

from robosc.supervisor import Strategy
from robosc.targets.code.expressions import FALSE_CODE, Code, Sort, literal, variable, words_of
from robosc.targets.code.python.expressions import code_text
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.statements import Assign, Return, codes
from robosc.targets.code.strategy import choosing, observing, seen
from robosc.targets.text import indent

_NOTHING = literal("None", Sort.INTEGER)
_SITUATION = "Return all of the state that what is observed and chosen depends on."
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
    taken, judged = observing(executable, scope, PythonNamer()), seen(executable, scope)
    choices = [choosing(executable, strategy, number, writer.conditions, _NOTHING) for number in range(count)]
    methods = [
        _situation(writer, codes([*taken, *(item for choice in choices for item in choice)]), judged),
        *_memory(writer),
        [
            *method("observe", _OBSERVE, taken),
            *indent([f"seen = self._seen = {_tuple(judged)}", "return seen"]),
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
    for number, (aim, body) in enumerate(zip(executable.obligations.aims, choices, strict=True), start=1):
        methods.append(method(f"_approach_{number}", f"Return the request that approaches {aim.name}.", body))
    return methods


def _situation(writer: Writer, statements: Iterable[Code], judged: Iterable[Code]) -> list[str]:
    """Return the method that gives all of the state that goals and the strategy depend on."""
    layout = writer.layout
    read = writer.conditions.read_by(words_of([*statements, *judged]))
    attributes = [*layout.locations.values(), *(name for name, _ in layout.variables.values())]
    parts = [variable(f"self.{name}") for name in attributes if f"self.{name}" in read]
    return method("situation", _SITUATION, [Return(variable(_tuple(parts)))])


def _memory(writer: Writer) -> list[list[str]]:
    """Return the methods that give and take what is remembered."""
    places = ["self.mode", *(f"self.{attribute}" for attribute in writer.layout.memory.values())]
    everything = _tuple([variable(place) for place in places])
    remembered = variable("remembered")
    return [
        method("remembered", "Return what is remembered of goals and missions.", [Return(variable(everything))]),
        method(
            "recall",
            "Remember what remembered() has returned.",
            [Assign(variable(everything), remembered)],
            [remembered],
        ),
    ]


def _tuple(items: Sequence[Code]) -> str:
    return "(" + "".join(f"{code_text(item)}, " for item in items).rstrip() + ")"
