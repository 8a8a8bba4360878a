"""Names that a text declares and what becomes of its messages, read from tokens: advice uses them in what it writes.

`robosc.model` knows all of it better, but not in a text with syntax errors.
"""

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import pairwise

import msgspec

from robosc.language.tokens import Kind, Tokens
from robosc.language.words import spelled

_NAME, _END = int(Kind.NAME), int(Kind.END)

_ITEMS = frozenset({"on", "transition", "state", "initial", "marked", "variable", "}", "component", "behaviour", ""})
"""Tokens with which a transition ends."""


class Message(msgspec.Struct):
    """A communication.

    Attributes:
        name: Its name.
        kind: `incoming`, `outgoing`, `service` or `action`.
        component: Its component.
        states: State that each of its events leads to, by the kind of the event.
        variables: Variables that its data is put into as it is, with their types.
    """

    name: str
    kind: str
    component: str
    states: dict[str, str] = msgspec.field(default_factory=dict)
    variables: dict[str, str] = msgspec.field(default_factory=dict)

    @property
    def is_requested(self) -> bool:
        """True if the robot requests it."""
        return self.kind != "outgoing"


class Part(msgspec.Struct):
    """A component.

    Attributes:
        states: Its states, the initial one first.
        marked: Those that are marked.
        variables: Types of its variables by name.
    """

    states: list[str] = msgspec.field(default_factory=list)
    marked: set[str] = msgspec.field(default_factory=set)
    variables: dict[str, str] = msgspec.field(default_factory=dict)


class Place(msgspec.Struct, frozen=True):
    """Place of a token among the components.

    Attributes:
        component: Component that it is in, or empty.
        state: State that it is in, or empty.
    """

    component: str
    state: str


