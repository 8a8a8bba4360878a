"""Validation of requests: each is refused, or accepted as a task with a key of its meaning.

This runs in the server's own process on untrusted bytes: their number is limited before they are parsed, the parser
refuses nesting beyond 100 levels (unknown fields included) and texts that are not UTF-8, and no file is ever opened by
name. No stage of the core is imported.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import entry_points, version
from typing import Any

from google.protobuf.message import DecodeError

from robosc._version import __version__
from robosc.dd_modules import has_cudd
from robosc.interfaces import CODENAMES
from robosc.source import visible
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.fields import Nested, has_few_fields, nested_of
from robosc_server.tasks.task import Reason, RefusedError, Task, TaskKind, own_key

NOT_A_MESSAGE = "the request is not a valid message of this service"

_PLUGINS = ("robosc.targets", "robosc.bdd_engines")
"""Groups of entry points of packages that have a say in results."""

_FRAMING_BYTES = 64 * 1024
"""Bytes that a message may have besides its names and texts: tags and lengths of a thousand files take 20 kB."""

_SUBMISSION_BYTES = 4096
"""Bytes that a job's submission has besides its request."""

_FIELDS_A_FILE = 8
"""A file of a bundle is a field with two, and so is one of properties; a place and a property are one each."""

_OTHER_FIELDS = 100

QUICK_BYTES = 16 * 1024
"""A message of no more bytes is parsed quickly, whatever they are."""

_REMEMBERED_BYTES = 64 * 1024
_ALL_REMEMBERED_BYTES = 4 * 2**20
"""Maximum size of all remembered requests, in bytes; one longer than `_REMEMBERED_BYTES` is checked each time."""

_ENTRY_BYTES = 500
"""Bytes that a remembered request takes besides its own."""

_ENDINGS = {pb.LANGUAGE_CIF: ".cif", pb.LANGUAGE_FAUDES: ".gen", pb.LANGUAGE_SUPREMICA: ".wmod"}
"""Ending of the main file's name, by the language of automata."""

_DEFAULT_GRAPH_STATES = 100_000
_DEFAULT_VERIFIED_STATES = 1_000_000
_DEFAULT_MADE_STATES = 200_000
_MAXIMUM_VERIFIED_STATES = 10**9


@dataclass(frozen=True, slots=True)
class RequestLimits:
    """Limits of a request.

    Attributes:
        bundle_bytes: Maximum size of all names and texts of a bundle; a given supervisor and properties count, too.
        bundle_files: Maximum number of files; also of searched places, and of properties.
        name_bytes: Maximum length of the name of a file, a target or an engine, in bytes.
        nodes: Maximum number of decision diagram nodes of a task; a request for more gets this number.
    """

    bundle_bytes: int = 2**20
    bundle_files: int = 1000
    name_bytes: int = 255
    nodes: int = 20_000_000

    @property
    def request_bytes(self) -> int:
        """Maximum size of a whole message, in bytes: a longer one is not parsed."""
        return self.bundle_bytes + _FRAMING_BYTES

    @property
    def submission_bytes(self) -> int:
        """Maximum size of a whole submission of a job, in bytes."""
        return self.request_bytes + _SUBMISSION_BYTES

    @property
    def fields(self) -> int:
        """Maximum number of fields of a whole message, those of messages in it included."""
        return _FIELDS_A_FILE * self.bundle_files + _OTHER_FIELDS


def require_short(content: bytes, limit: int) -> None:
    """Do nothing if a message does not exceed the limit on its bytes.

    Raises:
        RefusedError: The message is too long.
    """
    if len(content) > limit:
        raise _too_large(f"the request has {len(content)} bytes; this server accepts at most {limit}")


