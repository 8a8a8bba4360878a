"""Results that synthesis returns: outcomes are values."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from robosc.automata.structure import System
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.synthesis.questions import Answers


class SynthesisStatus(StrEnum):
    """Status at the end of a synthesis."""

    SUPERVISOR = "supervisor"
    EMPTY = "empty"
    """No supervisor can keep the system safe and nonblocking."""


@dataclass(frozen=True, slots=True)
class SynthesisProgress:
    """Progress of a synthesis.

    Attributes:
        phase: `encoding`; `coreachability`, `controllability` and, around these two, `fixed point`; `reachability`;
            where questions are asked that need it, again the fixed point, and `shortest runs`.
        iteration: Events encoded so far, or rounds of the phase.
        nodes: Nodes of what was found last: where an event is enabled, or a set of states.
    """

    phase: str
    iteration: int
    nodes: int

    def __str__(self) -> str:
        unit = "event" if self.phase == "encoding" else "round"
        return f"{self.phase}, {unit} {self.iteration}, {self.nodes} nodes"


class Search(StrEnum):
    """Direction in which synthesis has found the good states; `FixedPoint.solution` chooses."""

    BACKWARDS = "backwards"
    """From the marked states, whatever is reachable."""
    REACHABLE_FIRST = "reachable states first"
    """Within the states that plants and requirements let runs reach."""


class Order(StrEnum):
    """Static variable order, by what the heuristic FORCE began with; `block_order` and `other_order` choose."""

    DECLARED = "as declared"
    LEVELS = "level by level"
    DEPTHS = "depth first"
    PAIRED_LEVELS = "level by level, pairs close"
    PAIRED_DEPTHS = "depth first, pairs close"
    REVERSED = "upside down"


class Closure(StrEnum):
    """Order in which the steps of events are applied to sets of states; `closure_under` chooses."""

    COMPILED_SATURATION = "saturation in C"
    SATURATION = "saturation"
    CHAINING = "chaining"


@dataclass(frozen=True, slots=True)
class Strategy:
    """A strategy that took part in the race for the good states and those of the controlled system.

    Attributes:
        order: Its variable order.
        search: Its direction.
        nodes: Nodes that it had worked on when the race was over; the same for every engine.
        won: Number of systems for which it came to its end first: 0 or 1, or more for a system in several parts.
        given_up: Number of systems for which it would have taken more nodes than there may be.
    """

    order: Order
    search: Search
    nodes: int
    won: int
    given_up: int = 0

    def __str__(self) -> str:
        ends = [f"{self.nodes:,} nodes"]
        if self.won:
            ends.append("won" if self.won == 1 else f"won {self.won} times")
        if self.given_up:
            ends.append("given up, too many nodes" + f" {self.given_up} times" * (self.given_up > 1))
        return f"{self.search}, {self.order}: {', '.join(ends)}"


@dataclass(frozen=True, slots=True)
class Statistics:
    """Figures of one synthesis.

    Attributes:
        engine: Engine that was used.
        state_bits: Boolean variables that encode a state.
        iterations: Rounds of the fixed point.
        peak_nodes: Most nodes that such a predicate took at the end of a round of the strategy that won; the same for
            every engine.
        states: Reachable states of the controlled system, exact; 0 where there is no supervisor.
        search: Direction of the search for good states, that of the strategy that won the race.
        order: Variable order of that strategy.
        race: Every strategy that began, the winner among them.
        closure: Order of steps.
        parts: Number of independent parts that were synthesized one by one; their rounds and nodes are the most of one,
            search and order those of the one with the most nodes, and those of the race the sums.
    """

    engine: str
    state_bits: int
    iterations: int
    peak_nodes: int
    states: int
    search: Search = Search.BACKWARDS
    order: Order = Order.DECLARED
    race: tuple[Strategy, ...] = ()
    closure: Closure = Closure.SATURATION
    parts: int = 1


def statistics_of(figures: Sequence[Statistics], *, states: int, parts: int = 1) -> Statistics:
    """Return the figures of systems that were synthesized one by one, as those of one synthesis.

    Args:
        figures: The figures of each system.
        states: States of all of them together.
        parts: Number of independent parts that they are.
    """
    largest = max(figures, key=lambda item: item.peak_nodes)
    return Statistics(
        engine=largest.engine,
        state_bits=sum(item.state_bits for item in figures),
        iterations=max(item.iterations for item in figures),
        peak_nodes=largest.peak_nodes,
        states=states,
        search=largest.search,
        order=largest.order,
        race=_summed(strategy for item in figures for strategy in item.race),
        closure=largest.closure,
        parts=parts,
    )


def _summed(strategies: Iterable[Strategy]) -> tuple[Strategy, ...]:
    """Strategies of several races with what they did in all of them."""
    found: dict[tuple[Order, Search], Strategy] = {}
    for item in strategies:
        name = item.order, item.search
        before = found.get(name, Strategy(*name, 0, 0))
        found[name] = Strategy(*name, before.nodes + item.nodes, before.won + item.won, before.given_up + item.given_up)
    return tuple(found.values())


@dataclass(frozen=True, slots=True)
class SynthesisResult:
    """The outcome of a synthesis.

    Attributes:
        status: Status at the end.
        added: Conditions that the supervisor adds, for events to which it adds something, in the system's order.
        initial: Condition on the initial states in which the supervisor lets the system begin; None if in all.
        statistics: Figures.
        reason: Reason why there is no supervisor, in words; empty where there is one.
        answers: Answers to the other questions about the controlled system; empty where there is none.
        parts: Independent parts of the system with their results, where it was synthesized part by part.
    """

    status: SynthesisStatus
    added: tuple[AddedCondition, ...]
    statistics: Statistics
    reason: str = ""
    answers: Answers = field(default_factory=Answers)
    initial: DecisionDiagram | None = None
    parts: "tuple[tuple[System, SynthesisResult], ...]" = ()
