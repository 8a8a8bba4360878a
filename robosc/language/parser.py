"""Text to syntax tree: a recursive-descent parser of the language's definitions, which continues after errors.

It is written by hand because no general parser does all of this: report errors in the words of the language, continue
after them, allow contextual keywords as names, and take linear time on any text. Tests compare it with textX and the
grammar `tests/support/robosc.tx`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress

import msgspec

from robosc.errors import Diagnostic, RelatedPlace, sorted_diagnostics
from robosc.language import syntax
from robosc.language.cursor import Extent, Fault, TooManyFaults, shown
from robosc.language.expression_parser import ExpressionParser
from robosc.language.limits import FRAMES_PER_LEVEL, MAXIMUM_NESTING
from robosc.language.mission_parser import MissionParser
from robosc.language.tokens import Kind, Places, Tokens, obstacle, readable_tokens, tokenize
from robosc.recursion import allow_depth
from robosc.source import SourceFile

_NAME, _NUMBER, _STRING, _END = (int(kind) for kind in (Kind.NAME, Kind.NUMBER, Kind.STRING, Kind.END))
_MAXIMUM_VALUES = 5
"""Values by which the type of a variable without one is guessed."""

_MAXIMUM_READ = 10_000
"""Tokens of a text in which such values and their types are looked for."""

_MAXIMUM_BACK = 200
"""Tokens of a transition before a value."""

_TYPES = frozenset({*map(str, syntax.BasicTypeName), "array"})
_BEFORE_VALUES = frozenset({":=", "=", "!=", "<", "<=", ">", ">="})
_NEEDED = "a request is only made where requirements hold, so write 'requirement ... needs ...' in the robot."
_CHOSEN = "what is received always counts, so go to a state from where a 'transition if ...' chooses."
_RESULT_KINDS = ("request", "response", "feedback", "error", "cancel")
_QUALITIES = ("reliable", "best_effort", "sensor", "latched")

type _Nested = dict[str, _Nested | str]
"""Text of each property of an object, by its name."""


class Parsed(msgspec.Struct, frozen=True):
    """Result of parsing a text.

    Attributes:
        tree: The syntax tree, or None where there are errors.
        diagnostics: Everything that is wrong with the text, by place.
        sound: The syntax tree of the items that are sound, or None where not even the first words are; a name of the
            file that is missing is empty.
        extents: Begin and end of each sound item that stands in a list, inner ones first.
        expected: Words for what could stand at the end of a text that ends too early, such as `'goto'` or `a name`.
    """

    tree: syntax.File | None
    diagnostics: tuple[Diagnostic, ...]
    sound: syntax.File | None = None
    extents: tuple[Extent, ...] = ()
    expected: tuple[str, ...] = ()


def parse(file: SourceFile) -> Parsed:
    """The syntax tree of a file; never raises, whatever the text."""
    tokens, places = tokenize(file.text), Places(file)
    hidden = obstacle(file, tokens, places)
    if hidden is not None:
        # Other findings may come of it: it is reported alone, and the rest read for the sake of its sound parts.
        tokens = readable_tokens(file.text)
    # Users of the tree walk it recursively too.
    allow_depth(MAXIMUM_NESTING, FRAMES_PER_LEVEL)
    parser = _Parser(file, tokens, places)
    tree = None
    with suppress(Fault, TooManyFaults):
        tree = parser.file()
    diagnostics = sorted_diagnostics(parser.diagnostics) if hidden is None else (hidden,)
    return Parsed(None if diagnostics else tree, diagnostics, tree, tuple(parser.extents), parser.expected)


class _Parser(MissionParser):
    """Reads definitions."""

    def __init__(self, file: SourceFile, tokens: Tokens, places: Places) -> None:
        super().__init__(file, tokens, places)
        self._library_items: Mapping[str, Callable[[], syntax.Item]] = {
            "component": self._component,
            "datatype": self._data_type,
            "interface": self._interface,
            "constant": self._constant,
            "requirement": self._requirement,
            "provide": self._provide,
            "limit": self._limit,
        }
        self._robot_items = {
            **self._library_items,
            "goal": self.goal,
            "assume": self.assumption,
            "mission": self.mission,
            "prefer": self.preference,
        }
        self._component_items: Mapping[str, Callable[[], syntax.Communication | syntax.Behaviour]] = {
            "incoming": self._message,
            "outgoing": self._message,
            "service": self._service,
            "action": self._action,
            "behaviour": self._behaviour,
        }
        transitions: dict[str, Callable[[], syntax.Transition]] = {"on": self._on, "transition": self._tau}
        self._transitions = transitions
        self._behaviour_items: Mapping[str, Callable[[], syntax.Variable | syntax.State | syntax.Transition]] = {
            "variable": self._variable,
            "initial": self._state,
            "marked": self._state,
            "state": self._state,
            **transitions,
        }

    def file(self) -> syntax.File:
        """A robot or a library."""
        index = self.place
        if self.texts[index] not in ("robot", "library"):
            fault = self.fault("'robot'", "'library'")
            begin = self._begin_of_file()
            if begin is None:
                raise fault
            index = begin
        self.place = index + 1
        name = self._name_of_file()
        self.is_library = self.texts[index] == "library"
        # Those of a robot are read in a library, too, to say that they belong elsewhere.
        words = [f"'{word}'" for word in (self._library_items if self.is_library else self._robot_items)]
        items = self.items(self._robot_items, *words)
        if self.kinds[self.place] != _END and self.is_whole:
            closing = RelatedPlace(f"this '}}' ends the {self.texts[index]}", self.at(self.place - 1))
            self.fault("the end of the file", related=(closing,))
        while self.texts[self.place] in ("}", *self._robot_items):
            self.go_on(self._robot_items, *words)
        return syntax.File(self.is_library, name, items)

    def _begin_of_file(self) -> int | None:
        """Return the place where a robot or library begins behind what should not be before it."""
        for index in range(self.place, len(self.texts) - 2):
            if self.texts[index] in ("robot", "library") and "{" in self.texts[index + 1 : index + 3]:
                return index
        return None

    def _name_of_file(self) -> syntax.Name:
        """The name of a robot or library; empty where it is missing or a word: what stands in it is to be known."""
        try:
            return self.name()
        except Fault:
            if self.texts[self.place] != "{":
                if self.texts[self.place + 1] != "{":
                    raise
                self.place += 1
            return syntax.Name("", self.at(self.place - 1))

    def body_of(self, word: str, following: str) -> Callable[[], object] | None:
        """Return the reader of the list in braces of an item that begins with these words, or None if it has none."""
        match word, following:
            case "component", _:
                return self._component_list
            case "behaviour", _:
                return self._behaviour_list
            case "initial" | "marked" | "state", _:
                return self._state_list
            case "mission", _:
                return self.mission_list
            case "datatype", "object":
                return self._object_list
            case "datatype", "enum":
                return self._enum_list
            case _:
                return None

    # Definitions

    def _interface(self) -> syntax.Interface:
        self.take("interface")
        name = self.name()
        self.take("use")
        if self.texts[self.place + 1] == "/":
            package, _, type_name = self.texts[self.place : self.place + 3]
            fix = f"Write '{type_name} from {package}' instead of '{package}/{type_name}'."
            raise self.fault("a type's name", fix=fix)
        type_ = self.name()
        self.take("from")
        return syntax.Interface(name, type_, self.name())

    def _constant(self) -> syntax.Constant:
        self.take("constant")
        name = self.name()
        if self.texts[self.place] == "=" and (meant := self._type_of_value(self.place + 1)):
            raise self.fault("':'", fix=f"Write ': {'integer' if meant.isdigit() else meant}' before it.")
        self.take(":")
        type_ = self.type()
        self.take("=")
        return syntax.Constant(name, type_, self.expression())

    def _data_type(self) -> syntax.ObjectDefinition | syntax.EnumDefinition:
        self.take("datatype")
        if self.takes("object"):
            name = self.name()
            return syntax.ObjectDefinition(name, self._object_list())
        if not self.takes("enum"):
            raise self.fault()
        name = self.name()
        self.take("from")
        source = self.type()
        self.take("to")
        return syntax.EnumDefinition(name, source, self._enum_list())

    def _object_list(self) -> tuple[syntax.Property, ...]:
        return self.entries(self._property, self._begins_name, "a name")

    def _enum_list(self) -> tuple[syntax.EnumRule, ...]:
        return self.entries(self._rule, self._begins_rule, "an expression", "'default'")

    def _begins_name(self) -> bool:
        return self.kinds[self.place] == _NAME

    def _begins_rule(self) -> bool:
        return self.texts[self.place] == "default" or self.begins_expression()

    def _property(self) -> syntax.Property:
        name = self.name()
        self.take(":")
        return syntax.Property(name, self.type())

    def _rule(self) -> syntax.EnumRule:
        condition = None if self.texts[self.place] == "default" else self.expression()
        if condition is None:
            self.place += 1
        elif (
            self.texts[self.place - 2] == "=>"
            and self.kinds[self.place - 1] == _NAME
            and self.texts[self.place] != "->"
        ):
            self._thick_arrow(self.place - 2)
            self.place -= 1
            return syntax.EnumRule(condition, self.name())
        self.take("->")
        return syntax.EnumRule(condition, self.name())

    def _thick_arrow(self, index: int) -> None:
        """Report a `=>` for `->`, which was read as a part of the condition before it."""
        place = self.at(index)
        self.diagnostics = [
            item for item in self.diagnostics if (item.code, item.location) != ("ambiguous-implication", place)
        ]
        self.report("syntax-error", "'=>' does not fit here; expected '->'", place, "Write '->' instead of '=>'.")

    # Components

    def _component(self) -> syntax.Component:
        self.take("component")
        name = self.name()
        if self.takes("from"):
            library = self.name()
            self.take("import")
            return syntax.Component(name, (), syntax.Import(library, self.name()))
        return syntax.Component(name, self._component_list(), None)

    def _component_list(self) -> tuple[syntax.Communication | syntax.Behaviour, ...]:
        return self.items(self._component_items, *(f"'{word}'" for word in self._component_items))

    def _message(self) -> syntax.Message:
        direction = syntax.Direction(self.texts[self.place])
        self.place += 1
        self.take("message")
        name = self.name()
        given = self._with("type")
        return syntax.Message(direction, name, given.identifier, given.types["type"], given.link, given.options)

    def _service(self) -> syntax.Service:
        self.take("service")
        name = self.name()
        given = self._with("request", "response")
        types = given.types
        return syntax.Service(name, given.identifier, types["request"], types["response"], given.link, given.options)

    def _action(self) -> syntax.Action:
        self.take("action")
        name = self.name()
        given = self._with("request", "response", "feedback")
        request, response, feedback = (given.types[key] for key in ("request", "response", "feedback"))
        return syntax.Action(name, given.identifier, request, response, feedback, given.link, given.options)

    def _with(self, *keys: str) -> "_WithList":
        """A `with` list: an identifier, the types that `keys` names in their order, options anywhere among them."""
        self.take("with")
        identifier: syntax.Text | None = None
        types: dict[str, syntax.Type] = {}
        options: list[syntax.Option] = []
        while True:
            index = self.place
            key = self.texts[index]
            missing = keys[len(types)] if len(types) < len(keys) else None
            option = self._options.get(key)
            if key == missing:
                self.place += 1
                self.take(":")
                types[key] = self.type()
            elif key == "identifier" and identifier is None and not types:
                self.place += 1
                self.take(":")
                identifier = self.string()
            elif option is not None and all(item.key != key for item in options):
                self.place += 1
                self.take(":")
                options.append(syntax.Option(key, option(self), self.at(index)))  # type: ignore[arg-type]
            else:
                expected = ["'identifier'"] if identifier is None and not types else []
                expected += [f"'{missing}'"] if missing else []
                expected += [f"'{word}'" for word in self._options if all(item.key != word for item in options)]
                raise self.fault(*expected)
            if not self.takes(","):
                break
        if len(types) < len(keys):
            missing = keys[len(types)]
            if self.texts[self.place] == missing:
                raise self.fault(fix="Write ',' before it.")
            comma = "" if self.texts[self.place - 1] == "," else ", "
            raise self.fault(fix=f"Write '{comma}{missing}: none' before it, or the type that it carries.")
        link = self.name() if self.takes("links") else None
        return _WithList(identifier, types, tuple(options), link)

    def _quality(self) -> syntax.Name:
        if self.texts[self.place] not in _QUALITIES:
            raise self.fault(*(f"'{word}'" for word in _QUALITIES))
        return self.name()

    def _number_option(self) -> syntax.Literal:
        index = self.place
        if self.kinds[index] == _NUMBER and "." in self.texts[index]:
            self.place += 1
            return syntax.Literal(float(self.texts[index]), self.at(index))
        if self.texts[index] == "-" and "." in self.texts[index + 1]:
            self.place += 1
            raise self.fault("a number that is not negative")
        return syntax.Literal(self.integer(), self.since(index))

    def _when(self) -> syntax.Name | syntax.Expression:
        if self.takes("default"):
            return syntax.Name("default", self.at(self.place - 1))
        return self.expression()

    _options: Mapping[str, Callable[["_Parser"], syntax.Name | syntax.Text | syntax.Expression]] = {
        "qos": _quality,
        "depth": _number_option,
        "max_age": _number_option,
        "stamped": ExpressionParser.string,
        "when": _when,
    }

    # Behaviours

    def _behaviour(self) -> syntax.Behaviour:
        place = self.at(self.take("behaviour"))
        return syntax.Behaviour(self._behaviour_list(), place)

    def _behaviour_list(self) -> tuple[syntax.Variable | syntax.State | syntax.Transition, ...]:
        return self.items(self._behaviour_items, *(f"'{word}'" for word in self._behaviour_items))

    def _variable(self) -> syntax.Variable:
        self.take("variable")
        name = self.name()
        is_typed = self.texts[self.place] in _TYPES
        if self.texts[self.place] != ":" and not is_typed and (meant := self._type_of_variable(name.text)):
            raise self.fault("':'", fix=f"Write ': {meant}' before it.")
        self.take(":")
        type_ = self.type()
        return syntax.Variable(name, type_, self.initial_value() if self.takes("=") else None)

    def _type_of_variable(self, name: str) -> str:
        """The type of a variable that declares none, from the values that it is assigned or compared with."""
        if self.texts[self.place] == "(" or self.kinds[self.place] == _NAME:
            return ""
        values = [self.place + 1] if self.texts[self.place] == "=" else []
        for index, token in enumerate(self.texts[:_MAXIMUM_READ]):
            if token == name and self.texts[index + 1] in _BEFORE_VALUES:
                values.append(index + 2)
        types = [found for index in values[:_MAXIMUM_VALUES] if (found := self._type_of_value(index))]
        # Whole numbers are described as the range that has them all.
        whole = [int(found) for found in types if found.isdigit()]
        return f"integer(0..{max(whole)})" if whole and types[0].isdigit() else next(iter(types), "boolean")

    def _type_of_value(self, index: int) -> str:
        """The type of the value at a token; the digits of a whole number; empty if the type is not known."""
        texts = self.texts
        value, read = texts[index], range(min(len(texts) - 2, _MAXIMUM_READ))
        if value in ("true", "false"):
            return "boolean"
        if self.kinds[index] == _NUMBER:
            return "double" if "." in value else value[:9]
        if self.kinds[index] == _STRING:
            return "string"
        if value == "value" and texts[index + 1] != ".":
            # Received data has the type of the message.
            start = next((at for at in range(index, max(0, index - _MAXIMUM_BACK), -1) if texts[at] == "on"), 0)
            head = ["message", *texts[start + 3 : start + 4]]
            begin = next((at for at in read if texts[at : at + 2] == head), len(read))
            found = next((at for at in read[begin:] if texts[at] == "type"), None)
            return "" if found is None else texts[found + 2]
        # A value that an enum has is of that enum.
        rule = next((at for at in read if texts[at : at + 2] == ["->", value]), 0)
        enum = next((at for at in range(rule, 0, -1) if texts[at] == "enum"), None)
        return "" if enum is None else texts[enum + 1]

    def _state(self) -> syntax.State:
        is_initial = self.takes("initial")
        is_marked = self.takes("marked")
        self.take("state")
        name = self.name()
        return syntax.State(name, is_initial, is_marked, self._state_list())

    def _state_list(self) -> tuple[syntax.Transition, ...]:
        return self.items(self._transitions, "'on'", "'transition'")

    def _on(self) -> syntax.CommunicationTransition:
        begin = self.take("on")
        kind = self.texts[self.place]
        if kind not in _RESULT_KINDS:
            raise self.fault(*(f"'{word}'" for word in _RESULT_KINDS))
        self.place += 1
        index = self.place
        preposition = self.texts[index]
        if preposition not in ("from", "to"):
            raise self.fault("'from'", "'to'")
        self.place += 1
        communication = self.name()
        updates: list[syntax.Update] = []
        self._no_condition(kind)
        if self.takes("do"):
            updates.append(self._update())
            while self.takes(","):
                updates.append(self._update())
        self._no_condition(kind)
        target = self.name() if self.takes("goto") else None
        self._no_condition(kind)
        name = syntax.Name(preposition, self.at(index))
        return syntax.CommunicationTransition(kind, name, communication, tuple(updates), target, self.since(begin))

    def _update(self) -> syntax.Update:
        begin = self.place
        target = self.access()
        self.require_shallow(target, begin)
        index = self.place
        if self.texts[index] == ":=":
            self.place += 1
            return syntax.Update(target, self.expression())
        if self.texts[index] in ("+", "-", "*", "/") and self.texts[index + 1] == "=":
            sign = self.texts[index]
            raise self._assigned(2, f":= {self.source(begin)} {sign}")
        if self.texts[index] in ("+", "-") and self.texts[index + 1] == self.texts[index]:
            raise self._assigned(2, f":= {self.source(begin)} {self.texts[index]} 1")
        if self.texts[index] in ("=", ":"):
            raise self._assigned(2 if self.texts[index + 1] == "=" else 1, ":=")
        raise self.fault("':='")

    def _assigned(self, tokens: int, meant: str) -> Fault:
        """Return the error that an update is written as another language has it."""
        begin = self.place
        self.place += tokens
        written, place = self.source(begin), self.since(begin)
        message = f"{shown(written)} does not fit here; expected ':='"
        self.report("syntax-error", message, place, f"Write '{meant}' instead of '{written}'.")
        return self.reported_fault()

    def _tau(self) -> syntax.TauTransition:
        place = self.at(self.take("transition"))
        guard = self.expression() if self.takes("if") else None
        begin = self.place
        target = self.name() if self.takes("goto") else None
        if guard is None and target is not None and self.texts[self.place] == "if":
            raise self._late_condition(begin)
        return syntax.TauTransition(guard, target, place)

    def _no_condition(self, kind: str) -> None:
        """Report a condition of a transition that takes none, and go on behind it."""
        begin = self.place
        if self.texts[begin] == "if":
            self.place += 1
            self.expression()
            message = "only 'transition' has a condition; what is sent and received has none here"
            fix = f"Remove the condition: {_NEEDED if kind == 'request' else _CHOSEN}"
            self.report("syntax-error", message, self.since(begin), fix)

    def _late_condition(self, begin: int) -> Fault:
        """Return the error that the condition of a transition stands behind its `goto`."""
        condition = self.place
        target = self._file.text[self._starts[begin] : self._starts[condition]].strip()
        self.place += 1
        self.expression()
        message = "the condition of a transition stands before 'goto'"
        fix = f"Write '{self.source(condition)} {target}' instead of '{self.source(begin)}'."
        self.report("syntax-error", message, self.since(begin), fix)
        return self.reported_fault()

    # Requirements and data

    def _requirement(self) -> syntax.Requirement | syntax.Invariant:
        begin = self.take("requirement")
        place = self.at(begin)
        word = self.texts[self.place]
        if word in ("always", "never") and not self.begins_with_name("disables"):
            self.place += 1
            return syntax.Invariant(word == "never", self.expression(), place)
        if self.texts[self.place] == "{" or self.texts[self.place + 1] == "needs":
            names = self.names()
            self.take("needs")
            return syntax.Requirement(names, False, self.expression(), place)
        if self.kinds[self.place] == _NAME:
            if self.texts[self.place + 1] == ",":
                raise self.fault("'{'", fix="Write '{' before it.")
            self.possible("'needs'", ahead=1)
        expression = self.expression()
        self.take("disables")
        return syntax.Requirement(self.names(), True, expression, place)

    def _provide(self) -> syntax.Provide:
        place = self.at(self.take("provide"))
        communication = self.name()
        self.take("with")
        value = self._provided()
        condition = self.expression() if self.takes("if") else None
        return syntax.Provide(communication, value, condition, place)

    def _provided(self) -> syntax.ObjectValue | syntax.Expression:
        begin = self.place
        if self.texts[begin] != "{":
            if self.kinds[begin] == _NAME and self.texts[begin + 1] == ":":
                raise self.fault("'{'", fix="Write '{' before it.")
            return self.expression()
        return syntax.ObjectValue(self._properties(self._provided), self.since(begin))

    def _limit(self) -> syntax.Limit:
        begin = self.place
        place = self.at(self.take("limit"))
        communication = self.name()
        dot = self.place
        path = tuple(self._path())
        self._take_behind(dot if path else None, "to")
        first = self.place
        range_ = self._range()
        if path:
            nested: _Nested = {}
            _nest(nested, path, self.text_since(first))
            meant = f"limit {self.texts[dot - 1]} to {_nested_text(nested)}"
            raise self._not_nested(dot, meant, self.text_since(begin))
        condition = self.expression() if self.takes("if") else None
        return syntax.Limit(communication, range_, condition, place)

    def _range(self) -> syntax.ObjectRange | syntax.Range:
        begin = self.place
        if self.texts[begin] != "{":
            if self.kinds[begin] == _NAME and self.texts[begin + 1] == ":":
                raise self.fault("'{'", fix="Write '{' before it.")
            low = self.expression()
            self.take("..")
            return syntax.Range(low, self.expression(), self.since(begin))
        return syntax.ObjectRange(self._properties(self._range), self.since(begin))

    def _properties[Node](self, read: Callable[[], Node]) -> tuple[tuple[syntax.Name, Node], ...]:
        """Read the properties of an object in braces, each with what stands behind its colon."""
        begin = self.place
        self.place += 1
        self.deeper(begin)
        properties: list[tuple[syntax.Name, Node]] = []
        nested: _Nested = {}
        dot = None
        while self.texts[self.place] != "}" or properties:
            name = self.name()
            word, end = self.texts[self.place - 1], self.place
            path = (word, *self._path())
            self._take_behind(end if len(path) > 1 else None, ":")
            if dot is None and len(path) > 1:
                dot = end
            first = self.place
            properties.append((name, read()))
            _nest(nested, path, self.text_since(first))
            if not self.takes(","):
                break
        self.take("}")
        self.shallower()
        if dot is not None:
            raise self._not_nested(dot, _nested_text(nested), self.text_since(begin))
        return tuple(properties)

    def _path(self) -> Iterator[str]:
        """Read the further names of a path, which other languages have for the property of a property."""
        while self.kinds[self.place + 1] == _NAME and self.takes("."):
            self.name()
            yield self.texts[self.place - 1]

    def _take_behind(self, dot: int | None, text: str) -> None:
        """Read a sign or word; where it does not stand behind a path that begins at a dot, the dot is at fault."""
        if dot is not None and self.texts[self.place] != text:
            self.place = dot
        self.take(text)

    def _not_nested(self, dot: int, meant: str, written: str) -> Fault:
        """Report a path where objects are nested; raise what is returned."""
        self.report(
            "syntax-error",
            "'.' does not fit here: an object in braces stands for each property that has properties",
            self.at(dot),
            f"Write '{meant}'" + ("." if "\n" in written else f" instead of '{written}'."),
        )
        return self.reported_fault()


def _nest(nested: _Nested, path: Sequence[str], text: str) -> None:
    """Put the text behind a path where objects are nested."""
    first, *rest = path
    inner = nested.setdefault(first, {})
    if not rest or isinstance(inner, str):
        nested[first] = " ".join(text.split())
    else:
        _nest(inner, rest, text)


def _nested_text(nested: _Nested | str) -> str:
    if isinstance(nested, str):
        return nested
    return "{ " + ", ".join(f"{name}: {_nested_text(inner)}" for name, inner in nested.items()) + " }"


class _WithList(msgspec.Struct, frozen=True):
    """Content of a `with` list."""

    identifier: syntax.Text | None
    types: dict[str, syntax.Type]
    options: tuple[syntax.Option, ...]
    link: syntax.Name | None
