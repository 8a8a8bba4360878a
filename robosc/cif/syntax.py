"""Syntax tree of a CIF text: the text as it was written, with places, before any name is looked up.

Values of msgspec, as in `robosc.language.syntax`.
"""

from enum import StrEnum

import msgspec

from robosc.source import Location


class Root(StrEnum):
    """Scope from which a name is looked up."""

    HERE = ""
    """From the scope around it outwards."""
    SCOPE = "."
    """The nearest definition around it, else the specification."""
    SPECIFICATION = "^"


class Name(msgspec.Struct, frozen=True, gc=False):
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


class Identifier(msgspec.Struct, frozen=True, gc=False):
    """Name of something that is declared."""

    text: str
    at: Location


# Expressions


class Literal(msgspec.Struct, frozen=True, gc=False):
    """A number, string or truth value."""

    value: bool | int | float | str
    at: Location


class Unary(msgspec.Struct, frozen=True, gc=False):
    """`-`, `+`, `not` or `sample` before an operand."""

    operator: str
    operand: "Expression"
    at: Location


class Binary(msgspec.Struct, frozen=True, gc=False):
    """An operator between two operands; `at` is the place of the operator."""

    operator: str
    left: "Expression"
    right: "Expression"
    at: Location


class If(msgspec.Struct, frozen=True, gc=False):
    """`if g: a elif h: b else c end`: conditions that all must hold, with the value for each."""

    branches: tuple[tuple[tuple["Expression", ...], "Expression"], ...]
    otherwise: "Expression"
    at: Location


class Switch(msgspec.Struct, frozen=True, gc=False):
    """`switch v: case a: b else c end`."""

    subject: "Expression"
    cases: tuple[tuple["Expression", "Expression"], ...]
    otherwise: "Expression | None"
    at: Location


class Group(msgspec.Struct, frozen=True, gc=False):
    """Several values in brackets: a tuple `(a, b)`, list `[a]`, set `{a}`, or dictionary of keys and values in turn."""

    kind: str
    items: tuple["Expression", ...]
    at: Location


class Index(msgspec.Struct, frozen=True, gc=False):
    """`base[index]`."""

    base: "Expression"
    index: "Expression"
    at: Location


class Slice(msgspec.Struct, frozen=True, gc=False):
    """`base[low:high]`."""

    base: "Expression"
    low: "Expression | None"
    high: "Expression | None"
    at: Location


class Call(msgspec.Struct, frozen=True, gc=False):
    """Call of a function: a word of the language, or an expression."""

    function: "str | Expression"
    arguments: tuple["Expression", ...]
    at: Location


class Cast(msgspec.Struct, frozen=True, gc=False):
    """`<type>operand`."""

    type: "Type"
    operand: "Expression"
    at: Location


class Special(msgspec.Struct, frozen=True, gc=False):
    """`time`, `?` (a received value), `self`, or the derivative `x'`."""

    word: str
    name: Name | None
    at: Location


type Expression = Literal | Name | Unary | Binary | If | Switch | Group | Index | Slice | Call | Cast | Special


class Type(msgspec.Struct, frozen=True, gc=False):
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


class TypeDeclaration(msgspec.Struct, frozen=True, gc=False):
    """`type name = type;`."""

    name: Identifier
    type: Type


class Enum(msgspec.Struct, frozen=True, gc=False):
    """`enum name = a, b;`."""

    name: Identifier
    literals: tuple[Identifier, ...]


class Event(msgspec.Struct, frozen=True, gc=False):
    """`controllable name;`; `is_controllable` is None where that is not said, `data` the type of a channel."""

    name: Identifier
    is_controllable: bool | None
    data: Type | None


class Constant(msgspec.Struct, frozen=True, gc=False):
    """`const type name = value;`."""

    name: Identifier
    type: Type
    value: Expression


class Algebraic(msgspec.Struct, frozen=True, gc=False):
    """`alg type name = value;`, whose value may stand elsewhere."""

    name: Identifier
    type: Type
    value: Expression | None


class Input(msgspec.Struct, frozen=True, gc=False):
    """`input type name;`."""

    name: Identifier
    type: Type


class Discrete(msgspec.Struct, frozen=True, gc=False):
    """`disc type name = value;`; no values: the default; `is_any`: every value of the type."""

    name: Identifier
    type: Type
    values: tuple[Expression, ...]
    is_any: bool