def require_parsable(content: bytes, nested: Nested, limits: RequestLimits) -> None:
    """Do nothing if a short message can be parsed in a short time.

    Args:
        content: The message, serialized.
        nested: Fields of the message that are messages.
        limits: Limits of a request.

    Raises:
        RefusedError: The message has too many fields.
    """
    if len(content) > QUICK_BYTES and not has_few_fields(content, nested, limits.fields):
        raise _too_large(f"the request has more than {limits.fields} fields (files, names and texts)")


def accept_request(kind: TaskKind, request: bytes, limits: RequestLimits) -> Task:
    """Return the task of a request.

    Args:
        kind: Kind of the request.
        request: The serialized message of the request.
        limits: Limits of the request.

    Raises:
        RefusedError: The request is malformed, has invalid names, is incomplete or exceeds a limit.
    """
    require_short(request, limits.request_bytes)
    parse, read, nested = _KINDS[kind]
    require_parsable(request, nested, limits)
    try:
        message = parse(request)
    except DecodeError:
        # The parser's own message may quote the request.
        raise RefusedError(Reason.MALFORMED_REQUEST, NOT_A_MESSAGE) from None
    reader = _RequestReader(limits)
    # Python's notation of nested values is read back as those values only: other values have another notation.
    meaning = repr((_producer_versions(), kind.value, read(message, reader)))
    reader.require_small()
    return Task(kind, request, hashlib.sha256(meaning.encode("utf-8")).hexdigest(), reader.main_file)


class RequestCache:
    """Cache of accepted requests by their caller and bytes, since clients often repeat a request.

    Args:
        limits: Limits of a request; they and the versions of what makes results never change in one process.
        keys: Function that returns the key of a caller's task, from the key of the task and the caller.
    """

    def __init__(self, limits: RequestLimits, keys: Callable[[str, str], str] = own_key) -> None:
        self._limits, self._keys = limits, keys
        self._tasks: OrderedDict[tuple[TaskKind, str, bytes], Task] = OrderedDict()
        self._bytes = 0

    def accept(self, kind: TaskKind, caller: str, request: bytes) -> Task:
        """Return the task of a request under the key of its caller; see `accept_request`.

        Raises:
            RefusedError: The request is invalid.
        """
        place = kind, caller, request
        known = self._tasks.get(place)
        if known is not None:
            self._tasks.move_to_end(place)
            return known
        task = accept_request(kind, request, self._limits)
        task = replace(task, key=self._keys(task.key, caller))
        if len(request) <= _REMEMBERED_BYTES:
            self._tasks[place] = task
            self._bytes += len(request) + _ENTRY_BYTES
            while self._bytes > _ALL_REMEMBERED_BYTES:
                (_, _, oldest), _ = self._tasks.popitem(last=False)
                self._bytes -= len(oldest) + _ENTRY_BYTES
        return task


@cache
def _producer_versions() -> tuple[str, ...]:
    """Return everything that makes results, by version.

    It is this distribution, the diagrams, and those distributions whose targets and engines it uses.
    """
    # The engine `auto` is another one without dd's extension.
    diagrams = f"dd {version('dd')} {'with' if has_cudd() else 'without'} cudd, oxidd {version('oxidd')}"
    dists = [point.dist for group in _PLUGINS for point in entry_points(group=group)]
    others = {f"{dist.name} {dist.version}" for dist in dists if dist is not None and dist.name != "robosc"}
    return (__version__, diagrams, *sorted(others))


