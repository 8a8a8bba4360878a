"""Recorded runs of the example robots: one JSON Lines file each, with what came and the event log that it led to."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from support.equivalence.observation import Observation
from support.equivalence.scenario import Action, Scenario

FOLDER = Path(__file__).parents[2] / "equivalence" / "recorded"


def recorded_text(scenario: Scenario, seen: list[Observation]) -> str:
    """A run as text: its settings, then each action (`do`) before the entries of the log (`kind`) that it led to.

    Of the state that stands in entries of the log, a component is recorded when it is not as in the entry before.
    """
    return "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in _lines(scenario, seen))


def _lines(scenario: Scenario, seen: list[Observation]) -> Iterator[dict[str, Any]]:
    yield {"settings": dict(scenario.settings)}
    before: dict[str, Any] = {}
    for action, observation in zip((None, *scenario.actions), seen, strict=True):
        if action is not None:
            yield action.to_json()
        for entry in observation.log:
            line = dict(entry)
            if "state" in line:
                state = line.pop("state")
                changed = {name: part for name, part in state.items() if before.get(name) != part}
                before = state
                line.update({"changed": changed} if changed else {})
            yield line


def read_recorded(robot: str) -> Scenario:
    """Read everything that came to a robot, as it was recorded."""
    lines = [json.loads(line) for line in (FOLDER / f"{robot}.jsonl").read_text(encoding="utf-8").splitlines()]
    actions = tuple(Action.from_json(line) for line in lines if "do" in line)
    return Scenario(actions, lines[0]["settings"])
