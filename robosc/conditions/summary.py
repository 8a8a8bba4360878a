"""A supervisor in figures and words: what `synth` prints, on this machine or from a service."""

import textwrap
from collections.abc import Collection, Iterable, Sequence

import msgspec

from robosc.automata import System
from robosc.automata.plants import communication_plant_name
from robosc.conditions.goals import Formula, GoalInWords, assumption_text, goals_and_visits, goals_in_words
from robosc.conditions.literals import Vocabulary
from robosc.conditions.rendering import Formulas, diagram_lines, in_words, size_in_words
from robosc.conditions.requirements import invariant_text, requirement_text
from robosc.expressions import TRUE, Expression
from robosc.model.structure import Model
from robosc.supervisor import AddedCondition, Certificate, DecisionDiagram, Supervisor, certified_states
from robosc.supervisor.diagram import diagram_domains

_WIDTH = 100
"""Columns that a condition takes in the summary for people; it goes on in the next line."""

_NODES = 150
"""Nodes that the diagrams in a text for people may have together; a larger one is replaced by its size."""

_RANGES = 600
"""Ranges of values that the nodes of these diagrams may distinguish together: each is a test in the text."""

FROM_THE_FIRST = ", to be read from [1] on:"
"""Words between a diagram's size and its nodes."""

MEANWHILE = "meanwhile for others"
"""Words before the condition of a request that is taken along for other goals."""

ELSEWHERE = "; --json lists its nodes"
"""Words after the size of a diagram that is not written node by node."""

_TRUE = DecisionDiagram((), 1)


def summary_json(supervisor: Supervisor) -> dict[str, object]:
    """The summary as JSON values."""
    system = supervisor.executable.automata
    variables = _variables(supervisor.model)
    certificate = supervisor.certificate
    components = _components(supervisor)
    vocabulary = Vocabulary(diagram_domains(system), components)
    added = added_formulas(supervisor.added, system)
    goals_vocabulary = Vocabulary(diagram_domains(supervisor.executable.remembering_automata), components)
    return {
        "model": supervisor.model.name,
        "deployment": str(supervisor.deployment),
        "events": {
            "controllable": sum(event.is_controllable for event in system.events),
            "uncontrollable": sum(not event.is_controllable for event in system.events),
        },
        "variables": {"synthesis": variables[0], "code_only": variables[1]},
        "components": len(supervisor.model.components),
        "communications": len(supervisor.model.communications),
        "requirements": len(supervisor.model.requirements) + len(supervisor.model.invariants),
        "state_invariants": len(supervisor.model.invariants),
        "states": int(certificate.states) or None,
        "transitions": None if certificate.transitions is None else int(certificate.transitions),
        "modules": [
            {
                "components": list(item.components),
                "requirements": list(item.requirements),
                "states": item.states,
                "group": item.group,
            }
            for item in modules_in_words(supervisor)
        ],
        "added": {event: condition_line(diagram, formula, components) for event, diagram, formula in added},
        "diagrams": {event: _diagram_json(diagram, vocabulary) for event, diagram, formula in added if formula is None},
        "goals": [_goal_json(goal, goals_vocabulary, components) for goal in goals_in_words(supervisor)],
        "assumptions": [assumption_text(item) for item in supervisor.model.assumptions],
        "certificate": {
            "engine_version": certificate.engine_version,
            "bundle_sha256": certificate.bundle_sha256,
            "method": certificate.method,
            **_checks(certificate),
        },
        "controller": None if certificate.controller is None else msgspec.to_builtins(certificate.controller),
    }


def _diagram_json(diagram: DecisionDiagram, vocabulary: Vocabulary) -> list[dict[str, object]]:
    return [line.json() for line in diagram_lines(diagram, vocabulary)]


def _goal_json(goal: GoalInWords, vocabulary: Vocabulary, components: frozenset[str]) -> dict[str, object]:
    def listed(choices: Iterable[Formula]) -> list[dict[str, object]]:
        return [
            {
                "event": event,
                "condition": condition_line(diagram, formula, components),
                **({} if formula is not None else {"diagram": _diagram_json(diagram, vocabulary)}),
            }
            for event, diagram, formula in choices
        ]

    return {
        "name": goal.name,
        "goal": goal.text,
        "choices": listed(goal.choices),
        "meanwhile": listed(goal.meanwhile),
    }


