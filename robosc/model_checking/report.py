"""Verdicts for people and for machines: each state of a run in the words of the model."""

import textwrap
from collections.abc import Iterator, Sequence

from robosc.automata.state import Subject, subject_domain, subjects
from robosc.automata.structure import System
from robosc.errors import Diagnostic
from robosc.expressions import Value
from robosc.expressions.text import automaton_text
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Model
from robosc.model_checking.formulas import formula_text
from robosc.model_checking.outcome import EvidenceRun, State, Verdict

_NOTHING = "(nothing can happen any more)"
_WIDTH, _NARROWEST = 110, 40
"""Columns of a line, and of what changes at least."""


def verdict_text(verdict: Verdict, system: System, model: Model) -> str:
    """A verdict as lines; the run event by event, each with what it changes."""
    claim = verdict.property
    name = f"{claim.name}: " if claim.name else ""
    lines = [f"{'holds' if verdict.holds else 'FAILS'}  {name}{claim.text}"]
    if verdict.run is not None:
        lines += [f"       {line}".rstrip() for line in _run_lines(verdict.run, system, _components(model))]
    return "\n".join(lines) + "\n"


def _components(model: Model) -> frozenset[str]:
    return frozenset(component.name for component in model.components)


def _run_lines(run: EvidenceRun, system: System, components: frozenset[str]) -> Iterator[str]:
    yield f"{run.kind}:"
    width = max(len(event or _NOTHING) for event in ("initially", *run.events))
    before: dict[str, str] = {}
    for number, state in enumerate(run.states):
        shown = {_name(subject, components): _value_text(value) for subject, value in _changing_values(system, state)}
        changes = ", ".join(f"{name} = {value}" for name, value in shown.items() if before.get(name) != value)
        before = shown
        event = run.events[number - 1] or _NOTHING if number else "initially"
        margin = f"{number:4}  {event.ljust(width)}  "
        lines = textwrap.wrap(changes, max(_WIDTH - len(margin), _NARROWEST), break_long_words=False)
        yield margin + (lines[0] if lines else "")
        yield from (" " * len(margin) + line for line in lines[1:])
    if run.loop is not None:
        yield f"      and so on for ever from {run.loop}"
    for item in run.left:
        holds = "holds" if item.holds else "does not hold"
        yield f"      in {item.place}, '{formula_text(item.formula, components)}' {holds}, which this run does not show"


def _changing_values(system: System, state: State) -> Iterator[tuple[Subject, Value]]:
    """Yield the subjects that can change, with their values: the plants of messages have one location only."""
    for subject, value in zip(subjects(system), state, strict=True):
        if subject.variable is not None or len(subject_domain(system, subject)) > 1:
            yield subject, value


def _name(subject: Subject, components: frozenset[str]) -> str:
    return str(subject) if subject.variable is not None else automaton_text(subject.automaton, components)


def _value_text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def verdicts_json(verdicts: Sequence[Verdict], system: System, model: Model) -> dict[str, object]:
    """All verdicts as JSON values; `status` is `holds` or `fails`."""
    return {
        "status": "holds" if all(verdict.holds for verdict in verdicts) else "fails",
        "properties": [_verdict_json(verdict, system, model) for verdict in verdicts],
    }


def property_errors_json(diagnostics: Sequence[Diagnostic]) -> dict[str, object]:
    """Report as JSON values that properties cannot be understood."""
    return {"status": "property errors", **diagnostics_json(diagnostics)}


def _verdict_json(verdict: Verdict, system: System, model: Model) -> dict[str, object]:
    """A verdict as JSON values."""
    return {
        "name": verdict.property.name or None,
        "property": verdict.property.text,
        "holds": verdict.holds,
        "run": None if verdict.run is None else _run_json(verdict.run, system, model),
    }


def _run_json(run: EvidenceRun, system: System, model: Model) -> dict[str, object]:
    return {
        "kind": str(run.kind),
        "states": [_state_json(system, model, state) for state in run.states],
        "events": list(run.events),
        "loop": run.loop,
        "left": [
            {"state": item.place, "property": formula_text(item.formula, _components(model)), "holds": item.holds}
            for item in run.left
        ],
    }


def _state_json(system: System, model: Model, state: State) -> dict[str, dict[str, Value]]:
    """A state in the form that `robosc explore --json` gives it."""
    components = {component.name for component in model.components}
    found: dict[str, dict[str, Value]] = {"components": {}, "variables": {}, "communications": {}}
    for subject, value in zip(subjects(system), state, strict=True):
        kind, _, name = subject.automaton.partition(" ")
        if subject.variable is not None:
            found["variables"][str(subject)] = value
        elif subject.automaton in components:
            found["components"][subject.automaton] = value
        elif kind in ("service", "action"):
            found["communications"][name] = value
    return found