class Vocabulary:
    """Vocabulary of a text.

    Args:
        tokens: All of the text.
    """

    def __init__(self, tokens: Tokens) -> None:
        self._tokens = tokens

    @cached_property
    def _read(self) -> tuple[dict[str, Message], dict[str, Part], list[Place]]:
        """The communications and the components by their names, and the place of each token."""
        texts, kinds, _ = self._tokens
        messages: dict[str, Message] = {}
        parts: dict[str, Part] = {}
        places: list[Place] = []
        opened: list[Place] = []
        transitions: list[tuple[int, Place]] = []
        for index, word in enumerate(texts[: kinds.index(_END)]):
            place = opened[-1] if opened else Place("", "")
            places.append(place)
            name = texts[index + 1] if kinds[index + 1] == _NAME else ""
            if word == "{":
                opened.append(_inside(place, texts[index - 2], texts[index - 1]))
            elif word == "}":
                opened[-1:] = []
            elif word == "component" and name:
                parts.setdefault(name, Part())
            elif word == "state" and name and place.component and texts[index + 2] == "{":
                part = parts.setdefault(place.component, Part())
                is_initial = "initial" in texts[index - 2 : index]
                part.states.insert(0 if is_initial else len(part.states), name)
                part.marked.update([name] if texts[index - 1] == "marked" else [])
            elif word == "variable" and name and place.component and texts[index + 2] == ":":
                parts.setdefault(place.component, Part()).variables[name] = texts[index + 3]
            elif name and (kind := _kind(texts, index)):
                messages.setdefault(name.casefold(), Message(name, kind, place.component))
            elif word == "on" and texts[index + 2] in ("to", "from"):
                transitions.append((index, place))
        for index, place in transitions:
            self._note(index, place, messages, parts)
        return messages, parts, places

    def _note(self, index: int, place: Place, messages: dict[str, Message], parts: dict[str, Part]) -> None:
        """Note what a transition makes of a message."""
        texts, kinds, _ = self._tokens
        event, message = texts[index + 1], messages.get(texts[index + 3].casefold())
        if message is None or not place.component:
            return
        at = index + 4
        while texts[at] not in _ITEMS and kinds[at] != _END:
            if texts[at] == "goto" and kinds[at + 1] == _NAME:
                message.states.setdefault(event, f"{place.component}.{spelled(texts[at + 1])}")
                break
            is_whole = texts[at + 1 : at + 3] == [":=", "value"] and texts[at + 3] not in (".", "[")
            type_ = parts.get(place.component, Part()).variables.get(texts[at])
            if is_whole and type_ is not None:
                message.variables.setdefault(f"{place.component}.{spelled(texts[at])}", type_)
            at += 1

    @property
    def messages(self) -> dict[str, Message]:
        """The communications by their names without regard to case."""
        return self._read[0]

    @property
    def components(self) -> dict[str, Part]:
        """The components by their names."""
        return self._read[1]

    def place(self, index: int) -> Place:
        """Return the place of a token."""
        places = self._read[2]
        return places[index] if index < len(places) else Place("", "")

    @cached_property
    def interfaces(self) -> dict[tuple[str, str], str]:
        """Names of interfaces by package and type."""
        texts, kinds, _ = self._tokens
        return {
            (texts[index + 5], texts[index + 3]): texts[index + 1]
            for index, word in enumerate(texts[: kinds.index(_END)])
            if word == "interface" and texts[index + 2] == "use" and texts[index + 4] == "from"
        }

    def free(self, name: str, taken: Iterable[str]) -> str:
        """Return a name that is not taken, in any case: this one, or this one with a number."""
        names = {each.casefold() for each in taken}
        return next(each for each in _numbered(name) if each.casefold() not in names)

    def free_mission(self) -> str:
        """A name for a mission."""
        texts = self._tokens.texts
        return self.free("rounds", (name for word, name in pairwise(texts) if word == "mission"))

    def moving(self) -> list[Message]:
        """The requests that lead to unmarked states, which a robot that stands still does not make; else one."""
        asked = [item for item in self.messages.values() if item.is_requested]
        moving = [item for item in asked if self._is_under_way(item.states.get("request", ""))]
        leading = [item for item in asked if self.leads_on(item.states.get("request", ""))]
        return moving or leading[:1] or asked[:1]

    def _is_under_way(self, state: str) -> bool:
        component, _, name = state.partition(".")
        return self.leads_on(state) and name.removeprefix("^") not in self.components[component].marked

    def leads_on(self, state: str) -> bool:
        """Return True if a state, `Component.state`, is not the initial one."""
        component, _, name = state.partition(".")
        states = self.components.get(component, Part()).states
        return bool(state) and name.removeprefix("^") != next(iter(states), "")

    def state_with(self, name: str) -> str:
        """A state or boolean variable of this name, with its component; empty if there is not exactly one."""
        found = self._by_name.get(name.removeprefix("^"), ())
        return found[0] if len(found) == 1 else ""

    @cached_property
    def _by_name(self) -> dict[str, list[str]]:
        """The states and boolean variables with their components, by their names."""
        found: dict[str, list[str]] = {}
        for component, part in self.components.items():
            variables = [name for name, type_ in part.variables.items() if type_ == "boolean"]
            for name in (*part.states, *variables):
                found.setdefault(name.removeprefix("^"), []).append(f"{component}.{spelled(name)}")
        return found

    def any_condition(self, apart_from: str) -> str:
        """A condition that another component than one fulfils: a state that is not the initial one; else empty."""
        for component, part in self.components.items():
            if component != apart_from and len(part.states) > 1:
                return f"{component}.{spelled(part.states[1])}"
        return ""


def _numbered(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}_{number}"
        number += 1


def _inside(place: Place, word: str, name: str) -> Place:
    """The place inside of a brace, known by the two tokens before it."""
    if word == "component":
        return Place(name, "")
    return Place(place.component, name) if word == "state" else place


def _kind(texts: list[str], index: int) -> str:
    """The kind of the communication whose name follows a token, or empty."""
    word, before = texts[index], texts[index - 1]
    if word == "message" and before in ("incoming", "outgoing"):
        return before
    return word if word in ("service", "action") and texts[index + 2] == "with" else ""


__all__ = ["Message", "Part", "Place", "Vocabulary"]