def summary_text(supervisor: Supervisor) -> str:
    """The summary for people."""
    system = supervisor.executable.automata
    certificate = supervisor.certificate
    controllable = sum(event.is_controllable for event in system.events)
    synthesis, code_only = _variables(supervisor.model)
    transitions = f", {certificate.transitions} transitions" if certificate.transitions is not None else ""
    rows = [
        ("events", f"{len(system.events)}: {controllable} controllable, {len(system.events) - controllable} not"),
        ("variables", f"{synthesis + code_only}: {synthesis} in synthesis, {code_only} code-only"),
        ("requirements", _requirements(supervisor.model)),
        ("controlled", f"{certified_states(certificate)}{transitions}"),
    ]
    lines = [f"{supervisor.model.name}: a supervisor exists ({supervisor.deployment})"]
    lines += [f"  {name:<13} {text}" for name, text in rows]
    lines += [f"  {line}" for line in module_lines(supervisor)]
    lines.append("  the supervisor adds to each controllable event")
    lines += [f"    {line}" for line in added_lines(supervisor, system)]
    lines += [f"  {line}" for line in strategy_lines(supervisor)]
    if certificate.controller is not None:
        found = certificate.controller
        lines.append("  controller")
        lines.append(f"    {'finite response':<21} {found.finite_response}")
        lines.append(f"    {'confluence':<21} {found.confluence}")
        lines.append(f"    {'nonblocking':<21} {found.nonblocking}")
        if found.cancels is not None:
            lines.append(f"    {'cancels possible':<21} {found.cancels}")
        lines.append(f"    {'method':<21} {found.method}")
    lines.append("  certificate")
    checks = _checks(certificate)
    lines += [f"    {name.replace('_', ' '):<21} {outcome}" for name, outcome in checks.items()]
    lines.append(f"    {'method':<21} {certificate.method}")
    lines.append(f"    {'bundle SHA-256':<21} {certificate.bundle_sha256}")
    return "\n".join(lines) + "\n"


class ModuleInWords(msgspec.Struct, frozen=True):
    """A module of a modular synthesis in the words of the model.

    Attributes:
        components: The components that it has something of.
        requirements: The requirements that are in it, wholly or partly.
        states: Reachable states under its own supervisor.
        group: Number of its group.
    """

    components: tuple[str, ...]
    requirements: tuple[str, ...]
    states: int
    group: int


def modules_in_words(supervisor: Supervisor) -> tuple[ModuleInWords, ...]:
    """Return the modules of a supervisor in the words of its model."""
    model, names = supervisor.model, _components(supervisor)
    owners = {item.name: item.name for item in model.components}
    owners |= {communication_plant_name(item): item.component for item in model.communications}
    return tuple(
        ModuleInWords(
            tuple(dict.fromkeys(owners[name] for name in module.automata)),
            (
                *(requirement_text(model.requirements[number], names) for number in module.requirements),
                *(invariant_text(model.invariants[number], names) for number in module.invariants),
            ),
            int(module.states),
            module.group,
        )
        for module in supervisor.modules
    )


def module_lines(supervisor: Supervisor) -> list[str]:
    """Return the modules of a supervisor for people, and which of them were found not to block each other."""
    modules = modules_in_words(supervisor)
    if not modules:
        return []
    lines = [f"it was synthesized in {len(modules)} module{'s' if len(modules) != 1 else ''}"]
    for number, module in enumerate(modules, start=1):
        rows = [f"{number}, {module.states} states: {', '.join(module.components)}", *module.requirements]
        lines += [f"  {'  ' * (place > 0)}{line}" for place, row in enumerate(rows) for line in _wrapped(row)]
    for group in sorted({module.group for module in modules}):
        members = [str(number) for number, module in enumerate(modules, start=1) if module.group == group]
        if len(members) > 1:
            lines += [
                f"  {line}"
                for line in _wrapped(f"nonblocking together, as found on abstractions: {', '.join(members)}")
            ]
    return lines


def added_texts(supervisor: Supervisor, system: System) -> dict[str, str]:
    """For each controllable event what the supervisor adds, in the model's words; `true` where nothing."""
    components = _components(supervisor)
    return {
        event: condition_line(diagram, formula, components)
        for event, diagram, formula in added_formulas(supervisor.added, system)
    }


def _components(supervisor: Supervisor) -> frozenset[str]:
    return frozenset(item.name for item in supervisor.model.components)


def added_formulas(
    added: Sequence[AddedCondition], system: System
) -> list[tuple[str, DecisionDiagram, Expression | None]]:
    """For each controllable event what a supervisor adds, and its formula if there is one that reads well.

    Args:
        added: Conditions that the supervisor adds.
        system: Automata that it supervises.
    """
    formulas = Formulas(diagram_domains(system))
    events = [event.name for event in system.events if event.is_controllable]
    diagrams = {item.event: item.condition for item in added}
    return [
        (event, diagram, formulas.formula(diagram))
        for event, diagram in ((event, diagrams.get(event, _TRUE)) for event in events)
    ]


def condition_line(diagram: DecisionDiagram, formula: Expression | None, components: frozenset[str]) -> str:
    """A condition in one line: its formula, or the size of its diagram where it has none that reads well."""
    return size_in_words(diagram) if formula is None else in_words(formula, components)


