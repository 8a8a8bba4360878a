"""A supervisor in figures and words: what `synth` prints, on this machine or from a service."""

import msgspec

from robosc.automata import System, to_automata
from robosc.expressions.text import expression_text
from robosc.model.structure import Model
from robosc.supervisor.diagram import diagram_domains, to_expression
from robosc.supervisor.structure import Certificate, DecisionDiagram, Supervisor

_EXPRESSION_LIMIT = 40
"""Operands up to which a condition is printed as a formula; a larger one is told by its size."""


def summary_json(supervisor: Supervisor) -> dict[str, object]:
    """The summary as JSON values."""
    system = to_automata(supervisor.model, supervisor.deployment)
    variables = _variables(supervisor.model)
    certificate = supervisor.certificate
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
        "requirements": len(supervisor.model.requirements),
        "states": int(certificate.states),
        "transitions": None if certificate.transitions is None else int(certificate.transitions),
        "added": added_texts(supervisor, system),
        "certificate": {
            "engine_version": certificate.engine_version,
            "bundle_sha256": certificate.bundle_sha256,
            "method": certificate.method,
            **_checks(certificate),
        },
        "controller": None if certificate.controller is None else msgspec.to_builtins(certificate.controller),
    }


def summary_text(supervisor: Supervisor) -> str:
    """The summary for people."""
    system = to_automata(supervisor.model, supervisor.deployment)
    certificate = supervisor.certificate
    controllable = sum(event.is_controllable for event in system.events)
    synthesis, code_only = _variables(supervisor.model)
    transitions = f", {certificate.transitions} transitions" if certificate.transitions is not None else ""
    rows = [
        ("events", f"{len(system.events)}: {controllable} controllable, {len(system.events) - controllable} not"),
        ("variables", f"{synthesis + code_only}: {synthesis} in synthesis, {code_only} code-only"),
        ("requirements", f"{len(supervisor.model.requirements)}"),
        ("controlled", f"{certificate.states} states{transitions}"),
    ]
    lines = [f"{supervisor.model.name}: a supervisor exists ({supervisor.deployment})"]
    lines += [f"  {name:<13} {text}" for name, text in rows]
    lines.append("  the supervisor adds to each controllable event")
    added = added_texts(supervisor, system)
    width = max((len(event) for event in added), default=0)
    lines += [f"    {event:<{width}}  {text if text != 'true' else 'nothing'}" for event, text in added.items()]
    if certificate.controller is not None:
        found = certificate.controller
        lines.append("  controller")
        lines.append(f"    {'finite response':<21} {found.finite_response}")
        lines.append(f"    {'confluence':<21} {found.confluence}")
        lines.append(f"    {'nonblocking':<21} {found.nonblocking}")
        lines.append(f"    {'method':<21} {found.method}")
    lines.append("  certificate")
    checks = _checks(certificate)
    lines += [f"    {name.replace('_', ' '):<21} {outcome}" for name, outcome in checks.items()]
    lines.append(f"    {'method':<21} {certificate.method}")
    lines.append(f"    {'bundle SHA-256':<21} {certificate.bundle_sha256}")
    return "\n".join(lines) + "\n"


def added_texts(supervisor: Supervisor, system: System) -> dict[str, str]:
    """For each controllable event what the supervisor adds, in the model's words; `true` where nothing."""
    domains = diagram_domains(system)

    def text(diagram: DecisionDiagram | None) -> str:
        if diagram is None:
            return "true"
        expression = to_expression(diagram, domains, limit=_EXPRESSION_LIMIT)
        return (
            f"a decision diagram of {len(diagram.nodes)} nodes" if expression is None else expression_text(expression)
        )

    return {
        event.name: text(supervisor.added_condition(event.name)) for event in system.events if event.is_controllable
    }


def _variables(model: Model) -> tuple[int, int]:
    """How many variables take part in synthesis, and how many do not."""
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
    }
