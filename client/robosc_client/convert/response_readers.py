"""Readers of responses: each reassembles one result from the messages of a call, without any input or output.

Every size that a server declares is checked before anything is collected, and no more is collected than it declared.
Chunks in the wrong order, after the end, or too long are refused, and so is a stream that never reaches its result.
"""

import hashlib
from collections.abc import Callable
from typing import Any, Protocol

import msgspec

from robosc.language.tokens import tokenize
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.results import NoSupervisor
from robosc.signatures import MAXIMUM_SIGNATURE_BYTES
from robosc.source import Bundle, visible
from robosc.targets import GeneratedFiles
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.convert.response_fields import (
    diagnostics_of,
    explanation_status_of,
    goal_explanation_of,
    progress_of,
    reasons_of,
    statistics_of,
    status_of,
    summary_of,
    verification_status_of,
    whole_explanation_of,
)
from robosc_client.errors import NotThereError, malformed
from robosc_client.jobs import TaskKind
from robosc_client.paths import paths_problem
from robosc_client.results import (
    Explained,
    Exploration,
    Formatted,
    Generation,
    Progress,
    StateGraph,
    Synthesis,
    SynthesisStatus,
    TaskResult,
    Verification,
)

MAXIMUM_BYTES = 64 * 2**20
"""Maximum size of one result, and of one message, in bytes: a server's limit unless its settings say otherwise."""

MAXIMUM_FILES = 10_000
"""Maximum number of files of one result."""

_MAXIMUM_CHUNK_BYTES = 64 * 1024
"""Maximum size of a piece of a file or graph, in bytes."""

MAXIMUM_PROGRESS = 1_000_000
"""Maximum number of progress messages: a server sends fewer in many days."""


class ResponseReader[Result](Protocol):
    """Reader that reassembles one result."""

    def take(self, message: Any) -> Progress | None:
        """Take the next message; return its progress, if it has one.

        Raises:
            ServiceError: The message is invalid at this point.
        """

    def result(self) -> Result:
        """Return the result, once the stream has ended.

        Raises:
            ServiceError: The stream ended before the result was complete.
        """


class UnaryReader[Message, Result]:
    """ResponseReader for methods that answer with one message."""

    def __init__(self, convert: Callable[[Message], Result]) -> None:
        self._convert = convert
        self._found: list[Result] = []

    def take(self, message: Message) -> None:
        """Take the answer."""
        if self._found:
            raise malformed("it continues after its end")
        self._found.append(self._convert(message))

    def result(self) -> Result:
        """Return the answer."""
        if not self._found:
            raise malformed("it has no message")
        return self._found[0]


class _StreamReader:
    """Common part of every stream of the service: progress, then one result."""

    def __init__(self) -> None:
        self._reports = 0
        self._has_result = False

    def take(self, message: Any) -> Progress | None:
        """Take the next message."""
        match message.WhichOneof("event"):
            case "progress":
                self._reports += 1
                if self._has_result or self._reports > MAXIMUM_PROGRESS:
                    raise malformed("it has too many progress messages, or progress after its result")
                return progress_of(message.progress)
            case "result":
                if self._has_result:
                    raise malformed("there is more than one result")
                self._has_result = True
                self._take_result(message.result)
            case "chunk":
                if not self._has_result:
                    raise malformed("a chunk comes before the result")
                self._take_chunk(message.chunk)
            case _:
                raise malformed("a message has no field that this version of the client knows")
        return None

    def _take_result(self, message: Any) -> None:
        raise NotImplementedError

    def _take_chunk(self, chunk: Any) -> None:
        raise malformed("it continues after its end")

    def _require_result(self) -> None:
        if not self._has_result:
            raise malformed("it ended without a result")


