"""Candidates that can be written at a place of a text, also of one that is broken elsewhere."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from robosc.editing.definitions import DefinitionKind
from robosc.editing.place import Place, name_of, place_at
from robosc.expressions import ArrayType, EnumType, ObjectType, Type, type_text
from robosc.language import parse
from robosc.language.negation import NOT
from robosc.language.tokens import tokenize
from robosc.language.words import RESERVED_WORDS, spelled
from robosc.model.check import Inspected
from robosc.model.message_fields import model_type
from robosc.model.scope import ComponentNames, Scope
from robosc.model.structure import EVENT_KINDS, Communication, CommunicationKind, EventKind
from robosc.source import SourceFile

_TYPES = ("boolean", "integer", "double", "string", "none", "array")
_FUNCTIONS = ("abs", "all", "any", "clamp", "double", "integer", "length", "max", "min")
_OPERATORS = ("and", "or")
_COMPARISONS = ("=", "!=")
_AHEAD = 1000
"""Characters behind the cursor in which the other side of a comparison is looked for."""

_BEGUN = re.compile(r"\A\w+")
_KEYS = frozenset("identifier type request response feedback qos depth max_age stamped when".split())
_KINDS = {
    CommunicationKind.INCOMING_MESSAGE: DefinitionKind.INCOMING,
    CommunicationKind.OUTGOING_MESSAGE: DefinitionKind.OUTGOING,
    CommunicationKind.SERVICE: DefinitionKind.SERVICE,
    CommunicationKind.ACTION: DefinitionKind.ACTION,
}


type _Elements = Sequence[tuple[str, Sequence[str]]]
"""Names of elements, the innermost first, with the tokens that name the array."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A proposal for the text at the cursor.

    Attributes:
        text: Text to write.
        kind: Kind of the thing; None: a word of the language.
        detail: Its type or the like; may be empty.
        is_wanted: True if it has the very type that is needed there.
    """

    text: str
    kind: DefinitionKind | None = None
    detail: str = ""
    is_wanted: bool = False


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Surroundings of a text.

    Attributes:
        libraries: The components of each library that can be imported from, by its name.
        interfaces: The types of each ROS package, by its name.
    """

    libraries: Mapping[str, Sequence[str]] = field(default_factory=dict)
    interfaces: Mapping[str, Sequence[str]] = field(default_factory=dict)


def complete(
    text: str,
    offset: int,
    inspected: Inspected,
    surroundings: Callable[[], Surroundings] = Surroundings,
) -> tuple[int, tuple[Candidate, ...]]:
    """Return what can be written at a place, in the order of the kinds of things.

    Args:
        text: The text of the main file.
        offset: Offset of the cursor.
        inspected: Knowledge of the text, or of an earlier state of it.
        surroundings: Function that returns what there is around it; called only where that matters, since it may have
            to look.

    Returns:
        The offset where the word begins that is being typed, and the candidates for it.
    """
    place = place_at(text, offset)
    if place is None:
        return offset, ()
    expected = parse(SourceFile("", text[: place.begin])).expected if place.begin else ("'robot'", "'library'")
    if not text[: place.begin].strip():
        expected = ("'robot'", "'library'")
    if place.item in (("requirement", "always"), ("requirement", "never")):
        # They may be names of communications, too, and were taken for such.
        expected = (*expected, "an expression")
    behind = _BEGUN.sub("", text[offset : offset + _AHEAD], count=1)
    names = list(_Names(place, behind, inspected, surroundings).candidates(expected))
    if place.last() == NOT and "an expression" in expected and all(item.text != NOT for item in names):
        # The word can only be the operator where nothing has this name.
        expected = ("an expression",)
    found = [*names, *_words(place, expected)]
    chosen: dict[str, Candidate] = {}
    for item in found:
        chosen.setdefault(item.text, item)
    return place.begin, tuple(chosen.values())


def _words(place: Place, expected: Iterable[str]) -> Iterator[Candidate]:
    """The words of the language that fit."""
    words: list[str] = []
    for item in expected:
        if item == "an operator":
            words += _OPERATORS
        elif item == "a type":
            words += _TYPES
        elif item == "an expression":
            words += ("true", "false", "if", NOT)
        elif item.startswith("'") and item[1:-1].isidentifier():
            words.append(item[1:-1])
    if place.last() == "requirement":
        words += ("always", "never")
    if "an expression" in expected:
        words += _FUNCTIONS
    for word in words:
        is_key = word in _KEYS and place.item[:1] != ("on",) and "with" in place.item
        yield Candidate(f"{word}:" if is_key else word)


