"""The page of a robot, section by section, from the checked model alone.

The same model gives the same bytes: everything is in the order of the model, and no time, version or path is written.
"""

from collections.abc import Callable, Sequence

from robosc.documentation.diagram import diagram, updates_text
from robosc.documentation.markdown import blocks, bullets, code, codes, count, entities, fence, heading, quoted, table
from robosc.documentation.sentences import (
    assumption_sentence,
    enum_sentences,
    goal_sentence,
    invariant_sentence,
    limit_sentence,
    mission_sentences,
    preference_sentence,
    provide_sentences,
    requirement_sentence,
    type_cell,
)
from robosc.errors import Diagnostic
from robosc.expressions import Constant, EnumType, NoneType, Type, Value
from robosc.expressions.text import expression_text
from robosc.model.communications import STANDARD_INTERFACES
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Model,
    State,
    Transition,
    Variable,
)

_DIRECTIONS = {
    CommunicationKind.INCOMING_MESSAGE: "controller → robot",
    CommunicationKind.OUTGOING_MESSAGE: "robot → controller",
    CommunicationKind.SERVICE: "controller ⇄ robot",
    CommunicationKind.ACTION: "controller ⇄ robot",
}


def page(model: Model, findings: Sequence[Diagnostic] = ()) -> str:
    """Return the Markdown page of a robot; it ends with a line end.

    Args:
        model: The checked robot.
        findings: Other findings of the check, reported in a section of their own.
    """
    sections = blocks(
        heading(1, code(model.name)),
        _overview(model),
        _components(model),
        _communications(model),
        _data_types(model),
        _requirements(model),
        _goals(model),
        _provides(model),
        _findings(findings),
    )
    return f"{sections}\n"


def _overview(model: Model) -> str:
    behaviours = [component.behaviour for component in model.components if component.behaviour]
    variables = [variable for behaviour in behaviours for variable in behaviour.variables]
    kinds = [item.kind for item in model.communications]
    rows = [
        ("components", len(model.components), f"{len(behaviours)} with a behaviour"),
        ("communications", len(kinds), ", ".join(_kind_counts(kinds))),
        ("states", sum(len(behaviour.states) for behaviour in behaviours), ""),
        ("variables", len(variables), f"{sum(item.is_synthesis for item in variables)} in synthesis"),
        (
            "data types",
            len(model.enums) + len(model.objects),
            f"{count(len(model.enums), 'enum')}, {count(len(model.objects), 'object')}",
        ),
        ("requirements", len(model.requirements) + len(model.invariants), _invariant_count(model)),
        *_goal_rows(model),
        ("provide statements", len(model.provides), ""),
        *([("limits", len(model.limits), "")] if model.limits else []),
    ]
    return blocks(
        heading(2, "Overview"),
        table(("what", "number", "of these"), [(what, str(number), of_these) for what, number, of_these in rows]),
    )


def _invariant_count(model: Model) -> str:
    return count(len(model.invariants), "state invariant") if model.invariants else ""


def _goal_rows(model: Model) -> list[tuple[str, int, str]]:
    """The rows of goals and assumptions, of missions and of preferences; none where the model has none of them."""
    rows: list[tuple[str, int, str]] = []
    if model.goals or model.assumptions:
        allowed = sum(item.is_allowed for item in model.assumptions)
        rows += [
            ("goals", len(model.goals), ""),
            ("assumptions", len(model.assumptions), f"{allowed} that the robot may break" if allowed else ""),
        ]
    if model.missions:
        visits = count(sum(len(mission.visits) for mission in model.missions), "visit")
        detours = sum(len(mission.detours) for mission in model.missions)
        rows.append(("missions", len(model.missions), f"{visits}, {count(detours, 'detour')}" if detours else visits))
    if model.preferences:
        rows.append(("preferences", len(model.preferences), ""))
    return rows


def _kind_counts(kinds: Sequence[CommunicationKind]) -> list[str]:
    return [count(kinds.count(kind), kind) for kind in CommunicationKind if kind in kinds]


# Components


def _components(model: Model) -> str:
    if not model.components:
        return ""
    own: dict[str, list[str]] = {component.name: [] for component in model.components}
    for item in model.communications:
        own[item.component].append(item.name)
    pages = (_component(component, own[component.name]) for component in model.components)
    return blocks(heading(2, "Components"), *pages)


def _component(component: Component, own: Sequence[str]) -> str:
    speaks = f"Communications: {codes(own)}." if own else "It has no communications."
    if component.behaviour is None:
        return blocks(heading(3, code(component.name)), speaks, "It has no behaviour: it reacts to nothing.")
    return blocks(heading(3, code(component.name)), speaks, _behaviour(component.behaviour))


def _behaviour(behaviour: Behaviour) -> str:
    drawn = diagram(behaviour)
    states = f"States: {', '.join(_state(state) for state in behaviour.states)}."
    hints = "Thick border: marked. " if any(state.is_marked for state in behaviour.states) else ""
    if drawn.has_any:
        hints += "The transitions of “(any state)” stand in every state; one that leads back to it stays in the state."
    tabled = "" if drawn.is_complete else _transitions(behaviour)
    picture = blocks(fence("mermaid", drawn.text), hints.strip()) if drawn.text else ""
    return blocks(states, picture, tabled, _variables(behaviour))


def _state(state: State) -> str:
    roles = [role for role, is_one in (("initial", state.is_initial), ("marked", state.is_marked)) if is_one]
    return code(state.name) + (f" ({', '.join(roles)})" if roles else "")


def _transitions(behaviour: Behaviour) -> str:
    return table(("from", "event", "guard", "updates", "to"), [_transition(item) for item in behaviour.transitions])