class SynthesisReader(_StreamReader):
    """ResponseReader of the answer to Synthesize."""

    _found: Synthesis

    def _take_result(self, message: pb.SynthesisResult) -> None:
        status = status_of(message.status)
        if (status is SynthesisStatus.SUPERVISOR) != bool(message.supervisor):
            raise malformed("its status contradicts its supervisor")
        expected = hashlib.sha256(message.supervisor).digest() if message.supervisor else b""
        if message.supervisor_digest != expected:
            raise malformed("the digest of the supervisor does not match")
        if len(message.signature) > MAXIMUM_SIGNATURE_BYTES or (message.signature and not message.supervisor):
            raise malformed("its signature is invalid")
        self._found = Synthesis(
            status=status,
            diagnostics=diagnostics_of(message.diagnostics, accepted=message.accepted),
            reason=message.reason,
            supervisor=message.supervisor,
            summary=summary_of(message.summary) if message.HasField("summary") else None,
            statistics=statistics_of(message.statistics) if message.HasField("statistics") else None,
            explanation=reasons_of(status, message),
            signature=message.signature,
        )

    def result(self) -> Synthesis:
        """Return the outcome of the synthesis."""
        self._require_result()
        return self._found


class GenerationReader(_StreamReader):
    """ResponseReader of the answer to Generate: files, each from its beginning to its end."""

    _head: pb.GenerationResult
    _status: SynthesisStatus

    def __init__(self, target: str = "") -> None:
        """Prepare the reader.

        Args:
            target: Target that was asked for; empty: it is not known.
        """
        super().__init__()
        self._target = target
        self._place = 0
        self._contents: list[bytearray] = []

    def _take_result(self, message: pb.GenerationResult) -> None:
        self._status = status_of(message.status)
        if (self._status is SynthesisStatus.SUPERVISOR) != bool(message.files):
            raise malformed("its status contradicts its files")
        if len(message.files) > MAXIMUM_FILES or sum(file.size for file in message.files) > MAXIMUM_BYTES:
            raise malformed(f"it has more than {MAXIMUM_FILES} files, or {MAXIMUM_BYTES} bytes")
        paths = [file.path for file in message.files]
        if paths != sorted(set(paths)):
            raise malformed("its files are not sorted by their paths")
        problem = paths_problem(paths)
        if problem:
            raise malformed(problem)
        if message.digest != (_files_digest(message) if message.files else b""):
            raise malformed("the digest of its files does not match")
        self._head = message
        self._contents = [bytearray() for _ in message.files]

    def _take_chunk(self, chunk: pb.FileChunk) -> None:
        files = self._head.files
        if chunk.file >= len(files):
            raise malformed("a chunk belongs to no file")
        while self._place < chunk.file and self._is_whole(self._place):
            self._place += 1
        content, size = self._contents[chunk.file], files[chunk.file].size
        if chunk.file != self._place or chunk.offset != len(content):
            raise malformed("the chunks of files are not in order")
        # Empty chunks could continue for ever; only an empty file may have one.
        is_empty = not chunk.data and size > 0
        if is_empty or len(chunk.data) > _MAXIMUM_CHUNK_BYTES or len(content) + len(chunk.data) > size:
            raise malformed("a chunk of a file is empty or too long")
        content += chunk.data
        if not size:
            self._place += 1

    def _is_whole(self, place: int) -> bool:
        return len(self._contents[place]) == self._head.files[place].size

    def result(self) -> Generation:
        """Return the outcome of the generation."""
        self._require_result()
        head = self._head
        files = None
        if self._status is SynthesisStatus.SUPERVISOR:
            if not all(map(self._is_whole, range(len(head.files)))):
                raise malformed("it ended in the middle of the files")
            files = self._files()
        return Generation(
            self._status,
            diagnostics_of(head.diagnostics),
            head.reason,
            files,
            reasons_of(self._status, head),
            self._target,
        )

    def _files(self) -> GeneratedFiles:
        texts: dict[str, str] = {}
        for file, content in zip(self._head.files, self._contents, strict=True):
            if hashlib.sha256(content).digest() != file.digest:
                raise malformed(f"the digest of {file.path!r} does not match")
            try:
                texts[file.path] = content.decode("utf-8")
            except UnicodeDecodeError as error:
                raise malformed(f"{file.path!r} is not UTF-8") from error
        try:
            return GeneratedFiles(texts, frozenset(file.path for file in self._head.files if file.executable))
        except ValueError as error:
            raise malformed(str(error)) from error


