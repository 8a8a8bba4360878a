"""Random couriers: robots with much to request and several ways to each place, so that most missions can be reached."""

from collections.abc import Iterator, Sequence
from random import Random

import msgspec

from robosc.automata import ExecutableSystem, to_automata
from robosc.model.structure import Deployment, Model
from robosc.strategies import synthesize_strategy
from robosc.supervisor import AddedCondition, Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of
from support.failing import made, model_files
from support.models import model_of
from support.random_goals import with_random_goals, with_random_missions


def random_courier(seed: int) -> tuple[Model, tuple[AddedCondition, ...]] | None:
    """Return a random courier with missions and what its supervisor adds, or None if there is no supervisor."""
    dice = Random(f"courier {seed}")
    plain = model_of("robot Courier {\n" + "\n".join(_parts(dice)) + "\n}\n")
    model = with_random_missions(with_random_goals(plain, dice), dice)
    if dice.random() < 0.3:
        model = msgspec.structs.replace(model, goals=())
    made("random_courier", seed, lambda: model_files(model))
    result = synthesize(to_automata(model, Deployment.CONTROLLER))
    return None if result.status is SynthesisStatus.EMPTY else (model, result.added)


def strategic_courier(seed: int) -> Supervisor | None:
    """Return the supervisor of a random courier whose missions can be reached, or None if they cannot.

    It may keep its assumptions from coming true.
    """
    found = random_courier(seed)
    return None if found is None else strategic_supervisor(*found)


def strategic_supervisor(model: Model, added: Sequence[AddedCondition]) -> Supervisor | None:
    """Return a supervisor with its strategy, which may keep assumptions from coming true; None if there is none."""
    allowed = tuple(msgspec.structs.replace(item, is_allowed=True) for item in model.assumptions)
    model = msgspec.structs.replace(model, assumptions=allowed)
    strategy = synthesize_strategy(ExecutableSystem(model, Deployment.CONTROLLER), added).strategy
    if strategy is None:
        return None
    supervisor = supervisor_of(model, added=tuple(added))
    certificate = msgspec.structs.replace(supervisor.certificate, goals="not checked")
    return msgspec.structs.replace(supervisor, strategy=strategy, certificate=certificate)


def _parts(dice: Random) -> Iterator[str]:
    """The components and requirements of a courier, in the words of the language."""
    yield from _base(dice)
    yield from _door(dice)
    if dice.random() < 0.5:
        yield from _caller(dice)
    if dice.random() < 0.6:
        yield f"requirement r{dice.randrange(4)} needs Door.{dice.choice(('open', 'shut'))}"


def _base(dice: Random) -> Iterator[str]:
    """A base with some places, and requests of which each leads from some of them to another."""
    places = [f"p{number}" for number in range(dice.randint(2, 4))]
    requests = [f"r{number}" for number in range(4)]
    moves: dict[str, list[str]] = {place: [] for place in places}
    for number, name in enumerate(requests):
        # The first requests lead round, so that each place can be reached.
        target = places[number % len(places)]
        for place in places:
            if place != target and (number < len(places) or dice.random() < 0.7):
                moves[place].append(f"on request to {name} goto {dice.choice((target, target, dice.choice(places)))}")
    yield "component Base {"
    yield from (f'incoming message {name} with identifier: "/{name}", type: none' for name in requests)
    yield 'outgoing message slip with identifier: "/slip", type: none'
    yield "behaviour {"
    for number, place in enumerate(places):
        slips = f"on response from slip goto {dice.choice(places)}" if dice.random() < 0.2 else ""
        yield f"{'initial ' * (number == 0)}marked state {place} {{ {' '.join(moves[place])} {slips} }}"
    yield "} }"


def _door(dice: Random) -> Iterator[str]:
    yield "component Door {"
    yield from (f'incoming message {name} with identifier: "/{name}", type: none' for name in ("unlock", "lock"))
    yield from (f'outgoing message {name} with identifier: "/{name}", type: none' for name in ("opened", "push"))
    is_slow, is_pushed = dice.random() < 0.4, dice.random() < 0.3
    yield "behaviour {"
    yield f"initial marked state shut {{ on request to unlock goto {'opening' if is_slow else 'open'} }}"
    if is_slow:
        yield "marked state opening { on response from opened goto open }"
    pushed = "on response from push goto shut" if is_pushed else ""
    yield f"marked state open {{ on request to lock goto shut {pushed} }}"
    yield "} }"
    if is_slow and dice.random() < 0.8:
        yield "assume Door.opening leads to Door.open"


def _caller(dice: Random) -> Iterator[str]:
    yield "component Caller {"
    yield 'outgoing message call with identifier: "/call", type: none'
    yield "behaviour {"
    yield "initial marked state quiet { on response from call goto waiting }"
    yield f"marked state waiting {{ on request to r{dice.randrange(4)} goto quiet }}"
    yield "} }"
