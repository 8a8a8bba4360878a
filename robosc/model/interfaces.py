"""Communications against the definitions of their middleware types.

Whatever a generated node would refuse at its start is reported here, and is an error for the ROS packages with such
nodes (`robosc.targets.ros.package`): a supervisor can be made all the same, for whatever runs without ROS. That holds
for definitions of the user's own, too, which say for certain that a node would not start: what a model means does not
depend on the packages that are installed where it is read.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec
from msgspec.structs import replace

from robosc.expressions import Type
from robosc.interfaces import (
    DISTRIBUTIONS,
    INTERFACE_KINDS,
    Distribution,
    Field,
    Part,
    distribution_of,
    shipped_types,
    titles_of,
)
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces
from robosc.language import syntax
from robosc.language.words import spelled
from robosc.model.communications import CommunicationTree
from robosc.model.findings import Findings
from robosc.model.message_fields import Comparison, Fault, FieldChecker, Language, Message, fields_of_objects
from robosc.model.needless import LeftOut, PropertyUses
from robosc.model.structure import Communication, CommunicationKind, EventKind
from robosc.model.types import Types
from robosc.model.units import Unit
from robosc.source import Bundle, Location

KINDS = {
    CommunicationKind.INCOMING_MESSAGE: "msg",
    CommunicationKind.OUTGOING_MESSAGE: "msg",
    CommunicationKind.SERVICE: "srv",
    CommunicationKind.ACTION: "action",
}
"""Kind of interface of each kind of communication."""

_WORDS = {"msg": "message", "srv": "service", "action": "action"}
_ARTICLES = {"msg": "a message", "srv": "a service", "action": "an action"}


class _Outcome(msgspec.Struct, frozen=True):
    """Outcome of the comparisons that nodes of one kind make at their start.

    Attributes:
        catalogue: The interfaces that they know.
        faults: Faults that keep them from starting.
        unknown: Messages that could not be compared, with the places where they matter.
    """

    catalogue: Catalogue
    faults: tuple[Fault, ...]
    unknown: Mapping[str, Location]


type _ByLanguage = Mapping[Language, tuple[Fault, ...]]


class _Linked(msgspec.Struct, frozen=True):
    """A communication with the interface that it is linked to.

    Attributes:
        communication: The communication.
        tree: Its declaration.
        interface: Definition of the interface's name in the model.
    """

    communication: Communication
    tree: syntax.Communication
    interface: syntax.Interface

    @property
    def kind(self) -> str:
        """Folder of the interface in its package."""
        return KINDS[self.communication.kind]

    @property
    def package(self) -> str:
        """Package of the interface."""
        return self.interface.package.text

    @property
    def type(self) -> str:
        """Type of the interface in its package."""
        return self.interface.type.text

    def parts(self) -> Iterator[tuple[Type | None, Location]]:
        """Yield the types of the data, with their places, in the order of the definition's parts."""
        tree, item = self.tree, self.communication
        match tree:
            case syntax.Message():
                yield item.request if item.request is not None else item.response, tree.type.location
            case syntax.Service():
                yield item.request, tree.request.location
                yield item.response, tree.response.location
            case syntax.Action():
                yield item.request, tree.request.location
                yield item.response, tree.response.location
                yield item.feedback, tree.feedback.location


