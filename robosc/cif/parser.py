"""CIF text to syntax tree, by recursive descent: the language needs at most two tokens of look-ahead.

Tests compare the parser with textX and the grammar `tests/support/cif_language.tx`. textX needs 0.13 s to start and
0.19 s to accept or reject a model of 36 kB, where this parser takes 0.01 s for the whole tree. textX reports only the
first error of a text, and takes exponential time for nested braces unless it remembers every result. The present
distribution of Lark cannot be installed beside the older one that ROS 2 needs: both are the module `lark`.

After a syntax error in a declaration the parser continues with the next declaration, so that one run reports all
errors. After an error in the head of a component it stops, because the rest would be misread.
"""

from collections.abc import Callable
from functools import partial

from robosc.cif import syntax
from robosc.cif.cursor import Fault, Stop
from robosc.cif.function_parser import FunctionParser
from robosc.cif.reserved_words import INPUT_OUTPUT, ROLES
from robosc.cif.tokens import Kind
from robosc.errors import LanguageError
from robosc.language.limits import MAXIMUM_NESTING
from robosc.recursion import allow_depth
from robosc.source import SourceFile

_NAME, _ANNOTATION, _END = int(Kind.NAME), int(Kind.ANNOTATION), int(Kind.END)
_EVENT_WORDS = frozenset({"event", "controllable", "uncontrollable"})
_DECLARATIONS = frozenset(
    """
    type enum event controllable uncontrollable const alg input cont equation initial marked invariant plant requirement
    supervisor
    """.split()
)
_BODY = _DECLARATIONS | INPUT_OUTPUT | {"alphabet", "monitor", "disc", "location"}
"""Words that begin what stands in an automaton, none of which can begin an invariant's predicate."""

_ELEMENTS = frozenset({"initial", "marked", "urgent", "equation", "invariant", "edge"}) | ROLES

Declarations = tuple[syntax.Declaration, ...]


def parse(file: SourceFile) -> syntax.Specification:
    """The syntax tree of a file.

    Raises:
        LanguageError: It has syntax errors.
    """
    allow_depth(MAXIMUM_NESTING, 16)
    parser = Parser(file)
    body = parser.specification()
    if parser.diagnostics:
        raise LanguageError(parser.diagnostics)
    return syntax.Specification(file.name, body)


