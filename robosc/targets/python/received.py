"""Generated code that reads received data: properties, array elements, conversions to enums and ranges."""

from dataclasses import dataclass, field

from robosc.errors import InternalError
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    StringType,
    Type,
)
from robosc.expressions.text import expression_text
from robosc.model.received import Path
from robosc.model.structure import EnumDefinition
from robosc.targets.code.expression_writer import may_compute
from robosc.targets.code.expressions import TRUE_CODE, Code, Sort, Unknown, place
from robosc.targets.code.text import indent
from robosc.targets.paths import path_text, path_type
from robosc.targets.python.expressions import Scope, code_text
from robosc.targets.python.layout import Layout
from robosc.targets.python.naming import PythonNamer
from robosc.targets.python.text import comment

_PLAIN: dict[type, str] = {
    DoubleType: "read_double",
    IntegerType: "read_integer",
    BooleanType: "read_boolean",
    StringType: "read_string",
}
"""Functions of `values` that convert an element about which there is nothing to note."""


def received_unknown(type_: Type, path: Path) -> Unknown:
    """Return the way in which received data of a type, at a path, is unknown."""
    match type_:
        case DoubleType() | IntegerType():
            return Unknown.NAN
        case EnumType() if not any(isinstance(step, int) for step in path):
            return Unknown.NEVER  # Whatever came, the rules make a value of it; an element may be absent.
        case _:
            return Unknown.VALUE


def reader_namer() -> PythonNamer:
    """Names for a method's locals."""
    return PythonNamer(("data", "path", "self", "skipped", "found"))


