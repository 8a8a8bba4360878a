"""`robosc simulate`: step a robot under its supervisor by hand, event by event, before there is any ROS."""

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosc.certification.reasons import reasons_json
from robosc.cli import automata
from robosc.cli.arguments import add_engine_options, add_model_arguments
from robosc.cli.output import ESCAPED, CommandError, ExitCode, UsageError, has_unicode_output, print_json
from robosc.cli.simulation_steps import parts_text, state_lines, step_lines, take_event, write_lines
from robosc.cli.supervisor_argument import supervisor_of_arguments
from robosc.model.structure import Deployment
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.certification.supervisor_file import StateInWords
    from robosc.pipeline.counter_run import CounterRun
    from robosc.pipeline.manual_run import ManualRun
    from robosc.pipeline.missions import MissionProgress
    from robosc.pipeline.saved_runs import ModelOfTest
    from robosc.pipeline.simulation import Run
    from robosc.pipeline.steps import Step
    from robosc.pipeline.system_runs import SystemRun
    from robosc.pipeline.walking import WalkFinding

_DESCRIPTION = """\
Step the robot under its supervisor by hand: you play the world, and choose among what the controller may do. Events
come from a file (--events), by chance (--random, --until-finding), or as commands that are typed: 'help' lists them.
With none of these options commands are read from standard input; on a terminal with a prompt, a history and completion.
For automata (FILE.cif, .gen, .wmod), you play the plants.
"""

