"""The syntax tree of RoboSC: the text as it was written, with places, before any name is bound.

Frozen values with tuples inside. A large text has hundreds of thousands of them, so msgspec makes them, and the
garbage collector does not look at them: trees have no cycles.
"""

from enum import StrEnum
from typing import Literal as Word

import msgspec

from robosc.source import Location


class Name(msgspec.Struct, frozen=True, gc=False):
    """A name where it is defined or used; a leading `^` is taken off."""

    text: str
    location: Location


# Expressions


class Literal(msgspec.Struct, frozen=True, gc=False):
    """A number, text, true or false. An integer beyond 32 bits keeps its value."""

    value: bool | int | float | str
    location: Location


class Index(msgspec.Struct, frozen=True, gc=False):
    """`[i]` of an access; what stands in the brackets must be constant."""

    value: "Expression"
    location: Location


class Slice(msgspec.Struct, frozen=True, gc=False):
    """`[i..j]` of an access: both ends belong to it, and with i > j it goes on at the array's beginning."""

    low: "Expression"
    high: "Expression"
    location: Location


class Access(msgspec.Struct, frozen=True, gc=False):
    """`value` or a name, followed by properties, states, variables and indices.

    Attributes:
        root: The first name; None stands for the word `value`.
        steps: Steps that follow.
        location: The whole of it.
    """

    root: Name | None
    steps: tuple[Name | Index | Slice, ...]
    location: Location


class Unary(msgspec.Struct, frozen=True, gc=False):
    """`!` or `-` before an operand."""

    operator: str
    operand: "Expression"
    location: Location


class Binary(msgspec.Struct, frozen=True, gc=False):
    """An operator between operands; `location` is the operator's."""

    operator: str
    left: "Expression"
    right: "Expression"
    location: Location


class Conditional(msgspec.Struct, frozen=True, gc=False):
    """`if condition then one else other`; `location` is the word `if`."""

    condition: "Expression"
    then: "Expression"
    otherwise: "Expression"
    location: Location


class Call(msgspec.Struct, frozen=True, gc=False):
    """`function(arguments)`; which functions there are is not the grammar's business."""

    function: Name
    arguments: tuple["Expression", ...]

    @property
    def location(self) -> Location:
        """Place where the function is named."""
        return self.function.location


class Quantifier(msgspec.Struct, frozen=True, gc=False):
    """`any(x in array: condition)` or `all(...)`."""

    word: Name
    variable: Name
    array: Access
    condition: "Expression"

    @property
    def location(self) -> Location:
        """Place of the word."""
        return self.word.location


Expression = Literal | Access | Unary | Binary | Conditional | Call | Quantifier


# Types


class BasicTypeName(StrEnum):
    """Types that have no definition."""

    STRING = "string"
    BOOLEAN = "boolean"
    DOUBLE = "double"
    NONE = "none"
    INTEGER = "integer"


class BasicType(msgspec.Struct, frozen=True, gc=False):
    """A basic type, an integer perhaps with bounds."""

    name: BasicTypeName
    low: int | None
    high: int | None
    location: Location


class ArrayType(msgspec.Struct, frozen=True, gc=False):
    """`array(T)`."""

    element: "Type"
    location: Location


class NamedType(msgspec.Struct, frozen=True, gc=False):
    """A use of a data type."""

    name: Name

    @property
    def location(self) -> Location:
        """Place where it is used."""
        return self.name.location


Type = BasicType | ArrayType | NamedType


class Property(msgspec.Struct, frozen=True, gc=False):
    """A property of an object type."""

    name: Name
    type: Type


class ObjectDefinition(msgspec.Struct, frozen=True, gc=False):
    """`datatype object`."""

    name: Name
    properties: tuple[Property, ...]


class EnumRule(msgspec.Struct, frozen=True, gc=False):
    """`condition -> value`; without a condition, the default."""

    condition: Expression | None
    value: Name


class EnumDefinition(msgspec.Struct, frozen=True, gc=False):
    """`datatype enum`."""

    name: Name
    source: Type
    rules: tuple[EnumRule, ...]


class Interface(msgspec.Struct, frozen=True, gc=False):
    """`interface name use type from package`."""

    name: Name
    type: Name
    package: Name


# Components


class Direction(StrEnum):
    """Direction of a message as the component sees it."""

    INCOMING = "incoming"
    OUTGOING = "outgoing"


class Text(msgspec.Struct, frozen=True, gc=False):
    """A string where it is written."""

    value: str
    location: Location


OptionKey = Word["qos", "depth", "max_age", "stamped", "when"]


class Option(msgspec.Struct, frozen=True, gc=False):
    """`key: value` of a `with` list, other than name and types.

    Attributes:
        key: Key of the option; `location` is the key's.
        value: A Name for `qos`, a Text for `stamped`, a number for `depth` and `max_age`, a condition or the
            Name `default` for `when`.
    """

    key: OptionKey
    value: Name | Text | Expression
    location: Location


class Message(msgspec.Struct, frozen=True, gc=False):
    """A message."""

    direction: Direction
    name: Name
    identifier: Text | None
    type: Type
    link: Name | None
    options: tuple[Option, ...] = ()


class Service(msgspec.Struct, frozen=True, gc=False):
    """A service."""

    name: Name
    identifier: Text | None
    request: Type
    response: Type
    link: Name | None
    options: tuple[Option, ...] = ()


class Action(msgspec.Struct, frozen=True, gc=False):
    """An action."""

    name: Name
    identifier: Text | None
    request: Type
    response: Type
    feedback: Type
    link: Name | None
    options: tuple[Option, ...] = ()


