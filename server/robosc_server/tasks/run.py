"""Execution of a task in a worker, from the request message to the response messages.

Each kind of task corresponds to a command of `robosc` and has the same result: the same supervisor byte for byte, the
same documents. Errors of a model are results; everything else that can go wrong is a `Failure`.
"""

import hashlib
import traceback
from collections.abc import Callable, Iterable, Iterator
from importlib import resources
from typing import Any

from robosc.automata import to_automata
from robosc.errors import LanguageError, NodeLimitError
from robosc.explanation import RequestError
from robosc.exploration import DEFAULT_LIMIT, Graph, explore, graph_json
from robosc.formatting import format_text
from robosc.json_documents import json_pieces
from robosc.model.check import check
from robosc.pipeline.automata_files import check_automata_file
from robosc.pipeline.loading import LoadedAutomata
from robosc.supervisor import Supervisor, encode
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import UnknownEngineError
from robosc.synthesis.engines import keep_ready, resolve_engine
from robosc.targets import (
    GeneratedFiles,
    GenerateOptions,
    TargetRefusal,
    UnknownTargetError,
    generate_or_refuse,
    require_generatable,
)
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.clock import monotonic
from robosc_server.tasks.automata import Automata
from robosc_server.tasks.convert import chunks, from_proto, to_proto
from robosc_server.tasks.exceeded import memory_exceeded, result_too_large
from robosc_server.tasks.explain import explanation
from robosc_server.tasks.memory import is_lack_of_memory
from robosc_server.tasks.synthesis_attempt import OnReport, SynthesisAttempt
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, TaskKind, TaskLimits
from robosc_server.tasks.verify import DEFAULT_STATES, NoPropertyError, verification

_WARM_UP_ROUNDS = 3

_WARM_UP_MODEL = """
robot Rehearsal {
    interface twist use Twist from geometry_msgs
    interface laser_scan use LaserScan from sensor_msgs
    datatype object Vector { x: double y: double z: double }
    datatype object Velocity { linear: Vector angular: Vector }
    datatype object Scan { ranges: array(double) }
    datatype enum Distance from Scan to { value.ranges[0] > 1.0 and value.ranges[9] > 1.0 -> far default -> near }
    component Button {
        outgoing message pressed with identifier: "/pressed", type: boolean
        behaviour {
            variable is_down: boolean
            on response from pressed do is_down := value
            initial marked state up { transition if is_down goto down }
            state down { transition if !is_down goto up }
        }
    }
    component Lidar {
        outgoing message scan with identifier: "/scan", type: Distance links laser_scan
        behaviour {
            variable distance: Distance = near
            on response from scan do distance := value
            initial marked state blocked { transition if distance = far goto clear }
            marked state clear { transition if distance = near goto blocked }
        }
    }
    component Line {
        outgoing message offset with identifier: "/offset", type: double
        outgoing message lost with identifier: "/lost", type: none
        behaviour {
            variable current: double = 0.0
            on response from offset do current := value goto found
            on response from lost do current := 0.0 goto absent
            initial marked state absent { }
            marked state found { }
        }
    }
    component Base {
        incoming message drive with identifier: "/cmd_vel", type: Velocity links twist
        incoming message halt with identifier: "/cmd_vel", type: Velocity links twist
        behaviour { initial marked state ready { on request to drive on request to halt } }
    }
    component Door { incoming message open with identifier: "/open", type: none }
    requirement open needs Button.down
    requirement drive needs Line.found and Lidar.clear
    requirement halt needs Line.absent or Lidar.blocked
    provide drive with { linear: { x: 0.1 }, angular: { z: Line.current } }
    provide halt with { linear: { x: 0.0 } }
}
"""


class _ResultTooLargeError(Exception):
    """A result beyond its limit."""


PAUSE_S = 0.1


class ThrottledReports:
    """Filter of reports: passes on the first of each stage, and others if none was for a while.

    Small work reports little.

    Args:
        on_report: Receiver of the reports.
        clock: Monotonic clock, in seconds.
    """

    def __init__(self, on_report: Callable[[Report], None], clock: Callable[[], float] = monotonic) -> None:
        self._on_report = on_report
        self._clock = clock
        self._stage = ""
        self._reported_s = 0.0

    def __call__(self, report: Report) -> None:
        """Pass a report on, or drop it."""
        now_s = self._clock()
        if report.stage != self._stage or now_s - self._reported_s >= PAUSE_S:
            self._stage, self._reported_s = report.stage, now_s
            self._on_report(report)