@dataclass(slots=True)
class Reader:
    """Writes statements that read paths of one received datum into local variables.

    Attributes:
        layout: Names of the converters.
        root_type: Type of the datum.
        used: Functions of the runtime modules that the statements call.
        words: Texts of tuples that say what was unknown, so far.
        enum_flags: Locals that tell whether an enum fell to its default past an unknown rule, so far.
        namer: Names the locals; readers whose statements stand in one method share it.
    """

    layout: Layout
    root_type: Type
    used: set[str]
    words: list[str] = field(default_factory=list)
    enum_flags: list[str] = field(default_factory=list)
    namer: PythonNamer = field(default_factory=reader_namer)
    _lines: list[str] = field(default_factory=list)
    _sources: dict[Path, str] = field(default_factory=dict)
    _codes: dict[Path, Code] = field(default_factory=dict)

    def read(self, path: Path) -> Code:
        """The code of a path; its statements are written on first use."""
        if path not in self._codes:
            self._codes[path] = self._read(path, path_type(self.layout.model, self.root_type, path))
        return self._codes[path]

    @property
    def scope(self) -> Scope:
        """The scope of conditions on the datum."""
        return Scope(self.used.add, self.layout.model, received=self.read, root=self.root_type)

    def type_at(self, path: Path) -> Type:
        """The type of a path."""
        return path_type(self.layout.model, self.root_type, path)

    def seen(self, path: Path) -> str:
        """Text of a path's value as the event log shows it: as it came, None where nothing fitting came."""
        code = self.read(path)
        if code.unknown is not Unknown.NAN:
            return code.word
        if code.sort is Sort.INTEGER:
            return self._call("known", code.word)
        # A NaN that came is shown as one.
        return f"{code.word} if {code.word} == {code.word} else {self._call('read_double', self._access(path))}"

    def take_lines(self) -> list[str]:
        """The statements since the last call."""
        lines, self._lines = self._lines, []
        return lines

    @property
    def all_words(self) -> str:
        """Text of a tuple with everything that was unknown."""
        return " + ".join(self.words) or "()"

    @property
    def all_flags(self) -> str:
        """Text of whether any enum fell to its default past an unknown rule."""
        return " or ".join(self.enum_flags) or "False"

    def _local(self, path: Path, suffix: str = "") -> str:
        return self.namer.name("_".join(["value", *map(str, path)]) + suffix)

    def _call(self, function: str, *arguments: str) -> str:
        self.used.add(function)
        return f"{function}({', '.join(arguments)})"

    def _source(self, path: Path) -> str:
        """Local of the raw datum at a path that leads on."""
        if not path:
            return "data"
        if path not in self._sources:
            name = self._local(path, "_raw")
            self._lines.append(f"{name} = {self._access(path)}")
            self._sources[path] = name
        return self._sources[path]

    def _access(self, path: Path) -> str:
        """Text of the raw datum at a path."""
        if not path:
            return "data"
        return self._call("received_part", self._source(path[:-1]), repr(path[-1]))

    def _read(self, path: Path, type_: Type) -> Code:
        match type_:
            case DoubleType() if path and isinstance(path[-1], int):
                text = self._call("number_at", self._source(path[:-1]), repr(path[-1]))
                return self._assign(path, type_, text, Unknown.NAN)
            case DoubleType():
                return self._assign(path, type_, self._call("number", self._access(path)), Unknown.NAN)
            case IntegerType(low=int(low), high=int(high)):
                received = self._local(path, "_received")
                self._lines.append(f"{received} = {self._call('whole', self._access(path))}")
                self.words.append(self._call("moved", repr(path_text(path)), received, repr(low), repr(high)))
                text = self._call("clamped", received, repr(low), repr(high))
                return self._assign(path, type_, text, Unknown.NAN)
            case IntegerType():
                return self._assign(path, type_, self._call("integer", self._access(path)), Unknown.NAN)
            case BooleanType():
                return self._assign(path, type_, self._call("read_boolean", self._access(path)), Unknown.VALUE)
            case StringType():
                return self._assign(path, type_, self._call("read_string", self._access(path)), Unknown.VALUE)
            case EnumType(name=enum):
                return self._read_enum(path, type_, enum)
            case ArrayType(element=element):
                return self._read_array(path, type_, element)
        raise InternalError(f"{path_text(path)} is no single value")

    def _read_array(self, path: Path, type_: Type, element: Type) -> Code:
        plain = _PLAIN.get(type(element))
        if isinstance(element, IntegerType) and element.is_bounded:
            plain = None
        if plain is not None:
            self.used.add(plain)
            text = self._call("plain_elements", self._access(path), plain)
            return self._assign(path, type_, text, Unknown.VALUE)
        notes = self._local(path, "_notes")
        self._lines.append(f"{notes} = []")
        convert = f"lambda item, path, notes: {self._element(element, 'item', 'path', 1)}"
        code = self._assign(
            path,
            type_,
            self._call("elements", self._access(path), repr(path_text(path)), notes, convert),
            Unknown.VALUE,
        )
        self.words.append(self._call("words_of", notes))
        self.enum_flags.append(self._call("flag_of", notes))
        return code

    def _element(self, type_: Type, raw: str, path: str, depth: int) -> str:
        """Text that converts one element of an array, given the texts of it and of its path in words."""
        match type_:
            case IntegerType(low=int(low), high=int(high)):
                return self._call("noted_integer", raw, path, "notes", repr(low), repr(high))
            case EnumType(name=enum):
                return self._call("noted_enum", f"{self.layout.converters[enum]}({raw}, {path})", "notes")
            case ObjectType(name=name):
                parts = [
                    f"{item.name!r}: "
                    + self._element(
                        item.type,
                        self._call("received_part", raw, repr(item.name)),
                        f"{path} + {f'.{item.name}'!r}",
                        depth,
                    )
                    for item in self.layout.model.object(name).properties
                ]
                return f"{{{', '.join(parts)}}}"
            case ArrayType(element=element):
                inner = self._element(element, f"item{depth}", f"path{depth}", depth + 1)
                convert = f"lambda item{depth}, path{depth}, notes: {inner}"
                return self._call("elements", raw, path, "notes", convert)
            case _:
                plain = _PLAIN.get(type(type_))
                return "None" if plain is None else self._call(plain, raw)

    def _read_enum(self, path: Path, type_: Type, enum: str) -> Code:
        name, words, flag = self._local(path), self._local(path, "_words"), self._local(path, "_unknown")
        call = f"{self.layout.converters[enum]}({self._access(path)}, {path_text(path)!r})"
        self._lines.append(f"{name}, {words}, {flag} = {call}")
        self.words.append(words)
        self.enum_flags.append(flag)
        return place(name, type_, received_unknown(type_, path))

    def _assign(self, path: Path, type_: Type, text: str, unknown: Unknown) -> Code:
        name = self._local(path)
        self._lines.append(f"{name} = {text}")
        return place(name, type_, unknown)


def converter(layout: Layout, enum: EnumDefinition, used: set[str]) -> list[str]:
    """The function that makes an enum out of received data, as a readable chain of conditions."""
    reader = Reader(layout, enum.source, used)
    scope = reader.scope
    used.add("ABSENT")
    body = ["if data is ABSENT:", "    return None, (), False"]
    all_false = TRUE_CODE
    for rule in enum.rules:
        fires = scope.truth(rule.condition)
        all_false = scope.both(all_false, scope.falsity(rule.condition))
        # What only a later rule needs is not read before that rule's turn.
        body += reader.take_lines()
        body += comment(f"{expression_text(rule.condition)} -> {rule.value}")
        body += [f"if {code_text(fires)}:", f"    return {rule.value!r}, {reader.all_words}, {reader.all_flags}"]
    body += comment(f"default -> {enum.default}")
    if may_compute(rule.condition for rule in enum.rules):
        words = f"path + {f' is {enum.default} by default: an earlier rule is unknown'!r}"
        earlier = [*reader.words, f"({words},)"]
        body.append(f"if not ({code_text(all_false)}):")
        body.append(f"    return {enum.default!r}, {' + '.join(earlier)}, True")
    body.append(f"return {enum.default!r}, {reader.all_words}, {reader.all_flags}")
    return [
        f"def {layout.converters[enum.name]}(data, path):",
        f'    """{enum.name} from received data; in words what was unknown; whether that decided an enum."""',
        *indent(body),
    ]
