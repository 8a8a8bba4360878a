"""Modules of Supremica (`.wmod`): XML of Waters, as far as automata are plain.

Format: the XML schema of Waters modules (R. Malik, K. Akesson, H. Flordal and M. Fabian, "Supremica - an efficient
tool for large-scale discrete event systems", IFAC-PapersOnLine 50(1), 2017, pp. 5794-5799). An automaton without an
`:accepting` state is marked everywhere; a `:forbidden` state must not be entered.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import NoReturn
from xml.parsers import expat

from robosc.automata import Role, System, SystemPlaces
from robosc.errors import Diagnostic, LanguageError, Severity
from robosc.model.findings import Findings
from robosc.plain_automata.draft import MAXIMUM_PARTS, Draft, Named, require_plain, system_of
from robosc.source import Location, SourceFile

_ACCEPTING, _FORBIDDEN = ":accepting", ":forbidden"
_ROLES = {"PLANT": Role.PLANT, "SPEC": Role.REQUIREMENT, "SUPERVISOR": Role.REQUIREMENT}
_NAMESPACE = "http://waters.sourceforge.net/xsd/module"


@dataclass(slots=True)
class _Element:
    """An element of XML.

    Attributes:
        tag: Its name, without a prefix.
        attributes: Its attributes.
        at: Its place.
        children: Elements in it.
    """

    tag: str
    attributes: dict[str, str]
    at: Location
    children: list["_Element"] = field(default_factory=list)

    def all(self, tag: str) -> Iterator["_Element"]:
        """Yield the children of a name."""
        return (item for item in self.children if item.tag == tag)

    def named(self, key: str = "Name") -> Named:
        """The name in an attribute; empty where there is none."""
        return Named(self.attributes.get(key, ""), self.at)


def _fail(code: str, message: str, at: Location, fix: str) -> NoReturn:
    raise LanguageError([Diagnostic(Severity.ERROR, code, message, at, fix)])


def _tree(file: SourceFile) -> _Element:
    """The outermost element.

    Raises:
        LanguageError: It is not XML, declares entities, or has too many elements.
    """
    # The text is decoded already, whatever encoding its first line names.
    parser = expat.ParserCreate("utf-8")
    stack: list[_Element] = [_Element("", {}, Location(file.name, 1, 1, 1))]
    count = 0

    def here() -> Location:
        return Location(file.name, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, 1)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > 4 * MAXIMUM_PARTS:
            _fail("automata-unsupported", "there are too many elements", here(), "Split the module.")
        found = _Element(tag.rpartition(":")[2], attributes, here())
        stack[-1].children.append(found)
        stack.append(found)

    def refuse(*_: object) -> NoReturn:
        _fail("automata-syntax", "there is a document type in it, and no module has one", here(), "Leave it out.")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(file.text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        at = Location(file.name, error.lineno, error.offset + 1, 1)
        _fail("automata-syntax", f"this is no XML: {expat.ErrorString(error.code)}", at, "Correct the file.")
    return stack[0].children[0]


class _Reader:
    """Reader of one module.

    Args:
        findings: Collection of what is wrong.
    """

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self.events: dict[str, bool] = {}
        self.drafts: list[Draft] = []
        self.kinds = set[str]()

    def _unsupported(self, element: _Element, what: str, fix: str) -> None:
        self._findings.error("automata-unsupported", what, element.at, fix)

    def module(self, module: _Element) -> None:
        """Read a module."""
        for part in module.children:
            if part.tag == "EventDeclList":
                for event in part.children:
                    self._event(event)
            elif part.tag == "ComponentList":
                for component in part.children:
                    self._component(component)
            elif part.tag in ("EventAliasList", "InstanceList", "ParameterList") and part.children:
                self._unsupported(part, f"{part.tag} is not part of plain automata", "Flatten the module.")

    def _event(self, event: _Element) -> None:
        name, kind = event.named(), event.attributes.get("Kind", "")
        if event.tag != "EventDecl" or event.children:
            fix = "Declare each event by its own name: flatten the module."
            self._unsupported(event, f"the event '{name.text}' is an array or has parts", fix)
            return
        if kind == "PROPOSITION":
            return
        if kind not in ("CONTROLLABLE", "UNCONTROLLABLE"):
            message = f"the event '{name.text}' is of the kind '{kind}'"
            self._findings.error("automata-syntax", message, event.at, "Write CONTROLLABLE or UNCONTROLLABLE.")
            return
        if event.attributes.get("Observable") == "false":
            fix = "Let it be observable: supervisors see all events here."
            self._unsupported(event, f"the event '{name.text}' is not observable", fix)
        if name.text in self.events:
            message = f"the event '{name.text}' is declared twice"
            self._findings.error("automata-name", message, event.at, "Leave one of them out.")
        self.events[name.text] = kind == "CONTROLLABLE"

    def _component(self, component: _Element) -> None:
        name, kind = component.named(), component.attributes.get("Kind", "")
        if component.tag != "SimpleComponent":
            self._unsupported(
                component,
                f"a {component.tag} is not a plain automaton",
                "Flatten the module, and write its variables as automata.",
            )
            return
        if kind == "PROPERTY":
            message = f"'{name.text}' is a property, and is left out"
            fix = "Let it be a SPEC if the supervisor has to see to it."
            self._findings.warning("automata-left-out", message, component.at, fix)
            return
        graphs = list(component.all("Graph"))
        if kind not in _ROLES or len(graphs) != 1 or not name.text:
            message = f"'{name.text}' needs a name, a kind (PLANT, SPEC or SUPERVISOR) and one Graph"
            self._findings.error("automata-syntax", message, component.at, "Correct the component.")
            return
        draft = Draft(name, _ROLES[kind])
        self.kinds.add(kind)
        self.drafts.append(draft)
        has_accepting = False
        for part in graphs[0].children:
            if part.tag == "NodeList":
                for node in part.children:
                    has_accepting = self._node(draft, node) or has_accepting
            elif part.tag == "EdgeList":
                for edge in part.children:
                    self._edge(draft, edge)
            elif part.tag == "LabelBlock":
                draft.events += self._labels(part)
                # The label in the alphabet means that no other state is marked.
                has_accepting = has_accepting or _ACCEPTING in _names(part)
        if not has_accepting:
            draft.marked = list(draft.states)

    def _node(self, draft: Draft, node: _Element) -> bool:
        """Read a state; returns True if it is accepting."""
        if node.tag != "SimpleNode":
            self._unsupported(node, f"a {node.tag} is not a single state", "Draw an edge from each state.")
            return False
        name = node.named()
        propositions = {name for part in node.children for name in _names(part)}
        draft.states.append(name)
        if node.attributes.get("Initial") == "true":
            draft.initial.append(name)
        if _ACCEPTING in propositions:
            draft.marked.append(name)
        if _FORBIDDEN in propositions:
            draft.forbidden.append(name)
        return _ACCEPTING in propositions

    def _edge(self, draft: Draft, edge: _Element) -> None:
        for part in edge.all("GuardActionBlock"):
            if part.children:
                self._unsupported(part, "an edge has a guard or an action", "Write variables as automata.")
        for block in edge.all("LabelBlock"):
            for event in self._labels(block):
                draft.events.append(event)
                draft.edges.append((edge.named("Source"), event, edge.named("Target")))

    def _labels(self, block: _Element) -> list[Named]:
        found = []
        for item in block.children:
            if item.tag == "SimpleIdentifier":
                found.append(item.named())
            elif item.tag.endswith("Identifier") or item.tag.startswith("Foreach"):
                self._unsupported(item, f"a label is a {item.tag}", "Flatten the module.")
        return [item for item in found if item.text not in (_ACCEPTING, _FORBIDDEN)]


def _names(block: _Element) -> set[str]:
    return {item.attributes.get("Name", "") for item in block.all("SimpleIdentifier")}


def read_wmod(file: SourceFile, findings: Findings) -> tuple[System, SystemPlaces]:
    """The system of a module; of use only if no error is found.

    Raises:
        LanguageError: It is no module of Supremica.
    """
    module = _tree(file)
    if module.tag != "Module":
        _fail(
            "automata-syntax", f"the outermost element is {module.tag}, not Module", module.at, "Save it as a module."
        )
    reader = _Reader(findings)
    reader.module(module)
    if not reader.drafts and not findings.has_errors:
        findings.error("automata-syntax", "there is no automaton in it", module.at, "Add a SimpleComponent.")
    name = module.attributes.get("Name") or PurePath(file.name).stem
    system, places = system_of(name, reader.drafts, reader.events, findings)
    # States to be avoided are requirements, too.
    is_controlled = "SUPERVISOR" in reader.kinds and "SPEC" not in reader.kinds and not system.invariants
    return replace(system, is_controlled=is_controlled), places


def write_wmod(system: System) -> str:
    """A module of Supremica.

    Raises:
        UnsupportedModelError: Automata are not plain.
    """
    require_plain(system)
    lines = [
        '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>',
        f'<Module Name={_quoted(system.name)} xmlns="{_NAMESPACE}">',
        " <EventDeclList>",
        f'  <EventDecl Kind="PROPOSITION" Name="{_ACCEPTING}"/>',
    ]
    for event in system.events:
        kind = "CONTROLLABLE" if event.is_controllable else "UNCONTROLLABLE"
        lines.append(f'  <EventDecl Kind="{kind}" Name={_quoted(event.name)}/>')
    lines += [" </EventDeclList>", " <ComponentList>"]
    for automaton in system.automata:
        kind = "PLANT" if automaton.role is Role.PLANT else "SUPERVISOR" if system.is_controlled else "SPEC"
        lines.append(f'  <SimpleComponent Kind="{kind}" Name={_quoted(automaton.name)}>')
        lines.append("   <Graph>")
        silent = sorted(automaton.alphabet - {edge.event for edge in automaton.edges})
        # All states would be marked without an accepting one.
        silent += [] if automaton.marked else [_ACCEPTING]
        if silent:
            lines += ["    <LabelBlock>", *(f"     {_identifier(event)}" for event in silent), "    </LabelBlock>"]
        lines.append("    <NodeList>")
        for location in automaton.locations:
            initial = ' Initial="true"' if location in automaton.initial else ""
            head = f"     <SimpleNode{initial} Name={_quoted(location)}"
            marked = f"<EventList>{_identifier(_ACCEPTING)}</EventList></SimpleNode>"
            lines.append(f"{head}>{marked}" if location in automaton.marked else f"{head}/>")
        lines += ["    </NodeList>", "    <EdgeList>"]
        for edge in automaton.edges:
            ends = f"Source={_quoted(edge.source)} Target={_quoted(edge.target)}"
            lines.append(f"     <Edge {ends}><LabelBlock>{_identifier(edge.event)}</LabelBlock></Edge>")
        lines += ["    </EdgeList>", "   </Graph>", "  </SimpleComponent>"]
    return "\n".join([*lines, " </ComponentList>", "</Module>"]) + "\n"


def _identifier(name: str) -> str:
    return f"<SimpleIdentifier Name={_quoted(name)}/>"


def _quoted(text: str) -> str:
    # Loaded where it is needed: half of urllib comes with it.
    from xml.sax.saxutils import quoteattr

    return quoteattr(text)
