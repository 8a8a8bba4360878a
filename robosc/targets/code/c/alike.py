"""Functions of a C file that are alike but for places and numbers: one does for many, with a table of what differs.

A robot of many parts has many such functions. A processor has forgotten each of them when its turn comes again, and
code that it has to fetch makes it wait; a table takes a tenth of the memory, and is fetched ahead.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import PLANT_LOCATIONS, communication_plant_name
from robosc.targets.code.c.header import state_members
from robosc.targets.code.c.layout import Layout, width
from robosc.targets.code.c.text import comment

MANY = 16
"""Number of functions that are alike from which one does for all: fewer are easier to read one by one."""

_PIECES = re.compile(
    r'/\*.*?\*/|"(?:[^"\\]|\\.)*"|\bU?INT\d+_C\((?P<wide>\w+)\)|\b(?P<base>s->|old\.)(?P<member>\w+)'
    r"|(?P<word>[A-Za-z_]\w*|\d(?:[\w.]|(?<=[eE])[+-])*)"
)
_OLD = "    const state_t old = r->state;"
_MAXIMUM = 2**31 - 1

MACROS = [
    "/* Place of the state, of a type, at so many bytes from its beginning; the second one may be written. */",
    "#define READ(type, state, offset) (*(const type *)(const void *)((const char *)(state) + (offset)))",
    "#define PLACE(type, state, offset) (*(type *)(void *)((char *)(state) + (offset)))",
]


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part of a function that may be another one in a function that is alike.

    Attributes:
        text: Its text.
        value: The number that it stands for; the name of a member of the state.
        base: Text before a member; empty for a number.
    """

    text: str
    value: int | str
    base: str = ""


@dataclass(frozen=True, slots=True)
class Family:
    """Functions for events, of which some do for many.

    Attributes:
        blocks: Lines of the tables and functions.
        rows: Number of the function that does for an event, and the row of its table, by event.
        has_table: For each number, whether that function has a table.
    """

    blocks: list[list[str]]
    rows: Mapping[str, tuple[int, int]]
    has_table: Mapping[int, bool]

    def call(self, event: str, own: str) -> tuple[str, tuple[str, ...]]:
        """Return the function for an event, its own one unless it shares one, and the last argument if it takes one."""
        if event not in self.rows:
            return own, ()
        number, row = self.rows[event]
        return f"alike_{number}", (f"&ALIKE_{number}[{row}]",) if self.has_table[number] else ()

    def row_of(self, event: str) -> tuple[int, int]:
        """The number of the function that does for an event, or 0, and the row of its table."""
        return self.rows.get(event, (0, 0))

    def case(self, number: int, argument: str) -> tuple[int, str]:
        """The statement by which a function does what it does for the event with a `row` of its table."""
        row = f", &ALIKE_{number}[row]" if self.has_table[number] else ""
        return number, f"return alike_{number}({argument}{row});"


