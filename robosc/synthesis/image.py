"""Images of sets of states under an event, forwards or backwards, as operations of an engine one after the other."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from robosc.synthesis.engines import Manager
from robosc.synthesis.nodes import assigned, met, renamed


class Image(msgspec.Struct, frozen=True, kw_only=True):
    """Function from sets of states to sets of states: the operations below, in this order.

    Attributes:
        manager: The manager of all predicates.
        inside: States that count.
        needed: Predicate that variables have the values of `constants`: nothing comes of a set without such states.
            None if there are no such values.
        constants: Truth values that variables take.
        functions: Predicates that variables take, all at once.
        relation: Predicate that is conjoined.
        hidden: Variables that are then free to be either.
        names: Variables that are called otherwise in the end.
        outside: States that alone can be what comes of it.
    """

    manager: Manager
    relation: Any
    inside: Any = None
    needed: Any = None
    constants: Mapping[str, bool] = msgspec.field(default_factory=dict)
    functions: Mapping[str, Any] = msgspec.field(default_factory=dict)
    hidden: Sequence[str] = ()
    names: Mapping[str, str] = msgspec.field(default_factory=dict)
    outside: Any = None

    def __call__(self, states: Any) -> Any:
        """Return what comes of a set of states; from two sets comes what comes from each of them."""
        manager = self.manager
        if self.inside is not None:
            states = states & self.inside
        if self.needed is not None and states & self.needed == manager.false:
            return manager.false
        if self.constants:
            states = assigned(manager, self.constants, self.needed, states)
        if self.functions:
            states = manager.let(self.functions, states)
        states = met(manager, self.hidden, states, self.relation)
        if self.names:
            states = renamed(manager, self.names, states)
        return states if self.outside is None else states & self.outside
