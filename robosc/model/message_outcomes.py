"""Outcomes of messages in the behaviours of a robot: a message is no value, but its data may be kept in one."""

from collections.abc import Iterable, Mapping

from robosc.expressions import BooleanType
from robosc.language import syntax
from robosc.language.words import spelled
from robosc.model.behaviour import BehaviourTree
from robosc.model.communications import CommunicationTree
from robosc.model.outcomes import Outcome
from robosc.model.scope import ComponentNames


def message_outcomes(
    communications: Iterable[CommunicationTree],
    behaviours: Iterable[BehaviourTree],
    names: Mapping[str, ComponentNames],
) -> dict[str, Outcome]:
    """Return the outcomes of communications by their names."""
    found: dict[str, Outcome] = {}
    for item in communications:
        is_outgoing = isinstance(item.tree, syntax.Message) and item.tree.direction is syntax.Direction.OUTGOING
        own = names[item.part.name].variables if item.part.name in names else {}
        free = next((name for name, type_ in own.items() if isinstance(type_, BooleanType)), "")
        type_ = item.tree.type if isinstance(item.tree, syntax.Message) else item.tree.response
        has_data = not (isinstance(type_, syntax.BasicType) and type_.name is syntax.BasicTypeName.NONE)
        found.setdefault(item.tree.name.text, Outcome(not is_outgoing, has_data, item.part.name, free=free))
    for behaviour in behaviours:
        component = behaviour.part.name
        initial = next(
            (f"{component}.{spelled(state.name.text)}" for state in behaviour.states if state.is_initial), ""
        )
        for _, transition in behaviour.transitions:
            if not isinstance(transition, syntax.CommunicationTransition):
                continue
            outcome = found.get(transition.communication.text)
            if outcome is None:
                continue
            if transition.target is not None:
                state = f"{component}.{spelled(transition.target.text)}"
                outcome.states.setdefault(transition.kind, (state, initial))
            for update in transition.updates:
                value, root = update.value, update.target.root
                if isinstance(value, syntax.Access) and (value.root, value.steps) == (None, ()) and root is not None:
                    name = f"{component}.{spelled(root.text)}"
                    outcome.kept.setdefault(name, names[component].variables.get(root.text))
    return found


__all__ = ["message_outcomes"]
