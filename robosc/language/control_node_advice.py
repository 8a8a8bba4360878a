"""Advice for users who write a control node of a behaviour tree: how to write it with components, states, requirements.

A condition before an action becomes a requirement. An order, or another way after a failure, becomes states of a
component. Some nodes need no replacement, because the executor already does the same.
"""

from collections.abc import Iterator, Sequence
from enum import Enum, auto
from itertools import chain, count

import msgspec
from msgspec.structs import replace

from robosc.language.control_node_states import FALLBACKS, TooLargeError, negation, states_of
from robosc.language.control_nodes import Declared, Family, Leaf, Node, is_free
from robosc.language.words import spelled

_WHY = {
    Family.SEQUENCE: "write an order as states, and what must hold before as a requirement",
    Family.STATE_MACHINE: "a state machine is a component with a behaviour",
    Family.REACTIVE_SEQUENCE: "write what must hold all the time as a requirement",
    Family.PIPELINE: "write what may go on while the next begins as states",
    Family.ROUND_ROBIN: "write turns as states",
    Family.FALLBACK: "write another way after a failure as states after 'error', and which of several requests "
    "that are allowed goes first in the deployment's setting 'priority'",
    Family.REACTIVE_FALLBACK: "write what must not hold as a requirement",
    Family.RECOVERY: "write another way after a failure as states after 'error'",
    Family.PARALLEL: "components run side by side anyway, and write what must not go together as requirements",
    Family.IF_THEN_ELSE: "write a choice as requirements",
    Family.SWITCH: "write a choice as requirements",
    Family.CONDITION: "write a condition as a requirement",
    Family.INVERTER: "'!' negates a condition, and 'error' is the failure of a service or action",
    Family.FORCE_SUCCESS: "'response' and 'error' may lead to the same state",
    Family.FORCE_FAILURE: "'response' and 'error' may lead to the same state",
    Family.RETRY: "what ended in an error may be requested again anyway",
    Family.REPEAT: "what is allowed is requested again anyway",
    Family.KEEP_RUNNING: "what is allowed is requested again anyway",
    Family.RUN_ONCE: "what happens once leads to a state that nothing leaves",
    Family.TIMEOUT: "the deployment's settings 'service_timeout' and 'action_timeout' say how long a reply may take",
    Family.RATE: "the deployment's setting 'period' says how often the executor decides",
    Family.TREE: "what is in a robot needs nothing around it",
}

_IN_ORDER = frozenset(
    {Family.SEQUENCE, Family.STATE_MACHINE, Family.REACTIVE_SEQUENCE, Family.PIPELINE, Family.CONDITION}
)
_AROUND = frozenset({Family.TIMEOUT, Family.RATE, Family.TREE})
"""Families of nodes that do nothing but what their child does."""
_IDLE = "initial marked state idle { }"
_LONGEST = 2000
"""Characters of a sentence."""


class Place(Enum):
    """Kind of the list that a node stands in."""

    ROBOT = auto()
    COMPONENT = auto()
    """A component without another behaviour."""
    BEHAVIOUR = auto()
    """A behaviour with nothing else in it."""
    ELSEWHERE = auto()


_TOO_LARGE = (
    "Remove it, and write a component in the robot with a state for each step: 'on request to' begins one, and "
    "'on response from' and 'on error from' lead to the next."
)


class _Part(msgspec.Struct, frozen=True):
    """A node in this language.

    Attributes:
        states: States of a behaviour, or empty.
        requirements: Requirements of the robot, or empty.
        unknown: Names of communications that have to be declared.
    """

    states: str
    requirements: str
    unknown: tuple[str, ...]


def why(family: Family) -> str:
    """The reason why a node of a family is not needed."""
    return _WHY[family]


def advise(node: Node, declared: Declared, place: Place, written: str) -> str:
    """Return the sentence that says what a control node is in this language.

    Args:
        node: The node.
        declared: Names of the text.
        place: The list that it stands in.
        written: Quotation of it.
    """
    try:
        parts = _parts(_filled(node, declared), declared)
    except TooLargeError:
        return _TOO_LARGE
    sentence = _sentence(parts, _names(node, declared), place, written)
    return sentence if len(sentence) <= _LONGEST else _TOO_LARGE


