"""Saved runs: as an event log, and as a test for pytest that takes the same events."""

import math
import os
import pprint
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from robosc.certification.supervisor_file import StateInWords
from robosc.execution.runtime.event_log import json_line
from robosc.model.structure import Deployment
from robosc.pipeline.received_data import NO_DATA
from robosc.pipeline.steps import Step, SteppedRun
from robosc.supervisor import Supervisor

_WIDTH = 112


@dataclass(frozen=True, slots=True)
class ModelOfTest:
    """A model, or a supervisor's file, that a test loads.

    Attributes:
        path: Its file.
        deployment: Deployment that its supervisor is synthesized for.
        library_paths: More folders with libraries.
        interface_paths: More folders with ROS packages.
    """

    path: Path
    deployment: Deployment = Deployment.CONTROLLER
    library_paths: tuple[Path, ...] = ()
    interface_paths: tuple[Path, ...] = ()


class ReplayableRun(SteppedRun, Protocol):
    """Run of a robot that a test repeats."""

    @property
    def supervisor(self) -> Supervisor:
        """The supervisor of the system."""

    @property
    def initial(self) -> StateInWords:
        """The initial state."""

    @property
    def history(self) -> tuple[Step, ...]:
        """The events so far."""

    def step(self, event: str, data: object = NO_DATA, /) -> Step:
        """Take an event."""

    def again(self) -> "ReplayableRun":
        """Return a run of the same supervisor, from its initial state."""


def event_log(steps: Iterable[Step]) -> str:
    """Return the text of an event log of a run's steps; its clock counts the events, a second each."""
    return "".join(json_line(entry) for number, step in enumerate(steps, start=1) for entry in entries_of(step, number))


def entries_of(step: Step, number: int) -> Iterator[dict[str, Any]]:
    """Yield the entries of an event log that record a step.

    Args:
        step: The step.
        number: Its number in the run, from 1, which is also its time in seconds.
    """
    values = step.provided if step.is_controllable else dict(step.data)
    if step.unknown:
        yield {"time": float(number), "kind": "unknown", "event": step.event, "unknown": list(step.unknown)}
    yield {
        "time": float(number),
        "kind": "event",
        "event": step.event,
        "controllable": step.is_controllable,
        "data": values,
        "state": state_by_component(step.state),
        "decision_us": 0.0,
    }
    if step.skipped:
        yield {"time": float(number), "kind": "unknown", "event": step.event, "unknown": list(step.skipped)}
    for action in step.cancelling:
        why = "a requirement no longer holds"
        yield {"time": float(number), "kind": "cancelling", "action": action, "why": why}


def state_by_component(state: StateInWords) -> dict[str, dict[str, Any]]:
    """The state and variables of each component with a behaviour, in the form of event logs and executors."""
    found: dict[str, dict[str, Any]] = {
        name: {"state": place, "variables": {}} for name, place in state.components.items()
    }
    for name, value in state.variables.items():
        component, _, variable = name.rpartition(".")
        # An input variable of a CIF model, outside of automata, is one by itself.
        owner = component if component in found else name
        found.setdefault(owner, {"state": "", "variables": {}})["variables"][variable] = value
    return found


_TEST = '''\
"""A run of {name}, event by event: what each leads to, and what is enabled then. Saved by `robosc simulate`."""

{imports}from pathlib import Path

import robosc

{source}

INITIAL = {initial}
ENABLED = {enabled}

# Each event with its data (Ellipsis where none was given), what is enabled after it, and what it changes.
STEPS = [
{steps}]


def state_of(run):
    return {{**run.state.components, **run.state.variables, **run.state.communications}}


def test_run():
{supervisor}
    run = robosc.simulate(supervisor)
    state = dict(INITIAL)
    assert (run.enabled, state_of(run)) == (ENABLED, state)
    for number, (event, data, enabled, changes) in enumerate(STEPS, start=1):
        run.step(event, *(() if data is ... else (data,)))
        state |= changes
        assert (run.enabled, state_of(run)) == (enabled, state), f"after event {{number}}, {{event}}"
'''

_SYNTHESIZED = """\
    options = robosc.SynthesisOptions(deployment=robosc.Deployment.{deployment}, allow_livelock=True)
    made = robosc.synthesize(robosc.load(MODEL{folders}), options)
    assert made.supervisor is not None, str(made.explanation)
    supervisor = made.supervisor"""


def pytest_module(run: ReplayableRun, model: ModelOfTest, file: Path) -> str:
    """Return the text of a test for pytest that leads a run through the same events.

    Args:
        run: The run.
        model: The model that the test loads.
        file: File of the test: the path of the model is relative to it.
    """
    again = run.again()
    enabled, state = again.enabled, again.initial.parts
    initial, steps = dict(state), list[tuple[Any, ...]]()
    for step in run.history:
        given = _plain(step.given)
        again.step(step.event, *(() if given is ... else (given,)))
        now = again.state.parts
        changes = {name: value for name, value in now.items() if not _is_same(state[name], value)}
        steps.append((step.event, given, again.enabled, changes))
        state = now
    is_file = model.path.suffix == ".rsup"
    folders = "".join(
        f", {name}=[{', '.join(f'FOLDER / {_path_from(file, item)!r}' for item in paths)}]"
        for name, paths in (("library_paths", model.library_paths), ("interface_paths", model.interface_paths))
        if paths
    )
    written = "".join(textwrap.indent(_literal(step), "    ") + ",\n" for step in steps)
    made = _SYNTHESIZED.format(folders=folders, deployment=model.deployment.name)
    return _TEST.format(
        name=run.supervisor.model.name,
        imports="import math\n" if "math." in written else "",
        source=f"FOLDER = Path(__file__).parent\nMODEL = FOLDER / {_path_from(file, model.path)!r}",
        initial=_literal(initial),
        enabled=_literal(enabled),
        steps=written,
        supervisor="    supervisor = MODEL" if is_file else made,
    )


def _path_from(file: Path, path: Path) -> str:
    return os.path.relpath(os.path.realpath(path), os.path.realpath(file.parent))


def _is_same(a: object, b: object) -> bool:
    return type(a) is type(b) and a == b


def _plain(given: Any) -> Any:
    """Data as literals of Python; `...` if none was given."""
    if given is NO_DATA:
        return ...
    if isinstance(given, Mapping):
        return {str(name): _plain(item) for name, item in given.items()}
    if given is None or isinstance(given, bool | int | float):
        return given
    # A text may be of a class of its own, as the value of an enum is.
    return str(given) if isinstance(given, str) else [_plain(item) for item in given]


class _Text(str):
    """A number without a literal in Python, as an expression."""

    def __repr__(self) -> str:
        return str(self)


def _literal(value: Any) -> str:
    return pprint.pformat(_written(value), width=_WIDTH, sort_dicts=False, compact=True)


def _written(value: Any) -> Any:
    match value:
        case dict():
            return {name: _written(item) for name, item in value.items()}
        case list():
            return [_written(item) for item in value]
        case tuple():
            return tuple(_written(item) for item in value)
        case float() if not math.isfinite(value):
            return _Text("math.nan" if math.isnan(value) else "math.inf" if value > 0 else "-math.inf")
    return value
