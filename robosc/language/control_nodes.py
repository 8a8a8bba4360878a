"""Control nodes of behaviour trees and SMACH in a text: their words and their content.

The language has no control nodes, but people who know behaviour trees write them. `control_node_advice` says how to
write such a node in this language, with the names that it uses.

Sources: M. Colledanchise, P. Ogren, Behavior Trees in Robotics and AI, 2018, ch. 1; the nodes of BehaviorTree.CPP,
py_trees and Nav2, and the containers of SMACH, by their names there.
"""

from collections.abc import Iterator, Mapping
from enum import StrEnum, auto
from functools import cached_property

import msgspec

from robosc.language.tokens import Kind, Tokens
from robosc.language.words import RESERVED_WORDS, STARTS


class Family(StrEnum):
    """Way of a control node with its children; nodes of different names may have the same."""

    SEQUENCE = auto()
    STATE_MACHINE = auto()
    REACTIVE_SEQUENCE = auto()
    PIPELINE = auto()
    ROUND_ROBIN = auto()
    FALLBACK = auto()
    REACTIVE_FALLBACK = auto()
    RECOVERY = auto()
    PARALLEL = auto()
    IF_THEN_ELSE = auto()
    SWITCH = auto()
    CONDITION = auto()
    INVERTER = auto()
    FORCE_SUCCESS = auto()
    FORCE_FAILURE = auto()
    RETRY = auto()
    REPEAT = auto()
    KEEP_RUNNING = auto()
    RUN_ONCE = auto()
    TIMEOUT = auto()
    RATE = auto()
    TREE = auto()


_NAMES = {
    Family.SEQUENCE: "sequence sequencestar sequencewithmemory memorysequence asyncsequence",
    Family.STATE_MACHINE: "statemachine",
    Family.REACTIVE_SEQUENCE: "reactivesequence",
    Family.PIPELINE: "pipelinesequence pipeline",
    Family.ROUND_ROBIN: "roundrobin",
    Family.FALLBACK: (
        "fallback fallbackstar fallbackwithmemory memoryfallback asyncfallback selector selectorstar "
        "selectorwithmemory memoryselector priorityselector priority chooser"
    ),
    Family.REACTIVE_FALLBACK: "reactivefallback reactiveselector",
    Family.RECOVERY: "recovery recoverynode",
    Family.PARALLEL: "parallel parallelall concurrence concurrent",
    Family.IF_THEN_ELSE: "ifthenelse whiledoelse",
    Family.SWITCH: "switch manualselector",
    Family.CONDITION: "condition precondition eternalguard blackboardcheck",
    Family.INVERTER: "inverter inverse invert negation",
    Family.FORCE_SUCCESS: "forcesuccess failureissuccess alwayssuccess succeeder failureisrunning",
    Family.FORCE_FAILURE: "forcefailure successisfailure alwaysfailure failer successisrunning",
    Family.RETRY: "retry retryuntilsuccessful retryuntilsuccesful retryuntilsuccess",
    Family.REPEAT: "repeat repeater loop iterator loopuntil",
    Family.KEEP_RUNNING: "keeprunninguntilfailure keeprunning repeatuntilfailure untilfail untilfailure",
    Family.RUN_ONCE: "runonce oneshot singletrigger",
    Family.TIMEOUT: "timeout",
    Family.RATE: "ratecontroller rate delay cooldown throttle distancecontroller speedcontroller count",
    Family.TREE: (
        "root tree behaviortree behaviourtree subtree subtreeplus decorator composite control "
        "goalupdater goalupdatedcontroller pathlongeronapproach statustoblackboard"
    ),
}
_FAMILY_OF = {name: family for family, names in _NAMES.items() for name in names.split()}

_DECLARES = frozenset(STARTS) - {"action", "service"}
"""Words that begin items of the language: what has them in it is no list of children."""

_JOINS = frozenset({"=", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "and", "or"})
_CLOSING = {"{": "}", "(": ")", "[": "]"}
_MOST_NODES = 200
_DEEPEST = 20


def family_of(word: str) -> Family | None:
    """The family of a control node by its name, in any spelling; None: a word is no name of one."""
    name = word.casefold().replace("_", "")
    for shorter in (name, name.rstrip("0123456789"), name.removesuffix("node"), name.removesuffix("decorator")):
        if family := _FAMILY_OF.get(shorter):
            return family
    return None


