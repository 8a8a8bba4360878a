"""The supervisor automaton: one location, and a self-loop with a guard for each controllable event."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from robosc.automata import System
from robosc.automata.state import Subject
from robosc.conditions.formula import to_expression
from robosc.supervisor import DecisionDiagram, DecisionNode, Supervisor
from robosc.supervisor.diagram import diagram_domains
from robosc.targets.cif.expressions import Translator
from robosc.targets.cif.names import SUPERVISOR, data_plant
from robosc.targets.cif.plants import Plants
from robosc.targets.cif.subjects import Place
from robosc.targets.cif.text import FALSE, LINE_WIDTH, TRUE, Level, Text, all_of, chosen, escaped

FORMULA_LIMIT = 60
"""Operands beyond which a condition is written as a decision diagram."""

_OUTSIDE = Place("a condition of the supervisor")


@dataclass(slots=True)
class Diagrams:
    """Conditions that the supervisor adds, as formulas or as shared algebraic variables.

    Attributes:
        system: The system.
        translator: Writes expressions.
        lines: Declarations of the algebraic variables so far, in an order in which each uses earlier ones only.
    """

    system: System
    translator: Translator
    lines: list[str] = field(default_factory=list)
    _known: dict[str, Text] = field(default_factory=dict)

    def condition(self, diagram: DecisionDiagram) -> Text:
        """A condition as CIF text."""
        domains = diagram_domains(self.system)
        formula = to_expression(diagram, domains, limit=FORMULA_LIMIT)
        if formula is not None:
            return self.translator.predicate(formula, _OUTSIDE).true
        texts = [FALSE, TRUE]
        for node in diagram.nodes:
            texts.append(self._node(node, len(domains[node.automaton, node.variable]), texts))
        return texts[diagram.root]

    def _node(self, node: DecisionNode, count: int, texts: list[Text]) -> Text:
        """The algebraic variable of a node; equal nodes share one."""
        runs: dict[Text, list[range]] = {}
        for start, end, child in zip(node.starts, (*node.starts[1:], count), node.children, strict=True):
            found = runs.setdefault(texts[child], [])
            if found and found[-1].stop == start:
                found[-1] = range(found[-1].start, end)
            else:
                found.append(range(start, end))
        if len(runs) == 1:  # A file may hold a node that decides nothing.
            return next(iter(runs))
        reader, subject = self.translator.reader, Subject(node.automaton, node.variable)
        branches = [(reader.test(subject, where, _OUTSIDE), child) for child, where in runs.items()]
        text = chosen(branches[:-1], branches[-1][1])
        if text.text not in self._known:
            name = escaped(reader.names.diagram_node(len(self._known) + 1))
            self.lines.append(f"alg bool {name} = {text};")
            self._known[text.text] = Text(name)
        return self._known[text.text]


def supervisor_lines(
    supervisor: Supervisor, system: System, plants: Plants, translator: Translator, requirements: dict[str, Text]
) -> Iterator[str]:
    """Yield the lines of the supervisor automaton, behind the algebraic variables that it needs.

    Args:
        supervisor: The supervisor.
        system: Its plants and requirements.
        plants: Writer of the plants.
        translator: Writer of expressions.
        requirements: Condition of the requirements for each event, of those on which there are any.
    """
    names, diagrams = translator.reader.names, Diagrams(system, translator)
    loops: list[str] = []
    events: list[str] = []
    for event in system.events:
        if event.is_controllable:
            added = supervisor.added_condition(event.name)
            guard = all_of(
                [
                    requirements.get(event.name, TRUE),
                    *_ranges(system, plants, event.name),
                    TRUE if added is None else diagrams.condition(added),
                ]
            )
            reference = names.event_reference(event.name, None)
            events.append(reference)
            loops += _loop(reference, guard)
    for communication, places in names.provides.items():
        references = [names.reference(data_plant(communication), name, None) for _, name in places]
        events += references
        loops += [f"    edge {', '.join(references)};"]
    if diagrams.lines:
        yield "// The supervisor's decision diagrams: each node tests one location or variable."
        yield from diagrams.lines
        yield ""
    yield f"supervisor automaton {SUPERVISOR}:"
    yield from _alphabet(events)
    yield "  location:"
    yield "    initial; marked;"
    yield from loops
    yield "end"


def _alphabet(events: list[str]) -> Iterator[str]:
    if not events:
        return
    line = f"  alphabet {', '.join(events)};"
    if len(line) <= LINE_WIDTH:
        yield line
    else:
        yield "  alphabet"
        yield from (f"    {event}," for event in events[:-1])
        yield f"    {events[-1]};"


def _ranges(system: System, plants: Plants, event: str) -> Iterator[Text]:
    """Yield the conditions that an event leaves no range."""
    for automaton in system.automata:
        for edge in automaton.edges:
            if edge.event == event and edge.updates:
                yield plants.range_condition(automaton, edge)


def _loop(event: str, guard: Text) -> list[str]:
    """A self-loop; a long conjunction has a line for each of its parts."""
    if guard == TRUE:
        return [f"    edge {event};"]
    line = f"    edge {event} when {guard};"
    if len(line) <= LINE_WIDTH or guard.level != Level.AND:
        return [line]
    parts = [part.within(Level.COMPARISON) for part in guard.parts]
    return [f"    edge {event} when", *(f"      {part} and" for part in parts[:-1]), f"      {parts[-1]};"]
