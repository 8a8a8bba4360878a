"""Steps of `robosc simulate`: events as a person writes them, and what they led to in lines."""

import json
import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from robosc.source import visible

if TYPE_CHECKING:
    from robosc.certification.supervisor_file import StateInWords
    from robosc.pipeline.counter_run import CounterRun
    from robosc.pipeline.manual_run import ManualRun
    from robosc.pipeline.simulation import Run
    from robosc.pipeline.steps import Step
    from robosc.pipeline.system_runs import SystemRun


def take_event(run_: "Run | SystemRun", name: str, data: object, target: str) -> None:
    """Take an event as a person wrote it; the run's history has all that has happened.

    Args:
        run_: The run.
        name: Name of the event.
        data: Data that it carries; NO_DATA for none.
        target: Parts of the state that it is to lead to; of automata.

    Raises:
        RoboscError: It cannot happen so.
    """
    from robosc.pipeline.counter_run import WAIT, CounterRun
    from robosc.pipeline.received_data import NO_DATA
    from robosc.pipeline.simulation import Run
    from robosc.pipeline.system_runs import ChoiceError, state_parts

    event, given = run_.event_called(name), () if data is NO_DATA else (data,)
    if isinstance(run_, CounterRun) and event == WAIT:
        run_.wait()
        return
    if isinstance(run_, Run):
        run_.step(event, *given)
        return
    try:
        run_.step(event, *given, to=state_parts(run_.supervisor.system, target) if target else None)
    except ChoiceError as error:
        choose = f"; choose one: {name} -> {parts_text(error.example)}" if error.example else ""
        raise ChoiceError(f"{error.problem}{choose}") from error


def parts_text(parts: Mapping[str, object]) -> str:
    """Parts of a state as a person writes them: `Buffer = full, Buffer.count = 2`."""
    from robosc.explanation.notation import value_text

    return ", ".join(f"{name} = {value_text(value)}" for name, value in parts.items())  # type: ignore[arg-type]


def write_lines(lines: Iterable[str]) -> None:
    """Write lines to standard output, as a terminal can show them."""
    sys.stdout.write("".join(visible(line) + "\n" for line in lines))


def step_lines(number: int, step: "Step", before: "StateInWords", actor: str = "") -> list[str]:
    """Return a step in lines: the event with its data, its changes, the data of a request, and what was unknown.

    Args:
        number: Number of the step.
        step: The step.
        before: The state before it.
        actor: Side whose event it is, in a run against the surroundings; else empty.
    """
    from robosc.pipeline.steps import changes_text, event_text

    who = f"{actor:<14}" if actor else ""
    lines = [f"{number:4}  {who}{': '.join(filter(None, (event_text(step), changes_text(before, step.state))))}"]
    if step.provided is not None:
        lines.append(f"      sends {json.dumps(step.provided, default=str)}")
    goals = [f"goal {', '.join(map(str, step.reached))}"] if step.reached else []
    if goals or step.visits:
        lines.append(f"      reached: {', '.join([*goals, *step.visits])}")
    lines += [
        f"      {action} is being cancelled: an executor asks for it, and awaits the end" for action in step.cancelling
    ]
    lines += [f"      unknown: {item}" for item in step.unknown]
    lines += [f"      unknown: {item} keeps its value" for item in step.skipped]
    return lines


def state_lines(run_: "ManualRun") -> list[str]:
    """Return the state and what can happen in it, in lines."""
    from robosc.pipeline.counter_run import CounterRun

    others = [event for event in run_.possible if not run_.is_controllable(event)]
    can_come = [] if isinstance(run_, CounterRun) else [f"can come  {', '.join(others) or 'nothing'}"]
    return [
        f"now       {run_.state}{' (marked)' if run_.is_marked else ''}",
        *([f"cancelled {', '.join(run_.cancelling)}, not ended yet"] if run_.cancelling else []),
        *_strategy_lines(run_),
        f"allowed   {', '.join(run_.enabled) or 'nothing'}",
        *can_come,
    ]


def _strategy_lines(run_: "ManualRun") -> list[str]:
    """Return which goals are true, how far missions are, and what either side is about; nothing without any of them."""
    from robosc.pipeline.counter_run import CounterRun

    goals = ", ".join(f"{number} {'true' if is_true else 'not yet'}" for number, is_true in enumerate(run_.reached, 1))
    lines = [*([f"goals     {goals}"] if goals else []), *(f"mission   {item}" for item in run_.missions)]
    if isinstance(run_, CounterRun):
        denied = _denied_text(run_)
        came = ", ".join(f"{number} came true {count} times" for number, count in enumerate(run_.came_true, 1))
        return [*lines, *([f"assumed   {came}"] if came else []), f"denied    {denied}"]
    return [*lines, f"strategy  {run_.chosen or 'waits'}"] if run_.has_strategy else []


def _denied_text(run_: "CounterRun") -> str:
    if run_.denied is None:
        return "the turn: silent steps do not end"
    following = " or ".join(run_.denied_next)
    return f"{run_.denied}; if it comes true, {following}" if following else f"{run_.denied}, whatever you do"