class Parser(FunctionParser):
    """Parser of a file."""

    def specification(self) -> Declarations:
        """Read the whole file; what comes of it is of use only if there are no findings."""
        try:
            self.annotations("@@")
            body = self._group_body(is_file=True)
            if self.kinds[self.place] != _END:
                self._head_fault("a declaration")
            return body
        except (Fault, Stop):
            return ()

    # Lists of declarations

    def _head_fault(self, expected: str) -> None:
        """Report that a component cannot be read on.

        Raises:
            Stop: Always.
        """
        self.fault(expected)
        raise Stop

    def _guarded[Item](self, read: Callable[[], Item]) -> Item | None:
        """Read a declaration; behind a syntax error in it, go on behind its semicolon."""
        depth = self.depth
        try:
            return read()
        except Fault:
            self.back_to(depth)
        if self.sees("end"):
            return None
        while not self.takes(";"):
            if self.kinds[self.place] == _END or self.sees("end"):
                raise Stop
            self.place += 1
        return None

    def _group_body(self, *, is_file: bool) -> Declarations:
        found: list[syntax.Declaration] = []
        while self.kinds[self.place] != _END and not self.sees("end"):
            if is_file and self.texts[self.place] in ("import", "namespace"):
                found += self._guarded(self._file_declaration) or ()
            else:
                found += self._guarded(self._group_declaration) or ()
        return tuple(found)

    def _file_declaration(self) -> Declarations:
        if self.takes("namespace"):
            name = self.name()
            if name.root is not syntax.Root.HERE:
                self.report("a namespace is a plain name", name.at, "Remove the sign before it.")
            self.take(";")
            return (syntax.Namespace(name),)
        self.take("import")
        found = []
        while True:
            at = self.here
            found.append(syntax.Import(self.string(), at))
            if not self.takes(","):
                break
        self.take(";")
        return tuple(found)

    def _group_declaration(self) -> Declarations:
        self.annotations("@")
        word, following = self.texts[self.place], self.texts[self.place + 1]
        if self.kinds[self.place] == _NAME:
            return (self._instance(),)
        if word == "func":
            return (self.function(),)
        if word == "group":
            return (self._component(),)
        if word == "automaton" or (word in ROLES and (following in ("automaton", "def") or self._is_automaton())):
            return (self._component(),)
        return self._declaration("a declaration")

    def _is_automaton(self) -> bool:
        """Return True if `plant x:` opens an automaton, not an invariant called x, by the token after the colon."""
        kinds, texts, place = self.kinds, self.texts, self.place
        if kinds[place + 1] != _NAME or texts[place + 2] != ":":
            return False
        return texts[place + 3] in _BODY or kinds[place + 3] == _ANNOTATION

    def _instance(self) -> syntax.Instance:
        name = self.identifier()
        self.take(":")
        definition = self.name()
        self.take("(")
        arguments = self.expressions_up_to(")")
        self.take(";")
        return syntax.Instance(name, definition, arguments)

    def _component(self) -> syntax.Component:
        """Read a group or automaton, or the definition of one."""
        try:
            role = self.texts[self.place] if self.texts[self.place] in ROLES else None
            if role is not None:
                self.place += 1
            is_automaton = not self.takes("group")
            if is_automaton and not self.takes("automaton") and role is None:
                raise self.fault("'automaton'")
            is_definition = self.takes("def")
            name = self.identifier()
            parameters = self._parameters() if is_definition else None
            self.take(":")
        except Fault:
            raise Stop from None
        self.deeper()
        body = self._automaton_body() if is_automaton else self._group_body(is_file=False)
        self.shallower()
        if not self.takes("end"):
            self._head_fault("a declaration or 'end'")
        return syntax.Component(name, is_automaton, role, parameters, body)

    def _automaton_body(self) -> Declarations:
        found: list[syntax.Declaration] = []
        has_location = False
        while not self.sees("end"):
            if self.kinds[self.place] == _END:
                self._head_fault("'end'")
            begin = self.place
            read = partial(self._automaton_declaration, has_location=has_location)
            items = self._guarded(read) or ()
            has_location = has_location or "location" in self.texts[begin : self.place]
            found += items
        if not has_location:
            self._head_fault("a location")
        return tuple(found)

    def _automaton_declaration(self, *, has_location: bool) -> Declarations:
        self.annotations("@")
        word = self.texts[self.place]
        if word == "location":
            return (self._location(),)
        if has_location and word not in INPUT_OUTPUT:
            raise self.fault("a location or 'end'", "Put declarations before the first location.")
        if word in ("alphabet", "monitor"):
            at = self.at(self.take(word))
            events = () if self.sees(";") else self.names()
            self.take(";")
            return (syntax.Alphabet(word, events, at),)
        if word == "disc":
            return self._discrete()
        return self._declaration("a declaration or a location")

    # Declarations

    def _declaration(self, expected: str) -> Declarations:
        word = self.texts[self.place]
        if word in _EVENT_WORDS:
            return self._events()
        if word in INPUT_OUTPUT:
            return (self._input_output(),)
        if word == "invariant" or word in ROLES:
            return self._invariants()
        if word in ("initial", "marked"):
            found = self._predicates()
            if not found.predicates:
                self.report(f"'{word}' of a component needs a predicate", found.at, f"Write one behind '{word}'.")
            return (found,)
        if word == "equation":
            return self._equations()
        reader = {
            "type": self._type_declarations,
            "enum": self._enum,
            "const": self._constants,
            "alg": self._algebraic,
            "input": self._inputs,
            "cont": self._continuous,
        }.get(word)
        if reader is None:
            raise self.fault(expected)
        self.place += 1
        return reader()

    def _listed[Item](self, read: Callable[[], Item]) -> tuple[Item, ...]:
        """Read items with commas between them, and a semicolon."""
        found = [read()]
        while self.takes(","):
            found.append(read())
        self.take(";")
        return tuple(found)

    def _type_declarations(self) -> Declarations:
        def one() -> syntax.Declaration:
            name = self.identifier()
            self.take("=")
            return syntax.TypeDeclaration(name, self.type())

        return self._listed(one)

    def _enum(self) -> Declarations:
        name = self.identifier()
        self.take("=")

        def literal() -> syntax.Identifier:
            self.annotations("@")
            return self.identifier()

        return (syntax.Enum(name, self._listed(literal)),)

    def _event_head(self) -> tuple[bool | None, syntax.Type | None]:
        """Read the words before the names of events: controllability, and the type of a channel's data."""
        controllability = {"controllable": True, "uncontrollable": False}.get(self.texts[self.place])
        if controllability is not None:
            self.place += 1
            self.takes("event")
        else:
            self.take("event")
        if self.sees("void"):
            at = self.at(self.take("void"))
            return controllability, syntax.Type("void", at)
        # `event a, b;` has no type; `event a b` is named b and has the type a.
        is_name = self.kinds[self.place] == _NAME and self.kinds[self.place + 1] != _NAME
        return controllability, None if is_name else self.type()

    def _events(self) -> Declarations:
        controllability, data = self._event_head()
        return self._listed(lambda: syntax.Event(self.identifier(), controllability, data))

    def _constants(self) -> Declarations:
        type_ = self.type()

        def one() -> syntax.Declaration:
            name = self.identifier()
            self.take("=")
            return syntax.Constant(name, type_, self.expression())

        return self._listed(one)

    def _algebraic(self) -> Declarations:
        type_ = self.type()

        def one() -> syntax.Declaration:
            name = self.identifier()
            return syntax.Algebraic(name, type_, self.expression() if self.takes("=") else None)

        return self._listed(one)

    def _inputs(self) -> Declarations:
        type_ = self.type()
        return self._listed(lambda: syntax.Input(self.identifier(), type_))

    def _discrete(self) -> Declarations:
        self.take("disc")
        type_ = self.type()

        def one() -> syntax.Declaration:
            name = self.identifier()
            if self.takes("="):
                return syntax.Discrete(name, type_, (self.expression(),), is_any=False)
            if not self.takes("in"):
                return syntax.Discrete(name, type_, (), is_any=False)
            if self.takes("any"):
                return syntax.Discrete(name, type_, (), is_any=True)
            self.take("{")
            values = self.expressions()
            self.take("}")
            return syntax.Discrete(name, type_, values, is_any=False)

        return self._listed(one)

    def _continuous(self) -> Declarations:
        def one() -> syntax.Declaration:
            name = self.identifier()
            value = self.expression() if self.takes("=") else None
            return syntax.Continuous(name, value, self.expression() if self.takes("der") else None)

        return self._listed(one)

    def _equations(self) -> tuple[syntax.Equation, ...]:
        self.take("equation")

        def one() -> syntax.Equation:
            name = self.identifier()
            is_derivative = self.takes("'")
            self.take("=")
            return syntax.Equation(name, is_derivative, self.expression())

        return self._listed(one)

    def _predicates(self) -> syntax.Predicates:
        word, at = self.texts[self.place], self.here
        self.place += 1
        predicates = () if self.sees(";") else self.expressions()
        self.take(";")
        return syntax.Predicates(word, predicates, at)

    def _input_output(self) -> syntax.InputOutput:
        word, at = self.texts[self.place], self.here
        while not self.takes(";"):
            if self.kinds[self.place] == _END:
                raise self.fault("';'")
            self.place += 1
        return syntax.InputOutput(word, at)

    # Invariants

    def _invariants(self) -> tuple[syntax.Invariant, ...]:
        role = self.texts[self.place] if self.texts[self.place] in ROLES else None
        if role is not None:
            self.place += 1
            self.takes("invariant")
        else:
            self.take("invariant")
        return self._listed(lambda: self._invariant(role))

    def _invariant(self, role: str | None) -> syntax.Invariant:
        name = None
        if self.kinds[self.place] == _NAME and self.texts[self.place + 1] == ":":
            name = self.identifier()
            self.take(":")
        at = self.here
        first = self.expression()
        if self.sees("needs"):
            events = self._event_set(first, name)
            self.take("needs")
            return syntax.Invariant(role, name, syntax.InvariantForm.NEEDS, events, self.expression(), at)
        if self.takes("disables"):
            place = self.place
            if self.takes("{"):
                events = self.names()
                self.take("}")
                self._refuse_name(name)
            else:
                events = (self.name(),)
            assert self.place > place  # noqa: S101 - an event was read
            return syntax.Invariant(role, name, syntax.InvariantForm.DISABLES, events, first, at)
        return syntax.Invariant(role, name, syntax.InvariantForm.STATE, (), first, at)

    def _event_set(self, events: syntax.Expression, name: syntax.Identifier | None) -> tuple[syntax.Name, ...]:
        """Return the events before `needs`, which were read as an expression."""
        if isinstance(events, syntax.Name):
            return (events,)
        if isinstance(events, syntax.Group) and events.kind == "set":
            found = tuple(item for item in events.items if isinstance(item, syntax.Name))
            if found and len(found) == len(events.items):
                self._refuse_name(name)
                return found
        raise self.fault("the end of the invariant", "Write an event, or events in braces, before 'needs'.")

    def _refuse_name(self, name: syntax.Identifier | None) -> None:
        if name is not None:
            self.report("an invariant of several events has no name", name.at, "Remove its name.")

    # Locations and edges

    def _location(self) -> syntax.LocationDeclaration:
        at = self.at(self.take("location"))
        name = self.identifier() if self.kinds[self.place] == _NAME else None
        if self.takes(";"):
            return syntax.LocationDeclaration(name, (), (), (), (), at)
        self.take(":")
        predicates: list[syntax.Predicates] = []
        equations: list[syntax.Equation] = []
        invariants: list[syntax.Invariant] = []
        edges: list[syntax.Edge] = []
        begin = self.place

        def element() -> None:
            is_annotated = self.kinds[self.place] == _ANNOTATION
            self.annotations("@@")
            word = self.texts[self.place]
            if word == "edge":
                edges.append(self._edge())
            elif word == "invariant" or word in ROLES:
                invariants.extend(self._invariants())
            elif is_annotated:
                raise self.fault("an edge or an invariant")
            elif word in ("initial", "marked"):
                predicates.append(self._predicates())
            elif word == "equation":
                equations.extend(self._equations())
            else:
                self.take("urgent")
                self.take(";")

        while self.texts[self.place] in _ELEMENTS or self.texts[self.place].startswith("@@"):
            self._guarded(element)
        if self.place == begin:
            raise self.fault("'initial', 'marked', 'edge' or an invariant", "Write ';' for a location without more.")
        return syntax.LocationDeclaration(
            name, tuple(predicates), tuple(equations), tuple(invariants), tuple(edges), at
        )

    def _edge(self) -> syntax.Edge:
        at = self.at(self.take("edge"))
        events: list[syntax.EdgeEvent] = []
        if self.texts[self.place] not in ("when", "now", "do"):
            events.append(self._edge_event())
            while self.takes(","):
                events.append(self._edge_event())
        guards = self.expressions() if self.takes("when") else ()
        self.takes("now")
        updates = self._updates() if self.takes("do") else ()
        target = self.identifier() if self.takes("goto") else None
        self.take(";")
        return syntax.Edge(tuple(events), guards, updates, target, at)

    def _edge_event(self) -> syntax.EdgeEvent:
        at = self.here
        if self.takes("tau"):
            return syntax.EdgeEvent(None, "", None, at)
        if self.kinds[self.place] != _NAME:
            raise self.fault("an event, 'when', 'now' or 'do'")
        name = self.name()
        if self.takes("?"):
            return syntax.EdgeEvent(name, "?", None, at)
        if not self.takes("!"):
            return syntax.EdgeEvent(name, "", None, at)
        is_bare = self.texts[self.place] in (",", "when", "now", "do", "goto", ";")
        return syntax.EdgeEvent(name, "!", None if is_bare else self.expression(), at)

    def _updates(self) -> tuple[syntax.Update, ...]:
        found = [self._update()]
        while self.takes(","):
            found.append(self._update())
        return tuple(found)

    def _update(self) -> syntax.Update:
        at = self.here
        if not self.sees("if"):
            address = self.address()
            self.take(":=")
            return syntax.Assignment(address, self.expression(), at)
        self.deeper()
        self.take("if")
        branches = [self._update_branch()]
        while self.takes("elif"):
            branches.append(self._update_branch())
        otherwise = self._updates() if self.takes("else") else ()
        self.take("end")
        self.shallower()
        return syntax.IfUpdate(tuple(branches), otherwise, at)

    def _update_branch(self) -> tuple[tuple[syntax.Expression, ...], tuple[syntax.Update, ...]]:
        guards = self.expressions()
        self.take(":")
        return guards, self._updates()

    # Definitions

    def _parameters(self) -> tuple[syntax.Parameter, ...]:
        self.take("(")
        found: list[syntax.Parameter] = []
        if self.takes(")"):
            return ()
        while True:
            found += self._parameter_group()
            if not self.takes(";"):
                break
        self.take(")")
        return tuple(found)

    def _parameter_group(self) -> list[syntax.Parameter]:
        """Read parameters of one kind."""
        self.annotations("@")
        word = self.texts[self.place]
        if word in _EVENT_WORDS:
            controllability, data = self._event_head()
            return self._event_parameters(controllability, data)
        if self.takes("location"):
            return [syntax.Parameter(syntax.ParameterKind.LOCATION, name) for name in self.identifiers()]
        if self.takes("alg"):
            type_ = self.type()
            return [syntax.Parameter(syntax.ParameterKind.ALGEBRAIC, name, type_) for name in self.identifiers()]
        if self.kinds[self.place] != _NAME:
            raise self.fault("a parameter")
        definition = self.name()
        kind = syntax.ParameterKind.COMPONENT
        return [syntax.Parameter(kind, name, definition=definition) for name in self.identifiers()]

    def _event_parameters(self, controllability: bool | None, data: syntax.Type | None) -> list[syntax.Parameter]:
        found = []
        while True:
            name = self.identifier()
            begin = self.place
            while self.texts[self.place] in ("!", "?", "~"):
                self.place += 1
            flags = "".join(self.texts[begin : self.place])
            found.append(syntax.Parameter(syntax.ParameterKind.EVENT, name, data, controllability, flags))
            if not self.takes(","):
                return found