class _RequestReader:
    """Reader of the parts of one request, which validates them and counts their bytes.

    Attributes:
        main_file: Name of the main file.
        is_automata: True if the bundle, which is read first, holds automata.
    """

    __slots__ = ("_bytes", "_limits", "is_automata", "main_file")

    def __init__(self, limits: RequestLimits) -> None:
        self._limits = limits
        self._bytes = 0
        self.main_file = ""
        self.is_automata = False

    def require_small(self) -> None:
        """Do nothing if the bytes counted so far are within the limit.

        Raises:
            RefusedError: The limit is exceeded.
        """
        limit = self._limits.bundle_bytes
        if self._bytes > limit:
            raise _too_large(f"the names and texts have {self._bytes} bytes; this server accepts at most {limit}")

    def require_few(self, count: int, what: str) -> None:
        """Do nothing if the number of files, or of other items, is within its limit.

        Raises:
            RefusedError: There are too many.
        """
        limit = self._limits.bundle_files
        if count > limit:
            raise _too_large(f"the request has {count} {what}; this server accepts at most {limit}")

    def bundle(self, message: Any) -> tuple[object, ...]:
        """Return the meaning of a bundle, whatever the order of its libraries and of its interfaces.

        Raises:
            RefusedError: Its names are invalid, or it has too much.
        """
        language = message.language or pb.LANGUAGE_ROBOSC
        if language != pb.LANGUAGE_ROBOSC and language not in _ENDINGS:
            raise _malformed(f"the request has the unknown language {language}")
        self.is_automata = language in _ENDINGS
        libraries, interfaces, searched = message.libraries, message.interfaces, message.searched
        self.require_few(1 + len(libraries) + len(interfaces), "files")
        self.require_few(len(searched), "searched places")
        if not message.HasField("main"):
            raise _malformed("the bundle has no main file")
        main = self.file(message.main)
        self.main_file = main[0]
        if self.is_automata:
            self._require_automata(message, _ENDINGS[language])
        others = sorted(map(self.file, libraries)), sorted(map(self.file, interfaces))
        names = {self.main_file}
        for group in others:
            for name, _ in group:
                if name in names:
                    raise _malformed(f"two files of the bundle have the name '{name}'")
                names.add(name)
        if message.distribution and message.distribution not in CODENAMES:
            raise _malformed(
                f"there is no ROS distribution '{message.distribution[:80]}' here, but {', '.join(CODENAMES)}"
            )
        return language, main, *others, [self.text(place) for place in searched], message.distribution

    def _require_automata(self, message: Any, ending: str) -> None:
        """Do nothing if a bundle has what automata may have.

        Raises:
            RefusedError: It has more, or its main file another ending.
        """
        if not self.main_file.endswith(ending):
            raise _malformed(f"a file of this language has a name that ends in {ending}, not '{self.main_file[-80:]}'")
        self.refuse_of_robots(
            searched=message.searched, interfaces=message.interfaces, distribution=message.distribution
        )
        if message.libraries and ending != ".cif":
            raise _malformed("libraries: plain automata import no files")

    def refuse_of_robots(self, **given: object) -> None:
        """Do nothing if a request about automata has none of the fields that are for RoboSC models.

        Args:
            **given: Value of each of these fields.

        Raises:
            RefusedError: The request has such a field.
        """
        for name, value in given.items():
            if self.is_automata and value:
                raise _malformed(f"{name} applies to RoboSC models, and the request has automata")

    def refuse_of_automata(self, **given: object) -> None:
        """The same for a request about a RoboSC model, and the fields that are for automata."""
        for name, value in given.items():
            if value and not self.is_automata:
                raise _malformed(f"{name} applies to automata, and the request has a RoboSC model")

    def file(self, message: Any) -> tuple[str, str]:
        """Name of a file and digest of its text.

        Raises:
            RefusedError: Nothing can be called so.
        """
        name: str = message.name
        _require_relative(name)
        return self.name(name, "a file's name"), self.content(message.text.encode("utf-8"))

    def name(self, name: str, what: str) -> str:
        """A name that can be printed and is not too long; it may be empty.

        Raises:
            RefusedError: It is something else.
        """
        if not name.isprintable():
            raise _malformed(f"{what} contains a character that cannot be printed, such as NUL")
        size = len(name) if name.isascii() else len(name.encode("utf-8"))
        if size > self._limits.name_bytes:
            raise _malformed(f"{what} has {size} bytes, more than {self._limits.name_bytes}")
        self._bytes += size
        return name

    def text(self, text: str) -> str:
        """The digest of a text."""
        return self.content(text.encode("utf-8"))

    def content(self, content: bytes) -> str:
        """The digest of a content."""
        self._bytes += len(content)
        return hashlib.sha256(content).hexdigest()

    def options(self, message: Any, *, deployment: int = pb.DEPLOYMENT_CONTROLLER) -> tuple[object, ...]:
        """Return the meaning of the options of a synthesis, with the defaults filled in.

        Args:
            message: The options.
            deployment: Deployment that is meant if the options give none.

        Raises:
            RefusedError: There is no such deployment.
        """
        chosen = message.deployment or deployment
        if chosen not in _DEPLOYMENTS:
            raise _malformed(f"the request has the unknown deployment {chosen}")
        self.refuse_of_robots(
            deployment=chosen == pb.DEPLOYMENT_LAYER,
            allow_livelock=message.allow_livelock,
            verified_states=message.HasField("verified_states"),
        )
        engine = self.name(message.engine, "the engine's name") or "auto"
        nodes = min(message.maximum_nodes or self._limits.nodes, self._limits.nodes)
        states = message.verified_states if message.HasField("verified_states") else _DEFAULT_MADE_STATES
        if states > _MAXIMUM_VERIFIED_STATES:
            raise _malformed(f"verified_states is more than {_MAXIMUM_VERIFIED_STATES}")
        return chosen, engine, message.allow_livelock, message.allow_reordering, nodes, states


