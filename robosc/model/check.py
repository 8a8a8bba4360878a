"""From a bundle to the checked model: every name bound, every type known, every rule of part A applied."""

from collections import Counter
from collections.abc import Iterable, Mapping

import msgspec

from robosc.errors import Diagnostic, InternalError, LanguageError, RelatedPlace, Severity, sorted_diagnostics
from robosc.expressions import BooleanType, ObjectType
from robosc.interfaces import Field
from robosc.interfaces.catalogue import Catalogue
from robosc.language import Parsed, parse, syntax
from robosc.model.acceptances import LATER, accept
from robosc.model.array_lengths import ArrayLengths
from robosc.model.behaviour import (
    BehaviourBuilder,
    BehaviourTree,
    behaviour_tree,
    component_names,
    partial_updates,
    uses_of,
)
from robosc.model.communications import (
    CommunicationTree,
    build_communication,
    check_topics,
    communication_trees,
    with_conditions,
)
from robosc.model.constants import Constants
from robosc.model.defaults import permissive_defaults
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import WORD, Bindings, Findings
from robosc.model.goals import build_goals
from robosc.model.interfaces import InterfaceChecker
from robosc.model.limits import check_together
from robosc.model.message_outcomes import message_outcomes
from robosc.model.missions import build_missions, build_preferences
from robosc.model.needless import PropertyUses, without
from robosc.model.own_requests import OwnRequests
from robosc.model.places import Places
from robosc.model.received import received_paths
from robosc.model.restrictions import Restrictions
from robosc.model.robot_scopes import RobotScopes
from robosc.model.sent_messages import SentMessages
from robosc.model.structure import (
    Assumption,
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    EnumDefinition,
    EnumRule,
    EventKind,
    Goal,
    Limit,
    Mission,
    Model,
    Provide,
    Requirement,
)
from robosc.model.synthesis_variables import check_synthesis_variables, mark_synthesis_variables
from robosc.model.types import Types
from robosc.model.units import Libraries, Part, Unit, make_unit, parts_of
from robosc.source import Bundle, Location


class Checked(msgspec.Struct, frozen=True):
    """Result of checking a bundle.

    Attributes:
        model: The robot, or None if there are errors or the main file is a library.
        diagnostics: Every finding that the text does not accept, sorted by place.
        places: Places of the parts of the model, or None without a model.
        bindings: Meanings of the names of the text, as far as it was read.
        accepted: The findings that it accepts.
    """

    model: Model | None
    diagnostics: tuple[Diagnostic, ...]
    places: Places | None = None
    bindings: Bindings = msgspec.field(default_factory=Bindings)
    accepted: tuple[Diagnostic, ...] = ()

    @property
    def has_errors(self) -> bool:
        """True if any finding is an error."""
        return any(item.severity is Severity.ERROR for item in self.diagnostics)

    def model_or_raise(self) -> Model:
        """The model.

        Raises:
            LanguageError: There is none; it carries the findings, at least one of them an error.
        """
        if self.model is not None:
            return self.model
        if self.has_errors:
            raise LanguageError(self.diagnostics)
        library = Diagnostic(
            Severity.ERROR, "no-robot", "the file holds a library, not a robot", None, "Give the file of a robot."
        )
        raise LanguageError([library, *self.diagnostics])


class Inspected(msgspec.Struct, frozen=True):
    """Facts about a bundle, whatever is wrong with it, for editors.

    Attributes:
        checked: Result as `check` has it.
        parsed: Result of parsing the main text.
        parts: The components of the robot, imports followed.
        scopes: Meanings of names in each place of it; None where there is no tree.
        units: The files that were read, the main one first.
        communications: Those of the robot whose types are sound, by name.
        fields: Fields of messages that properties of object types can stand for, by model name of the type and name
            of the field.
    """

    checked: Checked
    parsed: Parsed
    parts: tuple[Part, ...] = ()
    scopes: RobotScopes | None = None
    units: tuple[Unit, ...] = ()
    communications: Mapping[str, Communication] = msgspec.field(default_factory=dict)
    fields: Mapping[str, Mapping[str, Field]] = msgspec.field(default_factory=dict)


