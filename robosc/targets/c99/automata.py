"""Automata under their supervisor as a library in C99, with a program that steps it by hand."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from robosc._version import __version__
from robosc.automata.structure import Event, System
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    BooleanType,
    EnumType,
    IntegerType,
    Quantifier,
    Reduction,
    Type,
    Value,
)
from robosc.expressions.text import cif_text
from robosc.model.received import Path
from robosc.model.structure import Model
from robosc.targets.code.automata import AutomataWriter, ControlledAutomata, always
from robosc.targets.code.c.conditions import CDiagrams
from robosc.targets.code.c.expressions import CWriter, number_code
from robosc.targets.code.c.helpers import HELPERS, called
from robosc.targets.code.c.naming import CNamer, prefix_for
from robosc.targets.code.c.statements import statement_lines, unused
from robosc.targets.code.c.text import is_nested_too_deeply, safe, string_literal
from robosc.targets.code.expression_writer import read_nothing
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Kind,
    Sort,
    literal,
    operation,
    place,
    variable,
    words_of,
)
from robosc.targets.code.naming import require_package_name
from robosc.targets.code.nesting import shallow
from robosc.targets.code.statements import Block, codes
from robosc.targets.code.templates import environment
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions, SupervisedSystem
from robosc.targets.text import indent

_API_NAMES = """
    t EVENT_COUNT H enabled event_name event_t happened_t init inputs_t is_controllable is_marked run set_inputs state_t
    take
