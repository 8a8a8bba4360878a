"""Random models without errors, as texts: what an author could write who knows the whole language.

Every expression is drawn by type, every name is one that is there, so that the checks find no error (warnings and
notes may occur). Names of part B, `^`, comments of both kinds, line ends and blanks are drawn too.
"""

from dataclasses import dataclass, field
from random import Random

from hypothesis import strategies as st

from robosc.language.tokens import Kind, tokenize
from robosc.source import Bundle, SourceFile
from support.failing import bundle_files, made

_STATES = ("idle", "busy", "^state", "always", "depth", "then_")
_VARIABLES = ("level", "^value", "never", "count", "max", "flag")
_GOAL_WORDS = ("allow", "always", "eventually", "goal", "leads", "once")
_MISSION_WORDS = ("anywhere", "mission", "over", "prefer", "then", "visit", "while")
_BLANKS = (" ", " ", " ", " ", "\n", "\n\n", "\t", "  ")
_COMMENTS = ("/* a } b */", "/**/", "// to the end {\n", "/* two\n lines */", "//\n")


def models(*, part_b: bool = True, goals: bool = False) -> st.SearchStrategy[Bundle]:
    """Bundles of a robot and perhaps a library that it imports from; the robot perhaps with goals and missions."""
    return st.integers(0, 2**32 - 1).map(lambda seed: random_bundle(seed, part_b=part_b, goals=goals))


def random_bundle(seed: int, *, part_b: bool = True, goals: bool = False) -> Bundle:
    """The bundle of a seed; with goals and missions it is the same but for them and the constants that they read."""
    dice = Random(seed)
    author = _Author(dice, part_b, goals)
    library = author.library() if dice.random() < 0.5 else None
    main = author.robot(library is not None)
    files = [] if library is None else [SourceFile("parts.rscd", relaid(library, dice))]
    bundle = Bundle(SourceFile("robot.rscd", relaid(main, dice)), tuple(files))
    made("random_bundle", seed, lambda: bundle_files(bundle))
    return bundle


def relaid(text: str, dice: Random) -> str:
    """The same tokens with other blanks and with comments between them."""
    tokens = tokenize(text)
    has_comments, end = dice.random() < 0.6, dice.choice(("\n", "\n", "\r\n"))
    parts: list[str] = []
    for token, kind in zip(tokens.texts, tokens.kinds, strict=True):
        if kind != Kind.END:
            comment = dice.choice(_COMMENTS) if has_comments and dice.random() < 0.05 else ""
            parts.append(f"{dice.choice(_BLANKS)}{comment}{token}")
    return "".join(parts).strip(" ").replace("\n", end) + end


@dataclass
class _Component:
    """Facts of a component that other parts of a model may refer to."""

    name: str
    states: list[str] = field(default_factory=list)
    variables: dict[str, str] = field(default_factory=dict)
    requests: dict[str, str] = field(default_factory=dict)


