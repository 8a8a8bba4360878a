"""The obvious twin of strategies: an explicit parity game on the controller automaton, and a check of what is chosen.

Goals and assumptions are counted off one after the other whenever the controller has its turn: a game with the
priorities 0, 1 (all assumptions once more) and 2 (all goals once more) is solved by Zielonka's algorithm. Source:
W. Zielonka, "Infinite games on finitely coloured graphs with applications to automata on infinite trees", Theoretical
Computer Science 200(1-2), 1998, pp. 135-183.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from robosc.automata import ExecutableSystem
from robosc.automata.compile import NO_DATA, Function, compile_expression
from robosc.automata.goal_memory import Obligations
from robosc.automata.state import subjects
from robosc.controller_properties.controller import Controller, Held, Node
from robosc.expressions import Expression
from robosc.model.structure import Assumption, Goal, GoalForm
from robosc.supervisor import AddedCondition, Strategy
from robosc.supervisor.predicates import state_predicate
from support.mission_twin import Mark, MissionTwin, mission_twin

Marks = tuple[Any, ...]
"""Memory of each assumption, then of each goal and visit: that an answer is owed, that it came true; of a visit, where
its mission is."""

Position = tuple[Node, Marks]

LOST = "lost"
"""The vertex that silent steps without end lead to."""


@dataclass
class Item:
    """A goal or an assumption over explicit states."""

    name: str
    form: GoalForm
    condition: Callable[[Any], bool]
    trigger: Callable[[Any], bool]
    start: Any = False

    def mark(self, mark: bool, state: Any) -> bool:
        if self.form is GoalForm.LEADS_TO:
            return (mark or self.trigger(state)) and not self.condition(state)
        return self.form is GoalForm.ONCE and (mark or self.condition(state))

    def holds(self, mark: bool, state: Any) -> bool:
        if self.form is GoalForm.LEADS_TO:
            return not mark
        return mark if self.form is GoalForm.ONCE else self.condition(state)

    def memory(self, mark: bool) -> dict[str, bool]:
        return {f"{self.name} {'was reached' if self.form is GoalForm.ONCE else 'is owed'}": mark}


@dataclass
class _Visit:
    """A visit over explicit states, which keeps account of its whole mission."""

    mission: MissionTwin
    is_done: Callable[[Mark, Any], bool]
    is_interrupted: Callable[[Mark, Any], bool] | None
    is_own: bool
    """True for a visit of the mission itself, False for one of a detour."""

    @property
    def start(self) -> Mark:
        return self.mission.start

    def mark(self, mark: Mark, state: Any) -> Mark:
        return self.mission.after(mark, state)

    def holds(self, mark: Any, state: Any) -> bool:
        return self.is_done(mark, state)

    def memory(self, mark: Mark) -> dict[str, bool]:
        return self.mission.memory(mark)


def _is_true(function: Function) -> Callable[[Any], bool]:
    return lambda state: function(state, NO_DATA) is True


NEVER = Item("never", GoalForm.ALWAYS_EVENTUALLY, lambda state: False, lambda state: False)
"""A goal that is never true."""


@dataclass
class Game:
    """The explicit game of a controller.

    Attributes:
        successors: For each position, the positions that a move of the surroundings leads to.
        choices: For each position, where each request leads to; waiting stays.
        first: The position in which the executor begins, or None if it never gets to one.
        made: Names of the visits that some run makes.
    """

    assumptions: list[Item]
    goals: list[Item | _Visit]
    successors: dict[Position, set[Any]] = field(default_factory=dict)
    choices: dict[Position, dict[str, Any]] = field(default_factory=dict)
    first: Any = None
    made: set[str] = field(default_factory=set)
    asked: tuple[list[Item], list[Item | _Visit]] | None = None

    def asking(self, assumptions: list[Item], goals: list[Item | _Visit]) -> "Game":
        """Return the same game about other assumptions and goals, of those that it keeps account of."""
        return replace(self, asked=(assumptions, goals))

    def holds(self, position: Position, item: Item | _Visit) -> bool:
        """Return True if an assumption or a goal counts as come true in a position."""
        (state, _), marks = position
        place = next((place for place, kept in enumerate((*self.assumptions, *self.goals)) if kept is item), None)
        return item.holds(False if place is None else marks[place], state)

    def can_meet_again_and_again(self, goals: Iterable[int], assumptions: Iterable[int] = ()) -> bool:
        """Return True if both sides together can make goals and assumptions true again and again."""
        items = [*(self.goals[item] for item in goals), *(self.assumptions[item] for item in assumptions)]
        following = {
            position: {*self.successors[position], *self.choices[position].values(), position} - {LOST}
            for position in self.choices
        }
        # Each position can be waited in: a turn at which a goal is true is a turn in its component.
        return any(
            all(any(self.holds(position, item) for position in component) for item in items)
            for component in components(list(following), following.__getitem__)
        )

    def memory(self, position: Position) -> dict[str, bool]:
        """Return what is remembered of assumptions, goals and missions in a position, by the names of the memory."""
        found: dict[str, bool] = {}
        for item, mark in zip((*self.assumptions, *self.goals), position[1], strict=True):
            found |= item.memory(mark)
        return found

    def possible(self, item: Item | _Visit) -> set[Position]:
        """Return the positions from which both sides together can make an assumption or a goal true again and again."""
        following = {
            position: {*self.successors[position], *self.choices[position].values(), position} - {LOST}
            for position in self.choices
        }
        groups = components(list(following), following.__getitem__)
        found = {at for group in groups if any(self.holds(one, item) for one in group) for at in group}
        while wider := {position for position, targets in following.items() if targets & found} - found:
            found |= wider
        return found

    def alone(self, item: Item | _Visit) -> set[Position]:
        """Return the positions from which the surroundings alone can make an assumption or a goal true."""
        found = {position for position in self.choices if self.holds(position, item)}
        while wider := {position for position, targets in self.successors.items() if targets & found} - found:
            found |= wider
        return found

    def holding(self, position: Position, items: Sequence[Item | _Visit]) -> tuple[bool, ...]:
        (state, _), marks = position
        offset = 0 if items is self.assumptions else len(self.assumptions)
        return tuple(item.holds(marks[offset + place], state) for place, item in enumerate(items))


def game_of(executable: ExecutableSystem, added: Iterable[AddedCondition], limit: int) -> Game | None:
    """Return the game of a controller, or None if it has more positions than a limit."""
    controller = Controller(executable, added)
    places = {subject: place for place, subject in enumerate(subjects(controller.system))}

    def test(condition: Expression) -> Callable[[Any], bool]:
        return _is_true(compile_expression(condition, places))

    def items(given: Sequence[Goal | Assumption], word: str) -> list[Item]:
        return [
            Item(
                f"{word} {number}",
                item.form,
                test(item.condition),
                (lambda state: False) if item.trigger is None else test(item.trigger),
            )
            for number, item in enumerate(given, start=1)
        ]

    model = executable.model
    twins = [mission_twin(mission, test) for mission in model.missions]
    visits = [
        _Visit(twin, is_done, is_interrupted, number < len(twin.visits))
        for twin in twins
        for number, ((_, is_done), is_interrupted) in enumerate(zip(twin.aims(), twin.interruptions(), strict=True))
    ]
    game = Game(items(model.assumptions, "assumption"), [*items(model.goals, "goal"), *visits])
    everything = [*game.assumptions, *game.goals]

    cancels = list(zip(controller.goals, executable.obligations.cancels, strict=True))
    nothing = (0,) * len(cancels)

    def held_after(state: Any, held: Held) -> Held:
        """Return what a strategy remembers of running goals: it sees stable states, and none in between."""
        found: list[int] = []
        for (goal, _), mask in zip(cancels, held, strict=True):
            holding = goal.holding(state)
            if state[goal.place] != goal.running:
                found.append(0)
            else:
                found.append(goal.asked if mask & goal.asked or mask & ~holding else mask | holding)
        return tuple(found)

    def ends(node: Node) -> Iterator[Node]:
        """Yield the states that an end of a goal as cancelled leads to, wherever it may have been asked for."""
        state, held = node
        for (goal, cancel), mask in zip(cancels, held, strict=True):
            unseen = sum(1 << bit for bit, passes in enumerate(cancel.passing) if passes)
            target = controller.after(state, goal.cancel)
            if target is not None and mask & (goal.asked | unseen):
                yield target, held

    def arrived(node: Node, marks: Marks) -> Any:
        state, held = node
        reached = controller.run((state, nothing)).end
        if reached is None:
            return LOST
        end = reached[0], held_after(reached[0], held)
        for item, mark in zip(everything, marks, strict=True):
            if isinstance(item, _Visit):
                game.made |= item.mission.made(mark, end[0])
        return end, tuple(item.mark(mark, end[0]) for item, mark in zip(everything, marks, strict=True))

    game.first = arrived((controller.start[0], nothing), tuple(item.start for item in everything))
    queue = [] if game.first == LOST else [game.first]
    for position in queue:
        if position in game.choices:
            continue
        if len(game.choices) == limit:
            return None
        node, marks = position
        requests: dict[str, Any] = {}
        others: set[Any] = set()
        state, held = node
        for events, _, (target, _) in controller.moves((state, nothing)):
            if len(events) == 1 and events[0] in controller.requests:
                requests[events[0]] = arrived((target, held), marks)
            else:
                others.add(arrived((target, held), marks))
        others.update(arrived(target, marks) for target in ends(node))
        game.choices[position], game.successors[position] = requests, others
        queue += [target for target in (*requests.values(), *others) if target != LOST]
    return game


def winning_positions(game: Game) -> set[Position]:
    """Return the positions from which the controller reaches its goals for ever, whatever the surroundings do."""
    vertices, priorities, owners = _vertices(game)
    won = _zielonka(vertices, set(vertices), priorities, owners)[0]
    return {vertex[0] for vertex in won if vertex != LOST and vertex[1] == "surroundings" and vertex[2:4] == (0, 0)}


def _vertices(game: Game) -> tuple[dict[Any, set[Any]], dict[Any, int], dict[Any, int]]:
    """The parity game: where each vertex leads, its priority, and whose it is (0 the controller's)."""
    edges: dict[Any, set[Any]] = {LOST: {LOST}}
    priorities, owners = {LOST: 1}, {LOST: 0}
    queue: list[Any] = [(position, "surroundings", 0, 0, 0) for position in game.choices]
    for vertex in queue:
        if vertex in edges:
            continue
        position, side, owed, wanted, priority = vertex
        priorities[vertex] = priority
        owners[vertex] = int(side == "surroundings")

        def at(target: Any, owed: int = owed, wanted: int = wanted) -> Any:
            return LOST if target == LOST else (target, "surroundings", owed, wanted, 0)

        if side == "surroundings":
            edges[vertex] = {at(target) for target in game.successors[position]}
            edges[vertex].add((position, "controller", *_counted(game, position, owed, wanted)))
        else:
            edges[vertex] = {at(target) for target in (position, *game.choices[position].values())}
        queue += edges[vertex]
    return edges, priorities, owners


def _counted(game: Game, position: Position, owed: int, wanted: int) -> tuple[int, int, int]:
    """Return the two counters after a turn, and the priority of it."""
    priority = 0
    wanting = game.asked or (game.assumptions, game.goals)
    assumptions, goals = (tuple(game.holds(position, item) for item in items) for items in wanting)
    # One more assumption, that there are turns at all, is true at each.
    if (*assumptions, True)[owed]:
        owed = (owed + 1) % (len(assumptions) + 1)
        priority = int(owed == 0)
    if goals[wanted]:
        wanted = (wanted + 1) % len(goals)
        priority = 2 if wanted == 0 else priority
    return owed, wanted, priority


def _zielonka(
    edges: Mapping[Any, set[Any]], inside: set[Any], priorities: Mapping[Any, int], owners: Mapping[Any, int]
) -> tuple[set[Any], set[Any]]:
    """The vertices of a subgame that each side wins: the controller, the surroundings."""
    if not inside:
        return set(), set()
    highest = max(priorities[vertex] for vertex in inside)
    side = highest % 2
    near = _attractor(edges, inside, {vertex for vertex in inside if priorities[vertex] == highest}, side, owners)
    regions = _zielonka(edges, inside - near, priorities, owners)
    if not regions[1 - side]:
        return (inside, set()) if side == 0 else (set(), inside)
    lost = _attractor(edges, inside, regions[1 - side], 1 - side, owners)
    found = _zielonka(edges, inside - lost, priorities, owners)
    return (found[0] | lost, found[1]) if side else (found[0], found[1] | lost)


def _attractor(
    edges: Mapping[Any, set[Any]], inside: set[Any], target: set[Any], side: int, owners: Mapping[Any, int]
) -> set[Any]:
    """The vertices of a subgame from which a side can force a visit of a target."""
    sources: dict[Any, list[Any]] = {}
    for vertex in inside:
        for following in edges[vertex]:
            if following in inside:
                sources.setdefault(following, []).append(vertex)
    left = {vertex: sum(item in inside for item in edges[vertex]) for vertex in inside}
    found, queue = set(target), list(target)
    for vertex in queue:
        for source in sources.get(vertex, ()):
            left[source] -= 1
            if source not in found and (owners[source] == side or left[source] == 0):
                found.add(source)
                queue.append(source)
    return found


Decide = Callable[[Position, int], tuple[str | None, int]]
"""Function that returns the request for a position and a mode, None for none, and the mode after it."""


def deciding(game: Game, executable: ExecutableSystem, strategy: Strategy) -> Decide:
    """Return what a strategy decides in the positions of a game."""
    owed, system = executable.obligations, executable.remembering_automata
    modes = [[(item.event, state_predicate(system, item.condition)) for item in mode] for mode in strategy.modes]

    def decide(position: Position, mode: int) -> tuple[str | None, int]:
        holding = game.holding(position, game.goals)
        following = [(mode + step) % len(holding) for step in range(len(holding))]
        number = next((number for number in following if not holding[number]), None)
        if number is None:
            return None, mode
        values = values_of(game, position, owed)
        return next((event for event, condition in modes[number] if condition(values)), None), number

    return decide


def values_of(game: Game, position: Position, owed: Obligations) -> tuple[Any, ...]:
    """Return a position of the explicit game as a state of the automata with their memory."""
    state, held = position[0]
    memory = game.memory(position)
    for cancel, mask in zip(owed.cancels, held, strict=True):
        # The bits of the requirements, then the one that the cancel was asked for.
        memory |= {place.name: bool(mask >> bit & 1) for bit, place in enumerate(cancel.places)}
    return (*state, "only", *(memory[place.name] for place in owed.places))


def unfair_goal(game: Game, decide: Decide) -> tuple[int, Any] | None:
    """Return a goal that a strategy may miss for ever although all assumptions come true again and again, with where.

    A request that is not enabled where it is chosen misses the first one.

    Args:
        game: The game.
        decide: Decisions of the strategy.
    """
    moves: dict[Any, set[Any]] = {}
    turns: dict[Any, Any] = {}
    queue: list[Any] = [(game.first, 0)]
    for vertex in queue:
        if vertex in moves:
            continue
        position, mode = vertex
        if position == LOST:
            return 0, vertex
        event, after = decide(position, mode)
        if event is not None and event not in game.choices[position]:
            return 0, vertex
        turns[vertex] = (position if event is None else game.choices[position][event], after)
        moves[vertex] = {(target, mode) for target in game.successors[position]}
        queue += [turns[vertex], *moves[vertex]]
    return next((found for goal in range(len(game.goals)) if (found := _missed(game, goal, moves, turns))), None)


def _missed(game: Game, goal: int, moves: dict[Any, set[Any]], turns: dict[Any, Any]) -> tuple[int, Any] | None:
    """Return a goal, with a vertex of a cycle that misses it although every assumption is true on it."""
    passing = {vertex: turn for vertex, turn in turns.items() if not game.holding(vertex[0], game.goals)[goal]}

    def after(vertex: Any) -> set[Any]:
        return {*moves[vertex], *([passing[vertex]] if vertex in passing else [])}

    for component in components(list(moves), after):
        met = [vertex for vertex in component if vertex in passing and passing[vertex] in component]
        holding = [game.holding(vertex[0], game.assumptions) for vertex in met]
        if met and all(any(item[place] for item in holding) for place in range(len(game.assumptions))):
            return goal, met[0]
    return None


def components(vertices: list[Any], after: Callable[[Any], set[Any]]) -> Iterator[set[Any]]:
    """Yield the strongly connected components, by two searches (Kosaraju)."""
    order: list[Any] = []
    seen: set[Any] = set()
    for root in vertices:
        stack: list[tuple[Any, Iterator[Any]]] = [] if root in seen else [(root, iter(after(root)))]
        seen.add(root)
        while stack:
            vertex, following = stack[-1]
            found = next((item for item in following if item not in seen), None)
            if found is None:
                order.append(vertex)
                stack.pop()
            else:
                seen.add(found)
                stack.append((found, iter(after(found))))
    sources: dict[Any, set[Any]] = {vertex: set() for vertex in vertices}
    for vertex in vertices:
        for item in after(vertex):
            sources[item].add(vertex)
    left = set(vertices)
    for root in reversed(order):
        if root in left:
            left.discard(root)
            component, queue = {root}, [root]
            for vertex in queue:
                for item in sources[vertex] & left:
                    left.discard(item)
                    component.add(item)
                    queue.append(item)
            yield component


@dataclass(frozen=True)
class Distances:
    """Distances of winning positions from a goal.

    Attributes:
        far: Distance of each position.
        last_resort: Positions from which only interruptions help.
        waited: For each distance, from 1 on, and each assumption, where a turn makes progress or waits for it.
    """

    far: dict[Position, int]
    last_resort: set[Position]
    waited: list[list[set[Position]]]


def distances(game: Game, won: set[Position], goal: int) -> Distances:
    """Return the distance of each winning position from a goal.

    A position has distance k + 1 where, for some assumption, the surroundings cannot prevent that each turn gets to
    distance k or less, or to the goal, or stays where that assumption fails. This is the definition, round by round:
    N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", VMCAI 2006, LNCS 3855, pp. 364-380.

    Of a visit no turn may lead to where it is interrupted, and no assumption counts that only comes true there, as long
    as there are such positions. Before that, an assumption is waited for only where moves that stay there can lead to
    where the surroundings alone can make it true. The robot may keep all of them from coming true.

    Args:
        game: The game.
        won: The positions from which the controller wins.
        goal: Number of the goal or visit.
    """
    item, is_calm = game.goals[goal], _is_calm(game, goal)
    calm = won if is_calm is None else set(filter(is_calm, won))
    found: dict[Position, int] = {}
    last_resort = set[Position]()
    sets: list[list[set[Position]]] = []

    def turns(position: Position) -> set[Any]:
        return {position, *game.choices[position].values()}

    reached = {position for position in won if game.holds(position, item) and turns(position) & won}
    failing = [{position for position in won if not game.holds(position, owed)} for owed in game.assumptions]
    hopeful = []
    for failed in failing:
        hope = calm - failed
        while wider := {at for at in calm if (turns(at) | game.successors[at]) & hope} - hope:
            hope |= wider
        hopeful.append(failed & hope)
    alone = [game.alone(owed) for owed in game.assumptions]
    ways = [(failing, won)] if is_calm is None else [(hopeful, calm), (failing, won)]
    while True:
        for is_earnest, (waited, allowed) in product((True, False) if alone else (False,), ways):
            onwards = found.keys() & allowed
            progress = {position for position in won if position in reached or turns(position) & onwards}
            near = set[Position]()
            stayed: list[set[Position]] = []
            # The empty assumption is one that never fails.
            for number, failed in enumerate(waited or [set[Position]()]):
                staying = set(won)
                while True:
                    kept = {
                        position
                        for position in staying
                        if game.successors[position] <= staying
                        and (position in progress or (position in failed and turns(position) & staying))
                    }
                    if is_earnest:
                        inside = (kept & allowed) - progress
                        led = inside & alone[number]
                        while wider := {at for at in inside if (turns(at) | game.successors[at]) & led} - led:
                            led |= wider
                        kept -= inside - led
                    if kept == staying:
                        break
                    staying = kept
                near |= staying
                stayed.append(staying)
            if not near <= found.keys():
                break
        else:
            return Distances(found, last_resort, sets)
        sets.append(stayed)
        fresh = near - found.keys()
        if is_calm is not None and waited is failing:
            last_resort |= fresh
        rank = max(found.values(), default=0) + 1
        found |= dict.fromkeys(fresh, rank)


def _is_calm(game: Game, goal: int) -> Callable[[Position], bool] | None:
    """Return whether a visit is not interrupted in a position; None if it never is, or if it is a goal."""
    item, number = game.goals[goal], len(game.assumptions) + goal
    is_interrupted = None if isinstance(item, Item) else item.is_interrupted
    return None if is_interrupted is None else lambda position: not is_interrupted(position[1][number], position[0][0])


def leading(game: Game, known: Distances, position: Position, goal: int) -> set[str]:
    """Return the requests that a strategy may choose in a position, before it looks at preferences.

    Where only interruptions help, what leads nearest is chosen, of what does not interrupt the visit, if there is any.

    Args:
        game: The game.
        known: Distances from the goal.
        position: The position.
        goal: Number of the goal or visit.
    """
    is_calm, far = _is_calm(game, goal), known.far
    near = {name: end for name, end in game.choices[position].items() if far.get(end, 10**9) < far[position]}
    if is_calm is None:
        return set(near)
    calm = {name: end for name, end in near.items() if is_calm(end)}
    if position not in known.last_resort:
        return set(calm)
    near = calm or near
    least = min((far[end] for end in near.values()), default=0)
    return {name for name, end in near.items() if far[end] == least}


def taken_along(
    game: Game, known: Sequence[Distances], allowed: Collection[int], own: Decide, position: Position, goal: int
) -> str | None:
    """Return the request for another goal that a strategy issues while it waits in a position.

    Args:
        game: The game.
        known: Distances from each goal.
        allowed: Numbers of the assumptions that the robot may keep from coming true.
        own: Decisions of each mode for its own goal.
        position: The position, in which the mode requests nothing for its own goal.
        goal: Number of the goal that it waits for.
    """

    def distance(at: Any, number: int) -> int:
        return 0 if game.holds(at, game.goals[number]) else known[number].far[at]

    def is_calm(at: Any, number: int) -> bool:
        calm = _is_calm(game, number)
        return calm is None or calm(at)

    waited = known[goal].waited[known[goal].far[position] - 1]
    order = [*allowed, *(item for item in range(len(game.assumptions)) if item not in allowed)]
    place = next(item for item in order if position in waited[item])
    within = waited[place] & game.alone(game.assumptions[place]) if place in allowed else waited[place]
    count = len(game.goals)
    others = [(goal + step) % count for step in range(1, count)]
    for number, other in enumerate(others):
        if distance(position, other) == 0:
            continue
        event, _ = own(position, other)
        target: Any = game.choices[position].get(event or "")
        if event is None or not {position, target} <= within or not (is_calm(target, goal) and is_calm(target, other)):
            continue
        is_nearer = known[other].far[target] < known[other].far[position]
        if is_nearer and all(distance(target, item) <= distance(position, item) for item in others[:number]):
            return event
    return None


def endless_requests(game: Game, decide: Decide) -> Any:
    """Return a position and a mode from which requests go on for ever without a move of the surroundings, or None.

    Only requests count that one mode issues one after the other: goals that are all reached by requests alone are
    reached again and again.
    """
    after: dict[Any, Any] = {}
    for position in game.choices:
        for mode in range(len(game.goals)):
            event, number = decide(position, mode)
            target = game.choices[position].get(event or "")
            if number == mode and target not in (None, LOST):
                after[position, mode] = (target, mode)
    done = set[Any]()
    for first in after:
        path = dict[Any, None]()
        at = first
        while at in after and at not in done:
            if at in path:
                return at
            path[at] = None
            at = after[at]
        done |= path.keys()
    return None


def put_off(game: Game, names: Sequence[str], decide: Decide) -> set[int]:
    """Return the visits that a strategy interrupts instead of making them, and then may leave unmade for ever.

    A run counts in which the surroundings keep to the assumptions, neither interrupt the visit anywhere nor make a
    condition true that leads to an interruption.

    Args:
        game: The game.
        names: Names of its goals and visits.
        decide: Decisions of the strategy.
    """
    found = set[int]()
    for goal, item in enumerate(game.goals):
        is_calm = _is_calm(game, goal)
        if is_calm is None or isinstance(item, Item):
            continue
        own, place = item, len(game.assumptions) + goal

        def is_made(before: Any, after: Any, own: _Visit = own, place: int = place, name: str = names[goal]) -> bool:
            return name in own.mission.made(before[1][place], after[0][0])

        def is_brought_about(before: Any, after: Any, own: _Visit = own, is_calm: Any = is_calm) -> bool:
            # Visits of a detour wait only while the mission is not asked for.
            causes = list(own.mission.causes())[: None if own.is_own else 1]
            calmed = is_calm(before) and not is_calm(after)
            return calmed or any(cause(after[0][0]) and not cause(before[0][0]) for cause in causes)

        vertices, chosen = _under(game, decide)
        turns: dict[Any, Any] = {}
        after: dict[Any, set[Any]] = {}
        begun = set[Any]()
        for vertex in vertices:
            position, mode = vertex
            moved, number = chosen[vertex]
            after[vertex] = {
                (target, mode)
                for target in game.successors[position]
                if not is_made(position, target) and not is_brought_about(position, target)
            }
            if not is_made(position, moved):
                turns[vertex] = (moved, number)
                after[vertex].add(turns[vertex])
                if number == goal and is_calm(position) and not is_calm(moved):
                    begun.add(turns[vertex])
        if _is_fair_run(game, after, turns, begun):
            found.add(goal)
    return found


def _under(game: Game, decide: Decide) -> tuple[list[Any], dict[Any, Any]]:
    """Return the positions under a strategy, each with a mode, and where each turn leads: a position and a mode."""
    chosen: dict[Any, Any] = {}
    queue: list[Any] = [(game.first, 0)]
    for vertex in queue:
        if vertex not in chosen:
            position, mode = vertex
            event, after = decide(position, mode)
            chosen[vertex] = (position if event is None else game.choices[position][event], after)
            queue += [chosen[vertex], *((target, mode) for target in game.successors[position])]
    return list(chosen), chosen


def _is_fair_run(game: Game, after: Mapping[Any, set[Any]], turns: Mapping[Any, Any], start: Collection[Any]) -> bool:
    """Return True if a run goes on for ever in a graph on which each assumption comes true at turns again and again.

    The definition by a greatest fixed point: E. A. Emerson and C.-L. Lei, "Modalities for model checking: branching
    time logic strikes back", Science of Computer Programming 8(3), 1987, pp. 275-306.
    """
    kept = set(after)
    while True:
        before = set(kept)
        for owed in (None, *game.assumptions):
            near = {
                vertex
                for vertex, turn in turns.items()
                if vertex in kept and turn in kept and (owed is None or game.holds(vertex[0], owed))
            }
            while wider := {vertex for vertex in kept - near if after[vertex] & near}:
                near |= wider
            kept &= near
        if kept == before:
            break
    reached, queue = set(start), list(start)
    for vertex in queue:
        queue += after[vertex] - reached
        reached |= after[vertex]
    return bool(reached & kept)