class _Names:
    """The names that fit at a place."""

    def __init__(
        self, place: Place, behind: str, inspected: Inspected, surroundings: Callable[[], Surroundings]
    ) -> None:
        self._place = place
        self._behind = behind
        self._inspected = inspected
        self._surroundings = surroundings
        part = next((part for part in inspected.parts if part.name == place.component), None)
        self._scope: Scope | None = None
        if inspected.scopes is not None and inspected.units:
            scopes = inspected.scopes
            self._scope = scopes.of(inspected.units[0]) if part is None else scopes.inside(part)

    def candidates(self, expected: Sequence[str]) -> Iterator[Candidate]:
        """They, the likeliest first."""
        place = self._place
        if not {"a name", "an expression", "a type"} & set(expected):
            return
        last = place.last()
        if last == ".":
            yield from self._members()
        elif last == "goto":
            yield from self._states(self._own)
        elif last in ("from", "to") and place.last(3) == "on":
            yield from self._communications(EventKind(place.last(2)) if place.last(2) in EventKind else None)
        elif last == "links":
            yield from (Candidate(spelled(name), DefinitionKind.INTERFACE) for name in self._unit("interfaces"))
        elif place.item[:1] == ("component",) and last in ("component", "from", "import"):
            yield from self._imported(last)
        elif place.item[:1] == ("interface",) and last in ("use", "from"):
            yield from self._interfaces(last)
        elif "a type" in expected:
            yield from self._types()
        elif place.open[-1:] and place.open[-1][:2] == ("datatype", "object"):
            yield from self._fields(name_of(place.open[-1][-1]))
        elif self._is_communication_wanted():
            yield from self._restrictable()
            if last == "requirement":
                yield from self._values(None)
        elif self._is_property_wanted():
            yield from self._properties(self._provided(), _written_properties(self._place.before))
        elif self._is_target_wanted():
            yield from self._variables(self._own)
        elif last == "in" or "an expression" in expected or "'true'" in expected:
            yield from self._values(self._required_type())

    # The place of the cursor

    def _is_communication_wanted(self) -> bool:
        item = self._place.item
        # Behind `requirement {` the item of the brace is the requirement itself.
        opened = self._place.open[-1] if self._place.open else ()
        return any(
            words in (("requirement",), ("provide",), ("limit",), ("prefer",))
            or words[-1:] == ("disables",)
            # Behind the braces of its first side, an item begins anew with `over`.
            or (words[:1] in (("prefer",), ("over",)) and words[-1:] == ("over",))
            for words in (item, opened)
        )

    def _is_property_wanted(self) -> bool:
        item = self._place.item
        # A comma between brackets parts arguments.
        is_whole = item.count("(") == item.count(")") and item.count("[") == item.count("]")
        return self._is_in_value() and is_whole and self._place.last() in ("{", ",")

    def _is_in_value(self) -> bool:
        return any(item[:1] in (("provide",), ("limit",)) for item in self._place.open)

    def _is_target_wanted(self) -> bool:
        item = self._place.item
        if item[:1] != ("on",) or "do" not in item:
            return False
        updates = item[item.index("do") + 1 :]
        return self._place.last() in ("do", ",") and updates.count("(") == updates.count(")")

    # The names that exist

    @property
    def _own(self) -> ComponentNames | None:
        return self._scope.own if self._scope is not None else None

    def _unit(self, what: str) -> Iterable[str]:
        return getattr(self._inspected.units[0], what) if self._inspected.units else ()

    def _states(self, component: ComponentNames | None) -> Iterator[Candidate]:
        if component is not None:
            for name in sorted(component.states):
                yield Candidate(spelled(name), DefinitionKind.STATE, f"state of {component.name}")

    def _variables(self, component: ComponentNames | None) -> Iterator[Candidate]:
        if component is not None:
            for name, type_ in component.variables.items():
                yield Candidate(spelled(name), DefinitionKind.VARIABLE, _type_words(type_))

    def _communications(self, kind: EventKind | None) -> Iterator[Candidate]:
        for item in self._inspected.communications.values():
            if kind is None or kind in EVENT_KINDS[item.kind]:
                yield _communication(item)

    def _restrictable(self) -> Iterator[Candidate]:
        for item in self._inspected.communications.values():
            if item.kind is not CommunicationKind.OUTGOING_MESSAGE:
                yield _communication(item)

    def _types(self) -> Iterator[Candidate]:
        for unit in self._inspected.units[:1]:
            for name, tree in unit.types.items():
                is_object = type(tree).__name__ == "ObjectDefinition"
                yield Candidate(spelled(name), DefinitionKind.OBJECT if is_object else DefinitionKind.ENUM)

    def _fields(self, name: str) -> Iterator[Candidate]:
        """Yield the fields of messages that further properties of an object type can stand for."""
        if not self._inspected.units:
            return
        fields = self._inspected.fields.get(self._inspected.units[0].type_name(name), {})
        written = _written_properties(self._place.before)
        for item in fields.values():
            if item.name not in written:
                type_ = model_type(item)
                text = f"{spelled(item.name)}: {type_}" if type_ else f"{spelled(item.name)}:"
                yield Candidate(text, DefinitionKind.PROPERTY, item.type_text)

    def _imported(self, last: str) -> Iterator[Candidate]:
        libraries = self._surroundings().libraries
        if last == "from":
            yield from (Candidate(spelled(name), DefinitionKind.LIBRARY) for name in sorted(libraries))
            return
        # A component that is imported has the name that it has there, more often than not.
        chosen = libraries if last == "component" else (name_of(self._place.last(2)),)
        for library in chosen:
            for name in libraries.get(library, ()):
                yield Candidate(spelled(name), DefinitionKind.COMPONENT, f"component of {library}")

    def _interfaces(self, last: str) -> Iterator[Candidate]:
        packages = self._surroundings().interfaces
        if last == "from":
            having = [name for name, types in packages.items() if name_of(self._place.last(2)) in types]
            for name in sorted(having or packages):
                yield Candidate(spelled(name), DefinitionKind.LIBRARY, "ROS package")
        else:
            homes: dict[str, list[str]] = {}
            for package, types in packages.items():
                for name in types:
                    homes.setdefault(name, []).append(package)
            for name in sorted(homes):
                yield Candidate(spelled(name), DefinitionKind.INTERFACE, ", ".join(sorted(homes[name])))

    def _values(self, wanted: Type | None) -> Iterator[Candidate]:
        """Yield the candidates that an expression can begin with."""
        scope = self._scope
        if scope is None:
            return
        if isinstance(wanted, EnumType):
            for name in wanted.values:
                yield Candidate(spelled(name), DefinitionKind.ENUM_VALUE, wanted.name, is_wanted=True)
        elements = _elements(self._place.before)
        for number, (name, array) in enumerate(elements, 1):
            yield Candidate(
                spelled(name), DefinitionKind.ELEMENT, _type_words(self._element_of(array, elements[number:]))
            )
        if self._received() is not None:
            yield Candidate("value", None, _type_words(self._received()))
        yield from self._variables(scope.own)
        for name in scope.components:
            yield Candidate(spelled(name), DefinitionKind.COMPONENT)
        for name, typed in scope.constants.items():
            yield Candidate(spelled(name), DefinitionKind.CONSTANT, _type_words(typed.type if typed else None))
        for name in scope.enums:
            yield Candidate(spelled(name), DefinitionKind.ENUM)
        for enum in dict.fromkeys(scope.enums.values()):
            for name in enum.values:
                yield Candidate(spelled(name), DefinitionKind.ENUM_VALUE, enum.name)

    def _members(self) -> Iterator[Candidate]:
        """Yield the candidates that can stand behind a point."""
        chain = _chain(self._place.before[:-1])
        scope = self._scope
        if not chain or scope is None:
            return
        if any(name == chain[0] for name, _ in _elements(self._place.before)):
            yield from self._properties(self._type_of(chain))
        elif len(chain) == 1 and chain[0] in scope.components:
            yield from self._states(scope.components[chain[0]])
            yield from self._variables(scope.components[chain[0]])
        elif len(chain) == 1 and chain[0] in scope.enums:
            for name in scope.enums[chain[0]].values:
                yield Candidate(spelled(name), DefinitionKind.ENUM_VALUE, scope.enums[chain[0]].name)
        else:
            yield from self._properties(self._type_of(chain))

    def _properties(self, type_: Type | None, written: frozenset[str] = frozenset()) -> Iterator[Candidate]:
        if self._scope is None or not isinstance(type_, ObjectType):
            return
        for name in self._scope.types.property_names(type_):
            if name in written:
                continue
            shown = _type_words(self._scope.types.property_type(type_, name))
            is_key = self._is_property_wanted()
            yield Candidate(f"{spelled(name)}:" if is_key else spelled(name), DefinitionKind.PROPERTY, shown)

    # Types

    def _type_of(self, chain: Sequence[str], elements: _Elements | None = None) -> Type | None:
        """The type of an access; `[` stands for an index.

        Args:
            chain: The access.
            elements: The elements that can be named; None: those at the place.
        """
        scope = self._scope
        if scope is None or not chain:
            return None
        first, *rest = chain
        if first == "value":
            return self._below(self._received(), rest)
        elements = _elements(self._place.before) if elements is None else elements
        for number, (name, array) in enumerate(elements, 1):
            if name == first:
                return self._below(self._element_of(array, elements[number:]), rest)
        if rest and first in scope.components:
            return self._below(scope.components[first].variables.get(rest[0]), rest[1:])
        if scope.own is not None and first in scope.own.variables:
            return self._below(scope.own.variables[first], rest)
        constant = scope.constants.get(first)
        return None if constant is None else self._below(constant.type, rest)

    def _element_of(self, array: Sequence[str], elements: _Elements) -> Type | None:
        """The type of the elements of an array, or of a slice of one, that some tokens name among outer elements."""
        type_ = self._type_of(_chain(array), elements)
        # A slice looks like an element.
        if ".." in array:
            return type_
        return type_.element if isinstance(type_, ArrayType) else None

    def _below(self, type_: Type | None, steps: Iterable[str]) -> Type | None:
        for step in steps:
            if type_ is None or self._scope is None:
                return None
            if step == "[":
                type_ = type_.element if isinstance(type_, ArrayType) else None
            else:
                type_ = self._scope.types.property_type(type_, step)
        return type_

    def _received(self) -> Type | None:
        """The type of `value` here."""
        place = self._place
        for item in reversed(place.open):
            if item[:2] == ("datatype", "enum") and len(item) > 2 and self._scope is not None:
                return self._scope.types.sources.get(self._inspected.units[0].type_name(name_of(item[2])))
        item = place.item
        if len(item) > 3 and item[0] == "on" and item[1] in EventKind:
            communication = self._inspected.communications.get(name_of(item[3]))
            if communication is not None and item[1] in EVENT_KINDS[communication.kind]:
                return communication.received_type(EventKind(item[1]))
        if "when" in item and item[:1] in (("incoming",), ("service",), ("action",)) and len(item) > 2:
            communication = self._inspected.communications.get(name_of(item[2 if item[1:2] == ("message",) else 1]))
            if communication is not None:
                return communication.request
            # The declaration is incomplete while it is being typed.
            key = "type" if item[0] == "incoming" else "request"
            return self._named(name_of(item[item.index(key) + 2])) if key in item[:-2] else None
        return None

    def _named(self, name: str) -> Type | None:
        """The object or enum of a name."""
        if self._scope is None:
            return None
        key = self._inspected.units[0].type_name(name)
        return ObjectType(key) if key in self._scope.types.objects else self._scope.enums.get(name)

    def _required_type(self) -> Type | None:
        """The type that is needed here, if the words before the cursor determine it."""
        before = _up_to_expression(self._place.before)
        item = self._place.item[: len(self._place.item) - (len(self._place.before) - len(before))]
        last = before[-1] if before else ""
        found = None
        if last in _COMPARISONS:
            is_given = item[:1] in (("variable",), ("constant",)) and item.count("=") == 1
            found = self._declared(item) if is_given else self._type_of(_chain(before[:-1]))
        elif last == ":=":
            found = self._type_of(_chain(before[:-1]))
        elif last == ":" and self._is_in_value() and item.count("(") == item.count(")"):
            found = self._below(self._provided(), [name_of(before[-2])])
        elif last == "with" and item[:1] == ("provide",):
            found = self._request(item)
        return found if found is not None else self._type_of(_compared_with(self._behind))

    def _declared(self, item: Sequence[str]) -> Type | None:
        """The type of a variable or constant that has no value yet, from the words of its declaration."""
        name = name_of(item[3]) if len(item) > 3 and item[2] == ":" else ""
        return None if self._scope is None else self._scope.enums.get(name)

    def _provided(self) -> Type | None:
        """The type of the object value that is open."""
        opened = self._place.open
        start = next(index for index, item in enumerate(opened) if item[:1] in (("provide",), ("limit",)))
        type_ = self._request(opened[start])
        # Each further brace stands behind `property:`.
        return self._below(type_, [name_of(item[-2]) for item in opened[start + 1 :] if len(item) > 1])

    def _request(self, item: Sequence[str]) -> Type | None:
        communication = self._inspected.communications.get(name_of(item[1])) if len(item) > 1 else None
        type_ = None if communication is None else communication.request
        if isinstance(type_, EnumType) and self._scope is not None:
            # A sent value is of the type that the enum is made from.
            return self._scope.types.sources.get(type_.name)
        return type_


