"""Jobs of mixed size, each reproducible from a seed and its number, and what their right results are.

The right result is worked out here, without a server: by the same functions that the command `robosc` calls.
"""

import hashlib
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

from msgspec.structs import replace

import robosc
from robosc.language import load_bundle
from robosc.source import Bundle, SourceFile
from robosc.supervisor import encode
from robosc_client import Check, Generate, Generation, Synthesis, Synthesize, Task, TaskResult
from support.hostile_models import bounded_products, buttons
from support.models import EXAMPLES
from support.random_models import random_bundle

SIZES: Mapping[str, float] = {"small": 0.80, "medium": 0.17, "large": 0.03}
"""Shares of the jobs by the size of their model: about 10 ms, 30 to 400 ms, a second of a processor."""

_KINDS = {"synthesize": 0.85, "generate": 0.10, "check": 0.05}
_REPEATED = 0.03
_TARGET = "python"
_LARGE_BITS = 8


@dataclass(frozen=True, slots=True)
class MixedJob:
    """One job of the mix.

    Attributes:
        number: Its number.
        size: `small`, `medium` or `large`.
        task: Task to be done.
    """

    number: int
    size: str
    task: Task


def mixed_job(seed: int, number: int) -> MixedJob:
    """The job of a number; a few have the task of an earlier one."""
    dice = random.Random(f"{seed}/{number}")
    if number and dice.random() < _REPEATED:
        earlier = mixed_job(seed, dice.randrange(number))
        return MixedJob(number, earlier.size, earlier.task)
    size = _drawn(SIZES, dice)
    bundle = _named(_bundle(size, dice), f"job{number}.rscd")
    match _drawn(_KINDS, dice):
        case "check":
            return MixedJob(number, size, Check(bundle))
        case "generate":
            return MixedJob(number, size, Generate(bundle, _TARGET))
        case _:
            return MixedJob(number, size, Synthesize(bundle))


def right_digest(task: Task) -> str:
    """Digest of the right result of a task, worked out here."""
    match task:
        case Check():
            return digest_of(tuple(robosc.check(task.model)))
        case Generate():
            return digest_of(robosc.generate(task.model, task.target))
        case Synthesize():
            made = robosc.synthesize(task.model)
            return digest(made.status, b"" if made.supervisor is None else encode(made.supervisor))
        case _:
            raise TypeError(task)


def digest_of(result: TaskResult) -> str:
    """Digest of a result of a server, equal to `right_digest` if it is right."""
    match result:
        case Synthesis():
            return digest(result.status, result.supervisor)
        case Generation():
            return digest(result.status, None if result.files is None else dict(result.files))
        case tuple():
            return digest(result)
        case _:
            raise TypeError(result)


def digest(*parts: object) -> str:
    """Digest of some values."""
    sum_ = hashlib.sha256()
    for text in _texts(parts):
        sum_.update(len(text).to_bytes(8, "big") + text)
    return sum_.hexdigest()


def _texts(parts: object) -> Iterator[bytes]:
    match parts:
        case bytes():
            yield parts
        case dict():
            for key in sorted(parts):
                yield from _texts((key, parts[key]))
        case tuple():
            for part in parts:
                yield from _texts(part)
        case _:
            yield str(parts).encode()


def _drawn(shares: Mapping[str, float], dice: random.Random) -> str:
    return dice.choices(list(shares), list(shares.values()))[0]


def _bundle(size: str, dice: random.Random) -> Bundle:
    if size == "small":
        return random_bundle(dice.randrange(2**32))
    if size == "medium":
        return dice.choice(_medium())
    return Bundle(SourceFile("large.rscd", bounded_products(_LARGE_BITS)))


@cache
def _medium() -> tuple[Bundle, ...]:
    examples = [
        load_bundle(EXAMPLES / name / f"{name}.rscd") for name in ("ball_pusher", "object_finder", "navigation")
    ]
    texts = [bounded_products(6), buttons(12), buttons(16)]
    return (*examples, *(Bundle(SourceFile("medium.rscd", text)) for text in texts))


def _named(bundle: Bundle, name: str) -> Bundle:
    """The same model under another name, which is worked out anew."""
    return replace(bundle, main=SourceFile(name, bundle.main.text))