""".split()


@dataclass(frozen=True, slots=True)
class Enumeration:
    """An enum of C: the locations of an automaton, or the values of an enum of the model.

    Attributes:
        type: Its type.
        enumerators: Its enumerators, each with the name of the location or value.
    """

    type: str
    enumerators: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Member:
    """A member of the state.

    Attributes:
        name: Its name.
        words: Name of the automaton, or of the automaton and variable, that it holds.
        type: C type.
        enumeration: Enum of C that it holds a value of, or None.
        is_boolean: True if it is true or false.
        low: Least integer.
        high: Greatest integer.
    """

    name: str
    words: str
    type: str
    enumeration: Enumeration | None = None
    is_boolean: bool = False
    low: int = 0
    high: int = 0


@dataclass
class Names:
    """Names of everything of some automata in C.

    Attributes:
        automata: The automata.
        prefix: Beginning of every global name.
        events: Enumerator of each event.
        locations: Member of the state that holds each automaton's location.
        variables: Member of the state that holds each variable, and its type.
        enumerators: Enumerator of each location, by automaton, and of each value, by enum.
        members: The members of the state, in the order of the model.
        enumerations: The enums of C.
    """

    automata: ControlledAutomata
    prefix: str
    events: dict[str, str] = field(default_factory=dict)
    locations: dict[str, str] = field(default_factory=dict)
    variables: dict[tuple[str, str], tuple[str, Type]] = field(default_factory=dict)
    enumerators: dict[tuple[str, str], str] = field(default_factory=dict)
    members: list[Member] = field(default_factory=list)
    enumerations: dict[str, Enumeration] = field(default_factory=dict)

    def __post_init__(self) -> None:
        starts = (self.prefix, self.prefix.upper())
        self._globals = CNamer({f"{start}_{name}" for start in starts for name in _API_NAMES})
        self._members = CNamer()
        for event in self.automata.events:
            self.events[event.name] = self._globals.name(f"{self.prefix}_EVENT_{event.name}".upper())
        for automaton in self.automata.system.automata:
            name = automaton.name
            if self.automata.has_location(name):
                found = self._enumeration(name, automaton.locations, "at")
                self.locations[name] = self._members.member(name)
                self.members.append(Member(self.locations[name], name, found.type, found))
            for item in automaton.variables:
                words = name if name in self.automata.inputs else f"{name}.{item.name}"
                member = self._members.member(words)
                self.variables[name, item.name] = member, item.type
                self.members.append(self._member(member, words, item.type))

    def _member(self, name: str, words: str, type_: Type) -> Member:
        match type_:
            case EnumType(name=enum, values=values):
                found = self._enumeration(enum, values, "value")
                return Member(name, words, found.type, found)
            case IntegerType(low=int(low), high=int(high)):
                return Member(name, words, "int32_t", low=low, high=high)
            case BooleanType():
                return Member(name, words, "bool", is_boolean=True)
        raise UnsupportedModelError(f"the target c99 does not do the type of {words}")

    def _enumeration(self, name: str, values: Sequence[str], word: str) -> Enumeration:
        key = f"{word} {name}"
        if key not in self.enumerations:
            type_ = self._globals.name(f"{self.prefix}_{word}_{name}_t".lower())
            start = f"{self.prefix}_{word}_{name}"
            named = [(self._globals.name(f"{start}_{value}".upper()), value) for value in values]
            self.enumerators |= {(key, value): enumerator for enumerator, value in named}
            self.enumerations[key] = Enumeration(type_, tuple(named))
        return self.enumerations[key]

    def function(self, preferred_name: str) -> str:
        """A new name for a static function."""
        return self._globals.name(preferred_name)


@dataclass(frozen=True)
class _Reading(CWriter):
    """Writer of expressions over a state.

    Attributes:
        names: Names of the automata.
        state: Pointer to the state.
        received: Code of received data.
    """

    names: Names
    state: str
    received: Callable[[Path], Code] = read_nothing
    root: Type | None = None
    elements: tuple[tuple[object, Type], ...] = ()

    @property
    def model(self) -> Model:
        """No model: reading it raises an error."""
        read_nothing("a model")

    def variable_place(self, component: str, variable: str) -> Code:
        """The place of a variable."""
        member, type_ = self.names.variables[component, variable]
        return self._member(member).typed(type_)

    def location_place(self, automaton: str) -> Code:
        """The place of an automaton's location."""
        return self._member(self.names.locations[automaton])

    def _member(self, name: str) -> Code:
        return Code(Kind.PLACE, f"{self.state}->{name}", (variable(self.state),), Sort.ENUM)

    def location_code(self, automaton: str, location: str) -> Code:
        """The code of a location."""
        return literal(self.names.enumerators[f"at {automaton}", location], Sort.ENUM)

    def state_code(self, automaton: str, state: str, is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in a location, or is not."""
        if automaton not in self.names.locations:
            return TRUE_CODE if is_in else FALSE_CODE
        return super().state_code(automaton, state, is_in)

    def _enum_code(self, enum: str, value: str) -> Code:
        return literal(self.names.enumerators[f"value {enum}", value], Sort.ENUM)

    def _stays_in_range(self, code: Code, low: int, high: int) -> Code:
        return operation("between", number_code(low), code, number_code(high))

    def _element_code(self, level: int, path: Path) -> Code:
        read_nothing(level, path)

    def _reduction_code(self, expression: Reduction) -> Code:
        read_nothing(expression)

    def _quantifier_code(self, expression: Quantifier) -> Code:
        read_nothing(expression)


class _Diagrams(CDiagrams):
    """Writes decision diagrams; each function is noted with what it uses."""

    uses: dict[str, set[str]]

    def __init__(self, system: System, scope: CWriter) -> None:
        super().__init__(system, scope, cif_text)
        self.uses = {}

    def _definition(self, name: str, head: str, body: Block) -> list[str]:
        self.uses[name] = words_of(codes(body))
        return _definition(head, body)


class _Writer(AutomataWriter):
    """Writes what events do in C."""

    def _stored(self, type_: Type, value: Code) -> Code:
        return operation("int32_t", value) if isinstance(type_, IntegerType) else value


def _definition(head: str, body: Block) -> list[str]:
    return [head, "{", *indent(statement_lines(body)), "}"]


def generate(supervised: SupervisedSystem, options: GenerateOptions) -> GeneratedFiles:
    """The files for automata under their supervisor.

    Args:
        supervised: The automata and their supervisor.
        options: Choices of the user: the name of the library, unless it is made from the system's.

    Raises:
        UnsupportedModelError: They leave open what happens, or compute what no code computes.
    """
    if options.package is not None:
        require_package_name(options.package)
    with shallow(supervised.system.name, "code"):
        automata = ControlledAutomata(supervised)
        files = _files(automata, Names(automata, prefix_for(options.package or supervised.system.name)))
    if any(map(is_nested_too_deeply, files.values())):
        raise UnsupportedModelError(f"{supervised.system.name} has an expression that is nested too deeply for C")
    return GeneratedFiles(files)


def _files(automata: ControlledAutomata, names: Names) -> dict[str, str]:
    before, after = _Reading(names, "s"), _Reading(names, "next")
    diagrams = _Diagrams(automata.system, before)
    writer = _Writer(automata, before, after, diagrams)
    used: set[str] = set()

    def function(head: str, body: Block) -> str:
        used.update(words_of(codes(body)))
        return "\n".join(_definition(head, body))

    steps: dict[str, str] = {}
    functions: list[str] = []
    for event in automata.events:
        steps[event.name] = names.function(f"step_{event.name}")
        head = f"static bool {steps[event.name]}(const state_t *s, state_t *next)"
        functions.append(function(head, [*unused("s", "next"), *writer.step(event)]))
    inputs = []
    for name in automata.inputs:
        member, type_ = names.variables[name, automata.input_variable(name)]
        setter = names.function(f"input_{name}")
        raw = place("value", IntegerType() if isinstance(type_, IntegerType) else type_)
        taken = _Reading(names, "s", always(raw))
        body = _Writer(automata, taken, after, diagrams).step(Event(name, False))
        c_type = next(item.type for item in names.members if item.name == member)
        head = f"static bool {setter}(const state_t *s, {c_type} value, state_t *next)"
        functions.append(function(head, [*unused("s"), *body]))
        inputs.append((next(item for item in names.members if item.name == member), setter))
    functions.append(function("static bool may_begin(const state_t *s)", [*unused("s"), *writer.may_begin()]))
    functions.append(function("static bool is_marked(const state_t *s)", [*unused("s"), *writer.is_marked()]))
    begin = writer.begin(lambda type_, value: _constant(names, type_, value))
    needed = called(used, diagrams.uses)
    values = {
        "version": __version__,
        "name": automata.system.name,
        "prefix": names.prefix,
        "upper": names.prefix.upper(),
        "events": [
            (names.events[item.name], item.name, item.is_controllable, steps[item.name]) for item in automata.events
        ],
        "enumerations": list(names.enumerations.values()),
        "members": names.members,
        "inputs": inputs,
        "helpers": [text for name, text in HELPERS.items() if name in needed],
        "nodes": ["\n".join(lines) for name, lines in diagrams.nodes.items() if name in needed],
        "functions": functions,
        "begin": statement_lines(begin),
    }
    templates = environment("robosc.targets.c99", filters={"c_text": string_literal, "c_safe": safe})
    files = {f"{names.prefix}.h": "automata.h", f"{names.prefix}.c": "automata.c"}
    files |= {name: f"automata_{name}" for name in ("main.c", "CMakeLists.txt", "README.md")}
    return {file: templates.get_template(f"{name}.j2").render(values) for file, name in files.items()}


def _constant(names: Names, type_: Type, value: Value) -> Code:
    match type_:
        case EnumType(name=enum):
            return literal(names.enumerators[f"value {enum}", str(value)], Sort.ENUM)
        case BooleanType():
            return TRUE_CODE if value else FALSE_CODE
        case _:
            return number_code(int(value))
