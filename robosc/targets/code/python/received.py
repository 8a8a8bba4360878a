"""Generated code that reads received data: properties, array elements, conversions to enums and ranges."""

from functools import reduce

from robosc.errors import InternalError
from robosc.expressions import ArrayType, BooleanType, DoubleType, EnumType, IntegerType, ObjectType, StringType, Type
from robosc.model.received import Path, path_text
from robosc.model.structure import EnumDefinition
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Sort,
    Unknown,
    call,
    integer,
    operation,
    place,
    variable,
)
from robosc.targets.code.python.expressions import Scope, constant
from robosc.targets.code.python.layout import Layout
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.statements import statement_lines
from robosc.targets.code.received import ReceivedReader
from robosc.targets.code.statements import Assign, If, Let, Return, when
from robosc.targets.text import indent

_PLAIN: dict[type, str] = {
    DoubleType: "read_double",
    IntegerType: "read_integer",
    BooleanType: "read_boolean",
    StringType: "read_string",
}
"""Functions of `values` that convert an element about which there is nothing to note."""

_DATA, _NOTES = variable("data"), variable("notes")
_ABSENT = (constant(None), constant(()), FALSE_CODE)


def received_unknown(type_: Type, path: Path) -> Unknown:
    """Return the way in which received data of a type, at a path, is unknown."""
    match type_:
        case DoubleType() | IntegerType():
            return Unknown.NAN
        case EnumType() if not any(isinstance(step, int) for step in path):
            return Unknown.NEVER  # The rules make a value of any data; an element may be absent.
        case _:
            return Unknown.VALUE


def reader_namer() -> PythonNamer:
    """Names for a method's locals."""
    return PythonNamer(("data", "path", "self", "skipped", "found"))


