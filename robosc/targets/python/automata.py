"""Automata under their supervisor as a module in Python, with methods to take an event and to list possible events."""

from collections.abc import Callable
from dataclasses import dataclass

from robosc._version import __version__
from robosc.automata.structure import Event, System
from robosc.expressions import EnumType, IntegerType, Type
from robosc.expressions.text import cif_text
from robosc.model.received import Path
from robosc.model.structure import Model
from robosc.targets.code.automata import AutomataWriter, ControlledAutomata, always
from robosc.targets.code.expression_writer import read_nothing
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, Sort, call, place, variable
from robosc.targets.code.naming import MAXIMUM_NAME, require_package_name, snake_case
from robosc.targets.code.nesting import shallow
from robosc.targets.code.python.conditions import PythonDiagrams
from robosc.targets.code.python.expressions import Scope, constant
from robosc.targets.code.python.folding import folded
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import function
from robosc.targets.code.statements import Block
from robosc.targets.code.templates import environment
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions, SupervisedSystem

_NO_MODEL = Model("", (), (), (), (), (), (), ())
_API_NAMES = ("EVENTS", "INPUTS", "State", "Supervisor", "copy", "div", "event", "first", "mod", "next_", "s", "value")


@dataclass(frozen=True)
class _Reading(Scope):
    """Writer of expressions over a state; nothing in it is ever unknown."""

    def state_code(self, automaton: str, state: str, is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in a location, or is not."""
        if not self.location(automaton):
            return TRUE_CODE if is_in else FALSE_CODE
        return super().state_code(automaton, state, is_in)

    def in_one_of(self, automaton: str, locations: tuple[str, ...], is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in one of some locations, or is in none."""
        if not self.location(automaton):
            return TRUE_CODE if is_in else FALSE_CODE
        return super().in_one_of(automaton, locations, is_in)

    def _function_code(self, function: str, arguments: list[Code]) -> Code:
        return self._bounded_call(function, arguments, call(function, *arguments, sort=Sort.INTEGER))


class _Diagrams(PythonDiagrams):
    """Writes decision diagrams; each function is noted with what it calls."""

    def __init__(self, system: System, scope: Scope) -> None:
        super().__init__(system, scope, cif_text)

    def _node_call(self, number: int) -> Code:
        return call(f"_node_{number}", variable("s"))

    def _node_function(self, number: int, words: str, body: Block) -> list[str]:
        return function(f"_node_{number}", words, body, [variable("s")])


class _Writer(AutomataWriter):
    """Writes what events do in Python."""

    def _stored(self, type_: Type, value: Code) -> Code:
        return value


@dataclass(frozen=True, slots=True)
class _Names:
    """Attributes of the state.

    Attributes:
        locations: Attribute that holds each automaton's location, of those that have several.
        variables: Attribute that holds each variable, and its type.
        words: Name in the model of what each attribute holds.
    """

    locations: dict[str, str]
    variables: dict[tuple[str, str], tuple[str, Type]]
    words: dict[str, str]


def _names(automata: ControlledAutomata) -> _Names:
    namer, found = PythonNamer(), _Names({}, {}, {})
    for automaton in automata.system.automata:
        if automata.has_location(automaton.name):
            found.locations[automaton.name] = namer.name(automaton.name)
            found.words[found.locations[automaton.name]] = automaton.name
        for item in automaton.variables:
            words = automaton.name if automaton.name in automata.inputs else f"{automaton.name}.{item.name}"
            attribute = namer.name(words)
            found.variables[automaton.name, item.name] = attribute, item.type
            found.words[attribute] = words
    return found


def generate(supervised: SupervisedSystem, options: GenerateOptions) -> GeneratedFiles:
    """The one file for automata under their supervisor.

    Args:
        supervised: The automata and their supervisor.
        options: Choices of the user: the name of the module, unless it is made from the system's.

    Raises:
        UnsupportedModelError: They leave open what happens, or compute what no code computes.
    """
    if options.package is not None:
        require_package_name(options.package)
    system = supervised.system
    module = options.package or f"{snake_case(system.name)[:MAXIMUM_NAME].rstrip('_')}_supervisor"
    with shallow(system.name, "code"):
        text = folded(_text(ControlledAutomata(supervised), module))
    return GeneratedFiles({f"{module}.py": text})


def _text(automata: ControlledAutomata, module: str) -> str:
    names = _names(automata)
    used: set[str] = set()

    def scope(state: str, received: Callable[[Path], Code] = read_nothing) -> _Reading:
        def attribute(component: str, name: str) -> tuple[str, Type]:
            found, type_ = names.variables[component, name]
            return f"{state}.{found}", type_

        def location(automaton: str) -> str:
            return f"{state}.{names.locations[automaton]}" if automaton in names.locations else ""

        return _Reading(used.add, _NO_MODEL, attribute, location, received)

    before, after = scope("s"), scope("next_")
    diagrams = _Diagrams(automata.system, before)
    writer = _Writer(automata, before, after, diagrams)
    namer = PythonNamer(_API_NAMES)
    functions: list[list[str]] = []
    events = []
    both = [variable("s"), variable("next_")]
    for event in automata.events:
        name = "_" + namer.name(f"step_{event.name}")
        events.append((event.name, event.is_controllable, name))
        functions.append(function(name, f"Take {event.name}.", writer.step(event), both))
    inputs = []
    for item in automata.inputs:
        attribute, type_ = names.variables[item, automata.input_variable(item)]
        name = "_" + namer.name(f"input_{item}")
        raw = place("value", IntegerType() if isinstance(type_, IntegerType) else type_)
        taken = scope("s", always(raw))
        body = _Writer(automata, taken, after, diagrams).step(Event(item, False))
        functions.append(function(name, f"Let the input {item} have a value.", body, [*both, variable("value")]))
        match type_:
            case IntegerType(low=low, high=high):
                values = f"range({low}, {int(high or 0) + 1})"
            case EnumType(values=literals):
                values = ascii(tuple(literals))
            case _:
                values = "(False, True)"
        inputs.append((item, attribute, values, name))
    functions.append(function("_may_begin", "Return True if the system may begin so.", writer.may_begin(), both[:1]))
    functions.append(function("_is_marked", "Return True if the state is marked.", writer.is_marked(), both[:1]))
    begin = function("_begin", "Write the first state.", writer.begin(lambda type_, value: constant(value)), both[1:])
    values_of_template = {
        "version": __version__,
        "name": automata.system.name,
        "module": module,
        "words": names.words,
        "events": events,
        "inputs": inputs,
        "helpers": sorted(used),
        "functions": [*diagrams.nodes.values(), *functions, begin if len(begin) > 2 else [*begin, "    return"]],
    }
    text = environment("robosc.targets.python", filters={}).get_template("automata.py.j2").render(values_of_template)
    try:
        compile(text, "supervisor.py", "exec", dont_inherit=True)
    except SyntaxError as error:
        # Names are checked: all that is left for the compiler to refuse are too many brackets in each other.
        raise RecursionError from error
    return text