class InterfaceChecker:
    """Checker of communications against their interfaces.

    Args:
        bundle: Texts with the definitions that were found; what is missing comes with RoboSC, if it has it.
        types: Types of the model.
        findings: Findings to which faults are reported.
        uses: Properties that are read or filled.

    Attributes:
        fields: Fields that properties of object types can stand for, by model name of the type and name of the field.
        left_out: Properties that nothing needs and no distribution has a field for, by name of the communication.
    """

    def __init__(self, bundle: Bundle, types: Types, findings: Findings, uses: PropertyUses) -> None:
        found = FoundInterfaces({file.name: file.text for file in bundle.interfaces})
        self._are_searched = bool(bundle.searched)
        self._chosen = distribution_of(bundle.distribution)
        meant = [item for item in DISTRIBUTIONS if self._chosen is None or item.version != self._chosen.version]
        # Findings speak of the chosen one.
        meant = meant if self._chosen is None else [self._chosen, *meant]
        self._catalogues = tuple(Catalogue(distribution, found) for distribution in meant)
        self._checkers = _checkers(self._catalogues, types)
        # Definitions that were found of packages that distributions have are of the chosen one.
        foreign = found.without(shipped_types())
        others = [item for item in DISTRIBUTIONS if item not in meant]
        self._others = _checkers([Catalogue(distribution, foreign) for distribution in others], types)
        self._types = types
        self._findings = findings
        self._noted: set[str] = set()
        self._reported: set[tuple[str, str, Location]] = set()
        self._uses = uses
        self.fields: dict[str, dict[str, Field]] = {}
        self.left_out: dict[str, LeftOut] = {}

    def check(
        self, trees: Iterable[CommunicationTree], communications: Mapping[str, Communication], unit: Unit
    ) -> dict[str, Catalogue]:
        """Report what does not fit.

        Returns:
            For each communication that fits, with the interface that it is linked to, a catalogue in which it does.


        Args:
            trees: Declarations of the communications.
            communications: Those that are sound, by name.
            unit: The file that is checked, whose interfaces that nothing is linked to are looked up, too.
        """
        linked = [_Linked(*found) for item in trees if (found := _linked(item, communications)) is not None]
        used = {id(item.interface) for item in linked}
        fitting = {item.communication.name: self._checked(item) for item in linked}
        for interface in unit.interfaces.values():
            if id(interface) not in used:
                self._check_unused(interface)
        return {name: catalogue for name, catalogue in fitting.items() if catalogue is not None}

    def _checked(self, item: _Linked) -> Catalogue | None:
        """Report what does not fit; the first catalogue in which something fits."""
        each = self._outcomes(item, self._checkers)
        outcomes: dict[tuple[int, Language], _Outcome] = {}
        for (distribution, language), found in each.items():
            key = (distribution.version, language)
            if key not in outcomes or len(found.faults) < len(outcomes[key].faults):
                outcomes[key] = found
        for outcome in tuple(outcomes.values())[:1]:
            for data, part in parts_by_event(item.communication, outcome.catalogue).values():
                fields_of_objects(data, part, outcome.catalogue, self._types, self.fields)
        if not outcomes:
            self._note_missing(item.package, f"{item.package}/{item.type}", item.interface.package.location)
            return None
        outcomes = self._without_needless(item, outcomes)
        if self._chosen is not None and self._report_of_chosen(item, outcomes, self._chosen.version):
            return None
        fitting = next((outcome for outcome in outcomes.values() if not outcome.faults), None)
        if fitting is None:
            # Faults are reported against the version that fits best.
            chosen = [outcome for (_, language), outcome in outcomes.items() if language is Language.PYTHON]
            for fault in min(chosen, key=lambda outcome: len(outcome.faults)).faults:
                self._report_once(fault)
            return None
        for type_, location in fitting.unknown.items():
            self._note_missing(type_.partition("/")[0], type_, location)
        ros1, ros2 = (
            {language: outcome.faults for (other, language), outcome in outcomes.items() if other == version}
            for version in (1, 2)
        )
        self._report_limits(ros1, ros2)
        if self._chosen is None:
            self._note_others(item, each, fitting.catalogue.distribution)
        return fitting.catalogue

    def _outcomes(
        self, item: _Linked, checkers: Mapping[tuple[Distribution, Language], FieldChecker]
    ) -> dict[tuple[Distribution, Language], _Outcome]:
        """Outcomes of the distributions that know the interface."""
        used = self._uses.of(item.communication.name)
        found = {key: _outcome(item, checker, used) for key, checker in checkers.items()}
        return {key: outcome for key, outcome in found.items() if outcome is not None}

    def _report_of_chosen(self, item: _Linked, outcomes: Mapping[tuple[int, Language], _Outcome], version: int) -> bool:
        """Report what the chosen distribution lacks and others of its version have; True if there is something."""
        own = [outcome for (other, _), outcome in outcomes.items() if other == version]
        if not own or not all(outcome.faults for outcome in own):
            return False
        needless = self.left_out.get(item.communication.name, LeftOut())
        fitting = _fitting(self._outcomes(item, self._others), version, needless)
        for fault in own[0].faults if fitting else ():
            fix = f"Use what {own[0].catalogue.distribution.title} has, or choose another one with --distribution."
            text = f"{fault.message}; it fits {titles_of(fitting)}"
            self._report_once(replace(fault, message=text, hint="", name="", fix=fix))
        return bool(fitting)

    def _note_others(
        self, item: _Linked, each: Mapping[tuple[Distribution, Language], _Outcome], fits: Distribution
    ) -> None:
        """Note what does not fit the distribution that is taken where none is chosen."""
        first = next(distribution for distribution in DISTRIBUTIONS if distribution.version == fits.version)
        needless = self.left_out.get(item.communication.name, LeftOut())
        found = [_essential(outcome, needless) for (other, _), outcome in each.items() if other is first]
        if fits is first or not found or not all(found):
            return
        fitting = _fitting(each, fits.version, needless)
        for fault in found[0]:
            text = f"{fault.message}; it fits {titles_of(fitting)}"
            fix = "Nothing needs fixing if the robot runs that: choose the distribution with --distribution."
            self._report_once(replace(fault, code="other-distribution", message=text, hint="", name="", fix=fix))

    def _without_needless(
        self, item: _Linked, outcomes: dict[tuple[int, Language], _Outcome]
    ) -> dict[tuple[int, Language], _Outcome]:
        """Return the outcomes without the properties that nothing needs and no distribution has, which are reported."""
        lacking = [
            {fault.needless: fault for fault in outcome.faults if fault.needless} for outcome in outcomes.values()
        ]
        needless = LeftOut(set(lacking[0]).intersection(*lacking[1:]))
        if not needless:
            return outcomes
        self.left_out[item.communication.name] = needless
        for key in sorted(needless):
            fault = lacking[0][key]
            message = f"{fault.message}, and nothing reads or fills it"
            self._report_once(replace(fault, code="needless-property", message=message))
        return {
            key: replace(outcome, faults=tuple(fault for fault in outcome.faults if fault.needless not in needless))
            for key, outcome in outcomes.items()
        }

    def _report_once(self, fault: Fault) -> None:
        """Report a fault that all nodes have, once."""
        known = (fault.code, fault.message, fault.location)
        if known in self._reported:
            return
        self._reported.add(known)
        near = self._findings.near(fault.name, fault.known) if fault.name else None
        hint, fix = (
            (fault.hint, fault.fix) if near is None else (f"; did you mean '{near}'?", f"Write '{spelled(near)}'.")
        )
        # Data that has no meaning is an error; what only ROS could not do is one for packages of ROS.
        report = _REPORTS.get(fault.code, Findings.warning)
        report(self._findings, fault.code, fault.message + hint, fault.location, fix, *fault.related)

    def _note_missing(self, package: str, type_: str, location: Location) -> None:
        if any(catalogue.knows(package) for catalogue in self._catalogues):
            package = type_
        # Missing definitions are noted only if they were searched for.
        if self._are_searched and package not in self._noted:
            self._noted.add(package)
            self._findings.note(
                "definition-not-found",
                f"not checked against {package} (its definitions were not found)",
                location,
                "Source the ROS workspace that has it, or name the folder of its package with -I.",
            )

    def _report_limits(self, ros1: _ByLanguage, ros2: _ByLanguage) -> None:
        """Report what keeps some nodes from starting, while others can; both are empty where nothing is known."""
        for one, version, code in ((ros2, 1, "ros1-only"), (ros1, 2, "ros2-only")):
            if one and all(one.values()):
                for fault in one[Language.PYTHON]:
                    self._only(fault, code, version)
        python1, python2 = (one.get(Language.PYTHON) for one in (ros1, ros2))
        if python2 and not ros2[Language.CPP] and python1 == ():
            for fault in python2:
                self._limited(fault, "not-in-ros2-python", "a node of ROS 2 in Python cannot start with that")
        elif python2 != () and python1 != ():
            for one in (ros2, ros1):
                if one and not one[Language.CPP]:
                    for fault in one[Language.PYTHON]:
                        self._limited(fault, "cpp-only", "only a node in C++ can start with that")
                    return

    def _only(self, fault: Fault, code: str, version: int) -> None:
        message = f"in ROS {3 - version}, {fault.message}; only in ROS {version} it fits"
        fix = f"Nothing needs fixing if the robot runs ROS {version}; packages for the other one are refused."
        self._findings.note(code, message, fault.location, fix, *fault.related)

    def _limited(self, fault: Fault, code: str, limit: str) -> None:
        self._findings.warning(code, f"{fault.message}; {limit}", fault.location, fault.fix, *fault.related)

    def _check_unused(self, interface: syntax.Interface) -> None:
        """Look for an interface that nothing is linked to among all kinds."""
        package, type_ = interface.package.text, interface.type.text
        knowing = [catalogue for catalogue in self._catalogues if catalogue.knows(package)]
        if any(catalogue.has(kind, package, type_) for catalogue in self._catalogues for kind in INTERFACE_KINDS):
            return
        if knowing:
            self._report_once(_unknown_type(interface, knowing[0], INTERFACE_KINDS))
        else:
            self._note_missing(package, f"{package}/{type_}", interface.package.location)