class Leaf(msgspec.Struct, frozen=True):
    """Child that has no children.

    Attributes:
        text: Name of a communication, or a condition.
        is_condition: True if it is a condition.
        is_requested: True if the robot requests it.
        is_answered: True if something is received from it.
        can_fail: True if it may end in an error.
        is_known: False if nothing in the text declares it.
    """

    text: str
    is_condition: bool = False
    is_requested: bool = False
    is_answered: bool = False
    can_fail: bool = False
    is_known: bool = True


class Node(msgspec.Struct, frozen=True):
    """Control node.

    Attributes:
        family: Its way with its children.
        children: Nodes and leaves in it, in their order.
        count: A whole number among its arguments, as the tries of a Retry have it.
        name: Name of its own, or empty.
    """

    family: Family
    children: tuple["Node | Leaf", ...] = ()
    count: int | None = None
    name: str = ""

    def leaves(self) -> Iterator[Leaf]:
        """All leaves below it, in the order of the text."""
        for child in self.children:
            if isinstance(child, Leaf):
                yield child
            else:
                yield from child.leaves()


class Declared:
    """Names that a text declares, as far as they can be reported in a text with errors.

    Args:
        tokens: All of the text.
    """

    def __init__(self, tokens: Tokens) -> None:
        self.tokens = tokens

    @cached_property
    def _read(self) -> tuple[Mapping[str, Leaf], Mapping[str, Leaf]]:
        """The communications by their names without regard to case, and the first request of each component."""
        texts, kinds, _ = self.tokens
        found: dict[str, Leaf] = {}
        used: dict[str, Leaf] = {}
        first: dict[str, Leaf] = {}
        component, is_in_set = "", False
        for index in range(1, kinds.index(Kind.END)):
            word, name = texts[index], texts[index + 1]
            # The names in braces of a requirement.
            is_in_set = (word == "{" and texts[index - 1] in ("requirement", "disables")) or (is_in_set and word != "}")
            if kinds[index + 1] != Kind.NAME:
                continue
            leaf = None
            if word == "component":
                component = name
            elif word == "message" and texts[index - 1] in ("incoming", "outgoing"):
                is_incoming = texts[index - 1] == "incoming"
                leaf = Leaf(name, is_requested=is_incoming, is_answered=not is_incoming)
            elif word in ("service", "action") and texts[index + 2] == "with":
                leaf = Leaf(name, is_requested=True, is_answered=True, can_fail=True)
            elif word in ("to", "from") and texts[index - 2] == "on":
                # The text has only the use of an imported component.
                is_incoming = texts[index - 1] == "request"
                used.setdefault(name.casefold(), Leaf(name, is_requested=is_incoming, is_answered=not is_incoming))
            elif (
                is_in_set or word in ("provide", "disables") or (word == "requirement" and texts[index + 2] == "needs")
            ):
                used.setdefault(name.casefold(), Leaf(name, is_requested=True))
            if leaf is not None:
                found.setdefault(name.casefold(), leaf)
                if leaf.is_requested:
                    first.setdefault(component, leaf)
        return {**found, **{name: leaf for name, leaf in used.items() if name not in found}}, first

    @property
    def communications(self) -> Mapping[str, Leaf]:
        """Leaves by the names of communications without regard to case: those declared, then those only used."""
        return self._read[0]

    def request_of(self, component: str) -> Leaf | None:
        """The first request of a component, or None."""
        return self._read[1].get(component)

    @cached_property
    def requests(self) -> tuple[Leaf, ...]:
        """The communications that the robot requests, in the order of the text."""
        return tuple(leaf for leaf in self.communications.values() if leaf.is_requested)

    @cached_property
    def components(self) -> frozenset[str]:
        """Names of the components."""
        texts, kinds, _ = self.tokens
        return frozenset(
            name
            for word, name, kind in zip(texts, texts[1:], kinds[1:], strict=False)
            if word == "component" and kind == Kind.NAME
        )

    @cached_property
    def condition(self) -> str:
        """A condition made of names of the text: a boolean variable, else a state; empty where there is none."""
        texts, kinds, _ = self.tokens
        component, state = "", ""
        for index, word in enumerate(texts[: kinds.index(Kind.END)]):
            if kinds[index + 1] != Kind.NAME:
                continue
            if word == "component":
                component = texts[index + 1]
            elif word == "variable" and component and texts[index + 2 : index + 4] == [":", "boolean"]:
                return f"{component}.{texts[index + 1]}"
            elif word == "state" and component and not state:
                state = f"{component}.{texts[index + 1]}"
        return state

    def choice(self, wanted: frozenset[str] = frozenset()) -> tuple[str, tuple[str, ...]] | None:
        """An enum variable and the values that it may have, one of those wanted if there is one.

        Args:
            wanted: Conditions of which one may be the variable.
        """
        texts, kinds, _ = self.tokens
        enums: dict[str, tuple[str, ...]] = {}
        variables: dict[str, tuple[str, ...]] = {}
        component = ""
        end = kinds.index(Kind.END)
        for index in range(end - 1):
            if texts[index] == "enum" and kinds[index + 1] == Kind.NAME:
                close = next((at for at in range(index, end) if texts[at] == "}"), end)
                enums[texts[index + 1]] = tuple(
                    dict.fromkeys(texts[at + 1] for at in range(index, close) if texts[at] == "->")
                )
        for index in range(end - 3):
            if texts[index] == "component":
                component = texts[index + 1]
            elif texts[index] == "variable" and texts[index + 2] == ":" and texts[index + 3] in enums:
                variables[f"{component}.{texts[index + 1]}"] = enums[texts[index + 3]]
        name = next((each for each in variables if each in wanted), next(iter(variables), None))
        return None if name is None else (name, variables[name])


