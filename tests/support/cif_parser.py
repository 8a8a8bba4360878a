"""The CIF subset of `cif.tx` as values of our own: what was written, before names and types are looked at."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from textx import metamodel_from_file
from textx.exceptions import TextXSyntaxError

_RESERVED = frozenset(
    """
    alg alphabet and any attr automaton bool break case const cont continue controllable def dict disables
    disc dist div do edge elif else end enum equation event external false file final for func goto group id
    if import in initial input int invariant list location marked mod monitor namespace needs not now on once
    or outside plant post pre print printfile real requirement return sample self set start startonce string
    sub supervisor svgcopy svgfile svgin svgmove svgout switch tau text time to true tuple type uncontrollable
    urgent value void when while abs acos acosh asin asinh atan atanh cbrt ceil cos cosh del empty exp floor
    fmt ln log max min pop pow round scale sign sin sinh size sqrt tan tanh bernoulli beta binomial constant
    erlang exponential gamma geometric lognormal normal poisson random triangle uniform weibull
    """.split()
)


class CifError(Exception):
    """A text is no CIF, or none that its tools would take."""


@dataclass(frozen=True)
class Apply:
    """An operator, and what it works on; `if` takes condition, result, ..., and the last result."""

    operator: str
    operands: tuple["Node", ...]


@dataclass(frozen=True)
class Name:
    """A name, in parts."""

    parts: tuple[str, ...]


Node = Apply | Name | int | bool


@dataclass(frozen=True)
class Type:
    """`bool`, `int` with bounds, or the name of an enum."""

    name: str
    low: int = 0
    high: int = 0


@dataclass(frozen=True)
class Edge:
    events: tuple[Name, ...]
    guard: Node
    updates: tuple[tuple[str, Node], ...]
    target: str | None


@dataclass(frozen=True)
class Location:
    name: str
    initial: bool
    marked: bool
    edges: tuple[Edge, ...]


@dataclass(frozen=True)
class Automaton:
    kind: str
    name: str
    events: tuple[tuple[str, bool], ...]
    alphabet: tuple[Name, ...] | None
    inputs: tuple[tuple[str, Type], ...]
    variables: tuple[tuple[str, Type, Node], ...]
    locations: tuple[Location, ...]


@dataclass(frozen=True)
class Specification:
    """A file: enums and their literals, algebraic variables, automata, requirements.

    `requirements` holds (event, predicate): the event needs it; the event is None for an invariant.
    """

    enums: tuple[tuple[str, tuple[str, ...]], ...]
    algebraics: tuple[tuple[str, Node], ...]
    automata: tuple[Automaton, ...]
    requirements: tuple[tuple[Name | None, Node], ...]


@cache
def _metamodel() -> Any:
    return metamodel_from_file(Path(__file__).with_name("cif.tx"), autokwd=True)


def parse(text: str) -> Specification:
    """The specification of a text.

    Raises:
        CifError: It does not follow the grammar.
    """
    if not text.isascii() or not text.endswith("\n") or any(char < " " and char != "\n" for char in text):
        raise CifError("a file is ASCII text and ends with its last line")
    metamodel = _metamodel()
    try:
        read = metamodel.model_from_str(text)
    except TextXSyntaxError as error:
        raise CifError(str(error)) from error
    return Specification(
        enums=tuple((_name(item.name), tuple(map(_name, item.literals))) for item in read.enums),
        algebraics=tuple((_name(item.name), _node(item.value)) for item in read.algebraics),
        automata=tuple(map(_automaton, read.automata)),
        requirements=tuple(_requirement(item.body) for item in read.requirements),
    )


def _name(text: str) -> str:
    if text in _RESERVED:
        raise CifError(f"'{text}' is a word of CIF and no name")
    return text.removeprefix("$")


def _reference(text: str) -> Name:
    return Name(tuple(map(_name, text.split("."))))


def _kind(item: Any) -> str:
    return str(type(item).__name__)


def _type(item: Any) -> Type:
    match _kind(item):
        case "BooleanType":
            return Type("bool")
        case "IntegerType":
            return Type("int", int(item.low), int(item.high))
        case _:
            return Type(_name(item.name))


def _automaton(item: Any) -> Automaton:
    if len(item.alphabets) > 1:
        raise CifError(f"{item.name} has two alphabets")
    return Automaton(
        kind=item.kind,
        name=_name(item.name),
        events=tuple((_name(name), part.kind == "controllable") for part in item.events for name in part.names),
        alphabet=tuple(map(_reference, item.alphabets[0].events)) if item.alphabets else None,
        inputs=tuple((_name(part.name), _type(part.type)) for part in item.inputs),
        variables=tuple((_name(part.name), _type(part.type), _node(part.value)) for part in item.variables),
        locations=tuple(map(_location, item.locations)),
    )


def _location(item: Any) -> Location:
    name = _name(item.name) if item.name else ""
    if not item.closed and not (item.initial or item.marked or item.edges):
        raise CifError(f"the colon behind location {name} promises that something follows")
    return Location(name, bool(item.initial), bool(item.marked), tuple(map(_edge, item.edges)))


def _edge(item: Any) -> Edge:
    return Edge(
        events=tuple(map(_reference, item.events)),
        guard=_node(item.guard) if item.guard else True,
        updates=tuple((_name(part.variable), _node(part.value)) for part in item.updates),
        target=_name(item.target) if item.target else None,
    )


def _requirement(item: Any) -> tuple[Name | None, Node]:
    predicate = _node(item.predicate)
    match _kind(item):
        case "Invariant":
            return None, predicate
        case "Needs":
            return _reference(item.event), predicate
        case _:
            return _reference(item.event), Apply("not", (predicate,))


def _node(item: Any) -> Node:
    """An expression, with rules that only pass on left out."""
    match _kind(item):
        case "Expression" | "Comparison":
            return Apply(item.operator, (_node(item.first), _node(item.second))) if item.second else _node(item.first)
        case "Disjunction" | "Conjunction":
            word = "or" if _kind(item) == "Disjunction" else "and"
            parts = tuple(map(_node, item.parts))
            return parts[0] if len(parts) == 1 else Apply(word, parts)
        case "Sum" | "Product":
            node = _node(item.first)
            for part in item.rest:
                node = Apply(part.operator, (node, _node(part.operand)))
            return node
        case "Negation":
            return Apply("not", (_node(item.operand),))
        case "Minus":
            return Apply("negative", (_node(item.operand),))
        case "Choice":
            parts = tuple(_node(part) for case in item.cases for part in (case.condition, case.result))
            return Apply("if", (*parts, _node(item.otherwise)))
        case "Group":
            return _node(item.inner)
        case "Literal":
            return item.truth == "true" if item.truth else int(item.number)
        case _:
            return Name(_reference(item.reference).parts)