_REPORTS = {"ambiguous-field": Findings.error, "other-distribution": Findings.note}


def _checkers(catalogues: Iterable[Catalogue], types: Types) -> dict[tuple[Distribution, Language], FieldChecker]:
    return {
        (catalogue.distribution, language): FieldChecker(catalogue, language, types)
        for catalogue in catalogues
        for language in Language
    }


def _fitting(
    outcomes: Mapping[tuple[Distribution, Language], _Outcome], version: int, needless: LeftOut
) -> tuple[Distribution, ...]:
    """The distributions of a version for which nodes in Python or in C++ can start."""
    return tuple(
        dict.fromkeys(
            distribution
            for (distribution, _), outcome in outcomes.items()
            if distribution.version == version and not _essential(outcome, needless)
        )
    )


def _essential(outcome: _Outcome, needless: LeftOut) -> tuple[Fault, ...]:
    """The faults that are not about properties that nothing needs."""
    return tuple(fault for fault in outcome.faults if fault.needless not in needless)


def _outcome(item: _Linked, checker: FieldChecker, used: frozenset[str]) -> _Outcome | None:
    """Compare a communication as nodes of one kind do at their start; None where the interface is not known."""
    catalogue = checker.catalogue
    definition = catalogue.definition(item.kind, item.package, item.type)
    if definition is None:
        kinds = [kind for kind in INTERFACE_KINDS if catalogue.has(kind, item.package, item.type)]
        if item.kind in kinds or not (kinds or catalogue.knows(item.package)):
            return None
        return _Outcome(catalogue, (_unknown_type(item.interface, catalogue, (item.kind,)),), {})
    name = catalogue.described(item.kind, item.package, item.type)
    found = Comparison()
    for part, (type_, location) in zip(definition, item.parts(), strict=False):
        if type_ is not None:
            found.include(checker.compare(type_, Message(name, part), location, used))
    if item.communication.frame is not None:
        found.add(*_header_faults(item, definition[0], name, catalogue))
    return _Outcome(catalogue, tuple(dict.fromkeys(found.faults)), found.unknown)


