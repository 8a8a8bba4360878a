"""Information about a name: its declaration, its users, the plant that it becomes, what the supervisor adds."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

from robosc.automata.plants import communication_plant
from robosc.automata.structure import Automaton
from robosc.editing.definitions import COMMUNICATIONS, Definition, DefinitionKind
from robosc.language import Parsed, syntax
from robosc.model.check import Inspected

_LONGEST = 12
"""Lines of a declaration that are shown."""

_MOST_PLACES = 8


def hover_text(
    definition: Definition,
    inspected: Inspected,
    declaration: str,
    holders: Sequence[str],
    added: Mapping[str, str],
) -> str:
    """Return the description of a definition, in Markdown.

    Args:
        definition: Definition of the name.
        inspected: Knowledge of it.
        declaration: The text of the definition.
        holders: Component, requirement or the like in which each use stands.
        added: Addition of the supervisor to each controllable event, in words; empty while it is not known.
    """
    lines = declaration.splitlines()
    shown = lines if len(lines) <= _LONGEST else [*lines[: _LONGEST - 1], "..."]
    paragraphs = ["\n".join(("```robosc", *shown, "```"))]
    owner = f" of `{definition.owner}`" if definition.owner else ""
    paragraphs.append(f"{definition.kind}{owner}")
    if definition.kind is not DefinitionKind.MISSION:
        # No statement names a mission.
        paragraphs.append(_used(holders))
    if definition.kind in COMMUNICATIONS:
        communication = inspected.communications.get(definition.name)
        if communication is not None:
            paragraphs.append(f"plant `{communication_plant(communication).name}`")
            paragraphs.append(_arcs(communication_plant(communication)))
            paragraphs += _added(communication.events, added)
    elif definition.kind is DefinitionKind.COMPONENT:
        paragraphs += _component(definition, inspected)
    return "\n\n".join(part for part in paragraphs if part)


def _used(holders: Sequence[str]) -> str:
    if not holders:
        return "not used"
    names = [f"{holder} ({count} times)" if count > 1 else holder for holder, count in Counter(holders).items()]
    more = [f"{len(names) - _MOST_PLACES} more"] if len(names) > _MOST_PLACES else []
    return "used by " + ", ".join([*names[:_MOST_PLACES], *more])


def _arcs(automaton: Automaton) -> str:
    return "\n".join(f"- {edge.source} -- `{edge.event}` --> {edge.target}" for edge in automaton.edges)


def _added(events: Iterable[str], added: Mapping[str, str]) -> Iterator[str]:
    for event in events:
        condition = added.get(event)
        if condition == "true":
            yield f"the supervisor adds nothing to `{event}`"
        elif condition is not None:
            yield f"the supervisor adds to `{event}`: `{condition}`"


def _component(definition: Definition, inspected: Inspected) -> Iterator[str]:
    model = inspected.checked.model
    if model is None:
        return
    found = next((item for item in model.components if item.name == definition.name), None)
    if found is not None and found.behaviour is not None:
        behaviour = found.behaviour
        counts = (
            (len(behaviour.states), "state"),
            (len(behaviour.variables), "variable"),
            (len(behaviour.transitions), "transition"),
        )
        yield "plant: " + ", ".join(f"{number} {word}{'' if number == 1 else 's'}" for number, word in counts)


def holder_of(parsed: Parsed, offset: int) -> str:
    """The component, requirement or the like that an offset stands in, in words; empty where that is none."""
    # Items of lists stand one in the other, inner ones first: the last is of the file.
    item = next((item for item, begin, end in reversed(parsed.extents) if begin <= offset < end), None)
    match item:
        case syntax.Requirement() | syntax.Invariant():
            return f"requirement (line {item.location.line})"
        case syntax.Goal():
            return f"goal (line {item.location.line})"
        case syntax.Assumption():
            return f"assumption (line {item.location.line})"
        case syntax.Mission():
            return f"mission `{item.name.text}`"
        case syntax.Preference():
            return f"preference (line {item.location.line})"
        case syntax.Provide():
            return f"provide (line {item.location.line})"
        case syntax.Limit():
            return f"limit (line {item.location.line})"
        case syntax.Component():
            return f"component `{item.name.text}`"
        case syntax.ObjectDefinition() | syntax.EnumDefinition():
            return f"datatype `{item.name.text}`"
        case syntax.Constant():
            return f"constant `{item.name.text}`"
        case _:
            return ""