class Sharing:
    """Finds the functions that are alike.

    Args:
        layout: Names.
    """

    def __init__(self, layout: Layout) -> None:
        self._types = {name: type_ for type_, name, _ in state_members(layout) if not type_.endswith("*")}
        self._offset = "uint16_t" if 8 * len(self._types) < 2**16 else "uint32_t"
        executable = layout.executable
        lists = [
            (component, [state.name for state in behaviour.states]) for component, behaviour in executable.behaviours
        ]
        called = (item for item in layout.model.communications if item.kind in CALLED_KINDS)
        lists += [(communication_plant_name(item), list(PLANT_LOCATIONS[item.kind])) for item in called]
        names = [[layout.location_names[automaton, name] for name in found] for automaton, found in lists]
        names += [[layout.values[enum.name, value] for value in enum.values] for enum in layout.model.enums]
        self._constants = {name: number for found in names for number, name in enumerate(found)}
        self._count = 0

    def family(self, functions: Mapping[str, list[str]]) -> Family:
        """The functions for some events.

        Args:
            functions: The lines of the function of each event.
        """
        groups: dict[str, dict[str, list[_Piece]]] = {}
        for event, lines in functions.items():
            pieces: list[_Piece] = []
            groups.setdefault(self._skeleton(lines, pieces), {})[event] = pieces
        blocks = dict(functions)
        rows: dict[str, tuple[int, int]] = {}
        has_table: dict[int, bool] = {}
        for skeleton, members in groups.items():
            if self._is_shared(skeleton, [*members.values()]):
                self._count += 1
                rows |= {event: (self._count, row) for row, event in enumerate(members)}
                first, *others = members
                has_table[self._count], blocks[first] = self._shared(functions, members)
                for event in others:
                    del blocks[event]
        return Family([*blocks.values()], rows, has_table)

    def _skeleton(self, lines: Sequence[str], pieces: list[_Piece]) -> str:
        """The code of a function without its name and its pieces, which are noted."""
        start, _, parameters = lines[0].partition("(")
        body = [self._replaced(line, pieces, None) for line, is_comment in _marked(lines[1:]) if not is_comment]
        return "\n".join([start.rpartition(" ")[0], parameters, *body])

    def _replaced(self, line: str, pieces: list[_Piece], texts: list[str] | None) -> str:
        """A line with texts, one after the other, in the place of its pieces; without texts, the pieces are noted."""

        def replace(match: re.Match[str]) -> str:
            text, base = match[0], match["base"]
            if base and match["member"] in self._types:
                found, kind = _Piece(text, match["member"], base), f"{base}{self._types[match['member']]}"
            elif text in self._constants or text.isdigit():
                found, kind = _Piece(text, self._constants[text] if text in self._constants else int(text)), "#"
            elif text.startswith("INT64") and match["wide"].isdigit():
                found, kind = _Piece(text, int(match["wide"])), "##"
            else:
                return text
            if texts is not None:
                return texts.pop(0)
            pieces.append(found)
            return kind

        return line if line == _OLD else _PIECES.sub(replace, line)

    def _is_shared(self, skeleton: str, members: list[list[_Piece]]) -> bool:
        if len(members) < MANY or re.search(r"\bold\b(?! = r->state;)", skeleton.replace("old.", "")):
            return False
        values = (piece.value for pieces in members for piece in pieces)
        return all(isinstance(value, str) or value <= _MAXIMUM for value in values)

    def _shared(
        self, functions: Mapping[str, list[str]], members: Mapping[str, list[_Piece]]
    ) -> tuple[bool, list[str]]:
        """Return whether functions that are alike need a table, and the table with the function that does for all."""
        first, number = next(iter(members)), self._count
        columns: dict[tuple[int | str, ...], str] = {}
        texts: list[str] = []
        was: dict[str, tuple[str, str]] = {}
        is_writing = "state_t *const s" in "\n".join(functions[first])
        for pieces in zip(*members.values(), strict=True):
            values, piece = tuple(item.value for item in pieces), pieces[0]
            if all(value == piece.value for value in values):
                place = f"r->state.{piece.value}" if piece.base == "old." else piece.text
            else:
                kind = "place" if piece.base else "value"
                name = f"like->{columns.setdefault(values, f'{kind}_{len(columns) + 1}')}"
                type_ = self._types.get(str(piece.value), "")
                match piece.base:
                    case "old.":
                        place = f"READ({type_}, &r->state, {name})"
                    case "s->":
                        place = f"{'PLACE' if is_writing else 'READ'}({type_}, s, {name})"
                    case _:
                        place = f"((int64_t){name})" if piece.text.startswith("INT64") else name
            if piece.base == "old.":
                type_ = self._types[str(piece.value)]
                place = was.setdefault(place, (f"was_{len(was) + 1}", type_))[0]
            texts.append(place)
        start, _, parameters = functions[first][0].partition("(")
        like = f"{parameters[:-1]}, const alike_{number}_t *like)" if columns else parameters
        body = []
        for line, is_comment in _marked(functions[first][1:]):
            if line == _OLD:
                body += [f"    const {type_} {name} = {place};" for place, (name, type_) in was.items()]
            else:
                body.append(line if is_comment else self._replaced(line, [], texts))
        words = f"Does for {len(members)} events that are alike; what stands here are the words of {first}."
        return bool(columns), [
            *self._table(columns, members, number),
            *comment(words),
            f"{start.rpartition(' ')[0]} alike_{number}({like}",
            *body,
        ]

    def _table(
        self, columns: Mapping[tuple[int | str, ...], str], members: Mapping[str, list[_Piece]], number: int
    ) -> list[str]:
        """The table of what differs; nothing where nothing does."""
        if not columns:
            return []
        types = [self._column_type(values) for values in columns]
        entries = (
            ", ".join(f"offsetof(state_t, {item})" if isinstance(item, str) else str(item) for item in row)
            for row in zip(*columns, strict=True)
        )
        lines = (f"    {{{entry}}}, /* {event} */" for event, entry in zip(members, entries, strict=True))
        return [
            "typedef struct {",
            *(f"    {type_} {name};" for type_, name in zip(types, columns.values(), strict=True)),
            f"}} alike_{number}_t;",
            "",
            f"static const alike_{number}_t ALIKE_{number}[] = {{",
            *lines,
            "};",
            "",
        ]

    def _column_type(self, values: tuple[int | str, ...]) -> str:
        greatest = max((value for value in values if isinstance(value, int)), default=None)
        if greatest is None:
            return self._offset
        return "int32_t" if greatest >= 2**16 else width(greatest + 1)


def _marked(lines: Sequence[str]) -> Iterator[tuple[str, bool]]:
    """Yield each line, and whether it is a comment or a part of one."""
    is_comment = False
    for line in lines:
        is_comment = is_comment or line.lstrip().startswith("/*")
        yield line, is_comment
        is_comment = is_comment and not line.endswith("*/")