def run_task(kind: TaskKind, request: bytes, limits: TaskLimits, on_report: OnReport) -> Outcome:
    """Run a task to its end.

    Args:
        kind: Kind of the task.
        request: The message of an accepted request.
        limits: Limits of the task; those of time and memory are enforced outside of this function.
        on_report: Callback that receives reports of the progress.
    """
    try:
        return Result(_bounded(_WORK[kind](request, limits, ThrottledReports(on_report)), limits.result_bytes))
    except NodeLimitError as error:
        return Failure(Reason.NODE_LIMIT, f"{error}, up to {limits.nodes} on this server")
    except _ResultTooLargeError:
        return result_too_large(limits)
    except (UnknownTargetError, UnknownEngineError, from_proto.OptionError, NoPropertyError) as error:
        return Failure(Reason.MALFORMED_REQUEST, str(error))
    except RequestError:
        # Its sentence names parts of the model.
        return Failure(Reason.MALFORMED_REQUEST, "initial names what the automata do not have")
    except Exception as error:  # The boundary of the worker: the server logs any error and continues.
        if is_lack_of_memory(error):
            return memory_exceeded(limits)
        return Failure(Reason.INTERNAL_FAULT, "the server has an internal error", _code_locations(error))


PRELOADED = ("robosc",)
"""Packages that are loaded, with all that is in them, before processes are forked that do tasks."""

NOT_PRELOADED = ("robosc.cli", "robosc.event_logs", "robosc.starter")
"""Packages that no task needs; drawing libraries start threads."""


def warm_up() -> None:
    """Run a small task, so that every fork of this process has what is loaded or built on first use.

    Python makes faster instructions of those that have run twice; a fork that did so would copy their pages.
    """
    file = pb.SourceFile(name="warm_up.rscd", text=_WARM_UP_MODEL)
    request = pb.SynthesizeRequest(bundle=pb.Bundle(main=file))
    for _ in range(_WARM_UP_ROUNDS):
        run_task(TaskKind.SYNTHESIZE, request.SerializeToString(), TaskLimits(), lambda report: None)
    # The first lookup loads the reader of package resources.
    resources.files("robosc.targets").joinpath("none").is_file()


def make_ready() -> None:
    """Make the decision diagrams of the first synthesis of every fork, if they make no threads, which no fork has."""
    engine = resolve_engine("auto")
    if engine != "oxidd":
        keep_ready(engine)


def _code_locations(error: BaseException) -> str:
    """Return the places of a fault, for a log: without its message, which may hold names of the model."""
    cause = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    before = f"{_code_locations(cause)}\n" if cause is not None else ""
    return f"{before}{''.join(traceback.format_tb(error.__traceback__))}{type(error).__qualname__}"


def _bounded(messages: Iterable[Any], maximum_bytes: int) -> tuple[bytes, ...]:
    """Messages as bytes.

    Raises:
        _ResultTooLargeError: They have more than `maximum_bytes`.
    """
    found: list[bytes] = []
    size = 0
    for message in messages:
        found.append(message.SerializeToString(deterministic=True))
        size += len(found[-1])
        if size > maximum_bytes:
            raise _ResultTooLargeError
    return tuple(found)


def _check(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.CheckResponse]:
    request = pb.CheckRequest.FromString(content)
    bundle = from_proto.bundle(request.bundle)
    on_report(Report("check", bundle.main.name))
    if isinstance(bundle, LoadedAutomata):
        yield pb.CheckResponse(diagnostics=to_proto.findings(check_automata_file(bundle).diagnostics))
        return
    found = check(bundle)
    yield pb.CheckResponse(diagnostics=to_proto.findings(found.diagnostics), accepted=to_proto.findings(found.accepted))


def _automata(
    request: pb.SynthesizeRequest | pb.GenerateRequest | pb.ExploreRequest | pb.VerifyRequest,
    limits: TaskLimits,
    on_report: OnReport,
) -> Automata | None:
    """Return the automata of a request; None: it is about a RoboSC model."""
    model = from_proto.bundle(request.bundle)
    return Automata(model, request.options, limits.nodes, on_report) if isinstance(model, LoadedAutomata) else None


def _synthesize(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.SynthesizeResponse]:
    request = pb.SynthesizeRequest.FromString(content)
    if (automata := _automata(request, limits, on_report)) is not None:
        yield pb.SynthesizeResponse(result=automata.synthesis(is_modular=request.modular))
        return
    attempt = SynthesisAttempt()
    result = pb.SynthesisResult()
    with attempt:
        allow_livelock, is_modular = request.options.allow_livelock, request.modular
        made = attempt.make(request, limits.nodes, on_report, allow_livelock=allow_livelock, is_modular=is_modular)
        result.accepted.extend(to_proto.findings(made.accepted))
        if made.statistics is not None:
            result.statistics.CopyFrom(to_proto.statistics(made.statistics))
        if made.supervisor is not None:
            content = encode(made.supervisor)
            result.supervisor, result.supervisor_digest = content, hashlib.sha256(content).digest()
            result.summary.CopyFrom(to_proto.summary(made.supervisor))
    result.MergeFrom(pb.SynthesisResult(**attempt.result_fields()))
    yield pb.SynthesizeResponse(result=result)