def added_lines(supervisor: Supervisor, system: System) -> list[str]:
    """Return the added conditions for people: formulas, and the lines of diagrams as long as they are few."""
    components = _components(supervisor)
    vocabulary = Vocabulary(diagram_domains(system), components)
    added = added_formulas(supervisor.added, system)
    short = short_diagrams(diagram for _, diagram, formula in added if formula is None)
    rows = [
        (event, ["nothing"] if formula == TRUE else _parts(diagram, formula, vocabulary, components, short))
        for event, diagram, formula in added
    ]
    return _table(rows)


def strategy_lines(supervisor: Supervisor) -> list[str]:
    """Return the choices of the strategy for people, goal by goal and visit by visit, then what is assumed.

    There are none without a strategy.
    """
    components = _components(supervisor)
    goals = goals_in_words(supervisor)
    if not goals:
        return []
    vocabulary = Vocabulary(diagram_domains(supervisor.executable.remembering_automata), components)
    every = (item for goal in goals for item in (*goal.choices, *goal.meanwhile))
    short = short_diagrams(diagram for _, diagram, formula in every if formula is None)
    what = goals_and_visits(supervisor)
    lines = [f"the strategy approaches its {what} in turn; it requests the first that applies"]
    if not any(goal.choices or goal.meanwhile for goal in goals):
        lines = [f"the strategy never requests anything: nothing has to be requested for its {what}"]
    for goal in goals:
        lines += [f"  {row}" for row in _wrapped(f"for {goal.name}, {goal.text}")]
        rows: list[tuple[str, list[str]]] = []
        for event, diagram, formula in goal.choices:
            parts = _parts(diagram, formula, vocabulary, components, short)
            always = "otherwise" if rows else "always"
            rows.append((event, [always] if formula == TRUE else [f"where {parts[0]}", *parts[1:]]))
        for event, diagram, formula in goal.meanwhile:
            parts = _parts(diagram, formula, vocabulary, components, short)
            rows.append((event, [MEANWHILE] if formula == TRUE else [f"{MEANWHILE}, where {parts[0]}", *parts[1:]]))
        if all(formula != TRUE for _, _, formula in (*goal.choices, *goal.meanwhile)):
            rows.append(("nothing", ["otherwise" if rows else "at all"]))
        lines += [f"    {line}" for line in _table(rows)]
    if supervisor.model.assumptions:
        lines.append("it assumes of the surroundings")
        for number, item in enumerate(supervisor.model.assumptions, start=1):
            lines += [f"  {row}" for row in _wrapped(f"assumption {number}, {assumption_text(item)}")]
    return lines


def _parts(
    diagram: DecisionDiagram,
    formula: Expression | None,
    vocabulary: Vocabulary,
    components: frozenset[str],
    short: Collection[DecisionDiagram],
) -> list[str]:
    """Return a condition in paragraphs: its formula, its diagram where that is short, or the diagram's size."""
    line = condition_line(diagram, formula, components)
    if formula is not None:
        return [line]
    if diagram in short:
        return [f"{line}{FROM_THE_FIRST}", *map(str, diagram_lines(diagram, vocabulary))]
    return [f"{line}{ELSEWHERE}"]


def _table(rows: Sequence[tuple[str, Sequence[str]]]) -> list[str]:
    """Return events in a column, with paragraphs about each beside it."""
    width = max((len(event) for event, _ in rows), default=0)
    lines: list[str] = []
    for event, paragraphs in rows:
        wrapped = [row for paragraph in paragraphs for row in _wrapped(paragraph)]
        lines += [f"{name:<{width}}  {row}" for name, row in zip([event, *[""] * len(wrapped)], wrapped, strict=False)]
    return lines


def short_diagrams(diagrams: Iterable[DecisionDiagram]) -> set[DecisionDiagram]:
    """Return those of some diagrams that a text writes node by node: the first ones that are short together."""
    found, nodes, ranges = set(), _NODES, _RANGES
    for diagram in diagrams:
        tested = sum(len(node.starts) for node in diagram.nodes)
        if len(diagram.nodes) <= nodes and tested <= ranges:
            nodes -= len(diagram.nodes)
            ranges -= tested
            found.add(diagram)
    return found


def _wrapped(text: str) -> list[str]:
    """The text in rows; names are never broken."""
    return textwrap.wrap(text, _WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)


def _requirements(model: Model) -> str:
    invariants = len(model.invariants)
    of_these = f", {invariants} of them state invariant{'s' * (invariants > 1)}" if invariants else ""
    return f"{len(model.requirements) + invariants}{of_these}"


def _variables(model: Model) -> tuple[int, int]:
    """Return the number of variables that take part in synthesis, and of those that do not."""
    flags = [
        v.is_synthesis for component in model.components if component.behaviour for v in component.behaviour.variables
    ]
    return sum(flags), len(flags) - sum(flags)


def _checks(certificate: Certificate) -> dict[str, str]:
    return {
        "safe": certificate.safe,
        "controllable": certificate.controllable,
        "nonblocking": certificate.nonblocking,
        "maximally_permissive": certificate.maximally_permissive,
        **({} if certificate.goals is None else {"goals": certificate.goals}),
    }