def _linked(
    item: CommunicationTree, communications: Mapping[str, Communication]
) -> tuple[Communication, syntax.Communication, syntax.Interface] | None:
    communication = communications.get(item.tree.name.text)
    link = item.tree.link
    interface = None if link is None else item.part.unit.interfaces.get(link.text)
    return None if communication is None or interface is None else (communication, item.tree, interface)


def parts_by_event(item: Communication, catalogue: Catalogue) -> dict[EventKind, tuple[Type, Part]]:
    """The type of the data of each event of a communication, and the part of its interface that the data comes as."""
    if item.interface is None:
        return {}
    definition = catalogue.definition(KINDS[item.kind], item.interface.package, item.interface.type) or ()
    types = {EventKind.REQUEST: item.request, EventKind.RESPONSE: item.response, EventKind.FEEDBACK: item.feedback}
    given = [(kind, type_) for kind, type_ in types.items() if type_ is not None]
    return {kind: (type_, part) for (kind, type_), part in zip(given, definition, strict=False)}


def headers_of(part: Part, catalogue: Catalogue, *, is_action: bool) -> tuple[tuple[str, ...], ...]:
    """The paths to the headers that a node stamps: the message's own; in an action else those of its fields."""
    if catalogue.has_header(part):
        return (("header",),)
    if not is_action:
        return ()
    return tuple(
        (name, "header")
        for name, item in part.fields.items()
        if item.array is None
        and item.is_message
        and (inner := catalogue.message(item.type)) is not None
        and catalogue.has_header(inner)
    )


def _header_faults(item: _Linked, part: Part, name: str, catalogue: Catalogue) -> Sequence[Fault]:
    is_action = item.communication.kind is CommunicationKind.ACTION
    unknown = [field for field in part.fields.values() if "/" in field.type and catalogue.message(field.type) is None]
    if headers_of(part, catalogue, is_action=is_action) or (is_action and unknown):
        return ()
    place = next(option.location for option in item.tree.options if option.key == "stamped")
    stamped = f"{item.type}Stamped"
    has_stamped = catalogue.definition(item.kind, item.package, stamped) is not None
    fix = f"Use '{stamped}' from {item.package}, or remove" if has_stamped else "Use a type with a header, or remove"
    message = f"'stamped' fills in a header, and {name} has none"
    return (Fault("no-header", message, "", place, f"{fix} 'stamped'."),)


def _unknown_type(interface: syntax.Interface, catalogue: Catalogue, kinds: Sequence[str]) -> Fault:
    package, type_ = interface.package.text, interface.type.text
    place = interface.type.location
    what = _WORDS[kinds[0]] if len(kinds) == 1 else "message, service or action"
    text = f"{catalogue.described_package(package)} has no {what} '{type_}'"
    other = next((kind for kind in INTERFACE_KINDS if kind not in kinds and catalogue.has(kind, package, type_)), None)
    if other is not None:
        fix = f"Link it to {_ARTICLES[other]}, or use a type that is {_ARTICLES[kinds[0]]}."
        return Fault("unknown-ros-type", text, f"; it is {_ARTICLES[other]}", place, fix)
    fix = f"Use a type that {package} has, or name the folder with a version that has it with -I."
    known = tuple(name for kind in kinds for name in catalogue.types(kind, package))
    return Fault("unknown-ros-type", text, "", place, fix, (), type_, known)
