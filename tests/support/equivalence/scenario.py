"""Scenario of a controller, independent of any target: a list of actions, one line of JSON each in a file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

from robosc.execution.runtime.settings import Settings

PERIOD_S = 0.125
"""A fraction that floats and microseconds hold exactly."""

_LEAST_RUN = 4


@dataclass(frozen=True)
class Action:
    """One thing that happens.

    Attributes:
        do: Kind: `tick`, `wait` (no period, only time), `message`, `reply`, `fail` (a call), `accept`, `feedback`,
            `end` (a goal), `refuse` (a goal's cancel), `stop`, `restart`. Kinds for an existing controller before a
            supervision layer: `ask` (a message), `ask_call`, `ask_goal`, `ask_cancel` (its last goal there).
        subject: The topic (`message`, `ask`), or the name of the service or action.
        data: Data that comes with it, as plain values: dicts of properties, lists, numbers, texts, booleans, None.
        how: Outcome of `end`; `ended` or `running` of `refuse`.
        seconds: Duration of `wait`, in seconds.
    """

    do: str
    subject: str = ""
    data: Any = None
    how: str = ""
    seconds: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object that stands in a file."""
        found: dict[str, Any] = {"do": self.do}
        for name, default in (("subject", ""), ("how", ""), ("seconds", 0.0)):
            if getattr(self, name) != default:
                found[name] = getattr(self, name)
        if self.data is not None:
            found["data"] = _packed(self.data)
        return found

    @staticmethod
    def from_json(line: Mapping[str, Any]) -> "Action":
        """The action of a line."""
        return Action(**{**line, "data": _unpacked(line.get("data"))})

    def __str__(self) -> str:
        return json.dumps(self.to_json())


@dataclass(frozen=True)
class Scenario:
    """A run of a controller, as far as the world decides it.

    Attributes:
        actions: Actions that happen, in order, after the start.
        settings: Settings of the deployment by name; the others have their default.
    """

    actions: tuple[Action, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)

    def all_settings(self) -> Settings:
        """Every setting."""
        return Settings(**{"period_s": PERIOD_S, **self.settings})


def _packed(data: Any) -> Any:
    """Data in which lists that repeat a number say how often: scans are nothing else."""
    if isinstance(data, dict):
        return {name: _packed(part) for name, part in data.items()}
    if isinstance(data, list):
        runs = [[value, sum(1 for _ in items)] for value, items in groupby(data)]
        if len(runs) * _LEAST_RUN <= len(data):
            return {"runs": runs}
        return [_packed(part) for part in data]
    return data


def _unpacked(data: Any) -> Any:
    if isinstance(data, dict):
        if data.keys() == {"runs"}:
            return [value for value, count in data["runs"] for _ in range(count)]
        return {name: _unpacked(part) for name, part in data.items()}
    if isinstance(data, list):
        return [_unpacked(part) for part in data]
    return data