def check(bundle: Bundle) -> Checked:
    """Check the main file of a bundle with the libraries that it imports from; never raises for any text."""
    parsed = parse(bundle.main)
    if parsed.tree is None:
        return _broken(parsed, bundle)
    return _checked(_RobotChecker(parsed.tree, bundle, Findings()), parsed.tree)


def inspect(bundle: Bundle) -> Inspected:
    """Return the result of `check`; of a text with errors, its sound parts have their names bound all the same."""
    parsed = parse(bundle.main)
    if parsed.sound is None:
        return Inspected(Checked(None, parsed.diagnostics), parsed)
    checker = _RobotChecker(parsed.sound, bundle, Findings())
    if parsed.tree is not None:
        checked = _checked(checker, parsed.tree)
    else:
        checker.model()
        checked = _with_sound_parts(parsed, checker)
    return Inspected(
        checked, parsed, checker.parts, checker.scopes, checker.units, checker.communications, checker.fields
    )


_FOLLOWING = frozenset(
    {
        "empty-model",
        "enum-default",
        "links-required",
        "marked-unreachable",
        "needless-acceptance",
        "no-initial-state",
        "partial-update",
        "request-leaves-requirement",
        "result-not-read",
    }
)
"""Codes of what a part may seem to lack because it is not sound, or because another one is not."""


_HIDING = frozenset({"invalid-character", "unclosed-comment", "unclosed-string"})
"""Codes of what may hide any part of the text that follows."""


def _broken(parsed: Parsed, bundle: Bundle) -> Checked:
    """Result for a text with errors of its grammar: these, and what is wrong with its sound parts."""
    if parsed.sound is None:
        return Checked(None, parsed.diagnostics)
    checker = _RobotChecker(parsed.sound, bundle, Findings())
    checker.model()
    return _with_sound_parts(parsed, checker)


def _with_sound_parts(parsed: Parsed, checker: "_RobotChecker") -> Checked:
    """The same once the sound parts are checked, without the findings that may follow from what is not there."""
    found = checker.findings.diagnostics
    hidden = any(item.code in _HIDING for item in parsed.diagnostics)
    broken = {(item.location.file, item.location.line) for item in parsed.diagnostics if item.location is not None}
    unknown = Counter(_name_of(item, checker.bundle) for item in found if item.code == "unknown-name")
    words = Counter(WORD.findall(checker.bundle.main.text)) if unknown else Counter[str]()
    # An unknown name that stands elsewhere in the text, too, may be defined there.
    defined = {name for name, count in unknown.items() if words[name] != count}
    own = [
        item
        for item in found
        if not hidden
        and item.code not in _FOLLOWING
        and not (item.code == "unknown-name" and _name_of(item, checker.bundle) in defined)
        and (item.location is None or (item.location.file, item.location.line) not in broken)
    ]
    diagnostics, accepted = accept(checker.bundle, sorted_diagnostics((*parsed.diagnostics, *own)), lambda code: False)
    return Checked(None, diagnostics, bindings=checker.findings.bindings, accepted=accepted)


def _name_of(finding: Diagnostic, bundle: Bundle) -> str:
    """The text at the place of a finding."""
    place = finding.location
    file = None if place is None else bundle.file(place.file)
    return "" if place is None or file is None else file.line(place.line)[place.column - 1 :][: place.length]


def _checked(checker: "_RobotChecker", tree: syntax.File) -> Checked:
    findings = checker.findings
    model = checker.model()
    # Other checks may not have been made if there are errors.
    diagnostics, accepted = accept(
        checker.bundle,
        sorted_diagnostics(findings.diagnostics),
        lambda code: code not in LATER and not findings.has_errors,
    )
    if findings.has_errors or tree.is_library:
        return Checked(None, diagnostics, bindings=findings.bindings, accepted=accepted)
    if model is None:
        raise InternalError("a model without errors could not be built")
    return Checked(model, diagnostics, checker.places, findings.bindings, accepted)