class NodeReader:
    """Reads control nodes from tokens; never raises.

    Args:
        text: All of the text.
        tokens: Its tokens.
        declared: Names in it.
    """

    def __init__(self, text: str, tokens: Tokens, declared: Declared) -> None:
        self._text = text
        self._texts, self._kinds, self._starts = tokens
        self._declared = declared
        self._nodes = 0

    def read(self, index: int) -> tuple[Node, int] | None:
        """Read the node at a token, with the index behind it; None: there is none that can be read."""
        self._nodes = 0
        try:
            return self._node(index, 0)
        except ValueError:
            return None

    def _node(self, index: int, depth: int) -> tuple[Node, int]:
        self._count(depth)
        family = family_of(self._texts[index])
        if family is None:
            raise ValueError
        begin, name, counts = index, "", list[int]()
        children: list[Node | Leaf] = []
        index += 1
        while True:
            token = self._texts[index]
            if token == "{":
                found, index = self._children(index, depth, counts)
                return Node(family, (*children, *found), next(iter(counts), None), name), index
            if token in ("(", "["):
                found, index = self._children(index, depth, counts)
                children += found
            elif self._kinds[index] in (Kind.NUMBER, Kind.STRING) or token in (":", "*", "->", "="):
                counts += [int(token)] if token.isdecimal() and len(token) < 10 else []
                index += 1
            elif self._is_argument(index):
                counts += [int(self._texts[index + 2])] if self._texts[index + 2].isdecimal() else []
                index += 3
            elif (
                self._kinds[index] == Kind.NAME and self._texts[index + 1] in ("{", "(", ":") and not (family_of(token))
            ):
                name = token
                index += 1
            elif not children and self._is_on_line(begin, index) and self._begins_child(index):
                return self._rest_of_line(family, name, begin, index, depth)
            else:
                return Node(family, tuple(children), next(iter(counts), None), name), index

    def _count(self, depth: int) -> None:
        """Count a node or child; the time of reading is bounded by their number."""
        self._nodes += 1
        if self._nodes > _MOST_NODES or depth > _DEEPEST:
            raise ValueError

    def _rest_of_line(self, family: Family, name: str, begin: int, index: int, depth: int) -> tuple[Node, int]:
        """Read a node without braces: its children are what follows on the line."""
        counts: list[int] = []
        children: list[Node | Leaf] = []
        while self._is_on_line(begin, index) and self._texts[index] not in ("}", ")", "]", *_DECLARES):
            child, index = self._child(index, depth, counts)
            children += child
        return Node(family, tuple(children), next(iter(counts), None), name), index

    def _children(self, index: int, depth: int, counts: list[int]) -> tuple[list[Node | Leaf], int]:
        """Read what stands in brackets, the index behind them."""
        closing = _CLOSING[self._texts[index]]
        children: list[Node | Leaf] = []
        index += 1
        while (token := self._texts[index]) != closing:
            if self._kinds[index] == Kind.END or token in _DECLARES or token in ("}", ")", "]"):
                raise ValueError
            child, index = self._child(index, depth, counts)
            children += child
        return children, index + 1

    def _child(self, index: int, depth: int, counts: list[int]) -> tuple[list[Node | Leaf], int]:
        """Read one child, none of a sign or argument; the index behind it."""
        self._count(depth)
        token, following = self._texts[index], self._texts[index + 1]
        is_name = self._kinds[index] == Kind.NAME
        if token in ("(", "[", "{"):
            if token == "(" and self._is_condition(index + 1):
                return self._condition(index)
            return self._children(index, depth + 1, counts)
        if is_name and following == "with":
            raise ValueError
        if family_of(token) is not None and token.casefold() not in self._declared.communications:
            node, index = self._node(index, depth + 1)
            return [node], index
        if token == "!" or self._is_condition(index):
            return self._condition(index)
        if self._is_argument(index):
            counts += [int(self._texts[index + 2])] if self._texts[index + 2].isdecimal() else []
            return [], index + 3
        if self._kinds[index] == Kind.NUMBER:
            counts += [int(token)] if token.isdecimal() and len(token) < 10 else []
        if is_name and token.casefold() not in ("then", "else", "ticks"):
            known = self._declared.communications.get(token.casefold()) or self._declared.request_of(token)
            leaf = known or Leaf(token, is_requested=True, is_known=False)
            index += 1
            if self._texts[index] in ("(", "{"):
                _, index = self._children(index, depth, [])
            return [leaf], index
        return [], index + 1

    def _is_argument(self, index: int) -> bool:
        """True if a named argument is next, such as `hz=1.0`."""
        return (
            self._kinds[index] == Kind.NAME
            and self._texts[index + 1] in ("=", ":")
            and self._kinds[index + 2] in (Kind.NUMBER, Kind.STRING)
        )

    def _is_condition(self, index: int) -> bool:
        is_not = self._texts[index] == "not" and self._kinds[index + 1] == Kind.NAME
        return is_not or (self._kinds[index] == Kind.NAME and self._texts[index + 1] == ".")

    def _begins_child(self, index: int) -> bool:
        return self._kinds[index] == Kind.NAME or self._texts[index] == "!"

    def _condition(self, index: int) -> tuple[list[Node | Leaf], int]:
        """Read a condition: operands of names and points, and what joins them."""
        begin = index
        while True:
            while self._texts[index] in ("!", "not"):
                index += 1
            if self._texts[index] == "(":
                depth = 0
                while self._kinds[index] != Kind.END:
                    depth += (self._texts[index] == "(") - (self._texts[index] == ")")
                    index += 1
                    if not depth:
                        break
            else:
                index += 1
                while self._texts[index] == ".":
                    index += 2
            if self._texts[index] not in _JOINS or self._kinds[index] == Kind.END:
                break
            index += 1
        if self._kinds[index - 1] == Kind.END:
            raise ValueError
        written = self._text[self._starts[begin] : self._starts[index - 1] + len(self._texts[index - 1])]
        if "'" in written or "\n" in written:
            raise ValueError
        return [Leaf(written, is_condition=True)], index

    def _is_on_line(self, begin: int, index: int) -> bool:
        """True if a token stands on the line of another one before it."""
        return self._kinds[index] != Kind.END and "\n" not in self._text[self._starts[begin] : self._starts[index]]


def is_free(name: str, declared: Declared) -> bool:
    """Return True if a component may be called so."""
    taken = {each.casefold() for each in declared.components}
    return name.isidentifier() and name.isascii() and name not in RESERVED_WORDS and name.casefold() not in taken


__all__ = ["Declared", "Family", "Leaf", "Node", "NodeReader", "family_of", "is_free"]