class Continuous(msgspec.Struct, frozen=True, gc=False):
    """`cont name = value der derivative;`."""

    name: Identifier
    value: Expression | None
    derivative: Expression | None


class Equation(msgspec.Struct, frozen=True, gc=False):
    """`equation name = value;`, or of the derivative `name'`."""

    name: Identifier
    is_derivative: bool
    value: Expression


class Predicates(msgspec.Struct, frozen=True, gc=False):
    """`initial p, q;` or `marked p, q;`; without predicates it always holds."""

    word: str
    predicates: tuple[Expression, ...]
    at: Location


class InvariantForm(StrEnum):
    """Form of an invariant."""

    STATE = "state"
    NEEDS = "needs"
    DISABLES = "disables"


class Invariant(msgspec.Struct, frozen=True, gc=False):
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


class Function(msgspec.Struct, frozen=True, gc=False):
    """A function that a user has defined.

    Attributes:
        name: Its name.
        results: Types of what it returns.
        parameters: Its parameters.
        variables: Its variables, with their initial values.
        statements: Its statements; none of one that is defined outside of the specification.
    """

    name: Identifier
    results: tuple[Type, ...]
    parameters: tuple[tuple[Identifier, Type], ...]
    variables: "tuple[tuple[Identifier, Type, Expression | None], ...]"
    statements: "tuple[Statement, ...]"


class Return(msgspec.Struct, frozen=True, gc=False):
    """`return value;` in a function; several values are a tuple."""

    value: Expression
    at: Location


class Leave(msgspec.Struct, frozen=True, gc=False):
    """`break;` or `continue;` in a function."""

    word: str
    at: Location


class Block(msgspec.Struct, frozen=True, gc=False):
    """`if` (`is_choice`) or `while` in a function, with the statements of each branch."""

    is_choice: bool
    branches: "tuple[tuple[tuple[Expression, ...], tuple[Statement, ...]], ...]"
    otherwise: "tuple[Statement, ...]"
    at: Location


class InputOutput(msgspec.Struct, frozen=True, gc=False):
    """A declaration about pictures or printing; it means nothing here."""

    word: str
    at: Location


class Import(msgspec.Struct, frozen=True, gc=False):
    """`import "file";`."""

    file: str
    at: Location


class Namespace(msgspec.Struct, frozen=True, gc=False):
    """`namespace a.b;`."""

    name: Name


class Alphabet(msgspec.Struct, frozen=True, gc=False):
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


class Parameter(msgspec.Struct, frozen=True, gc=False):
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


class EdgeEvent(msgspec.Struct, frozen=True, gc=False):
    """An event on an edge; `name` is None for `tau`, `use` is `!` or `?` for a channel."""

    name: Name | None
    use: str
    value: Expression | None
    at: Location


class Assignment(msgspec.Struct, frozen=True, gc=False):
    """`address := value`; an address is a name, an index of one, or a tuple of addresses."""

    address: Expression
    value: Expression
    at: Location


class IfUpdate(msgspec.Struct, frozen=True, gc=False):
    """`if g: updates elif h: updates else updates end`."""

    branches: tuple[tuple[tuple[Expression, ...], tuple["Update", ...]], ...]
    otherwise: tuple["Update", ...]
    at: Location


type Update = Assignment | IfUpdate
type Statement = Assignment | Return | Leave | Block


class Edge(msgspec.Struct, frozen=True, gc=False):
    """An edge; no events: `tau`, no target: a self-loop."""

    events: tuple[EdgeEvent, ...]
    guards: tuple[Expression, ...]
    updates: tuple[Update, ...]
    target: Identifier | None
    at: Location


class LocationDeclaration(msgspec.Struct, frozen=True, gc=False):
    """A location of an automaton."""

    name: Identifier | None
    predicates: tuple[Predicates, ...]
    equations: tuple[Equation, ...]
    invariants: tuple[Invariant, ...]
    edges: tuple[Edge, ...]
    at: Location


class Component(msgspec.Struct, frozen=True, gc=False):
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


class Instance(msgspec.Struct, frozen=True, gc=False):
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


class Specification(msgspec.Struct, frozen=True, gc=False):
    """Text of one file."""

    file: str
    body: tuple[Declaration, ...]