class _RobotChecker:
    """Checks one robot; a library is checked as if it were a robot of its own components."""

    def __init__(self, tree: syntax.File, bundle: Bundle, findings: Findings) -> None:
        self._tree = tree
        self.findings = findings
        self._types = Types(findings)
        self._unit = make_unit(tree, findings)
        self.bundle = bundle
        self._libraries = Libraries(bundle, self._unit, findings)
        self.parts = parts_of(self._unit, self._libraries, findings)
        self.places = Places(tree.name.location)
        self._defaults: dict[str, Location] = {}
        self.scopes: RobotScopes | None = None
        self.communications: Mapping[str, Communication] = {}
        self.fields: Mapping[str, Mapping[str, Field]] = {}

    @property
    def units(self) -> tuple[Unit, ...]:
        """The files that were read, the main one first."""
        return tuple(dict.fromkeys((self._unit, *self._libraries.units)))

    def model(self) -> Model | None:
        """The model, or None where it cannot be built."""
        self._resolve_own_types()
        trees = communication_trees(self.parts, self.findings)
        communications = self._communications(trees)
        behaviour_trees = {part.name: behaviour_tree(part, self.findings) for part in self.parts}
        names = {
            part.name: component_names(part, behaviour_trees[part.name], self._types, self.findings)
            for part in self.parts
        }
        constants = Constants(self._types, self._libraries, self.findings)
        outcomes = message_outcomes(trees, filter(None, behaviour_trees.values()), names)
        self.scopes = scopes = RobotScopes(
            self._unit, self._types, self.parts, self._libraries, names, constants, outcomes
        )
        scopes.of(self._unit)  # Also a file whose constants nothing uses has them checked.
        enums = self._enums(scopes)
        behaviours = self._behaviours(behaviour_trees, scopes, communications)
        restrictions = Restrictions(self._unit, self.parts, self._libraries, scopes, self._types, self.findings)
        restrictions.build(communications, self.places)
        requirements, provides = tuple(restrictions.requirements), tuple(restrictions.provides)
        invariants = tuple(restrictions.invariants)
        checker = ExpressionChecker(scopes.of(self._unit), self.findings)
        goals, assumptions = build_goals(self._tree.items, checker, self.places)
        missions = build_missions(self._tree.items, checker, self.findings, self.places)
        preferences = build_preferences(self._tree.items, communications, self.findings, self.places)
        communications = with_conditions(trees, communications, scopes, self.findings)
        self.communications = communications
        aims: tuple[Goal | Assumption | Mission, ...] = (*goals, *assumptions, *missions)
        marked = mark_synthesis_variables(behaviours, requirements, provides, invariants, aims)
        for name, behaviour in marked.items():
            tree = behaviour_trees[name]
            if tree is not None:
                check_synthesis_variables(tree, behaviour, communications, self._types, self.findings)
                partial_updates(tree, behaviour, self.findings)
        limits = tuple(restrictions.limits)
        check_together(limits, self.places.limits, marked, self.findings)
        uses = PropertyUses(communications.values(), behaviours.values(), provides, limits, enums, self._types.objects)
        interfaces = InterfaceChecker(self.bundle, self._types, self.findings, uses)
        fitting = interfaces.check(trees, communications, self._unit)
        self.fields = interfaces.fields
        self._check_data(trees, communications, provides, limits, fitting)
        self._check_indices(trees, communications, behaviour_trees, fitting)
        self._check_requests(communications, marked, requirements)
        self._check_empty(communications)
        self.places.objects.update(self._types.object_places)
        if self.findings.has_errors:
            return None
        needed = without(communications.values(), enums, self._types.objects.values(), interfaces.left_out)
        self.places.objects.update((name, self.places.objects[old]) for name, old in needed.origins.items())
        model = Model(
            name=self._tree.name.text,
            components=tuple(Component(part.name, marked.get(part.name)) for part in self.parts),
            communications=needed.communications,
            enums=needed.enums,
            objects=needed.objects,
            requirements=requirements,
            provides=provides,
            invariants=invariants,
            goals=goals,
            assumptions=assumptions,
            missions=missions,
            preferences=preferences,
            limits=limits,
        )
        self._check_results(model)
        permissive_defaults(model, self.places, self._defaults, self.findings)
        return model

    def _resolve_own_types(self) -> None:
        """Every type of the file itself, used or not, so that its faults are found."""
        for item in self._tree.items:
            if isinstance(item, syntax.ObjectDefinition | syntax.EnumDefinition):
                self._types.named(item.name, self._unit)

    def _communications(self, trees: Iterable[CommunicationTree]) -> dict[str, Communication]:
        found: dict[str, Communication] = {}
        for item in trees:
            communication = build_communication(item, self._types, self.findings)
            if communication is not None and communication.name not in found:
                found[communication.name] = communication
                self.places.communications[communication.name] = item.location
                self.places.identifiers[communication.name] = item.identifier_location
        self.findings.communications_are_broken({item.tree.name.text for item in trees} - found.keys())
        check_topics(found.values(), self.places.communications, self._types, self.findings)
        return found

    def _enums(self, scopes: RobotScopes) -> tuple[EnumDefinition, ...]:
        """The definition of every enum, its rules resolved."""
        found = []
        for key, (enum, unit, tree) in self._types.enums.items():
            source = self._types.sources[key]
            checker = ExpressionChecker(scopes.for_rules(unit, source), self.findings)
            rules = []
            for rule in tree.rules:
                condition = None if rule.condition is None else checker.condition(rule.condition)
                if condition is not None:
                    rules.append(EnumRule(condition, rule.value.text))
            default = next((rule.value.text for rule in tree.rules if rule.condition is None), None)
            self.places.enums[key] = tree.name.location
            for rule in tree.rules:
                if rule.condition is None:
                    self._defaults[key] = rule.value.location
            if default is not None:
                found.append(EnumDefinition(key, source, enum.values, tuple(rules), default))
        return tuple(found)

    # Behaviours

    def _behaviours(
        self,
        trees: Mapping[str, BehaviourTree | None],
        scopes: RobotScopes,
        communications: Mapping[str, Communication],
    ) -> dict[str, Behaviour]:
        defaults = {
            key: next((rule.value.text for rule in tree.rules if rule.condition is None), enum.values[-1])
            for key, (enum, _, tree) in self._types.enums.items()
            if enum.values
        }
        uses = uses_of(filter(None, trees.values()), (item for unit in self.units for item in unit.tree.items))
        found: dict[str, Behaviour] = {}
        for part in self.parts:
            self.places.components[part.name] = part.place
            tree = trees[part.name]
            if tree is None:
                continue
            unknown = self._unknown_communication(part, communications)
            scope = scopes.inside(part)
            builder = BehaviourBuilder(tree, scope, communications, defaults, self.findings, unknown, uses)
            found[part.name] = builder.build()
            self._place_behaviour(tree)
        return found

    def _place_behaviour(self, tree: BehaviourTree) -> None:
        name = tree.part.name
        self.places.states.update({(name, state.name.text): state.name.location for state in tree.states})
        self.places.variables.update({(name, item.name.text): item.name.location for item in tree.variables})
        self.places.transitions[name] = tuple(transition.location for _, transition in tree.transitions)

    def _unknown_communication(self, part: Part, communications: Mapping[str, Communication]) -> "_Unknown":
        return _Unknown(part, self._unit, communications, self.findings)

    def _check_data(
        self,
        trees: Iterable[CommunicationTree],
        communications: Mapping[str, Communication],
        provides: Iterable[Provide],
        limits: Iterable[Limit],
        fitting: Mapping[str, Catalogue],
    ) -> None:
        """Check what requests send against the interfaces that they fit."""
        placed = tuple(zip(provides, self.places.provides, strict=True))
        limited = tuple(zip(limits, self.places.limits, strict=True))
        sent = SentMessages(fitting, placed, limited, self._types, self.findings)
        for item in trees:
            communication = communications.get(item.tree.name.text)
            if communication is not None:
                sent.check(communication, item.tree, item.location)

    def _check_indices(
        self,
        trees: Iterable[CommunicationTree],
        communications: Mapping[str, Communication],
        behaviours: Mapping[str, BehaviourTree | None],
        fitting: Mapping[str, Catalogue],
    ) -> None:
        """Check indices of received arrays against the lengths that interfaces give."""
        lengths = ArrayLengths(self._types, self.findings)
        for item in trees:
            name = item.tree.name.text
            if name in fitting:
                lengths.check_communication(communications[name], item.tree, fitting[name])
        for behaviour in behaviours.values():
            for _, transition in behaviour.transitions if behaviour else ():
                if isinstance(transition, syntax.CommunicationTransition) and transition.communication.text in fitting:
                    name = transition.communication.text
                    lengths.check_transition(transition, communications[name], fitting[name])

    def _check_requests(
        self,
        communications: Mapping[str, Communication],
        behaviours: Mapping[str, Behaviour],
        requirements: Iterable[Requirement],
    ) -> None:
        """Note an action whose own request makes one of its requirements false."""
        own = OwnRequests(behaviours)
        for place, requirement in zip(self.places.requirements, requirements, strict=True):
            for name in requirement.communications:
                if communications[name].kind is CommunicationKind.ACTION:
                    component = own.breaking(name, requirement.condition)
                    if component is not None:
                        self.findings.note(
                            "request-leaves-requirement",
                            f"the request of '{name}' makes this requirement false in '{component}', so it never "
                            "cancels it",
                            place,
                            "If that is meant, write '// robosc: accept request-leaves-requirement: REASON' above it.",
                        )

    def _check_results(self, model: Model) -> None:
        """Note a service or action that says whether it has succeeded, where nothing reads that."""
        read = {
            (transition.event, path[:1])
            for component in model.components
            for transition in (component.behaviour.transitions if component.behaviour else ())
            for update in transition.updates
            for path in received_paths(update.expression)
        }
        for item in model.communications:
            response = item.response
            if item.kind not in (CommunicationKind.SERVICE, CommunicationKind.ACTION):
                continue
            if not isinstance(response, ObjectType) or (item.event(EventKind.RESPONSE), ("success",)) in read:
                continue
            types = {part.name: part.type for part in model.object(response.name).properties}
            if isinstance(types.get("success"), BooleanType):
                self.findings.note(
                    "result-not-read",
                    f"nothing reads 'success' of the response of '{item.name}', so that a refusal counts as done",
                    self.places.communications[item.name],
                    f"Keep it in a variable, 'on response from {item.name} do done := value.success', and let what "
                    "follows need it.",
                )

    def _check_empty(self, communications: Mapping[str, Communication]) -> None:
        if not communications and not self._tree.is_library and not self.findings.has_errors:
            self.findings.warning(
                "empty-model",
                f"'{self._tree.name.text}' has no communication: there is nothing to synthesize",
                self._tree.name.location,
                "Add components with messages, services or actions.",
            )


class _Unknown(msgspec.Struct, frozen=True):
    """Report a communication that a behaviour names and that no component has."""

    part: Part
    robot: Unit
    communications: Mapping[str, Communication]
    findings: Findings
    reported: set[str] = msgspec.field(default_factory=set)

    def __call__(self, name: syntax.Name) -> None:
        if self.part.unit is self.robot:
            self.findings.unknown_communication(name.text, name.location, self.communications)
            return
        if name.text in self.reported or self.findings.explain(name.text):
            return  # Several transitions may react to it: the import is wrong once.
        self.reported.add(name.text)
        self.findings.error(
            "unknown-name",
            f"the imported component '{self.part.tree.name.text}' reacts to '{name.text}', which is not imported",
            self.part.place,
            f"Import the component of '{self.part.unit.tree.name.text}' that has '{name.text}' too.",
            RelatedPlace(f"'{name.text}' is named here", name.location),
        )
