"""Syntax tree of a CIF text: what was written, with places, before any name is looked up."""

from dataclasses import dataclass
from enum import StrEnum

from robosc.source import Location


class Root(StrEnum):
    """Scope from which a name is looked up."""

    HERE = ""
    """From the scope around it outwards."""
    SCOPE = "."
    """The nearest definition around it, else the specification."""
    SPECIFICATION = "^"


@dataclass(frozen=True, slots=True)
class Name:
    """A reference, such as `x`, `a.x`, `.a.x` or `^a.x`; without `$`.

    Attributes:
        parts: Identifiers.
        root: Scope that the first one is looked up in.
        at: Place.
    """

    parts: tuple[str, ...]
    root: Root
    at: Location

    def __str__(self) -> str:
        return f"{self.root}{'.'.join(self.parts)}"


@dataclass(frozen=True, slots=True)
class Identifier:
    """Name of something that is declared."""

    text: str
    at: Location


# Expressions


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, string or truth value."""

    value: bool | int | float | str
    at: Location


@dataclass(frozen=True, slots=True)
class Unary:
    """`-`, `+`, `not` or `sample` before an operand."""

    operator: str
    operand: "Expression"
    at: Location


@dataclass(frozen=True, slots=True)
class Binary:
    """An operator between two operands; `at` is the place of the operator."""

    operator: str
    left: "Expression"
    right: "Expression"
    at: Location


@dataclass(frozen=True, slots=True)
class If:
    """`if g: a elif h: b else c end`: conditions that all must hold, with the value for each."""

    branches: tuple[tuple[tuple["Expression", ...], "Expression"], ...]
    otherwise: "Expression"
    at: Location


@dataclass(frozen=True, slots=True)
class Switch:
    """`switch v: case a: b else c end`."""

    subject: "Expression"
    cases: tuple[tuple["Expression", "Expression"], ...]
    otherwise: "Expression | None"
    at: Location


@dataclass(frozen=True, slots=True)
class Group:
    """Several values in brackets: a tuple `(a, b)`, list `[a]`, set `{a}`, or dictionary of keys and values in turn."""

    kind: str
    items: tuple["Expression", ...]
    at: Location


@dataclass(frozen=True, slots=True)
class Index:
    """`base[index]`."""

    base: "Expression"
    index: "Expression"
    at: Location


@dataclass(frozen=True, slots=True)
class Slice:
    """`base[low:high]`."""

    base: "Expression"
    low: "Expression | None"
    high: "Expression | None"
    at: Location


@dataclass(frozen=True, slots=True)
class Call:
    """Call of a function: a word of the language, or an expression."""

    function: "str | Expression"
    arguments: tuple["Expression", ...]
    at: Location


@dataclass(frozen=True, slots=True)
class Cast:
    """`<type>operand`."""

    type: "Type"
    operand: "Expression"
    at: Location


@dataclass(frozen=True, slots=True)
class Special:
    """`time`, `?` (a received value), `self`, or the derivative `x'`."""

    word: str
    name: Name | None
    at: Location


type Expression = Literal | Name | Unary | Binary | If | Switch | Group | Index | Slice | Call | Cast | Special


@dataclass(frozen=True, slots=True)
class Type:
    """A written type.

    Attributes:
        kind: Word of the type; `name` for one that is named.
        bounds: Bounds of an integer or a list.
        parts: Types that it is made of.
        fields: Names of a tuple's fields.
        name: The name, where it is named.
        at: Place.
    """

    kind: str
    at: Location
    bounds: tuple[Expression, ...] = ()
    parts: tuple["Type", ...] = ()
    fields: tuple[Identifier, ...] = ()
    name: Name | None = None


# Declarations


@dataclass(frozen=True, slots=True)
class TypeDeclaration:
    """`type name = type;`."""

    name: Identifier
    type: Type


@dataclass(frozen=True, slots=True)
class Enum:
    """`enum name = a, b;`."""

    name: Identifier
    literals: tuple[Identifier, ...]


@dataclass(frozen=True, slots=True)
class Event:
    """`controllable name;`; `is_controllable` is None where that is not said, `data` the type of a channel."""

    name: Identifier
    is_controllable: bool | None
    data: Type | None


@dataclass(frozen=True, slots=True)
class Constant:
    """`const type name = value;`."""

    name: Identifier
    type: Type
    value: Expression


@dataclass(frozen=True, slots=True)
class Algebraic:
    """`alg type name = value;`, whose value may stand elsewhere."""

    name: Identifier
    type: Type
    value: Expression | None


@dataclass(frozen=True, slots=True)
class Input:
    """`input type name;`."""

    name: Identifier
    type: Type


@dataclass(frozen=True, slots=True)
class Discrete:
    """`disc type name = value;`; no values: the default; `is_any`: every value of the type."""

    name: Identifier
    type: Type
    values: tuple[Expression, ...]
    is_any: bool


@dataclass(frozen=True, slots=True)
class Continuous:
    """`cont name;`; its derivative is not kept."""

    name: Identifier
    value: Expression | None


@dataclass(frozen=True, slots=True)
class Equation:
    """`equation name = value;`, or of the derivative `name'`."""

    name: Identifier
    is_derivative: bool
    value: Expression


@dataclass(frozen=True, slots=True)
class Predicates:
    """`initial p, q;` or `marked p, q;`; without predicates it always holds."""

    word: str
    predicates: tuple[Expression, ...]
    at: Location


class InvariantForm(StrEnum):
    """Form of an invariant."""

    STATE = "state"
    NEEDS = "needs"
    DISABLES = "disables"


@dataclass(frozen=True, slots=True)
class Invariant:
    """One invariant.

    Attributes:
        role: `plant`, `requirement`, `supervisor` or None.
        name: Its name, if it has one.
        form: Its form.
        events: Events that it speaks of.
        predicate: Its predicate.
        at: Place.
    """

    role: str | None
    name: Identifier | None
    form: InvariantForm
    events: tuple[Name, ...]
    predicate: Expression
    at: Location


@dataclass(frozen=True, slots=True)
class Function:
    """A function that a user has defined; its body is read and left aside."""

    name: Identifier
    results: tuple[Type, ...]
    parameters: tuple[tuple[Identifier, Type], ...]


@dataclass(frozen=True, slots=True)
class InputOutput:
    """A declaration about pictures or printing; it means nothing here."""

    word: str
    at: Location


@dataclass(frozen=True, slots=True)
class Import:
    """`import "file";`."""

    file: str
    at: Location


@dataclass(frozen=True, slots=True)
class Namespace:
    """`namespace a.b;`."""

    name: Name


@dataclass(frozen=True, slots=True)
class Alphabet:
    """`alphabet a, b;` or `monitor a, b;`."""

    word: str
    events: tuple[Name, ...]
    at: Location


class ParameterKind(StrEnum):
    """Kind of a parameter."""

    EVENT = "event"
    LOCATION = "location"
    ALGEBRAIC = "alg"
    COMPONENT = "component"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a definition.

    Attributes:
        kind: Its kind.
        name: Its name.
        type: Type of an algebraic parameter, or of the data of a channel.
        is_controllable: Controllability that an event must have; None for any.
        flags: `!`, `?` and `~`: uses of a channel that are allowed; empty: all.
        definition: Definition that a component must be an instance of.
    """

    kind: ParameterKind
    name: Identifier
    type: Type | None = None
    is_controllable: bool | None = None
    flags: str = ""
    definition: Name | None = None