_DEPLOYMENTS = (pb.DEPLOYMENT_UNSPECIFIED, pb.DEPLOYMENT_CONTROLLER, pb.DEPLOYMENT_LAYER)


def _require_relative(name: str) -> None:
    r"""A file's name says nothing of a place on a machine: no root, no drive (`C:`), no host (`\\`)."""
    if not name:
        raise _malformed("a file has no name")
    if name[0] in "/\\" or name[1:2] == ":":
        raise _malformed(f"a file's name must be relative, not '{visible(name[:80])}'")


def _check(message: Any, reader: _RequestReader) -> object:
    return reader.bundle(message.bundle)


def _synthesize(message: Any, reader: _RequestReader) -> object:
    bundle = reader.bundle(message.bundle)
    return bundle, reader.options(message.options), message.modular


_METADATA = ("maintainer", "email", "license", "version", "copyright")


def _generate(message: Any, reader: _RequestReader) -> object:
    if not message.target:
        raise _malformed("the request names no target")
    choices = message.generation
    bundle, options = reader.bundle(message.bundle), reader.options(message.options)
    reader.refuse_of_automata(initial=message.initial)
    if reader.is_automata:
        reader.refuse_of_robots(
            publish_state=choices.publish_state,
            log_events=choices.log_events,
            supervised=choices.HasField("supervised"),
            metadata=choices.HasField("metadata"),
            state_message=choices.state_message,
        )
        if message.target == "all":
            raise _malformed("the target all is for RoboSC models: of automata name c99, cif or python")
        if message.target == "cif" and choices.package:
            raise _malformed("package: of automata, the target cif makes one file and no package")
    supervised = None
    if choices.HasField("supervised"):
        named = choices.supervised
        supervised = [
            reader.name(text, "a name of the supervised controller")
            for text in (named.package, named.executable, named.launch_file)
        ]
    return (
        bundle,
        options,
        reader.text(message.initial),
        message.modular,
        reader.name(message.target, "the target's name"),
        reader.name(choices.package, "the package's name"),
        choices.publish_state,
        choices.log_events,
        supervised,
        [reader.name(getattr(choices.metadata, name), f"the package's {name}") for name in _METADATA],
        reader.name(choices.state_message, "the form of the state"),
    )