def _sentence(parts: Sequence[_Part], names: Iterator[str], place: Place, written: str) -> str:
    whole: list[str] = []
    for part in parts:
        declarations = " ".join(f"incoming message {spelled(name)} with type: none" for name in part.unknown)
        own = " ".join(filter(None, (declarations, f"behaviour {{ {part.states} }}" if part.states else "")))
        if len(parts) == 1 and not part.requirements:
            if place is Place.BEHAVIOUR and not declarations:
                return f"Write '{part.states or _IDLE}' instead of '{written}'."
            if place is Place.COMPONENT and own:
                return f"Write '{own}' instead of '{written}'."
        whole += [f"component {next(names)} {{ {own} }}"] if own else []
        whole += [part.requirements] if part.requirements else []
    if not whole:
        return f"Remove '{written}'."
    # A behaviour needs a state.
    where = {Place.ROBOT: "", Place.BEHAVIOUR: f" in the robot, and '{_IDLE}'"}.get(place, " in the robot")
    return f"Write '{' '.join(whole)}'{where} instead of '{written}'."


def _names(node: Node, declared: Declared) -> Iterator[str]:
    """Names for components that are free: the node's own one first, if it has one."""
    if is_free(node.name, declared):
        yield node.name
    names = chain(("Order",), (f"Order_{number}" for number in count(2)))
    yield from (name for name in names if name != node.name and is_free(name, declared))


def _filled(node: Node, declared: Declared) -> Node:
    """A node with names of the text where it has no children."""
    if any(True for _ in node.leaves()):
        return node
    requests = declared.requests
    conditions = (Leaf(declared.condition, is_condition=True),) if declared.condition else ()
    children: tuple[Leaf, ...] = ()
    match node.family:
        case Family.SEQUENCE | Family.STATE_MACHINE | Family.PIPELINE | Family.ROUND_ROBIN:
            children = requests[:2]
        case Family.FALLBACK | Family.RECOVERY:
            children = tuple(sorted(requests, key=lambda leaf: not leaf.can_fail))[:2]
        case Family.REACTIVE_SEQUENCE | Family.REACTIVE_FALLBACK | Family.CONDITION:
            children = (*conditions, *requests[:1]) if conditions else ()
        case Family.IF_THEN_ELSE:
            children = (*conditions, *requests[:2]) if conditions else ()
        case Family.SWITCH:
            children = requests[:2]
        case Family.INVERTER:
            children = conditions
        case _:
            pass
    return replace(node, children=children)


def _parts(node: Node, declared: Declared) -> tuple[_Part, ...]:
    """Return what a node is; the children of one that is parallel to nothing else go each by itself."""
    node = _plain(node, declared)
    if node.family is Family.PARALLEL and any(isinstance(child, Node) for child in node.children):
        parts = [replace(node, children=(child,)) if isinstance(child, Leaf) else child for child in node.children]
        return tuple(each for part in parts for each in _parts(part, declared))
    return (_part(node, declared),)


def _part(node: Node, declared: Declared) -> _Part:
    """Return what a node is, the shorter way if there is one."""
    leaves = tuple(dict.fromkeys(node.leaves()))
    unknown = tuple(dict.fromkeys(leaf.text for leaf in leaves if not leaf.is_known))
    requirements = _requirements(node, declared)
    if requirements is not None:
        return _Part("", " ".join(requirements), unknown)
    if _is_done_anyway(node):
        return _Part("", "", unknown)
    reactive: list[str] = []
    if node.family is Family.REACTIVE_SEQUENCE:
        conditions: list[str] = []
        for child in node.children:
            if isinstance(child, Leaf) and child.is_condition:
                conditions.append(child.text)
            elif conditions:
                names = child.leaves() if isinstance(child, Node) else (child,)
                reactive += [_needs(leaf, _all(conditions)) for leaf in names if leaf.is_requested]
        children = tuple(each for each in node.children if isinstance(each, Node) or not each.is_condition)
        node = replace(node, children=children)
    return _Part(states_of(node), " ".join(dict.fromkeys(reactive)), unknown)