def _files_digest(message: pb.GenerationResult) -> bytes:
    """Return the digest over all files, as the API defines it."""
    listing = hashlib.sha256()
    for file in message.files:
        try:
            path = file.path.encode("utf-8")
        except UnicodeEncodeError as error:
            raise malformed("a path is not valid Unicode") from error
        listing.update(path + b"\0" + (b"\1" if file.executable else b"\0") + file.digest)
    return listing.digest()


class ExplorationReader(_StreamReader):
    """ResponseReader of the answer to Explore: one document in pieces."""

    _head: pb.ExplorationResult
    _status: SynthesisStatus

    def __init__(self) -> None:
        super().__init__()
        self._content = bytearray()

    def _take_result(self, message: pb.ExplorationResult) -> None:
        self._status = status_of(message.status)
        if (self._status is SynthesisStatus.SUPERVISOR) != bool(message.size):
            raise malformed("its status contradicts its graph")
        if message.size > MAXIMUM_BYTES:
            raise malformed(f"the graph has more than {MAXIMUM_BYTES} bytes")
        self._head = message

    def _take_chunk(self, chunk: bytes) -> None:
        if not 0 < len(chunk) <= _MAXIMUM_CHUNK_BYTES or len(self._content) + len(chunk) > self._head.size:
            raise malformed("a chunk of the graph is empty or too long")
        self._content += chunk

    def result(self) -> Exploration:
        """Return the outcome of the exploration."""
        self._require_result()
        head = self._head
        if len(self._content) != head.size:
            raise malformed("it ended in the middle of the graph")
        if head.digest != (hashlib.sha256(self._content).digest() if head.size else b""):
            raise malformed("the digest of the graph does not match")
        return Exploration(
            self._status,
            diagnostics_of(head.diagnostics),
            head.reason,
            self._graph() if head.size else None,
            reasons_of(self._status, head),
        )

    def _graph(self) -> StateGraph:
        try:
            graph = msgspec.json.decode(self._content, type=StateGraph)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
            raise malformed(f"the graph is invalid: {error}") from error
        numbers = range(len(graph.states))
        begins = (graph.initial, *graph.initial_states)
        ends = (number for source, _, target in graph.transitions for number in (source, target))
        is_whole = all(number in numbers for number in (*begins, *ends))
        if not is_whole or (len(graph.states), len(graph.transitions)) != (self._head.states, self._head.transitions):
            raise malformed("the graph lacks states or transitions")
        return graph


class VerificationReader(_StreamReader):
    """ResponseReader of the answer to Verify."""

    _found: Verification

    def _take_result(self, message: pb.VerificationResult) -> None:
        try:
            report = msgspec.json.decode(message.report, type=dict[str, Any]) if message.report else {}
        except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
            raise malformed(f"the report is invalid: {error}") from error
        self._found = Verification(
            verification_status_of(message.status), diagnostics_of(message.diagnostics), message.reason, report
        )

    def result(self) -> Verification:
        """Return the outcome of the verification."""
        self._require_result()
        return self._found


