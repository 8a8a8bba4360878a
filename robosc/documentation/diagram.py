"""A component's automaton as a Mermaid state diagram (https://mermaid.js.org/syntax/stateDiagram.html).

States get identifiers of our own (`s1`, `s2`, ...) and their names as labels, because a state's name may be a keyword
of Mermaid (`end`, `state`, `note`). In labels, every character with a meaning in Mermaid is written as a reference by
number, such as `#59;` for a semicolon.
"""

import re
from dataclasses import dataclass

from robosc.expressions.text import expression_text
from robosc.model.structure import Behaviour, Transition
from robosc.source import visible

MAXIMUM_TRANSITIONS = 100
"""Transitions in a diagram; a larger one is unreadable (and viewers refuse 500)."""

MAXIMUM_LABEL = 100
"""Characters of a transition's label."""

_SPECIAL = re.compile(r"[^A-Za-z0-9_ .,()\[\]=!/+-]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])")
"""Characters that could mean something to Mermaid or, as underscores at a word's edge, to Markdown in its labels."""
_ANY = "any"


@dataclass(frozen=True, slots=True)
class Diagram:
    """A diagram of a behaviour.

    Attributes:
        text: Its Mermaid text, or empty if it would be too large.
        has_any: True if it shows transitions that stand in every state.
        is_complete: True if it shows everything: nothing is left out or cut.
    """

    text: str
    has_any: bool
    is_complete: bool


def diagram(behaviour: Behaviour) -> Diagram:
    """The state diagram of a behaviour."""
    has_any = any(transition.source is None for transition in behaviour.transitions)
    if len(behaviour.transitions) > MAXIMUM_TRANSITIONS or len(behaviour.states) > MAXIMUM_TRANSITIONS:
        return Diagram("", has_any, is_complete=False)
    labels = [label(transition) for transition in behaviour.transitions]
    return Diagram(
        "\n".join(_lines(behaviour, labels, has_any)),
        has_any,
        is_complete=all(len(text) <= MAXIMUM_LABEL for text in labels),
    )


def label(transition: Transition) -> str:
    """Return the label of a transition: `event [guard] / updates`, as plain text on one line."""
    guard = f" [{visible(expression_text(transition.guard))}]" if transition.guard is not None else ""
    return transition.event + guard + (f" / {updates_text(transition)}" if transition.updates else "")


def updates_text(transition: Transition) -> str:
    """The updates of a transition as plain text on one line, empty if there are none."""
    return ", ".join(f"{item.variable} := {visible(expression_text(item.expression))}" for item in transition.updates)


def _lines(behaviour: Behaviour, labels: list[str], has_any: bool) -> list[str]:
    places: dict[str | None, str] = {state.name: f"s{number}" for number, state in enumerate(behaviour.states, 1)}
    places[None] = _ANY
    lines = ["stateDiagram-v2"]
    lines += [f'    state "{_escaped(state.name)}" as {places[state.name]}' for state in behaviour.states]
    if has_any:
        lines.append(f'    state "(any state)" as {_ANY}')
    lines.append(f"    [*] --> {places[behaviour.initial]}")
    for transition, text in zip(behaviour.transitions, labels, strict=True):
        source = places[transition.source]
        target = source if transition.target is None else places[transition.target]
        lines.append(f"    {source} --> {target} : {_escaped(_cut(text))}")
    marked = [places[state.name] for state in behaviour.states if state.is_marked]
    if marked:
        lines += ["    classDef marked stroke-width:4px", f"    class {','.join(marked)} marked"]
    if has_any:
        lines += ["    classDef anyState stroke-dasharray:4", f"    class {_ANY} anyState"]
    return lines


def _cut(text: str) -> str:
    return text if len(text) <= MAXIMUM_LABEL else f"{text[: MAXIMUM_LABEL - 3]}..."


def _escaped(text: str) -> str:
    """Text for a label: no character in it means anything to Mermaid."""
    return _SPECIAL.sub(lambda found: f"#{ord(found[0])};", text)