class Reader(ReceivedReader):
    """Builds statements that read paths of one received datum into local variables.

    Args:
        layout: Names of the converters.
        root: Type of the datum.
        used: Functions of the runtime modules that the statements call.
        namer: Names the locals.

    Attributes:
        words: Tuples that say what was unknown, so far.
        flags: Conditions that an enum fell to its default past an unknown rule, so far.
    """

    def __init__(self, layout: Layout, root: Type, used: set[str], namer: PythonNamer | None = None) -> None:
        super().__init__(layout.model, root, namer or reader_namer())
        self.layout = layout
        self.used = used
        self.words: list[Code] = []
        self.flags: list[Code] = []
        self._sources: dict[Path, Code] = {}

    @property
    def scope(self) -> Scope:
        """Writer of conditions on the datum."""
        return Scope(self.used.add, self._model, received=self.read, root=self._root)

    def seen(self, path: Path) -> Code:
        """A path's value as the event log shows it: as it came, None where nothing fitting came."""
        code = self.read(path)
        if code.unknown is not Unknown.NAN:
            return code
        if code.sort is Sort.INTEGER:
            return self._call("known", code)
        # A NaN that came is shown as one.
        return operation("if not NaN", code, self._call("read_double", self._access(path)))

    @property
    def noted(self) -> tuple[Code, Code]:
        """A tuple with everything that was unknown, and whether any enum fell to its default past an unknown rule."""
        return _joined(self.words), operation("or", *self.flags) if self.flags else FALSE_CODE

    def _call(self, function: str, *arguments: Code) -> Code:
        self.used.add(function)
        return call(function, *arguments)

    def _source(self, path: Path) -> Code:
        """Local of the raw datum at a path that leads on."""
        if not path:
            return _DATA
        if path not in self._sources:
            source = variable(self.local(path, "_raw"))
            self._statements.append(Let(source, self._access(path)))
            self._sources[path] = source
        return self._sources[path]

    def _access(self, path: Path) -> Code:
        """The raw datum at a path."""
        return self._call("received_part", self._source(path[:-1]), constant(path[-1])) if path else _DATA

    def _read(self, path: Path, type_: Type) -> Code:
        match type_:
            case DoubleType() if path and isinstance(path[-1], int):
                value = self._call("number_at", self._source(path[:-1]), constant(path[-1]))
            case DoubleType():
                value = self._call("number", self._access(path))
            case IntegerType(low=int(low), high=int(high)):
                received, bounds = variable(self.local(path, "_received")), (integer(low), integer(high))
                self._statements.append(Let(received, self._call("whole", self._access(path))))
                self.words.append(self._call("moved", constant(path_text(path)), received, *bounds))
                value = self._call("clamped", received, *bounds)
            case IntegerType():
                value = self._call("integer", self._access(path))
            case BooleanType() | StringType():
                value = self._call(_PLAIN[type(type_)], self._access(path))
            case EnumType(name=enum):
                return self._read_enum(path, type_, enum)
            case ArrayType(element=element):
                return self._read_array(path, type_, element)
            case _:
                raise InternalError(f"{path_text(path)} is not a single value")
        return self._assign(path, type_, value)

    def _read_array(self, path: Path, type_: Type, element: Type) -> Code:
        plain = _PLAIN.get(type(element))
        if plain is not None and not (isinstance(element, IntegerType) and element.is_bounded):
            self.used.add(plain)
            return self._assign(path, type_, self._call("plain_elements", self._access(path), variable(plain)))
        notes = variable(self.local(path, "_notes"))
        self._statements.append(Let(notes, operation("array", operation("list"))))
        converted = operation("lambda", _arguments(""), self._element(element, variable("item"), variable("path"), 1))
        value = self._call("elements", self._access(path), constant(path_text(path)), notes, converted)
        code = self._assign(path, type_, value)
        self.words.append(self._call("words_of", notes))
        self.flags.append(self._call("flag_of", notes))
        return code

    def _element(self, type_: Type, raw: Code, path: Code, depth: int) -> Code:
        """The conversion of one element of an array, given it and its path in words."""
        match type_:
            case IntegerType(low=int(low), high=int(high)):
                return self._call("noted_integer", raw, path, _NOTES, integer(low), integer(high))
            case EnumType(name=enum):
                return self._call("noted_enum", call(self.layout.converters[enum], raw, path), _NOTES)
            case ObjectType(name=name):
                entries: list[Code] = []
                for item in self._model.object(name).properties:
                    part = self._call("received_part", raw, constant(item.name))
                    words = operation("+", path, constant(f".{item.name}"))
                    entries.append(
                        operation("entry", constant(item.name), self._element(item.type, part, words, depth))
                    )
                return operation("object", operation("list", *entries))
            case ArrayType(element=element):
                inner = self._element(element, variable(f"item{depth}"), variable(f"path{depth}"), depth + 1)
                converted = operation("lambda", _arguments(depth), inner)
                return self._call("elements", raw, path, _NOTES, converted)
            case _:
                plain = _PLAIN.get(type(type_))
                return constant(None) if plain is None else self._call(plain, raw)

    def _read_enum(self, path: Path, type_: Type, enum: str) -> Code:
        value, words, flag = (variable(self.local(path, suffix)) for suffix in ("", "_words", "_unknown"))
        converted = call(self.layout.converters[enum], self._access(path), constant(path_text(path)))
        self._statements.append(Assign(operation("list", value, words, flag), converted))
        self.words.append(words)
        self.flags.append(flag)
        return value.typed(type_, received_unknown(type_, path))

    def _assign(self, path: Path, type_: Type, value: Code) -> Code:
        code = place(self.local(path), type_, received_unknown(type_, path))
        self._statements.append(Let(code, value))
        return code

    def _result(self, value: Code) -> Return:
        return Return(operation("list", value, *self.noted))

    def _undecided(self, enum: EnumDefinition, test: Code) -> If:
        words = operation("+", variable("path"), constant(f" is {enum.default} by default: an earlier rule is unknown"))
        noted = _joined([*self.words, operation("tuple", words)])
        return when(self.scope.negated(test), Return(operation("list", constant(enum.default), noted, TRUE_CODE)))


def _joined(words: list[Code]) -> Code:
    """The sum of tuples."""
    return reduce(lambda left, right: operation("+", left, right), words) if words else constant(())


def _arguments(depth: int | str) -> Code:
    """The parameters of a function that converts an element."""
    return operation("list", variable(f"item{depth}"), variable(f"path{depth}"), _NOTES)


def converter(layout: Layout, enum: EnumDefinition, used: set[str]) -> list[str]:
    """The function that makes an enum out of received data, as a readable chain of conditions."""
    used.add("ABSENT")
    absent = when(operation("is", _DATA, variable("ABSENT")), Return(operation("list", *_ABSENT)))
    return [
        f"def {layout.converters[enum.name]}(data, path):",
        f'    """Return {enum.name} from data; what was unknown, in words; if that decided an enum."""',
        *indent(statement_lines([absent, *Reader(layout, enum.source, used).conversion(enum)])),
    ]