Communication = Message | Service | Action


class Variable(msgspec.Struct, frozen=True, gc=False):
    """A variable with its written initial value, if any."""

    name: Name
    type: Type
    initial: Expression | None


class Update(msgspec.Struct, frozen=True, gc=False):
    """`target := value`."""

    target: Access
    value: Expression


class CommunicationTransition(msgspec.Struct, frozen=True, gc=False):
    """`on kind from|to communication ...`."""

    kind: str
    preposition: Name
    communication: Name
    updates: tuple[Update, ...]
    target: Name | None
    location: Location


class TauTransition(msgspec.Struct, frozen=True, gc=False):
    """`transition ...`."""

    guard: Expression | None
    target: Name | None
    location: Location


Transition = CommunicationTransition | TauTransition


class State(msgspec.Struct, frozen=True, gc=False):
    """A state with the transitions written in it."""

    name: Name
    is_initial: bool
    is_marked: bool
    transitions: tuple[Transition, ...]


class Behaviour(msgspec.Struct, frozen=True, gc=False):
    """A behaviour: its parts in the order of the text."""

    items: tuple[Variable | State | Transition, ...]
    location: Location


class Import(msgspec.Struct, frozen=True, gc=False):
    """`from library import component`."""

    library: Name
    component: Name


class Component(msgspec.Struct, frozen=True, gc=False):
    """A component with its parts, or imported."""

    name: Name
    items: tuple[Communication | Behaviour, ...]
    imported: Import | None


# Requirements and data


class Requirement(msgspec.Struct, frozen=True, gc=False):
    """`R needs E` (`disables` false) or `E disables R`."""

    communications: tuple[Name, ...]
    disables: bool
    expression: Expression
    location: Location


class Invariant(msgspec.Struct, frozen=True, gc=False):
    """`requirement always E`, or `requirement never E` (`is_never`)."""

    is_never: bool
    expression: Expression
    location: Location


class Constant(msgspec.Struct, frozen=True, gc=False):
    """`constant name: type = value`."""

    name: Name
    type: Type
    value: Expression


class ObjectValue(msgspec.Struct, frozen=True, gc=False):
    """`{ property: value, ... }`."""

    properties: tuple[tuple[Name, "ObjectValue | Expression"], ...]
    location: Location


class Provide(msgspec.Struct, frozen=True, gc=False):
    """`provide communication with value if condition`."""

    communication: Name
    value: ObjectValue | Expression
    condition: Expression | None
    location: Location


class Range(msgspec.Struct, frozen=True, gc=False):
    """`low .. high`; `location` is the whole of it."""

    low: Expression
    high: Expression
    location: Location


class ObjectRange(msgspec.Struct, frozen=True, gc=False):
    """`{ property: range, ... }`."""

    properties: tuple[tuple[Name, "ObjectRange | Range"], ...]
    location: Location


class Limit(msgspec.Struct, frozen=True, gc=False):
    """`limit communication to range if condition`."""

    communication: Name
    range: ObjectRange | Range
    condition: Expression | None
    location: Location


GoalForm = Word["always eventually", "leads to", "once"]


class Goal(msgspec.Struct, frozen=True, gc=False):
    """`goal always eventually E`, `goal E leads to E` or `goal once E`.

    Attributes:
        form: Words that tell when the condition is to hold.
        trigger: The expression before `leads to`; None in the other forms.
        condition: The expression behind the words of the form.
        location: Place of the word `goal`.
    """

    form: GoalForm
    trigger: Expression | None
    condition: Expression
    location: Location


class Assumption(msgspec.Struct, frozen=True, gc=False):
    """`assume always eventually E` or `assume E leads to E`, perhaps with `allow` behind `assume`.

    Attributes:
        is_allowed: True with `allow`.
        form: Words that tell when the condition holds; never `once`.
        trigger: The expression before `leads to`; None in the other form.
        condition: The expression behind the words of the form.
        location: Place of the word `assume`.
    """

    is_allowed: bool
    form: GoalForm
    trigger: Expression | None
    condition: Expression
    location: Location


class Visit(msgspec.Struct, frozen=True, gc=False):
    """A condition behind `visit` or `then`; `location` is the whole of it."""

    condition: Expression
    location: Location


class Detour(msgspec.Struct, frozen=True, gc=False):
    """`on E from anywhere visit E then E ...`; `location` is the word `on`."""

    trigger: Expression
    visits: tuple[Visit, ...]
    location: Location


class Mission(msgspec.Struct, frozen=True, gc=False):
    """`mission name while E { visit E then E ... on E from anywhere ... }`.

    Attributes:
        name: Its name.
        condition: The expression behind `while`; None without one.
        visits: Visits in their order.
        detours: Detours in the order of the text.
        location: Place of the word `mission`.
    """

    name: Name
    condition: Expression | None
    visits: tuple[Visit, ...]
    detours: tuple[Detour, ...]
    location: Location


class Preference(msgspec.Struct, frozen=True, gc=False):
    """`prefer R over R`; `location` is the word `prefer`."""

    preferred: tuple[Name, ...]
    others: tuple[Name, ...]
    location: Location


Item = (
    Component
    | ObjectDefinition
    | EnumDefinition
    | Interface
    | Constant
    | Requirement
    | Invariant
    | Provide
    | Limit
    | Goal
    | Assumption
    | Mission
    | Preference
)


class File(msgspec.Struct, frozen=True, gc=False):
    """A robot or a library.

    Attributes:
        is_library: True for a library, False for a robot.
        name: Its name.
        items: Its definitions in the order of the text.
    """

    is_library: bool
    name: Name
    items: tuple[Item, ...]