@dataclass(frozen=True, slots=True)
class EdgeEvent:
    """An event on an edge; `name` is None for `tau`, `use` is `!` or `?` for a channel."""

    name: Name | None
    use: str
    value: Expression | None
    at: Location


@dataclass(frozen=True, slots=True)
class Assignment:
    """`address := value`; an address is a name, an index of one, or a tuple of addresses."""

    address: Expression
    value: Expression
    at: Location


@dataclass(frozen=True, slots=True)
class IfUpdate:
    """`if g: updates elif h: updates else updates end`."""

    branches: tuple[tuple[tuple[Expression, ...], tuple["Update", ...]], ...]
    otherwise: tuple["Update", ...]
    at: Location


type Update = Assignment | IfUpdate


@dataclass(frozen=True, slots=True)
class Edge:
    """An edge; no events: `tau`, no target: a self-loop."""

    events: tuple[EdgeEvent, ...]
    guards: tuple[Expression, ...]
    updates: tuple[Update, ...]
    target: Identifier | None
    at: Location


@dataclass(frozen=True, slots=True)
class LocationDeclaration:
    """A location of an automaton."""

    name: Identifier | None
    predicates: tuple[Predicates, ...]
    equations: tuple[Equation, ...]
    invariants: tuple[Invariant, ...]
    edges: tuple[Edge, ...]
    at: Location


@dataclass(frozen=True, slots=True)
class Component:
    """A group or automaton, or the definition of one.

    Attributes:
        name: Its name.
        is_automaton: False for a group.
        role: Role of an automaton, None where none is said.
        parameters: Parameters of a definition, None for a component.
        body: Its declarations, components and locations.
    """

    name: Identifier
    is_automaton: bool
    role: str | None
    parameters: tuple[Parameter, ...] | None
    body: tuple["Declaration", ...]


@dataclass(frozen=True, slots=True)
class Instance:
    """`name: Definition(arguments);`."""

    name: Identifier
    definition: Name
    arguments: tuple[Expression, ...]


type Declaration = (
    TypeDeclaration
    | Enum
    | Event
    | Constant
    | Algebraic
    | Input
    | Discrete
    | Continuous
    | Equation
    | Predicates
    | Invariant
    | Function
    | InputOutput
    | Import
    | Namespace
    | Alphabet
    | LocationDeclaration
    | Component
    | Instance
)


@dataclass(frozen=True, slots=True)
class Specification:
    """Text of one file."""

    file: str
    body: tuple[Declaration, ...]