def _written_properties(tokens: Sequence[str]) -> frozenset[str]:
    """The properties that the object value which is open has before this place."""
    found: set[str] = set()
    depth = 0
    for before, token in zip(reversed(tokens[:-1]), reversed(tokens[1:]), strict=True):
        depth += (token == "}") - (token == "{")
        if depth < 0:
            break
        if token == ":" and not depth:
            found.add(name_of(before))
    return frozenset(found)


def _up_to_expression(tokens: Sequence[str]) -> Sequence[str]:
    """The tokens before an expression that as a whole has the value of what comes next, in parentheses or an `if`."""
    end = len(tokens)
    while end:
        word = tokens[end - 1]
        if word == "(" and (end < 2 or tokens[end - 2] not in _FUNCTIONS):
            end -= 1
        elif word in ("then", "else"):
            # Every other `if` behind the one that it belongs to has such a word of its own.
            depth = 0
            while end:
                end -= 1
                depth += (tokens[end] == word) - (tokens[end] == "if")
                if not depth:
                    break
        else:
            break
    return tokens[:end]


def _compared_with(behind: str) -> list[str]:
    """The access that an expression is compared with which ends where some text begins; empty where it is not."""
    tokens = tokenize(behind).texts
    if tokens[0] not in _COMPARISONS:
        return []
    begin = 1
    while tokens[begin] == "(":
        begin += 1
    end = begin
    while tokens[end] and (end == begin or tokens[end] in (".", "[") or tokens[end - 1] == "."):
        end = _closing(tokens, end) + 1
    return _chain(tokens[begin:end])


