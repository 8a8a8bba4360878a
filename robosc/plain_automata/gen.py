"""Generators of libFAUDES: text files of tokens between tags, one generator or several.

Format: T. Moor and others, libFAUDES user reference, "Generator file format"; each rule was tried with libFAUDES
2.34.5. A name may be in quotes, `%` begins a comment, and a state without a name is a number.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import PurePath
from typing import NoReturn

from robosc.automata import Role, System, SystemPlaces
from robosc.errors import Diagnostic, LanguageError, Severity, UnsupportedModelError
from robosc.model.findings import Findings
from robosc.plain_automata.draft import MAXIMUM_PARTS, Draft, Named, require_plain, system_of
from robosc.source import Location, SourceFile

_TOKEN = re.compile(
    r"(?:\s++|%[^\n]*+)*+(?:"
    r"(?P<tag></?[A-Za-z]\w*+(?:\s++[A-Za-z]\w*+=\"[^\"\n]*+\")*+\s*+/?>)"
    r'|"(?P<quoted>[^"\n]*+)"'
    r"|(?P<option>\+[A-Za-z]*+\+)"
    r"|(?P<bare>[^\s<>\"%]++)"
    r"|(?P<end>\Z)"
    r"|(?P<other>.))"
)
_ATTRIBUTE = re.compile(r'([A-Za-z]\w*+)="([^"\n]*+)"')
_SYMBOL = re.compile(r"[A-Za-z0-9_.:;,|+*/=!?$&@(){}\[\]^~-]+")
_NUMBER = re.compile(r"[0-9]+")
_COUNT = re.compile(r"[0-9]{1,9}")

_FLAGS = frozenset("CcOoFfAa")
_VECTOR = "Vector"


@dataclass(frozen=True, slots=True)
class _Token:
    """A token.

    Attributes:
        kind: `tag`, `name`, `option` or `end`.
        text: The tag as written, the name, or the letters of the option.
        at: Its place.
    """

    kind: str
    text: str
    at: Location

    @property
    def tag(self) -> str:
        """Name of a tag, with a slash before that of a closing one; empty for other tokens."""
        found = re.match(r"<(/?\w+)", self.text) if self.kind == "tag" else None
        return found[1] if found else ""

    @property
    def is_whole(self) -> bool:
        """True for a tag that closes itself."""
        return self.text.endswith("/>")

    @property
    def attributes(self) -> dict[str, str]:
        """The attributes of a tag."""
        return dict(_ATTRIBUTE.findall(self.text))


def _fail(code: str, message: str, at: Location, fix: str) -> NoReturn:
    raise LanguageError([Diagnostic(Severity.ERROR, code, message, at, fix)])


def _tokens(file: SourceFile) -> Iterator[_Token]:
    """Yield the tokens of a file; the last one is an `end`.

    Raises:
        LanguageError: Some text is no token.
    """
    line, line_start, place = 1, 0, 0
    while True:
        match = _TOKEN.match(file.text, place)
        assert match is not None  # noqa: S101  # Some branch takes any text.
        kind = str(match.lastgroup)
        start = match.start(kind)
        line += file.text.count("\n", place, start)
        line_start = file.text.rfind("\n", 0, start) + 1 if "\n" in file.text[place:start] else line_start
        text = match[kind]
        at = Location(file.name, line, start - line_start + 1, max(1, min(len(text), 80)))
        place = match.end()
        if kind == "other":
            _fail(
                "automata-syntax",
                f"{text!r} begins no token",
                at,
                "Write a tag, a name, an option such as +C+, or a %.",
            )
        yield _Token({"quoted": "name", "bare": "name"}.get(kind, kind), text, at)
        if kind == "end":
            return


class _Reader:
    """Reader of one file.

    Args:
        file: The file.
        findings: Collection of what is wrong.
    """

    def __init__(self, file: SourceFile, findings: Findings) -> None:
        self._tokens = _tokens(file)
        self._findings = findings
        self._next = next(self._tokens)
        self._parts = 0
        self._names = set[str]()
        self.drafts: list[Draft] = []
        self.types: list[str] = []
        self.stated: list[dict[str, bool]] = []
        """For each generator the events of which its alphabet says whether they are controllable."""

    def read(self) -> None:
        """Read all generators."""
        while self._next.kind != "end":
            token = self._take()
            if token.tag.removeprefix("/").endswith(_VECTOR):
                continue
            if token.tag != "Generator":
                self._refuse(token, "a generator", "Write <Generator>, or <Generator name=...>.")
            self._generator(token)

    def _take(self) -> _Token:
        token = self._next
        if token.kind != "end":
            self._next = next(self._tokens)
        return token

    def _refuse(self, token: _Token, wanted: str, fix: str) -> NoReturn:
        found = "the end of the file" if token.kind == "end" else f"'{token.text:.60}'"
        _fail("automata-syntax", f"there must be {wanted}, and there is {found}", token.at, fix)

    def _generator(self, token: _Token) -> None:
        name = Named(token.attributes.get("name", ""), token.at)
        if not token.is_whole and self._next.kind == "name":
            named = self._take()
            name = Named(named.text, named.at)
        wish = name.text or "automaton"
        # Copies of one generator, as a vector may hold them, have one name.
        names = (wish if number == 1 else f"{wish}_{number}" for number in count(1))
        unique = next(item for item in names if item not in self._names)
        self._names.add(unique)
        draft = Draft(Named(unique, name.at))
        self.drafts.append(draft)
        self.stated.append({})
        self.types.append(token.attributes.get("ftype", "Generator"))
        sections = {
            "States": lambda: self._states(draft.states, "States"),
            "InitStates": lambda: self._states(draft.initial, "InitStates"),
            "MarkedStates": lambda: self._states(draft.marked, "MarkedStates"),
            "Alphabet": lambda: self._alphabet(draft),
            "TransRel": lambda: self._transitions(draft),
        }
        while not token.is_whole:
            section = self._take()
            if section.tag == "/Generator":
                return
            read = sections.get(section.tag)
            if read is None:
                self._refuse(
                    section,
                    "<Alphabet>, <States>, <TransRel>, <InitStates>, <MarkedStates> or </Generator>",
                    "Leave it out: only plain generators are read.",
                )
            if not section.is_whole:
                read()

    def _count(self, at: Location) -> None:
        self._parts += 1
        if self._parts > MAXIMUM_PARTS:
            message = f"there are more than {MAXIMUM_PARTS:,} states and transitions"
            _fail("automata-unsupported", message, at, "Give the parts that it is composed of instead.")

    def _names_until(self, section: str) -> Iterator[_Token]:
        """Yield names, and tags inside, up to the end of a section."""
        while True:
            token = self._take()
            if token.tag == f"/{section}":
                return
            if token.kind == "end":
                self._refuse(token, f"</{section}>", "Close the section.")
            yield token

    def _states(self, found: list[Named], section: str) -> None:
        for token in self._names_until(section):
            if token.tag == "Consecutive":
                first, last, close = self._take(), self._take(), self._take()
                ends = [item.text for item in (first, last) if _COUNT.fullmatch(item.text)]
                if len(ends) < 2 or close.tag != "/Consecutive":
                    self._refuse(first, "two numbers of at most nine digits and </Consecutive>", "Write both.")
                for number in range(int(ends[0]), int(ends[1]) + 1):
                    self._count(first.at)
                    found.append(Named(str(number), first.at))
                continue
            if token.kind != "name":
                self._refuse(token, "a state", f"Write a name, or </{section}>.")
            # A name may come with the number that stands for it.
            name, sign, _ = token.text.partition("#")
            if name or not sign:
                self._count(token.at)
                found.append(Named(name, token.at))

    def _alphabet(self, draft: Draft) -> None:
        for token in self._names_until("Alphabet"):
            if token.kind != "name":
                self._refuse(token, "an event", "Write a name, which may be followed by an option such as +C+.")
            draft.events.append(Named(token.text, token.at))
            if self._next.kind == "option":
                self._options(token, self._take())

    def _options(self, event: _Token, option: _Token) -> None:
        letters = option.text.strip("+")
        if not set(letters) <= _FLAGS:
            self._refuse(option, "an option of the letters C, O, F and A", "Write +C+ for a controllable event.")
        if "o" in letters:
            message = f"the event '{event.text}' is not observable"
            fix = "Let it be observable: supervisors see all events here."
            self._findings.error("automata-unsupported", message, option.at, fix)
        if "c" in letters.lower():
            self.stated[-1][event.text] = "C" in letters

    def _transitions(self, draft: Draft) -> None:
        found: list[_Token] = []
        for token in self._names_until("TransRel"):
            if token.kind != "name":
                self._refuse(token, "a state or an event", "Write transitions as state, event and state.")
            found.append(token)
            if len(found) == 3:
                self._count(token.at)
                source, event, target = (Named(item.text, item.at) for item in found)
                draft.edges.append((source, event, target))
                found = []
        if found:
            self._refuse(found[-1], "state, event and state", "Write the rest of the transition.")


def read_gen(file: SourceFile, findings: Findings) -> tuple[System, SystemPlaces]:
    """The system of a file; of use only if no error is found.

    A generator of the type `System` is a plant, every other one a requirement. Where no generator has that type, plants
    are those whose alphabet has a controllable event. An event of a plant is uncontrollable unless its alphabet
    says otherwise; alphabets of requirements need not say it.

    Raises:
        LanguageError: It is no file of libFAUDES.
    """
    reader = _Reader(file, findings)
    reader.read()
    at = Location(file.name, 1, 1, 1)
    if not reader.drafts:
        _fail("automata-syntax", "there is no generator in it", at, "Write <Generator>, or <Generator name=...>.")
    has_types = "System" in reader.types
    for draft, type_, stated in zip(reader.drafts, reader.types, reader.stated, strict=True):
        is_plant = type_ == "System" if has_types else any(stated.values())
        draft.role = Role.PLANT if is_plant else Role.REQUIREMENT
    if all(draft.role is Role.REQUIREMENT for draft in reader.drafts):
        fix = 'Write ftype="System" at the plants, or +C+ behind their controllable events.'
        findings.error("automata-unsupported", "no generator is a plant", reader.drafts[0].name.at, fix)
    return system_of(PurePath(file.name).stem, reader.drafts, _events(reader, findings), findings)


def _events(reader: _Reader, findings: Findings) -> dict[str, bool]:
    """The events, and whether each is controllable, on which all alphabets that say it must agree."""
    found: dict[str, bool] = {}
    for draft, stated in zip(reader.drafts, reader.stated, strict=True):
        for item in draft.events:
            if item.text not in stated and draft.role is Role.REQUIREMENT:
                continue
            is_controllable = stated.get(item.text, False)
            if found.setdefault(item.text, is_controllable) is not is_controllable:
                message = f"the event '{item.text}' is controllable in one alphabet and not in another"
                findings.error("automata-name", message, item.at, "Say the same in all of them.")
    return {item.text: found.get(item.text, False) for draft in reader.drafts for item in draft.events}


def write_gen(system: System) -> str:
    """A file of libFAUDES: plants are generators of the type `System`, requirements of none.

    Raises:
        UnsupportedModelError: Automata are not plain, or a name is not a symbol of libFAUDES.
    """
    require_plain(system)
    controllable = {event.name for event in system.events if event.is_controllable}
    lines = [f"% The automata of {system.name!a}, written by RoboSC."]
    for automaton in system.automata:
        type_ = ' ftype="System"' if automaton.role is Role.PLANT else ""
        options = {event: " +C+" if event in controllable else "" for event in sorted(automaton.alphabet)}
        sections = {
            "Alphabet": [_symbol(event) + option for event, option in options.items()],
            "States": [_state(item) for item in automaton.locations],
            "TransRel": [
                f"{_state(edge.source)} {_symbol(edge.event)} {_state(edge.target)}" for edge in automaton.edges
            ],
            "InitStates": [_state(item) for item in automaton.initial],
            "MarkedStates": [_state(item) for item in automaton.locations if item in automaton.marked],
        }
        lines += ["", f"<Generator name={_symbol(automaton.name)}{type_}>"]
        for name, parts in sections.items():
            lines += _section(name, parts)
        lines.append("</Generator>")
    return "\n".join(lines) + "\n"


def _section(name: str, parts: Iterable[str]) -> list[str]:
    return [f"<{name}>", *parts, f"</{name}>"]


def _symbol(text: str) -> str:
    if not _SYMBOL.fullmatch(text):
        raise UnsupportedModelError(
            f"{text!a:.100} is not a symbol of libFAUDES: printable ASCII without #, % and quotes"
        )
    return f'"{text}"'


def _state(text: str) -> str:
    # Digits alone would be the number of a state without a name.
    return text if _NUMBER.fullmatch(text) else _symbol(text)