def _plain(node: Node, declared: Declared) -> Node:
    """A node without those that have no leaves, and with choices as conditions."""
    children = tuple(_plain(child, declared) if isinstance(child, Node) else child for child in node.children)
    kept = tuple(child for child in children if isinstance(child, Leaf) or child.children)
    if node.family in _AROUND and len(kept) == 1 and isinstance(kept[0], Node):
        return kept[0]
    node = replace(node, children=kept)
    return _chosen(node, declared) if node.family is Family.SWITCH else node


def _chosen(node: Node, declared: Declared) -> Node:
    """A Switch as conditions one after the other; the last child is for all other values."""
    conditions = frozenset(child.text for child in node.children if isinstance(child, Leaf) and child.is_condition)
    cases = tuple(child for child in node.children if isinstance(child, Node) or not child.is_condition)
    choice = declared.choice(conditions)
    if len(cases) < 2 or choice is None:
        return replace(node, family=Family.FALLBACK, children=cases)
    variable, values = choice
    if len(cases) > len(values):
        raise TooLargeError
    found: Node | Leaf = cases[-1]
    for case, value in reversed(tuple(zip(cases[:-1], values, strict=False))):
        condition = Leaf(f"{variable} = {value}", is_condition=True)
        found = Node(Family.IF_THEN_ELSE, (condition, case, found))
    return found if isinstance(found, Node) else node


# Requirements


def _requirements(node: Node, declared: Declared) -> tuple[str, ...] | None:
    """The requirements that a node is; None: it needs states."""
    children = _unwrapped(node)
    if children is None:
        return None
    conditions = [child.text for child in children if child.is_condition]
    requests = [child for child in children if child.is_requested]
    is_before = all(child.is_condition for child in children[: len(conditions)])
    if not conditions or not is_before or len(requests) != len(children) - len(conditions):
        return None
    if not requests:
        requests = list(declared.requests[:1])
    match node.family:
        case Family.IF_THEN_ELSE if len(conditions) == 1 and len(requests) <= 2:
            wanted = (conditions[0], negation(conditions[0]))
            return tuple(_needs(leaf, text) for leaf, text in zip(requests, wanted, strict=False))
        case _ if len(requests) != 1:
            return None
        case family if family in FALLBACKS:
            return (_needs(requests[0], _all([negation(text) for text in conditions])),)
        case Family.INVERTER:
            return (_needs(requests[0], negation(_all(conditions))),)
        case family if family in _IN_ORDER:
            return (_needs(requests[0], _all(conditions)),)
        case _:
            return None


def _unwrapped(node: Node) -> tuple[Leaf, ...] | None:
    """The children as leaves, conditions below an Inverter negated; None: there are other nodes among them."""
    found: list[Leaf] = []
    for child in node.children:
        if isinstance(child, Leaf):
            found.append(child)
        elif child.family is Family.INVERTER and all(leaf.is_condition for leaf in child.leaves()):
            inner = _unwrapped(child)
            if inner is None:
                return None
            found.append(Leaf(negation(_all([leaf.text for leaf in inner])), is_condition=True))
        elif child.family in _AROUND or child.family is Family.CONDITION:
            inner = _unwrapped(child)
            if inner is None:
                return None
            found += inner
        else:
            return None
    return tuple(found)


def _needs(leaf: Leaf, condition: str) -> str:
    return f"requirement {spelled(leaf.text)} needs {condition}"


def _all(conditions: Sequence[str]) -> str:
    """The conjunction of conditions."""
    if len(conditions) == 1:
        return conditions[0]
    return " and ".join(f"({text})" if " or " in text else text for text in conditions)


def _is_done_anyway(node: Node) -> bool:
    """Return True if the executor does a node without a request for it."""
    leaves = list(node.leaves())
    if len(leaves) < 2 and node.family is not Family.RUN_ONCE:
        return not any(child.family is Family.RUN_ONCE for child in node.children if isinstance(child, Node))
    if node.family is Family.PARALLEL:
        return all(isinstance(child, Leaf) for child in node.children)
    # A node that cannot fail would leave the others waiting for ever.
    return node.family in FALLBACKS and not any(leaf.can_fail or leaf.is_condition for leaf in leaves[:-1])


__all__ = ["Place", "advise", "why"]