def _closing(tokens: Sequence[str], index: int) -> int:
    """The end of what begins at a token: behind a `[` its `]`, or itself."""
    depth = 0
    for place in range(index, len(tokens)):
        depth += (tokens[place] == "[") - (tokens[place] == "]")
        if depth <= 0:
            return place
    return len(tokens) - 1


def _chain(tokens: Sequence[str]) -> list[str]:
    """The access that some tokens end with; `[` stands for an index."""
    found: list[str] = []
    index = len(tokens) - 1
    while index >= 0:
        if tokens[index] == "]":
            depth = 0
            while index > 0:
                depth += (tokens[index] == "]") - (tokens[index] == "[")
                if not depth:
                    break
                index -= 1
            found.append("[")
            index -= 1
            continue
        if not name_of(tokens[index]).isidentifier() or (tokens[index] in RESERVED_WORDS and tokens[index] != "value"):
            return []
        found.append(name_of(tokens[index]))
        if index == 0 or tokens[index - 1] != ".":
            break
        index -= 2
    return found[::-1]


def _elements(tokens: Sequence[str]) -> _Elements:
    """Return the names that open `all` and `any` give the elements, innermost first, with what names the array."""
    opened: list[int] = []
    for index, token in enumerate(tokens):
        if token == "(":
            opened.append(index)
        elif token == ")" and opened:
            opened.pop()
    found: list[tuple[str, Sequence[str]]] = []
    for index in reversed(opened):
        if index and tokens[index - 1] in ("all", "any") and tokens[index + 2 : index + 3] == ("in",):
            array = tokens[index + 3 :]
            # They have no name in what names the array.
            if ":" in array:
                found.append((name_of(tokens[index + 1]), array[: array.index(":")]))
    return found


def _communication(item: Communication) -> Candidate:
    return Candidate(spelled(item.name), _KINDS[item.kind], f"{item.kind} of {item.component}")


def _type_words(type_: Type | None) -> str:
    return "" if type_ is None else type_text(type_)