def _transition(transition: Transition) -> tuple[str, ...]:
    return (
        code(transition.source) if transition.source else "any state",
        code(transition.event),
        code(expression_text(transition.guard)) if transition.guard is not None else "",
        code(updates_text(transition)) if transition.updates else "",
        code(transition.target) if transition.target else "the same state",
    )


def _variables(behaviour: Behaviour) -> str:
    if not behaviour.variables:
        return ""
    return table(("variable", "type", "initial value", "used in"), [_variable(item) for item in behaviour.variables])


def _variable(variable: Variable) -> tuple[str, ...]:
    used = "synthesis" if variable.is_synthesis else "code only"
    return code(variable.name), type_cell(variable.type), code(_value_text(variable.type, variable.initial)), used


def _value_text(type_: Type, value: Value) -> str:
    """A value as a user writes it; one of an enum by its name."""
    return str(value) if isinstance(type_, EnumType) else expression_text(Constant(value))


# Communications and data types


def _communications(model: Model) -> str:
    if not model.communications:
        return ""
    columns = [(head, [cell(model, item) for item in model.communications]) for head, cell in _COLUMNS.items()]
    shown = [(head, cells) for head, cells in columns if any(cells)]
    return blocks(
        heading(2, "Communications"),
        table([head for head, _ in shown], zip(*(cells for _, cells in shown), strict=True)),
    )


def _data_cell(item: Communication) -> str:
    match item.kind:
        case CommunicationKind.INCOMING_MESSAGE:
            return type_cell(item.request)
        case CommunicationKind.OUTGOING_MESSAGE:
            return type_cell(item.response)
        case _:
            parts = (("request", item.request), ("response", item.response), ("feedback", item.feedback))
            return ", ".join(f"{name} {type_cell(type_)}" for name, type_ in parts if type_ is not None)


def _middleware_type(model: Model, item: Communication) -> str:
    """The linked type, else what a basic type crosses as."""
    if item.interface is not None:
        return f"{item.interface.package}/{item.interface.type}"
    type_ = item.request if item.kind is CommunicationKind.INCOMING_MESSAGE else item.response
    crossing = model.enum(type_.name).source if isinstance(type_, EnumType) else type_ or NoneType()
    return f"std_msgs/{STANDARD_INTERFACES[type(crossing)]}"


def _quality_cell(item: Communication) -> str:
    """Quality of service of a message: as the model says, or the default for its type."""
    if item.kind not in (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE):
        return ""
    return f"{code(item.effective_quality)}, depth {item.effective_depth}"


def _age_cell(item: Communication) -> str:
    return "" if item.max_age is None else f"{code(expression_text(Constant(item.max_age)))} s"


_COLUMNS: dict[str, Callable[[Model, Communication], str]] = {
    "name": lambda _, item: code(item.name),
    "component": lambda _, item: code(item.component),
    "kind": lambda _, item: str(item.kind),
    "direction": lambda _, item: _DIRECTIONS[item.kind],
    "identifier": lambda _, item: code(quoted(item.identifier)),
    "middleware type": lambda model, item: code(_middleware_type(model, item)),
    "data": lambda _, item: _data_cell(item),
    "QoS": lambda _, item: _quality_cell(item),
    "stale after": lambda _, item: _age_cell(item),
    "stamped with frame": lambda _, item: "" if item.frame is None else code(quoted(item.frame)),
    "when": lambda _, item: _when_cell(item),
}
"""The table of communications: each column's head and cells; a column without any content is left out."""


def _when_cell(item: Communication) -> str:
    if item.is_when_default:
        return code("default")
    return "" if item.when is None else code(expression_text(item.when))


def _data_types(model: Model) -> str:
    if not model.enums and not model.objects:
        return ""
    enums = [blocks(heading(3, code(item.name)), enum_sentences(item)) for item in model.enums]
    objects = [
        blocks(
            heading(3, code(item.name)),
            table(("property", "type"), [(code(part.name), type_cell(part.type)) for part in item.properties])
            if item.properties
            else "An object without properties.",
        )
        for item in model.objects
    ]
    return blocks(heading(2, "Data types"), *enums, *objects)


# Requirements, goals, missions and data of requests


def _requirements(model: Model) -> str:
    if not model.requirements and not model.invariants:
        return ""
    sentences = [*map(requirement_sentence, model.requirements), *map(invariant_sentence, model.invariants)]
    return blocks(heading(2, "Requirements"), bullets(sentences))


def _goals(model: Model) -> str:
    sections = (
        ("Goals", map(goal_sentence, model.goals)),
        ("Missions", map(mission_sentences, model.missions)),
        ("Preferences", map(preference_sentence, model.preferences)),
        ("Assumptions", map(assumption_sentence, model.assumptions)),
    )
    listed = [(title, list(sentences)) for title, sentences in sections]
    return blocks(*(blocks(heading(2, title), bullets(found)) for title, found in listed if found))


def _provides(model: Model) -> str:
    names = dict.fromkeys(item.communication for item in model.provides)
    if not names and not model.limits:
        return ""
    sentences = [provide_sentences(name, model.provides_for(name)) for name in names]
    sentences += map(limit_sentence, model.limits)
    return blocks(heading(2, "Data of requests"), bullets(sentences))


def _findings(findings: Sequence[Diagnostic]) -> str:
    if not findings:
        return ""
    return blocks(heading(2, "Findings"), bullets(map(_finding, findings)))


def _finding(finding: Diagnostic) -> str:
    place = f", line {finding.location.line}" if finding.location else ""
    return f"{finding.severity} ({finding.code}{place}): {entities(finding.message)}. {entities(finding.fix)}"
