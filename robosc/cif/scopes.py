"""Scopes of a specification: files merged, definitions instantiated, and names looked up in them.

Components and instances are both a `Scope`. The body of a definition becomes one scope for each instance. Names in the
body are looked up at the definition, and names in the arguments at the instance.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from robosc.cif import syntax
from robosc.errors import RelatedPlace
from robosc.model.findings import Findings, did_you_mean
from robosc.source import Location

MAXIMUM_INSTANCES = 20_000
"""Instances of definitions beyond which a specification is refused."""

type Declared = (
    syntax.TypeDeclaration
    | syntax.Enum
    | syntax.Event
    | syntax.Constant
    | syntax.Algebraic
    | syntax.Input
    | syntax.Discrete
    | syntax.Continuous
    | syntax.Function
    | syntax.LocationDeclaration
    | syntax.Invariant
)


@dataclass(eq=False, slots=True)
class Entity:
    """A declaration in its scope.

    Attributes:
        declaration: Its declaration.
        scope: Scope that it stands in.
        identifier: Its name, which for a literal of an enum is that of the literal.
        value: Value of an algebraic parameter.
        value_scope: Scope in which that value was written.
    """

    declaration: Declared
    scope: "Scope"
    identifier: syntax.Identifier
    value: syntax.Expression | None = None
    value_scope: "Scope | None" = None

    @property
    def name(self) -> str:
        """Absolute name."""
        return self.scope.absolute(self.identifier.text)

    @property
    def at(self) -> Location:
        """Place of the name."""
        return self.identifier.at

    @property
    def is_literal(self) -> bool:
        """True for a literal of an enum."""
        return isinstance(self.declaration, syntax.Enum) and self.identifier is not self.declaration.name

    @property
    def kind(self) -> str:
        """Kind of thing, in words."""
        if self.is_literal:
            return "an enum's literal"
        return _KINDS[type(self.declaration)]


_KINDS: dict[type, str] = {
    syntax.TypeDeclaration: "a type",
    syntax.Enum: "an enum",
    syntax.Event: "an event",
    syntax.Constant: "a constant",
    syntax.Algebraic: "an algebraic variable",
    syntax.Input: "an input variable",
    syntax.Discrete: "a discrete variable",
    syntax.Continuous: "a continuous variable",
    syntax.Function: "a function",
    syntax.LocationDeclaration: "a location",
    syntax.Invariant: "an invariant",
}


@dataclass(eq=False, slots=True)
class Definition:
    """A definition of components.

    Attributes:
        component: The definition.
        scope: Scope that it stands in.
        is_used: True once it is instantiated.
    """

    component: syntax.Component
    scope: "Scope"
    is_used: bool = False
    kind = "a definition"

    @property
    def at(self) -> Location:
        """Place of its name."""
        return self.component.name.at


@dataclass(eq=False, slots=True)
class PendingInstance:
    """An instance whose scope is made on first use."""

    instance: syntax.Instance
    container: "Scope"
    made: "Scope | None" = None
    has_failed: bool = False
    is_being_made: bool = False
    kind = "a component"

    @property
    def at(self) -> Location:
        """Place of its name."""
        return self.instance.name.at


@dataclass(eq=False, slots=True)
class Alias:
    """A parameter that stands for something declared elsewhere, found on first use."""

    parameter: syntax.Parameter
    argument: syntax.Expression
    argument_scope: "Scope"
    scope: "Scope"
    target: "Item | None" = None
    is_resolved: bool = False
    kind = "a parameter"

    @property
    def at(self) -> Location:
        """Place of its name."""
        return self.parameter.name.at


@dataclass(eq=False, slots=True)
class Scope:
    """A component: the specification, a group, an automaton, or an instance of a definition.

    Attributes:
        path: Absolute name; empty for the specification.
        parent: Scope around the text of the component.
        at: Place of its name.
        is_automaton: True for an automaton.
        role: Role of an automaton.
        definition: Definition that it is an instance of.
        ancestry: Definitions of all instances that it stands in.
        entries: Names declared in it.
        parameters: Names of its parameters.
        body: Declarations in order, those of merged groups one after the other.
        is_real: False in a definition that is checked without an instance.
        is_function: True for a function, which uses its own variables, constants, types and functions alone.
        files: Files that have a part of a group.
    """

    path: str
    parent: "Scope | None"
    at: Location
    is_automaton: bool = False
    role: str | None = None
    definition: Definition | None = None
    ancestry: tuple[syntax.Component, ...] = ()
    entries: "dict[str, Item | Alias | PendingInstance]" = field(default_factory=dict)
    parameters: set[str] = field(default_factory=set)
    body: list[syntax.Declaration] = field(default_factory=list)
    is_real: bool = True
    is_function: bool = False
    files: set[str] = field(default_factory=set)

    @property
    def kind(self) -> str:
        """Kind of thing, in words."""
        return "an automaton" if self.is_automaton else "a group"

    def absolute(self, name: str) -> str:
        """Absolute name of something declared here."""
        return f"{self.path}.{name}" if self.path else name

    @property
    def root(self) -> "Scope":
        """The scope that `.x` is looked up in: the nearest definition around it, else the specification."""
        found = self
        while found.definition is None and found.parent is not None:
            found = found.parent
        return found


type Item = Entity | Definition | Scope


def allows(parameter: syntax.Parameter, use: str) -> bool:
    """Return True if the flags of an event parameter allow a use: `!`, `?`, or `~` for events without either."""
    if parameter.type is None:
        return use == "~"
    return not parameter.flags or use in parameter.flags


class Scopes:
    """All scopes of a specification.

    Attributes:
        findings: Findings so far.
        root: The specification.
    """

    def __init__(self, files: tuple[syntax.Specification, ...], findings: Findings) -> None:
        self.findings = findings
        self.root = Scope("", None, Location(files[0].file, 1, 1))
        self._instances = 0
        self._definitions: list[Definition] = []
        for file in files:
            self._declare(self._namespace(file), tuple(item for item in file.body))
        self._force(self.root)
        for definition in list(self._definitions):
            if not definition.is_used:
                self._look_at(definition)

    # Declaring

    def _namespace(self, file: syntax.Specification) -> Scope:
        """The scope of a file's content."""
        found = [item for item in file.body if isinstance(item, syntax.Namespace)]
        for item in found[1:]:
            self._error("cif-structure", "the file has two namespaces", item.name.at, "Remove one of them.")
        scope = self.root
        for part in found[0].name.parts if found else ():
            scope = self._group(scope, syntax.Identifier(part, found[0].name.at)) or scope
        return scope

    def _declare(self, scope: Scope, body: tuple[syntax.Declaration, ...]) -> None:
        scope.body.extend(body)
        for item in body:
            match item:
                case syntax.Enum():
                    self._add(scope, item.name, Entity(item, scope, item.name))
                    for literal in item.literals:
                        self._add(scope, literal, Entity(item, scope, literal))
                case syntax.Component(parameters=None):
                    self._component(scope, item)
                case syntax.Component():
                    definition = Definition(item, scope)
                    self._check_flags(item)
                    self._definitions.append(definition)
                    self._add(scope, item.name, definition)
                case syntax.Instance():
                    self._add(scope, item.name, PendingInstance(item, scope))
                case syntax.LocationDeclaration():
                    for invariant in item.invariants:
                        if invariant.name is not None:
                            self._add(scope, invariant.name, Entity(invariant, scope, invariant.name))
                    if item.name is not None:
                        self._add(scope, item.name, Entity(item, scope, item.name))
                case (
                    syntax.TypeDeclaration()
                    | syntax.Event()
                    | syntax.Constant()
                    | syntax.Algebraic()
                    | syntax.Input()
                    | syntax.Discrete()
                    | syntax.Continuous()
                    | syntax.Function()
                ):
                    self._add(scope, item.name, Entity(item, scope, item.name))
                case syntax.Invariant(name=syntax.Identifier() as name):
                    self._add(scope, name, Entity(item, scope, name))
                case _:
                    pass

    def _check_flags(self, item: syntax.Component) -> None:
        """Report flags of event parameters that mean nothing."""
        for parameter in item.parameters or ():
            name, flags = parameter.name, parameter.flags
            if len(set(flags)) < len(flags):
                self._error("cif-structure", f"'{name.text}' has a flag twice", name.at, "Write each flag once.")
            if flags and parameter.type is None:
                self._error("cif-structure", f"'{name.text}' has flags, and is no channel", name.at,
                            "Remove them, or write the type of its data before the name.")  # fmt: skip

    def _component(self, scope: Scope, item: syntax.Component) -> None:
        if not item.is_automaton:
            group = self._group(scope, item.name)
            if group is not None:
                self._declare(group, item.body)
            return
        made = Scope(scope.absolute(item.name.text), scope, item.name.at, is_automaton=True, role=item.role)
        made.ancestry, made.is_real = scope.ancestry, scope.is_real
        self._add(scope, item.name, made)
        self._declare(made, item.body)

    def _group(self, scope: Scope, name: syntax.Identifier) -> Scope | None:
        """A new group, or the one of that name of another file, with which it is merged."""
        known = scope.entries.get(name.text)
        is_group = isinstance(known, Scope) and not known.is_automaton and known.definition is None
        if isinstance(known, Scope) and is_group and name.at.file not in known.files:
            known.files.add(name.at.file)
            return known
        made = Scope(scope.absolute(name.text), scope, name.at, ancestry=scope.ancestry, is_real=scope.is_real)
        made.files.add(name.at.file)
        self._add(scope, name, made)
        return made

    def _add(self, scope: Scope, name: syntax.Identifier, item: "Item | Alias | PendingInstance") -> None:
        known = scope.entries.get(name.text)
        if known is not None:
            self.findings.error(
                "cif-duplicate-name",
                f"there is already {known.kind} '{name.text}' here",
                name.at,
                "Rename one of the two.",
                RelatedPlace("the other one", known.at),
            )
            return
        scope.entries[name.text] = item

    # Instances

    def _force(self, scope: Scope) -> None:
        """Make every instance below a scope."""
        stack = [scope]
        while stack:
            for item in list(stack.pop().entries.values()):
                made = self._made(item) if isinstance(item, PendingInstance) else item
                if isinstance(made, Scope):
                    stack.append(made)

    def _made(self, item: PendingInstance) -> Scope | None:
        """The scope of an instance; None if there is none, which has been reported."""
        if item.is_being_made:
            name = item.instance.definition
            self._error("cif-cycle", f"what '{name}' means depends on '{item.instance.name.text}' itself", name.at,
                        "Name a definition.")  # fmt: skip
        elif item.made is None and not item.has_failed:
            item.is_being_made = True
            item.made = self._instantiated(item)
            item.is_being_made, item.has_failed = False, item.made is None
        return item.made

    def _instantiated(self, item: PendingInstance) -> Scope | None:
        instance, container = item.instance, item.container
        definition = self.resolve(instance.definition, container)
        if definition is None:
            return None
        if not isinstance(definition, Definition):
            self._wrong_kind(instance.definition, definition, "a definition")
            return None
        definition.is_used = definition.is_used or container.is_real
        if definition.component in container.ancestry:
            self._error("cif-cycle", f"'{instance.definition}' is instantiated in itself", instance.definition.at,
                        "Move the instance out of the definition.")  # fmt: skip
            return None
        self._instances += 1
        if self._instances > MAXIMUM_INSTANCES:
            if self._instances == MAXIMUM_INSTANCES + 1:
                self._error("cif-too-large", f"there are more than {MAXIMUM_INSTANCES} instances", instance.name.at,
                            "Instantiate fewer definitions.")  # fmt: skip
            return None
        scope = self._new_scope(definition, container.absolute(instance.name.text), instance.name.at, container)
        parameters = definition.component.parameters or ()
        if len(parameters) != len(instance.arguments):
            self._error(
                "cif-arguments",
                f"'{instance.definition}' takes {len(parameters)} arguments, and is given {len(instance.arguments)}",
                instance.name.at,
                f"Give it {len(parameters)} arguments.",
            )
            return None
        for parameter, argument in zip(parameters, instance.arguments, strict=True):
            scope.parameters.add(parameter.name.text)
            entry: Entity | Alias
            if parameter.kind is syntax.ParameterKind.ALGEBRAIC:
                entry = self._algebraic(parameter, scope, argument, container)
            else:
                entry = Alias(parameter, argument, container, scope)
            self._add(scope, parameter.name, entry)
        self._declare(scope, definition.component.body)
        return scope

    def _new_scope(self, definition: Definition, path: str, at: Location, container: Scope) -> Scope:
        component = definition.component
        return Scope(
            path,
            definition.scope,
            at,
            is_automaton=component.is_automaton,
            role=component.role,
            definition=definition,
            ancestry=(*container.ancestry, component),
            is_real=container.is_real,
        )

    def _algebraic(
        self, parameter: syntax.Parameter, scope: Scope, value: syntax.Expression | None, value_scope: Scope
    ) -> Entity:
        assert parameter.type is not None  # noqa: S101 - an algebraic parameter has a type
        declaration = syntax.Algebraic(parameter.name, parameter.type, None)
        return Entity(declaration, scope, parameter.name, value, value_scope)

    def _look_at(self, definition: Definition) -> None:
        """Make a scope of a definition without an instance, so that it is checked, too."""
        if definition.component in definition.scope.ancestry:
            return
        scope = self._new_scope(definition, definition.scope.absolute(definition.component.name.text),
                                definition.at, definition.scope)  # fmt: skip
        scope.is_real = False
        for parameter in definition.component.parameters or ():
            scope.parameters.add(parameter.name.text)
            self._add(scope, parameter.name, self._stand_in(parameter, scope))
        self._declare(scope, definition.component.body)
        self._force(scope)
        self.root.entries[f"definition {len(self.root.entries)}"] = scope

    def _stand_in(self, parameter: syntax.Parameter, scope: Scope) -> "Item | Alias | PendingInstance":
        """Return a stand-in of the parameter's kind."""
        match parameter.kind:
            case syntax.ParameterKind.ALGEBRAIC:
                return self._algebraic(parameter, scope, None, scope)
            case syntax.ParameterKind.EVENT:
                event = syntax.Event(parameter.name, parameter.is_controllable, parameter.type)
                return Entity(event, scope, parameter.name)
            case syntax.ParameterKind.LOCATION:
                place = syntax.LocationDeclaration(parameter.name, (), (), (), (), parameter.name.at)
                return Entity(place, scope, parameter.name)
        assert scope.parent is not None  # noqa: S101 - a definition stands somewhere
        found = self._definition(parameter, scope)
        if found is None or found.component in scope.ancestry:
            return Scope(parameter.name.text, scope.parent, parameter.name.at, is_real=False)
        made = self._new_scope(found, scope.absolute(parameter.name.text), parameter.name.at, scope)
        for inner in found.component.parameters or ():
            made.parameters.add(inner.name.text)
            self._add(made, inner.name, self._stand_in(inner, made))
        self._declare(made, found.component.body)
        return made

    # Looking up

    def _definition(self, parameter: syntax.Parameter, scope: Scope) -> Definition | None:
        """Return what a component parameter of an instance must be an instance of, which an instance may hold."""
        assert parameter.definition is not None  # noqa: S101 - a component's parameter names a definition
        assert scope.parent is not None  # noqa: S101 - a definition stands somewhere
        found = self.resolve(parameter.definition, scope.parent, is_type=True)
        if found is not None and not isinstance(found, Definition):
            self._wrong_kind(parameter.definition, found, "a definition")
            return None
        return found

    def parameter(self, name: syntax.Name, scope: Scope) -> tuple[syntax.Parameter | None, "Scope | None"]:
        """Return the parameter that a name is, and the scope that its type is written in; None if it is none."""
        if len(name.parts) > 1 or name.root is syntax.Root.SPECIFICATION:
            return None, None
        found: Scope | None = scope.root if name.root is syntax.Root.SCOPE else scope
        while found is not None and name.parts[0] not in found.entries:
            found = found.parent
        if found is None or found.definition is None or name.parts[0] not in found.parameters:
            return None, None
        parameters = found.definition.component.parameters or ()
        return next(item for item in parameters if item.name.text == name.parts[0]), found.parent

    def resolve(self, name: syntax.Name, scope: Scope, *, is_type: bool = False) -> "Item | None":
        """Return what a name means where it is written; None if nothing, which has been reported.

        Args:
            name: The name.
            scope: Scope that it is written in.
            is_type: True for what a parameter is an instance of: that alone may be a definition in an instance.
        """
        first, *others = name.parts
        if name.root is syntax.Root.SPECIFICATION:
            start: Scope | None = self.root
        elif name.root is syntax.Root.SCOPE:
            start = scope.root
        else:
            start = scope
            while start is not None and first not in start.entries:
                start = start.parent
        if start is None or first not in start.entries:
            self._unknown(first, name, scope)
            return None
        found = self._target(start.entries[first])
        through_instance = False
        for part in others:
            if found is None:
                return None
            if not isinstance(found, Scope):
                self._unknown(part, name, None)
                return None
            through_instance = through_instance or found.definition is not None
            entry = None if part in found.parameters else found.entries.get(part)
            if entry is None or (isinstance(entry, Definition) and through_instance and not is_type):
                self._unknown(part, name, found)
                return None
            found = self._target(entry)
        return found

    def _target(self, entry: "Item | Alias | PendingInstance") -> "Item | None":
        if isinstance(entry, PendingInstance):
            return self._made(entry)
        if isinstance(entry, Alias):
            if not entry.is_resolved:
                entry.is_resolved = True
                entry.target = self._argument(entry)
            return entry.target
        return entry

    def _argument(self, alias: Alias) -> "Item | None":
        """The thing that is given for a parameter, if it is of its kind."""
        argument, parameter = alias.argument, alias.parameter
        wanted = {"event": "an event", "location": "a location", "component": "an instance"}[parameter.kind]
        if not isinstance(argument, syntax.Name):
            at = argument.at
            self._error("cif-arguments", f"'{parameter.name.text}' takes {wanted}", at, f"Give the name of {wanted}.")
            return None
        found = self.resolve(argument, alias.argument_scope)
        if found is None:
            return None
        if parameter.kind is syntax.ParameterKind.COMPONENT:
            definition = self._definition(parameter, alias.scope)
            if definition is None:
                return None
            made_from = found.definition if isinstance(found, Scope) else None
            # Each instance around a definition has one of its own.
            if made_from is not None and made_from.component is definition.component:
                return found
            self._error("cif-arguments", f"'{argument}' is not an instance of '{parameter.definition}'", argument.at,
                        f"Give an instance of '{parameter.definition}'.")  # fmt: skip
            return None
        expected = syntax.Event if parameter.kind is syntax.ParameterKind.EVENT else syntax.LocationDeclaration
        if not isinstance(found, Entity) or not isinstance(found.declaration, expected):
            self._error("cif-arguments", f"'{argument}' is {found.kind}, and '{parameter.name.text}' takes {wanted}",
                        argument.at, f"Give the name of {wanted}.")  # fmt: skip
            return None
        return found

    def function(self, item: syntax.Function, scope: Scope) -> Scope:
        """The scope of a function's parameters and variables."""
        made = Scope(scope.absolute(item.name.text), scope, item.name.at, is_real=False, is_function=True)
        for name, type_ in (*item.parameters, *((name, type_) for name, type_, _ in item.variables)):
            self._add(made, name, Entity(syntax.Discrete(name, type_, (), is_any=False), made, name))
        return made

    def target(self, entry: "Item | Alias | PendingInstance") -> "Item | None":
        """The thing that an entry of a scope stands for."""
        return self._target(entry)

    def _unknown(self, part: str, name: syntax.Name, scope: Scope | None) -> None:
        known: set[str] = set()
        while scope is not None:
            known.update(key for key in scope.entries if " " not in key and key != part)
            scope = scope.parent if len(name.parts) == 1 or part == name.parts[0] else None
        near = did_you_mean(part, known)
        whole = f" of '{name}'" if len(name.parts) > 1 else ""
        hint = f"; did you mean '{near}'?" if near else ""
        fix = f"Write '{near}'." if near else f"Declare '{part}', or use a name that is there."
        self._error("cif-unknown-name", f"unknown name '{part}'{whole}{hint}", name.at, fix)

    def wrong_kind(self, name: syntax.Name, found: "Item", wanted: str) -> None:
        """Report that a name means something of another kind than is needed."""
        self._wrong_kind(name, found, wanted)

    def _wrong_kind(self, name: syntax.Name, found: "Item", wanted: str) -> None:
        self._error(
            "cif-wrong-kind", f"'{name}' is {found.kind}, not {wanted}", name.at, f"Write the name of {wanted}."
        )

    def _error(self, code: str, message: str, location: Location, fix: str) -> None:
        self.findings.error(code, message, location, fix)

    def scopes(self) -> Iterator[Scope]:
        """Every scope, outer ones before inner ones, in order of declaration."""
        stack = [self.root]
        while stack:
            scope = stack.pop()
            yield scope
            inner = []
            for entry in scope.entries.values():
                made = entry.made if isinstance(entry, PendingInstance) else entry
                if isinstance(made, Scope) and made is not scope and entry.__class__ is not Alias:
                    inner.append(made)
            stack += reversed(inner)
