"""Writes the recordings of the corpus: `python tests/corpus/record.py [--force] [CASE ...]`.

A recording says what a model of the published language means, so that nothing may change it later. Record a
new model once, look at what was found, and keep it; existing recordings are only replaced with `--force`, where the
recording itself was wrong.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from typing import Any
from zlib import crc32

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import robosc
from robosc.certification import make_supervisor
from robosc.errors import LanguageError
from robosc.expressions import (
    ArrayType,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    StringType,
    Type,
    leaves,
)
from robosc.model.check import check
from robosc.model.structure import CommunicationKind, EnumDefinition, Model
from support.corpus import Run, Stimulus, bundle_of_case, cases, differences, outcome, recorded, recording_path, written

STEPS = 40
"""Stimuli of a run after its start."""

PERIOD_S = 0.1
LONGER_THAN_TIMEOUT_S = 11.0


class World:
    """A random world around an executor: sensors, servers, time.

    Args:
        model: The robot.
        dice: Decides everything.
    """

    def __init__(self, model: Model, dice: Random) -> None:
        self._model = model
        self._dice = dice
        self._accepted: dict[str, int] = {}
        self._constants = {item.name: _constants(item) for item in model.enums}

    def stimuli(self, run: Run) -> Iterator[Stimulus]:
        """A start, then `STEPS` random stimuli; the run takes each before the next is drawn."""
        yield ["start"]
        for _ in range(STEPS):
            choices = [["tick"]] * 4 + [["receive"]] * 5 + self._replies(run)
            kind, *subject = self._dice.choice(choices)
            if kind == "accept":
                self._accepted[subject[0]] = run.open[subject[0]]
            yield self._stimulus(kind, *subject)

    def _replies(self, run: Run) -> list[list[str]]:
        found: list[list[str]] = []
        for name, number in run.open.items():
            if self._model.communication(name).kind is CommunicationKind.SERVICE:
                found += [["reply", name]] * 3 + [["fail", name]]
            else:
                is_new = self._accepted.get(name) != number
                found += [["accept", name]] * 4 if is_new else [["feedback", name]] * 3 + [["end", name]] * 2
                found.append(["end", name])
        return found

    def _stimulus(self, kind: str, name: str = "") -> Stimulus:
        received = [item for item in self._model.communications if item.kind is CommunicationKind.OUTGOING_MESSAGE]
        if kind == "receive" and received:
            item = self._dice.choice(received)
            return ["receive", item.identifier, self._data(item.response)]
        match kind:
            case "reply":
                return [kind, name, self._data(self._model.communication(name).response)]
            case "feedback":
                return [kind, name, self._data(self._model.communication(name).feedback)]
            case "end":
                ends = ["succeeded"] * 4 + ["rejected", "aborted", "cancelled", "lost"]
                how = self._dice.choice(ends)
                data = self._data(self._model.communication(name).response) if how == "succeeded" else None
                return [kind, name, how, data]
            case "fail" | "accept":
                return [kind, name]
            case _:
                is_long = self._dice.random() < 0.05
                return ["tick", LONGER_THAN_TIMEOUT_S if is_long else PERIOD_S]

    def _data(self, type_: Type | None, constants: Sequence[Any] = ()) -> Any:
        """Return possible data of a type; now and then something that does not fit."""
        dice = self._dice
        if dice.random() < 0.02:
            return dice.choice([None, "no such thing", True, -1, {"float": "nan"}])
        match type_:
            case EnumType(name=name):
                definition = self._model.enum(name)
                return self._data(definition.source, self._constants[name])
            case ObjectType(name=name):
                return {item.name: self._data(item.type, constants) for item in self._model.object(name).properties}
            case ArrayType(element=element):
                length = 5 if dice.random() < 0.9 else dice.randrange(5)
                return [self._data(element, constants) for _ in range(length)]
            case BooleanType():
                return dice.random() < 0.5
            case IntegerType():
                return self._integer(type_, [item for item in constants if type(item) is int])
            case DoubleType():
                return self._double([item for item in constants if type(item) in (int, float)])
            case StringType():
                return dice.choice([*(item for item in constants if isinstance(item, str)), "", "something"])
            case _:
                return None

    def _integer(self, type_: IntegerType, constants: list[int]) -> int:
        low, high = (-3 if type_.low is None else type_.low), (12 if type_.high is None else type_.high)
        if constants and self._dice.random() < 0.6:
            return self._dice.choice(constants) + self._dice.choice([-1, 0, 1])
        if self._dice.random() < 0.1:
            return self._dice.choice([low - 1, high + 1, 2**31])
        return self._dice.randint(low, high)

    def _double(self, constants: list[float]) -> Any:
        if self._dice.random() < 0.04:
            return {"float": self._dice.choice(["nan", "inf", "-inf"])}
        if constants and self._dice.random() < 0.7:
            return self._dice.choice(constants) + self._dice.choice([-0.25, 0.0, 0.25])
        return self._dice.choice([-1.5, 0.0, 0.125, 0.5, 1.0, 2.5, 10.0, 100.0])


def _constants(enum: EnumDefinition) -> list[Any]:
    """The constants in an enum's rules: data near them matters most."""
    return [leaf.value for rule in enum.rules for leaf in leaves(rule.condition) if isinstance(leaf, Constant)]


def new_stimuli(case: str) -> tuple[Stimulus, ...]:
    """Random stimuli for a case, the same for the same case and model; none if nothing can run."""
    try:
        bundle = bundle_of_case(case)
    except LanguageError:
        return ()
    model = check(bundle).model
    supervisor = make_supervisor(bundle).supervisor
    if model is None or supervisor is None:
        return ()
    run = Run(supervisor)
    found: list[Stimulus] = []
    for stimulus in World(model, Random(crc32(case.encode()))).stimuli(run):
        if "fault" in run.apply(stimulus)["log"]:
            # The length of silent steps that never end is no matter of the language.
            break
        found.append(stimulus)
    return tuple(found)


def main() -> int:
    """Write the recordings that are asked for; 1 if one exists, differs and was not to be replaced."""
    parser = argparse.ArgumentParser(description="Write the recordings of the corpus.")
    parser.add_argument("cases", nargs="*", metavar="CASE", help="such as robots/docking; default: all of them")
    parser.add_argument("--force", action="store_true", help="replace recordings that differ")
    arguments = parser.parse_args()
    unknown = set(arguments.cases) - set(cases())
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    sys.stdout.write(f"recording with {Path(robosc.__file__).parent}\n")
    refused = False
    for case in arguments.cases or cases():
        found = outcome(case, new_stimuli(case))
        path = recording_path(case)
        if not path.exists():
            sys.stdout.write(f"{case}: recorded\n")
        else:
            changed = differences(recorded(case), found)
            if not changed:
                continue
            verb = "replaced" if arguments.force else "differs; --force replaces it"
            sys.stdout.write("\n  ".join([f"{case}: {verb}", *changed[:10]]) + "\n")
            if not arguments.force:
                refused = True
                continue
        path.write_text(written(found), encoding="utf-8")
    return int(refused)


if __name__ == "__main__":
    sys.exit(main())