_EPILOG = """\
a file of events has one a line, with its data as JSON or as name=value; what is left out is unknown:
  scan.response front=0.7              properties of an object; for an enum, its value or raw data
  scan.response {"front": 0.7}
  level.response 3
  move.request                         a request, where it is allowed
  wait                                 no request; with --counter-strategy
  take -> Buffer = full                of automata, which of several states it leads to
An event log (.jsonl) is taken as well: its events happen again.

kinds of findings, for --finding and until-finding:
  deadlock  no event at all can happen, in a state that is not marked
  waiting   nothing is allowed and no service or action is under way, in a state that is not marked
  blocked   the behaviours could do a request that requirements or the supervisor forbid
  unknown   something was unknown: data, an update that was skipped, what a request sends

exit status:
  0  done
  1  an event of the file, or a command, is not possible; --until-finding found something; there is no supervisor
  2  wrong use; a file that cannot be read or written
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "simulate",
        help="step the robot under its supervisor by hand, in the terminal or from a file",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_model_arguments(parser, json_help="print one JSON object a line: for each event, and at the end")
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help="deployment in which the supervisor stands (default: as a .rsup file says; for a model: controller)",
    )
    add_engine_options(parser)
    group = parser.add_argument_group("what happens, in this order")
    group.add_argument(
        "--events", metavar="FILE", help="events of a file, one a line, or of an event log; - for standard input"
    )
    group.add_argument("--random", type=_count, metavar="N", help="then N events by chance")
    group.add_argument(
        "--until-finding", type=_count, metavar="N", help="then events by chance, at most N, until there is a finding"
    )
    group.add_argument(
        "--strategy",
        action="store_true",
        help="let the controller follow its strategy in --random and --until-finding: only the world plays by chance",
    )
    group.add_argument(
        "--counter-strategy",
        action="store_true",
        help="let the surroundings play, so that goals or missions that cannot be reached are never reached: you "
        "choose requests, or 'wait', in commands or in --events; in --random chance does",
    )
    group.add_argument("--seed", type=int, default=0, metavar="SEED", help="seed of the chance (default: 0)")
    group.add_argument(
        "--finding",
        action="append",
        choices=["deadlock", "waiting", "blocked", "unknown"],
        help="kind of finding that --until-finding looks for (may be repeated; default: all)",
    )
    parser.add_argument(
        "--initial",
        metavar="STATE",
        help="state in which automata begin that may begin in several: 'p.x = 1, q = on'",
    )
    group.add_argument(
        "--save",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="write what has happened, at last: an event log (.jsonl) or a test for pytest (.py); may be repeated",
    )
    parser.set_defaults(run=run)


def _count(text: str) -> int:
    value = int(text)
    if not 0 < value <= 1_000_000:
        raise ValueError
    return value


_count.__name__ = "number of events from 1 to 1000000"


def run(arguments: argparse.Namespace) -> int:
    """Simulate; 0 if every given step was taken, 1 if not.

    Raises:
        UsageError: A file cannot be read or written.
        InvalidSupervisorError: The supervisor's file is malformed.
    """
    from robosc.pipeline.simulation import Run

    for file in arguments.save:
        if file.suffix not in (".jsonl", ".py"):
            raise UsageError(f"{file}: the name of a saved run ends in .jsonl (an event log) or .py (a test)")
    if arguments.finding and arguments.until_finding is None:
        raise UsageError("--finding says what --until-finding looks for: it needs that")
    if arguments.strategy and not (arguments.random or arguments.until_finding):
        raise UsageError(
            "--strategy says how the controller plays in --random and --until-finding: it needs one of them"
        )
    is_scripted = arguments.events is not None or arguments.random or arguments.until_finding
    if not is_scripted and (arguments.json or arguments.save):
        raise UsageError("--json and --save need events: --events, --random or --until-finding")
    if arguments.counter_strategy:
        _refuse_beside_counter_strategy(arguments)
    if automata.is_given(arguments):
        return _run_automata(arguments, is_scripted=bool(is_scripted))
    if arguments.initial is not None:
        raise UsageError("--initial chooses where automata begin: a robot begins in one state")
    run_: Run | None
    if arguments.counter_strategy:
        run_ = counter_run(arguments)
        if run_ is None:
            return ExitCode.FAILED
    else:
        supervisor = supervisor_of_arguments(arguments, is_json=arguments.json)
        if supervisor is None:
            return ExitCode.FAILED
        if arguments.deployment not in (None, str(supervisor.deployment)):
            raise UsageError(f"{arguments.model} was made for the deployment {supervisor.deployment}")
        run_ = Run(supervisor)
    if is_scripted:
        return _script(arguments, run_)
    from robosc.cli.simulation_shell import Shell

    return Shell(run_, model_of_test(arguments)).loop(sys.stdin)


def _refuse_beside_counter_strategy(arguments: argparse.Namespace) -> None:
    """Do nothing if all that is asked for means something where the surroundings play.

    Raises:
        UsageError: Something does not.
    """
    automata.refuse(arguments.strategy, "--strategy: there is none where goals or missions cannot be reached")
    automata.refuse(
        arguments.until_finding is not None, "--until-finding: the surroundings do not play by chance in this run"
    )
    if automata.is_given(arguments) or arguments.model.suffix == ".rsup":
        raise UsageError("--counter-strategy is for the model of a robot, whose goals or missions cannot be reached")
    if arguments.deployment == str(Deployment.LAYER):
        raise UsageError("--counter-strategy is for controllers: goals have no effect in a supervision layer")


def counter_run(arguments: argparse.Namespace) -> "CounterRun | None":
    """Return the run against the surroundings; None if the model has errors, which have been reported.

    Raises:
        CommandError: There is no counter-strategy: all goals and missions can be reached, there are none, or it is
            too large.
    """
    from robosc.certification.goals import GoalExplanation
    from robosc.cli import synth
    from robosc.cli.arguments import read_bundle
    from robosc.json_documents import diagnostics_json
    from robosc.pipeline.counter_run import CounterRun, NoCounterStrategyError
    from robosc.strategies import goals_and_missions

    bundle = read_bundle(arguments)
    given = argparse.Namespace(**{**vars(arguments), "deployment": str(Deployment.CONTROLLER)})
    outcome = synth.make(given, bundle, allow_livelock=True)
    if isinstance(outcome.explanation, GoalExplanation):
        try:
            return CounterRun(outcome.explanation)
        except NoCounterStrategyError as error:
            raise CommandError(str(error), ExitCode.FAILED) from error
    if outcome.supervisor is not None:
        aims = goals_and_missions(outcome.supervisor.model)
        why = f"the {aims} can be reached" if aims else "the model has no goals or missions"
        raise CommandError(f"--counter-strategy: the surroundings have none, since {why}", ExitCode.FAILED)
    if arguments.json:
        print_json({"status": str(outcome.status), **reasons_json(outcome), **diagnostics_json(outcome.diagnostics)})
    else:
        synth.report_problems(outcome, bundle)
    return None


def _run_automata(arguments: argparse.Namespace, *, is_scripted: bool) -> int:
    """Simulate automata.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
        CommandError: It may begin in several states, or not as it is asked for.
    """
    from robosc.cli.simulation_shell import Shell
    from robosc.errors import UnknownNameError
    from robosc.pipeline.system_runs import ChoiceError, SystemRun, state_parts

    automata.refuse(bool(arguments.save), "--save: event logs and tests are of robots, not of automata")
    model, made = automata.synthesized(arguments)
    if made.supervisor is None:
        return automata.report_none(arguments, made, model)
    try:
        initial = None if arguments.initial is None else state_parts(made.supervisor.system, arguments.initial)
        run_ = SystemRun(made.supervisor, initial)
    except ChoiceError as error:
        choose = f"; choose one: --initial '{parts_text(error.example)}'" if error.example else ""
        raise CommandError(f"{error.problem}{choose}", ExitCode.FAILED) from error
    except UnknownNameError as error:
        raise UsageError(f"--initial: {error}") from error
    return _script(arguments, run_) if is_scripted else Shell(run_, None).loop(sys.stdin)


def model_of_test(arguments: argparse.Namespace) -> "ModelOfTest":
    """Return the model, as a saved test is to load it."""
    from robosc.pipeline.saved_runs import ModelOfTest

    return ModelOfTest(
        arguments.model,
        Deployment(arguments.deployment or Deployment.CONTROLLER),
        tuple(arguments.library_path),
        tuple(arguments.interface_path),
    )


def _script(arguments: argparse.Namespace, run_: "Run | SystemRun") -> int:
    """Have happen what the options say, and report it."""
    from robosc.errors import RoboscError
    from robosc.pipeline.simulation import Run
    from robosc.pipeline.walking import ALL_FINDINGS, WalkFindingKind

    report = _JsonReport(run_) if arguments.json else _TextReport(run_)
    finding, problem = None, ""
    # The surroundings may have begun.
    for step in run_.history:
        report.step(step)
    try:
        if arguments.events is not None:
            problem = _take_events(arguments.events, run_, report.step)
        if not problem and arguments.random:
            for step in run_.walk(arguments.random, arguments.seed, strategy=arguments.strategy):
                report.step(step)
        if not problem and arguments.until_finding:
            kinds = frozenset(map(WalkFindingKind, arguments.finding or ())) or ALL_FINDINGS
            before = len(run_)
            finding = run_.walk_until_finding(
                arguments.until_finding, arguments.seed, kinds, strategy=arguments.strategy
            )
            for step in run_.history[before:]:
                report.step(step)
        if isinstance(run_, Run):
            for file in arguments.save:
                run_.save(file, model_of_test(arguments))
    except OSError as error:
        raise UsageError(str(error)) from error
    except RoboscError as error:
        problem = str(error)
    report.end(finding, problem)
    if problem:
        sys.stdout.flush()
        sys.stderr.write(f"robosc: {visible(problem)}\n")
    return ExitCode.FAILED if problem or finding is not None else ExitCode.OK


def _take_events(name: str, run_: "Run | SystemRun", report: Callable[["Step"], None]) -> str:
    """Take the events of a file; returns what is wrong with the first that is not possible.

    Raises:
        UsageError: The file cannot be read.
    """
    from robosc.errors import UnknownNameError
    from robosc.pipeline.event_scripts import ScriptError, read_script
    from robosc.pipeline.manual_run import EventNotPossibleError
    from robosc.pipeline.received_data import DataError
    from robosc.pipeline.simulation import Run
    from robosc.pipeline.system_runs import ChoiceError

    shown = "standard input" if name == "-" else name
    model = run_.supervisor.model if isinstance(run_, Run) else None
    try:
        if name == "-":
            script = read_script(sys.stdin.buffer, shown, model)
        else:
            with Path(name).open("rb") as stream:
                script = read_script(stream, shown, model)
    except OSError as error:
        raise UsageError(f"cannot read {shown}: {error.strerror or error}") from error
    except ScriptError as error:
        raise CommandError(str(error), ExitCode.FAILED) from error
    for item in script:
        if not item.event:
            run_.restart()
            continue
        before = len(run_)
        try:
            take_event(run_, item.event, item.data, item.target)
        except (ChoiceError, DataError, EventNotPossibleError, UnknownNameError) as error:
            return f"{shown}:{item.line}: {error}"
        for step in run_.history[before:]:
            report(step)
    return ""


class _TextReport:
    """Report for a person."""

    def __init__(self, run_: "ManualRun") -> None:
        self._run = run_
        self._count = 0
        self._state = run_.initial

    def step(self, step: "Step") -> None:
        self._count += 1
        write_lines(step_lines(self._count, step, self._state, self._run.actor(step.event)))
        self._state = step.state

    def end(self, finding: "WalkFinding | None", problem: str) -> None:
        write_lines([*([] if finding is None else [str(finding)]), *state_lines(self._run)])


class _JsonReport:
    """Report for a machine: one JSON object a line."""

    def __init__(self, run_: "ManualRun") -> None:
        self._run = run_
        self._count = 0

    def step(self, step: "Step") -> None:
        self._count += 1
        _print_line(
            {
                "step": self._count,
                "event": step.event,
                **({"by": by} if (by := self._run.actor(step.event)) else {}),
                "controllable": step.is_controllable,
                "data": dict(step.data),
                "provided": step.provided,
                "skipped": list(step.skipped),
                "unknown": list(step.unknown),
                "reached": list(step.reached),
                "visits": list(step.visits),
                "cancelling": list(step.cancelling),
                "strategy": step.chosen,
                "state": state_json(step.state),
            }
        )

    def end(self, finding: "WalkFinding | None", problem: str) -> None:
        run_ = self._run
        disabled = [event for event in run_.events if run_.is_controllable(event) and event not in run_.enabled]
        _print_line(
            {
                "status": "not possible" if problem else "finding" if finding is not None else "done",
                "message": problem or (str(finding) if finding is not None else ""),
                "finding": None if finding is None else finding_json(finding),
                "steps": self._count,
                "state": state_json(run_.state),
                "marked": run_.is_marked,
                "goals": list(run_.reached),
                "missions": [mission_json(item) for item in run_.missions],
                "cancelling": list(run_.cancelling),
                "strategy": run_.chosen,
                **opposition_json(run_),
                "enabled": list(run_.enabled),
                "disabled": [{"event": event, "why": list(run_.reasons(event))} for event in disabled],
                "possible": list(run_.possible),
            }
        )


def _print_line(document: Mapping[str, Any]) -> None:
    from robosc.execution.runtime.event_log import plain

    text = json.dumps(plain(dict(document)), ensure_ascii=not has_unicode_output(), allow_nan=False)
    sys.stdout.write(text.translate(ESCAPED) + "\n")


def state_json(state: "StateInWords") -> dict[str, object]:
    """A state as JSON values."""
    return {
        "components": dict(state.components),
        "variables": dict(state.variables),
        "communications": dict(state.communications),
    }


def mission_json(mission: "MissionProgress") -> dict[str, object]:
    """Progress of a mission as JSON values."""
    return {
        "mission": mission.name,
        "asked": mission.is_asked,
        "visit": mission.visit,
        "condition": mission.condition,
        "round": mission.is_round,
        "detours": [
            {"detour": item.number, "visit": item.visit, "condition": item.condition} for item in mission.detours
        ],
    }


def opposition_json(run_: "ManualRun") -> dict[str, object]:
    """Return what the surroundings deny, and how often each assumption came true; nothing where they deny nothing."""
    from robosc.pipeline.counter_run import CounterRun

    if not isinstance(run_, CounterRun):
        return {}
    return {
        "denied": run_.denied,
        "denied_next": list(run_.denied_next),
        "assumptions": list(run_.came_true),
    }


def finding_json(finding: "WalkFinding") -> dict[str, object]:
    """WalkFinding as JSON values."""
    return {"kind": str(finding.kind), "event": finding.event, "why": list(finding.why), "steps": finding.steps}