def _explore(message: Any, reader: _RequestReader) -> object:
    bundle = reader.bundle(message.bundle)
    deployment, engine, _, *rest = reader.options(message.options)
    # Silent steps are allowed, whatever the options say of them.
    return bundle, deployment, engine, rest, message.maximum_states or _DEFAULT_GRAPH_STATES


def _verify(message: Any, reader: _RequestReader) -> object:
    bundle = reader.bundle(message.bundle)
    reader.refuse_of_robots(
        supervisor=message.supervisor, properties=message.properties, property_files=message.property_files
    )
    is_given, is_robot = bool(message.supervisor), not reader.is_automata
    if is_robot and not is_given and (message.maximum_states or message.strict):
        raise _malformed("maximum_states and strict apply only to a given supervisor, and the request has none")
    if is_robot and (message.controller or message.as_is):
        raise _malformed("controller and as_is apply only to automata")
    if is_robot and not is_given and not message.properties and not message.property_files:
        raise _malformed("the request has neither a supervisor nor properties")
    if message.maximum_states > _MAXIMUM_VERIFIED_STATES:
        raise _malformed(f"maximum_states is more than {_MAXIMUM_VERIFIED_STATES}")
    reader.require_few(len(message.properties), "properties")
    reader.require_few(len(message.property_files), "files of properties")
    # A supervisor that is given may be for any deployment.
    unsaid = pb.DEPLOYMENT_UNSPECIFIED if is_given else pb.DEPLOYMENT_CONTROLLER
    deployment, engine, _, *rest, made_states = reader.options(message.options, deployment=unsaid)
    return (
        bundle,
        # A given supervisor needs no synthesis.
        (deployment, engine, rest, None if is_given else made_states),
        reader.content(message.supervisor) if is_given else None,
        [reader.text(text) for text in message.properties],
        [reader.file(file) for file in message.property_files],
        message.maximum_states or _DEFAULT_VERIFIED_STATES,
        message.strict,
        message.controller,
        message.as_is,
    )


def _explain(message: Any, reader: _RequestReader) -> object:
    bundle = reader.bundle(message.bundle)
    # Silent steps are allowed, and nothing is verified, whatever the options say of them.
    deployment, engine, _, *rest, _ = reader.options(message.options)
    asked = [
        reader.text(getattr(message, name)) if message.HasField(name) else None for name in ("event", "state", "after")
    ]
    reader.refuse_of_robots(modular=message.modular)
    if message.modular and (message.HasField("state") or message.HasField("after")):
        raise _malformed("modular explains events: state and after are about the whole robot")
    return bundle, deployment, engine, rest, asked, message.modular


def _format(message: Any, reader: _RequestReader) -> object:
    if not message.HasField("file"):
        raise _malformed("the request has no file")
    found = reader.file(message.file)
    reader.main_file = found[0]
    return found


_REQUESTS: dict[TaskKind, tuple[Any, Callable[[Any, _RequestReader], object]]] = {
    TaskKind.CHECK: (pb.CheckRequest, _check),
    TaskKind.SYNTHESIZE: (pb.SynthesizeRequest, _synthesize),
    TaskKind.GENERATE: (pb.GenerateRequest, _generate),
    TaskKind.EXPLORE: (pb.ExploreRequest, _explore),
    TaskKind.VERIFY: (pb.VerifyRequest, _verify),
    TaskKind.EXPLAIN: (pb.ExplainRequest, _explain),
    TaskKind.FORMAT: (pb.FormatRequest, _format),
}
_KINDS: dict[TaskKind, tuple[Callable[[bytes], Any], Callable[[Any, _RequestReader], object], Nested]] = {
    kind: (message.FromString, read, nested_of(message)) for kind, (message, read) in _REQUESTS.items()
}


def _malformed(message: str) -> RefusedError:
    return RefusedError(Reason.MALFORMED_REQUEST, message)


def _too_large(message: str) -> RefusedError:
    return RefusedError(Reason.REQUEST_TOO_LARGE, message)