def _generate(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.GenerateResponse]:
    request = pb.GenerateRequest.FromString(content)
    require_generatable(request.target)
    choices = from_proto.generation(request.generation)
    if (automata := _automata(request, limits, on_report)) is not None:
        files, fields = automata.generation(
            request.target, choices, request.initial or None, is_modular=request.modular
        )
    else:
        files, fields = _generated(request, choices, limits, on_report)
    listing = [] if files is None else chunks.listing(files)
    digest = chunks.digest_of(listing) if listing else b""
    yield pb.GenerateResponse(result=pb.GenerationResult(files=listing, digest=digest, **fields))
    if files is not None:
        yield from (pb.GenerateResponse(chunk=chunk) for chunk in chunks.file_chunks(files))


def _generated(
    request: pb.GenerateRequest, choices: GenerateOptions, limits: TaskLimits, on_report: OnReport
) -> tuple[GeneratedFiles | None, dict[str, Any]]:
    """Return the files for a robot, or None, and the fields of the result."""
    attempt = SynthesisAttempt()
    files: GeneratedFiles | None = None
    with attempt:
        allow_livelock, is_modular = request.options.allow_livelock, request.modular
        made = attempt.make(request, limits.nodes, on_report, allow_livelock=allow_livelock, is_modular=is_modular)
        on_report(Report("generation", request.target))
        found = generate_or_refuse(made.supervisor, made.diagnostics, request.target, choices)
        if isinstance(found, TargetRefusal):
            attempt.refusal = found
        else:
            files = found
    return files, attempt.result_fields()


def _explore(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.ExploreResponse]:
    request = pb.ExploreRequest.FromString(content)
    if (automata := _automata(request, limits, on_report)) is not None:
        graph, fields = automata.exploration(request.maximum_states or DEFAULT_LIMIT)
    else:
        graph, fields = _explored(request, limits, on_report)
    if graph is None:
        yield pb.ExploreResponse(result=pb.ExplorationResult(**fields))
        return
    text = _bounded_text(json_pieces(graph_json(graph)), limits.result_bytes)
    digest = hashlib.sha256(text).digest()
    states, transitions = len(graph.states), len(graph.transitions)
    yield pb.ExploreResponse(
        result=pb.ExplorationResult(states=states, transitions=transitions, size=len(text), digest=digest, **fields)
    )
    yield from (pb.ExploreResponse(chunk=chunk) for chunk in chunks.content_chunks(text))


def _explored(
    request: pb.ExploreRequest, limits: TaskLimits, on_report: OnReport
) -> tuple[Graph | None, dict[str, Any]]:
    """Return the graph of a robot under its supervisor, or None, and the fields of the result."""
    attempt = SynthesisAttempt()
    graph: Graph | None = None
    with attempt:
        # The graph is of everything allowed, whatever an executor would choose.
        made = attempt.make(request, limits.nodes, on_report, allow_livelock=True, only_shown=True)
        if made.supervisor is not None:
            on_report(Report("exploration", f"{made.supervisor.certificate.states} states"))
            graph = _graph(made.supervisor, request.maximum_states or DEFAULT_LIMIT)
    return graph, attempt.result_fields()


def _graph(supervisor: Supervisor, maximum_states: int) -> Graph:
    """Return the graph of everything that the robot may do.

    Raises:
        UnsupportedModelError: The graph has more than `maximum_states` states.
    """
    system = to_automata(supervisor.model, supervisor.deployment)
    return explore(system, state_predicates(system, supervisor.added), supervisor.model, limit=maximum_states)


def _bounded_text(texts: Iterable[str], maximum_bytes: int) -> bytes:
    """Return the bytes of a text that comes in pieces; stop early if it is too long.

    Raises:
        _ResultTooLargeError: It has more than `maximum_bytes`.
    """
    content = bytearray()
    for text in texts:
        content += text.encode("utf-8")
        if len(content) > maximum_bytes:
            raise _ResultTooLargeError
    return bytes(content)


def _verify(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.VerifyResponse]:
    request = pb.VerifyRequest.FromString(content)
    if (automata := _automata(request, limits, on_report)) is None:
        result = verification(request, limits.nodes, on_report)
    else:
        result = automata.verification(
            request.maximum_states or DEFAULT_STATES,
            is_strict=request.strict,
            controller=request.controller,
            as_is=request.as_is,
        )
    yield pb.VerifyResponse(result=result)


def _explain(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.ExplainResponse]:
    request = pb.ExplainRequest.FromString(content)
    yield pb.ExplainResponse(result=explanation(request, limits.nodes, on_report))


def _format(content: bytes, limits: TaskLimits, on_report: OnReport) -> Iterator[pb.FormatResponse]:
    request = pb.FormatRequest.FromString(content)
    try:
        yield pb.FormatResponse(text=format_text(request.file.text, request.file.name))
    except LanguageError as error:
        yield pb.FormatResponse(diagnostics=to_proto.findings(error.diagnostics))


_WORK: dict[TaskKind, Callable[[bytes, TaskLimits, OnReport], Iterator[Any]]] = {
    TaskKind.CHECK: _check,
    TaskKind.SYNTHESIZE: _synthesize,
    TaskKind.GENERATE: _generate,
    TaskKind.EXPLORE: _explore,
    TaskKind.VERIFY: _verify,
    TaskKind.EXPLAIN: _explain,
    TaskKind.FORMAT: _format,
}