class ExplanationReader(_StreamReader):
    """ResponseReader of the answer to Explain.

    Args:
        bundle: Texts that were sent; None: they are not available.
    """

    _found: Explained | None
    _problem: str

    def __init__(self, bundle: Bundle | None = None) -> None:
        super().__init__()
        self._bundle = bundle

    def _take_result(self, message: pb.ExplanationResult) -> None:
        self._problem, self._found = visible(message.reason), None
        status = explanation_status_of(message.status)
        if status is None:
            return
        diagnostics = diagnostics_of(message.diagnostics, self._bundle)
        if message.HasField("goals"):
            if status is not SynthesisStatus.MODEL_ERRORS or message.explanation:
                raise malformed("its status contradicts its explanation")
            if isinstance(self._bundle, LoadedAutomata):
                raise malformed("the explanation is of a model in another language")
            self._found = Explained(status, diagnostics, self._problem, goal_explanation_of(message.goals))
            return
        if status not in (SynthesisStatus.SUPERVISOR, SynthesisStatus.EMPTY):
            if message.explanation:
                raise malformed("its status contradicts its explanation")
            nothing = NoSupervisor(self._problem, diagnostics)
            self._found = Explained(status, diagnostics, self._problem, nothing)
            return
        explanation = whole_explanation_of(message.explanation)
        if (status is SynthesisStatus.EMPTY) != (explanation.empty is not None):
            raise malformed("its status contradicts its explanation")
        if self._bundle is not None and explanation.is_of_automata != isinstance(self._bundle, LoadedAutomata):
            raise malformed("the explanation is of a model in another language")
        self._found = Explained(status, diagnostics, self._problem, explanation)

    def result(self) -> Explained:
        """Return the outcome of the explanation.

        Raises:
            NotThereError: An event, a state or a run of the request does not exist.
        """
        self._require_result()
        if self._found is None:
            raise NotThereError(self._problem)
        return self._found


def check_reader(bundle: Bundle | None = None) -> UnaryReader[pb.CheckResponse, Findings]:
    """Return the reader of the response to Check.

    Args:
        bundle: Texts that were sent; None: they are not available.
    """
    return UnaryReader(lambda message: diagnostics_of(message.diagnostics, bundle, message.accepted))


def format_reader(before: str | None) -> UnaryReader[pb.FormatResponse, Formatted]:
    """Return the reader of the response to Format.

    Args:
        before: Text that was sent, of which only the layout may differ in the answer; None: it is not available.
    """

    def convert(message: pb.FormatResponse) -> Formatted:
        diagnostics = diagnostics_of(message.diagnostics)
        text = None if diagnostics else message.text
        if text is not None and before is not None and not _differ_in_layout_alone(before, text):
            raise malformed("the text differs in more than its layout")
        return Formatted(text, diagnostics)

    return UnaryReader(convert)


def _differ_in_layout_alone(before: str, after: str) -> bool:
    """Return True if two texts have the same tokens and the same comments, but for blanks."""
    if "".join(before.split()) != "".join(after.split()):
        return False
    # A comment that ends on a later line would hide the code after it.
    return tokenize(before).texts == tokenize(after).texts


class JobResultReader:
    """ResponseReader of the answer to GetJobResult: the messages of one of the others, each in an envelope."""

    def __init__(self, expected: TaskKind | None = None) -> None:
        """Prepare the reader.

        Args:
            expected: Kind of the job's task; None: it is not known.
        """
        self._expected = expected
        self._kind: TaskKind | None = None
        self._inner: ResponseReader[TaskResult]

    def take(self, message: jobs_pb2.GetJobResultResponse) -> None:
        """Take the next message."""
        name = message.WhichOneof("response")
        if name is None or name not in TaskKind:
            raise malformed("a message has no field that this version of the client knows")
        if self._kind is None:
            self._kind = TaskKind(name)
            if self._expected not in (None, self._kind):
                raise malformed(f"the job has the kind {self._expected}, but its result has the kind {self._kind}")
            self._inner = _reader_for(self._kind)
        if self._kind is not TaskKind(name):
            raise malformed("it has results of two task kinds")
        if self._inner.take(getattr(message, name)) is not None:
            raise malformed("the result of a job has progress messages")

    def result(self) -> TaskResult:
        """Return the result."""
        if self._kind is None:
            raise malformed("it ended without a result")
        return self._inner.result()


def _reader_for(kind: TaskKind) -> ResponseReader[TaskResult]:
    """Return a new reader for the responses of a kind of task."""
    match kind:
        case TaskKind.CHECK:
            return check_reader()
        case TaskKind.SYNTHESIZE:
            return SynthesisReader()
        case TaskKind.GENERATE:
            return GenerationReader()
        case TaskKind.EXPLORE:
            return ExplorationReader()
        case TaskKind.VERIFY:
            return VerificationReader()
        case TaskKind.EXPLAIN:
            return ExplanationReader()
        case TaskKind.FORMAT:
            return format_reader(None)