class _Author:
    """Author of one bundle.

    Args:
        dice: Source of chance that decides everything.
        part_b: True if the language's extensions are used.
        goals: True if the robot has goals, assumptions, missions and preferences.
    """

    def __init__(self, dice: Random, part_b: bool, goals: bool = False) -> None:
        self._dice = dice
        self._part_b = part_b
        self._has_goals = goals
        self._number = 0
        self._constants: dict[str, str] = {}
        self._components: list[_Component] = []

    def _chance(self, share: float) -> bool:
        return self._dice.random() < share

    def _extra(self, share: float) -> bool:
        """Return True if something of part B is to be written."""
        return self._part_b and self._chance(share)

    def _new(self, stem: str) -> str:
        self._number += 1
        return f"{stem}{self._number}"

    # Files

    def robot(self, has_library: bool) -> str:
        """A robot; one that has a library imports all its components."""
        parts = [] if not has_library else [f"component {c.name} from Parts import {c.name}" for c in self._components]
        parts += self._definitions()
        own = [self._component() for _ in range(self._dice.randint(1, 3))]
        parts += own
        parts += self._restrictions(self._components, self._dice.randint(0, 4))
        if self._has_goals:
            words = (*_GOAL_WORDS, *_MISSION_WORDS)
            parts += [f"constant {word}: boolean = {self._dice.choice(('true', 'false'))}" for word in words]
            parts += [self._goal() for _ in range(self._dice.randint(1, 5))]
            parts += [self._mission(name) for name in self._dice.sample(words, self._dice.randint(0, 2))]
            parts += self._preferences()
        self._dice.shuffle(parts)
        return f"robot {self._new('Robot')} {{ {' '.join(parts)} }}"

    def library(self) -> str:
        """A library with one or two components."""
        self._prefix = "Lib"
        parts = self._definitions()
        parts += [self._component() for _ in range(self._dice.randint(1, 2))]
        if self._extra(0.6):
            for component in self._components:
                parts += self._restrictions([component], 1)
        self._constants = {}
        self._dice.shuffle(parts)
        return f"library Parts {{ {' '.join(parts)} }}"

    _prefix = ""

    def _definitions(self) -> list[str]:
        """Interfaces, object types and enums; their names differ from file to file only by a prefix."""
        prefix, self._prefix = self._prefix, ""
        scan, kind, level, twist = (f"{prefix}{name}" for name in ("Scan", "Kind", "Level", "Twist"))
        self._types = {"scan": scan, "kind": kind, "level": level, "twist": twist, "link": f"{prefix}link"}
        parts = [
            f"interface {prefix}link use Sample from own_msgs",
            f"datatype object {scan} {{ ranges: array(double) size: integer name: string on_: boolean "
            f"inner: {twist} }}",
            f"datatype object {twist} {{ x: double ^value: integer }}",
        ]
        if self._extra(0.7):
            for type_ in ("double", "integer"):
                name = self._new("LIMIT_")
                number = self._dice.randint(-9, 9)
                value = f"clamp({number}, -5, 5)" if type_ == "integer" else f"double({number}) / 4"
                parts.append(f"constant {name}: {type_} = {value}")
                self._constants[name] = type_
        values = {"double": "value.ranges[0]", "integer": "value.size", "boolean": "value.on_"}
        rules = " ".join(
            f"{self._condition(2, {}, values, arrays=True)} -> {name}" for name in self._dice.sample(["near", "far"], 1)
        )
        parts.append(f"datatype enum {kind} from {scan} to {{ {rules} default -> nothing }}")
        received = {"double": "value"}
        parts.append(
            f"datatype enum {level} from double to {{ {self._condition(1, {}, received)} -> low default -> high }}"
        )
        return parts

    # Components

    def _component(self) -> str:
        component = _Component(self._new("Part"))
        types = self._types
        lines: list[str] = []
        events: list[tuple[str, str, dict[str, str]]] = []
        for _ in range(self._dice.randint(1, 3)):
            name = self._new(self._dice.choice(("go", "always", "when", "min", "^message")))
            shape = self._dice.randrange(5)
            option = self._options(incoming=shape <= 1)
            if shape == 0:
                lines.append(f"incoming message {name} with type: double{option}")
                component.requests[name] = "double"
                events.append(("request to", name, {}))
            elif shape == 1:
                identifier = f'identifier: "/{name.strip("^")}", '
                lines.append(
                    f"incoming message {name} with {identifier}type: {types['twist']}{option} links {types['link']}"
                )
                component.requests[name] = "object"
                events.append(("request to", name, {}))
            elif shape == 2:
                lines.append(f"outgoing message {name} with type: {types['kind']}{option} links {types['link']}")
                events.append(("response from", name, {types["kind"]: "value"}))
            elif shape == 3:
                lines.append(f"outgoing message {name} with type: {types['scan']}{option} links {types['link']}")
                inner = {
                    "double": "value.inner.x",
                    "boolean": "value.on_",
                    "string": "value.name",
                    "integer": "value.size",
                }
                events.append(("response from", name, inner))
            else:
                lines.append(f"service {name} with request: none, response: boolean links {types['link']}")
                component.requests[name] = "none"
                events += [
                    ("request to", name, {}),
                    ("response from", name, {"boolean": "value"}),
                    ("error from", name, {}),
                ]
        if self._chance(0.8):
            lines.append(self._behaviour(component, events))
        self._components.append(component)
        return f"component {component.name} {{ {' '.join(lines)} }}"

    def _options(self, *, incoming: bool) -> str:
        found = []
        if self._extra(0.3):
            found.append(f"qos: {self._dice.choice(('reliable', 'best_effort', 'sensor', 'latched'))}")
        if self._extra(0.3):
            found.append(f"depth: {self._dice.randint(1, 20)}")
        if self._extra(0.3) and not incoming:
            found.append("max_age: 0.5")
        return "".join(f", {item}" for item in found)

    def _behaviour(self, component: _Component, events: list[tuple[str, str, dict[str, str]]]) -> str:
        states = self._dice.sample(_STATES, self._dice.randint(1, 3))
        kinds = ("boolean", "integer(0..3)", self._types["kind"], self._types["level"], "double", "string", "integer")
        names = self._dice.sample(_VARIABLES, self._dice.randint(0, 3))
        variables = {name: self._dice.choice(kinds) for name in names}
        if self._extra(0.4):
            variables = {
                name: "integer(-3..3)" if type_ == "integer(0..3)" else type_ for name, type_ in variables.items()
            }
        parts = [f"variable {name}: {type_}{self._initial(type_)}" for name, type_ in variables.items()]
        component.variables = {
            name: type_
            for name, type_ in variables.items()
            if type_.startswith(("boolean", "integer(")) or "L" in type_
        }
        component.states = list(states)
        for place, state in enumerate(states):
            # A marked state everywhere: nothing can be unreachable.
            inside = self._transitions(component, states, events, variables)
            parts.append(f"{'initial ' if place == 0 else ''}marked state {state} {{ {' '.join(inside)} }}")
        return f"behaviour {{ {' '.join(parts)} }}"

    def _initial(self, type_: str) -> str:
        if self._chance(0.5):
            return ""
        if type_.startswith("integer("):
            return f" = {self._dice.choice(('-1', '1')) if '-3' in type_ else '2'}"
        plain = {"boolean": "true", "double": "0.25", "string": "'it\\'s'", "integer": "7"}
        return f" = {plain[type_]}" if type_ in plain else (" = nothing" if "Kind" in type_ else " = low")

    def _transitions(
        self,
        component: _Component,
        states: list[str],
        events: list[tuple[str, str, dict[str, str]]],
        variables: dict[str, str],
    ) -> list[str]:
        found = []
        for kind, name, received in self._dice.sample(events, self._dice.randint(0, len(events))):
            text = f"on {kind} {name}" + ("" if kind == "request to" else self._updates(variables, received))
            found.append(text + (f" goto {self._dice.choice(states)}" if self._chance(0.7) else ""))
        if self._chance(0.2) and len(states) > 1:
            found.append(f"transition if {component.name}.{states[0]} goto {states[1]}")
        return found

    def _updates(self, variables: dict[str, str], received: dict[str, str]) -> str:
        parts = []
        for name, type_ in variables.items():
            if self._chance(0.5):
                parts.append(f"{name} := {self._new_value(name, type_, received)}")
        return f" do {', '.join(parts)}" if parts else ""

    def _new_value(self, name: str, type_: str, received: dict[str, str]) -> str:
        if type_ in received and self._chance(0.6) and type_ != "integer":
            # Infinite data must not get into what synthesis depends on, so only whole values of one's own type.
            return received[type_]
        if type_.startswith("integer("):
            return f"clamp({name} + 1, 0, 3)" if self._extra(0.3) else self._dice.choice(("0", "1", "2"))
        plain = {"boolean": "!true", "double": "1.5 / 2", "string": '"x"', "integer": "-3 * (2 + 1)"}
        return plain.get(type_) or ("nothing" if "Kind" in type_ else "high")

    # Expressions

    def _condition(self, depth: int, states: dict[str, str], values: dict[str, str], *, arrays: bool = False) -> str:
        """A boolean expression over variables and states (`states`) and received data (`values`)."""
        choices = ["true", "false", "comparison", "comparison"]
        choices += ["state"] * 3 if states else []
        choices += ["binary", "binary", "not", "implies", "if"] if depth > 0 else []
        choices += ["array", "array"] if arrays and self._part_b else []

        def below() -> str:
            return self._condition(depth - 1, states, values, arrays=arrays)

        match self._dice.choice(choices):
            case "comparison":
                type_ = self._dice.choice(("integer", "double"))
                operator = self._dice.choice(("=", "!=", "<", "<=", ">", ">="))
                left, right = (self._number_of(type_, states, depth, values) for _ in range(2))
                return f"({left} {operator} {right})"
            case "state":
                return self._dice.choice(sorted(states))
            case "binary":
                return f"({below()} {self._dice.choice(('and', 'or'))} {below()})"
            case "not":
                return f"!{below()}"
            case "implies":
                return f"(({below()}) => ({below()}))"
            case "if":
                return f"(if {below()} then {below()} else {below()})" if self._part_b else below()
            case "array":
                low, high = self._dice.randint(0, 9), self._dice.randint(0, 9)
                part = self._dice.choice(("value.ranges", f"value.ranges[{low}..{high}]"))
                word = self._dice.choice(("any", "all"))
                return self._dice.choice(
                    (f"{word}(x in {part}: x < 0.5 or x > 3)", f"(min({part}) > 0.25)", "(length(value.ranges) > 3)")
                )
            case plain:
                return plain

    def _number_of(self, type_: str, states: dict[str, str], depth: int, values: dict[str, str]) -> str:
        choices = [str(self._dice.randint(0, 9)), "0.5" if type_ == "double" else "7"]
        choices += [text for kind, text in values.items() if kind == type_]
        choices += [name for name, kind in self._constants.items() if kind == type_]
        if depth <= 0 or self._chance(0.4):
            return self._dice.choice(choices)
        left, right = (self._number_of(type_, states, depth - 1, values) for _ in range(2))
        if self._extra(0.4):
            call = self._dice.choice(
                ("abs({0})", "min({0}, {1})", "max({0}, {1})", "clamp({0}, 1, {1})", "double({0})")
            )
            text = call.format(left, right)
            return f"integer({text})" if type_ == "integer" and "double" in text else text
        return f"({left} {self._dice.choice('+-*')} {right})"

    # Requirements and data

    def _readable(self, components: list[_Component]) -> dict[str, str]:
        """Conditions about states and variables of some components."""
        states: dict[str, str] = {}
        for component in components:
            states |= {f"{component.name}.{state}": "" for state in component.states}
            for name, type_ in component.variables.items():
                if type_ == "boolean":
                    states[f"{component.name}.{name}"] = ""
                elif type_.startswith("integer("):
                    states[f"({component.name}.{name} >= 1)"] = ""
        return states

    def _goal(self) -> str:
        """A goal or an assumption; the words of both are names in it, too."""
        conditions = self._readable(self._components) | dict.fromkeys(_GOAL_WORDS, "")
        trigger, condition = (self._condition(2, conditions, {}) for _ in range(2))
        first = self._dice.choice(("goal", "assume", "assume allow"))
        forms = [f"{first} always eventually {condition}", f"{first} {trigger} leads to {condition}"]
        if first == "goal":
            forms.append(f"goal once {condition}")
        return self._dice.choice(forms)

    def _mission(self, name: str) -> str:
        """A mission; its words are names in it, too."""
        conditions = self._readable(self._components) | dict.fromkeys(_MISSION_WORDS, "")

        def visits() -> str:
            found = (self._condition(2, conditions, {}) for _ in range(self._dice.randint(1, 3)))
            return f"visit {' then '.join(found)}"

        head = f"mission {name}" + (f" while {self._condition(2, conditions, {})}" if self._chance(0.5) else "")
        detours = (
            f"on {self._condition(2, conditions, {})} from anywhere {visits()}" for _ in range(self._dice.randint(0, 2))
        )
        return f"{head} {{ {visits()} {' '.join(detours)} }}"

    def _preferences(self) -> list[str]:
        """Preferences that one order of the requests obeys."""
        names = sorted({name for component in self._components for name in component.requests})
        self._dice.shuffle(names)
        found: list[str] = []
        for _ in range(self._dice.randint(0, 2) if len(names) > 1 else 0):
            cut = self._dice.randint(1, len(names) - 1)
            sides = [self._dice.sample(part, self._dice.randint(1, len(part))) for part in (names[:cut], names[cut:])]
            texts = [side[0] if len(side) == 1 and self._chance(0.7) else f"{{ {', '.join(side)} }}" for side in sides]
            found.append(f"prefer {texts[0]} over {texts[1]}")
        return found

    def _restrictions(self, components: list[_Component], count: int) -> list[str]:
        states = self._readable(components)
        requests = {name: kind for component in components for name, kind in component.requests.items()}
        found = []
        for _ in range(count):
            if requests:
                name = self._dice.choice(sorted(requests))
                condition = self._condition(2, states, {})
                shapes = [f"requirement {name} needs {condition}", f"requirement {condition} disables {{{name}}}"]
                if requests[name] == "double":
                    shapes.append(f"provide {name} with {self._number_of('double', {}, 2, {})} if {condition}")
                    shapes.append(f"limit {name} to -1.5..clamp(1, 2, 3) if {condition}")
                elif requests[name] == "object":
                    shapes.append(f"provide {name} with {{ x: {self._number_of('double', {}, 1, {})}, ^value: -3 }}")
                    shapes.append(f"limit {name} to {{ x: 0.5..2.0, ^value: -3..-1 }}")
                found.append(self._dice.choice(shapes))
            if states and self._extra(0.2):
                found.append(f"requirement {self._dice.choice(('always', 'never'))} {self._condition(2, states, {})}")
        return found
