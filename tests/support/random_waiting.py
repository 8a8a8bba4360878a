"""Random robots with several things to do at a time: some take long, and meanwhile others can be done by requests."""

from collections.abc import Iterator
from random import Random

import msgspec

from robosc.automata import to_automata
from robosc.model.structure import Deployment, Model
from robosc.supervisor import AddedCondition, Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.failing import made, model_files
from support.models import model_of
from support.random_couriers import strategic_supervisor
from support.random_goals import with_random_missions


def random_waiting(seed: int) -> tuple[Model, tuple[AddedCondition, ...]] | None:
    """Return a random robot and what its supervisor adds, or None if there is no supervisor."""
    dice = Random(f"waiting {seed}")
    model = model_of("robot Waiting {\n" + "\n".join(_parts(dice)) + "\n}\n")
    if dice.random() < 0.3:
        missions = with_random_missions(model, dice)
        model = msgspec.structs.replace(model, missions=missions.missions)
    made("random_waiting", seed, lambda: model_files(model))
    result = synthesize(to_automata(model, Deployment.CONTROLLER))
    return None if result.status is SynthesisStatus.EMPTY else (model, result.added)


def _parts(dice: Random) -> Iterator[str]:
    """The components, requirements, goals and assumptions, in the words of the language."""
    sizes = [dice.randint(2, 3) for _ in range(dice.randint(2, 3))]
    owed: list[str] = []
    for number, size in enumerate(sizes):
        slow = [dice.random() < 0.5 for _ in range(size)]
        owed += [f"!M{number}.to{place}" for place in range(size) if slow[place]]
        yield from _machine(dice, number, slow)

    def test() -> str:
        number = dice.randrange(len(sizes))
        return f"M{number}.s{dice.randrange(sizes[number])}"

    for _ in range(dice.choice((0, 1, 1, 2))):
        number = dice.randrange(len(sizes))
        yield f"requirement go{number}{dice.randrange(sizes[number])} needs {dice.choice(('', '!'))}{test()}"
    for _ in range(dice.randint(2, 4)):
        wanted = f"{test()} and {test()}" if dice.random() < 0.4 else test()
        yield dice.choice((f"goal always eventually {wanted}",) * 3 + (f"goal {test()} leads to {wanted}",))
    if owed and dice.random() < 0.3:
        yield f"assume always eventually {' and '.join(owed)}"
    else:
        yield from (f"assume always eventually {item}" for item in owed)


def _machine(dice: Random, number: int, slow: list[bool]) -> Iterator[str]:
    """A machine that requests move between places; on the way to slow ones it takes its time."""
    places = range(len(slow))
    yield f"component M{number} {{"
    yield from (
        f'incoming message go{number}{place} with identifier: "/go{number}{place}", type: none' for place in places
    )
    yield f'outgoing message there{number} with identifier: "/there{number}", type: none'
    yield "behaviour {"
    for here in places:
        ways = [place for place in places if place != here and (place == (here + 1) % len(slow) or dice.random() < 0.5)]
        steps = [f"on request to go{number}{place} goto {'to' if slow[place] else 's'}{place}" for place in ways]
        yield f"{'initial ' * (here == 0)}marked state s{here} {{ {' '.join(steps)} }}"
    for place in places:
        if slow[place]:
            back = f"on request to go{number}{(place + 1) % len(slow)} goto s{place}" if dice.random() < 0.2 else ""
            yield f"marked state to{place} {{ on response from there{number} goto s{place} {back} }}"
    yield "} }"


def strategic_waiting(seed: int) -> Supervisor | None:
    """Return the supervisor of a random robot whose goals can be reached, or None if they cannot."""
    found = random_waiting(seed)
    return None if found is None else strategic_supervisor(*found)
