"""`controller-config.json` beside a model: the original tool's settings for generated files."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path, PurePosixPath
from typing import Any

from robosc.errors import RoboscError
from robosc.model.structure import Deployment
from robosc.targets.registry import GenerateOptions, PackageMetadata, StateMessage, SupervisedController

CONFIG_FILE = "controller-config.json"
MAXIMUM_BYTES = 64 * 1024

_PUBLISHES = "publishStateInformation"
_WRITES = "writeEventsToLog"
_LOCATIONS = "outputLocations"
_SUPERVISED = "supervisedController"
_SUPERVISED_KEYS = ("package", "executable", "launchFile")
_OUTPUT = "output"
_SUPERVISOR = "supervisor"
_NODES: Mapping[str, tuple[tuple[str, ...], Deployment]] = {
    "ros1ControllerNodeLocation": (("ros1", "ros1-cpp"), Deployment.CONTROLLER),
    "ros2ControllerNodeLocation": (("ros2", "ros2-cpp"), Deployment.CONTROLLER),
    "ros2SupervisorNodeLocation": (("ros2", "ros2-cpp"), Deployment.LAYER),
}
"""Names in `output` of the original, with the targets and the deployment of their packages."""
_RUN_KEYS = ("packageName", "namespace", "executable", "name")
_LAUNCH_KEYS = ("packageName", "file")
_METADATA = ("maintainer", "license", "version", "copyright")
_STATE_MESSAGE = "stateMessage"
_KEYS = (_PUBLISHES, _WRITES, _LOCATIONS, _SUPERVISED, *_METADATA, _STATE_MESSAGE, _OUTPUT, _SUPERVISOR)

_TARGET = re.compile(r"[a-z0-9-]{1,40}\Z")


class ControllerConfigError(RoboscError, ValueError):
    """A `controller-config.json` cannot be used; says which file, where in it, and what is wrong."""


@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """Content of such a file.

    Attributes:
        publish_state: True if `/state` is published.
        log_events: True if the event log is written.
        locations: Folder to generate into by target, below the folder of the file.
        nodes: Folder to generate into by target and deployment, as the original has it.
        supervised: The existing controller, or None.
        metadata: Maintainer, licence, version and copyright of a generated ROS package.
        state_message: Form of the state of a generated ROS 2 node.
        warnings: Things that were found and not understood, one sentence each.
    """

    publish_state: bool = False
    log_events: bool = False
    locations: Mapping[str, Path] = field(default_factory=dict)
    nodes: Mapping[tuple[str, Deployment], Path] = field(default_factory=dict)
    supervised: SupervisedController | None = None
    metadata: PackageMetadata = field(default_factory=PackageMetadata)
    state_message: StateMessage = StateMessage.JSON
    warnings: tuple[str, ...] = ()

    def location(self, target: str, deployment: Deployment) -> Path | None:
        """Return the folder to generate a target into, or None if the file names none."""
        return self.locations.get(target) or self.nodes.get((target, deployment))

    def options(self, package: str | None) -> GenerateOptions:
        """Return the options that a target is called with."""
        return GenerateOptions(
            package, self.publish_state, self.log_events, self.supervised, self.metadata, self.state_message
        )


def read_controller_config(folder: Path) -> ControllerConfig:
    """Return the content of the file in a folder; the defaults where there is none.

    Raises:
        ControllerConfigError: It is there and cannot be used.
    """
    path = folder / CONFIG_FILE
    try:
        with path.open("rb") as file:
            content = file.read(MAXIMUM_BYTES + 1)
    except FileNotFoundError:
        return ControllerConfig()
    except OSError as error:
        raise ControllerConfigError(f"{path}: {error.strerror or error}") from error
    if len(content) > MAXIMUM_BYTES:
        raise ControllerConfigError(f"{path}: more than {MAXIMUM_BYTES} bytes")
    return _Reader(path).config(_document(path, content))


def _document(path: Path, content: bytes) -> dict[str, Any]:
    try:
        document = json.loads(content.decode("utf-8"), object_pairs_hook=_without_repetition)
    except RecursionError:
        raise ControllerConfigError(f"{path}: nested too deeply") from None
    except ValueError as error:
        raise ControllerConfigError(f"{path}: no JSON: {error}") from error
    if not isinstance(document, dict):
        raise ControllerConfigError(f"{path}: it must hold an object")
    return document


def _without_repetition(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name stands twice in one object")
    return found


class _Reader:
    """Reads one file's document; every error names the file and the place in it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._warnings: list[str] = []

    def config(self, document: dict[str, Any]) -> ControllerConfig:
        self._warn_of_unknown(document, _KEYS, "")
        return ControllerConfig(
            publish_state=self._boolean(document, _PUBLISHES),
            log_events=self._boolean(document, _WRITES),
            locations=self._locations(document.get(_LOCATIONS, {})),
            nodes=self._nodes(document.get(_OUTPUT)),
            supervised=self._supervised(document.get(_SUPERVISED)) or self._supervisor(document.get(_SUPERVISOR)),
            metadata=self._metadata(document),
            state_message=self._state_message(document.get(_STATE_MESSAGE, StateMessage.JSON)),
            warnings=tuple(self._warnings),
        )

    def _wrong(self, place: str, expected: str) -> ControllerConfigError:
        return ControllerConfigError(f"{self._path}: '{place}' must be {expected}")

    def _warn_of_unknown(self, found: Mapping[str, Any], known: tuple[str, ...], place: str) -> None:
        for name in found:
            if name not in known:
                near = get_close_matches(name, known, n=1)
                hint = f"; did you mean '{near[0]}'?" if near else f"; there is {', '.join(known)}"
                self._warnings.append(f"{self._path}: '{place}{name[:60]}' is not known{hint}")

    def _boolean(self, document: Mapping[str, Any], name: str) -> bool:
        value = document.get(name, False)
        if not isinstance(value, bool):
            raise self._wrong(name, "true or false")
        return value

    def _locations(self, value: object) -> dict[str, Path]:
        if not isinstance(value, dict):
            raise self._wrong(_LOCATIONS, "an object: a folder for each target")
        found: dict[str, Path] = {}
        for name, folder in value.items():
            # The original writes ROS1 and ROS2.
            target = name.lower()
            if not _TARGET.match(target) or target in found:
                raise self._wrong(_LOCATIONS, "an object whose names are those of targets, each once")
            found[target] = self._folder(f"{_LOCATIONS}.{target}", folder)
        return found

    def _folder(self, place: str, folder: object) -> Path:
        if not isinstance(folder, str) or not _is_below(folder):
            raise self._wrong(place, "the relative path of a folder, with `/` and without `..`; see also -o")
        return self._path.parent / folder

    def _nodes(self, value: object) -> dict[tuple[str, Deployment], Path]:
        """Return the folders that the original copies its packages into."""
        found: dict[tuple[str, Deployment], Path] = {}
        for name, folder in self._object(_OUTPUT, value, tuple(_NODES)).items():
            targets, deployment = _NODES.get(name, ((), Deployment.CONTROLLER))
            if targets and folder is not None:
                path = self._folder(f"{_OUTPUT}.{name}", folder)
                found.update(((target, deployment), path) for target in targets)
        return found

    def _object(self, place: str, value: object, known: tuple[str, ...]) -> dict[str, Any]:
        """Return an object of the original's; an empty one where there is none."""
        if value is None:
            return {}
        if not isinstance(value, dict):
            raise self._wrong(place, f"an object with {', '.join(known)}")
        self._warn_of_unknown(value, known, f"{place}.")
        return value

    def _supervisor(self, value: object) -> SupervisedController | None:
        """Return the existing controller as the original names it: what it runs, or launches."""
        place = f"{_SUPERVISOR}.controller"
        controller = self._object(
            place, self._object(_SUPERVISOR, value, ("controller",)).get("controller"), ("run", "launch")
        )
        given = {word: controller[word] for word in ("run", "launch") if controller.get(word) is not None}
        if not given:
            return None
        if len(given) > 1:
            raise self._wrong(place, "an object with either run or launch")
        ((word, described),) = given.items()
        found = self._object(f"{place}.{word}", described, _RUN_KEYS if word == "run" else _LAUNCH_KEYS)
        if not all(item is None or isinstance(item, str) for item in found.values()):
            raise self._wrong(f"{place}.{word}", "an object of texts")
        names = {name: found.get(name) or None for name in ("executable", "namespace", "name") if word == "run"}
        try:
            return SupervisedController(found.get("packageName") or "", launch_file=found.get("file"), **names)
        except ValueError as error:
            raise ControllerConfigError(f"{self._path}: '{place}.{word}': {error}") from error

    def _metadata(self, document: Mapping[str, Any]) -> PackageMetadata:
        given = {name: document[name] for name in _METADATA if document.get(name) is not None}
        found = PackageMetadata()
        for name, value in given.items():
            if not isinstance(value, str):
                raise self._wrong(name, "a text")
            try:
                found = found.with_maintainer(value) if name == "maintainer" else replace(found, **{name: value})
            except ValueError as error:
                raise ControllerConfigError(f"{self._path}: '{name}': {error}") from error
        return found

    def _state_message(self, value: object) -> StateMessage:
        if not isinstance(value, str) or value not in set(StateMessage):
            raise self._wrong(_STATE_MESSAGE, f"one of {', '.join(StateMessage)}")
        return StateMessage(value)

    def _supervised(self, value: object) -> SupervisedController | None:
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self._wrong(_SUPERVISED, "an object with package and executable or launchFile")
        self._warn_of_unknown(value, _SUPERVISED_KEYS, f"{_SUPERVISED}.")
        given = [value.get(name) for name in _SUPERVISED_KEYS]
        if not all(item is None or isinstance(item, str) for item in given):
            raise self._wrong(_SUPERVISED, "an object of texts")
        try:
            return SupervisedController(given[0] or "", given[1], given[2])
        except ValueError as error:
            raise ControllerConfigError(f"{self._path}: '{_SUPERVISED}': {error}") from error


def _is_below(folder: str) -> bool:
    """Return True if a path stays below its start, links apart."""
    path = PurePosixPath(folder)
    return (
        bool(folder)
        and "\\" not in folder
        and folder.isprintable()
        and not path.is_absolute()
        and ".." not in path.parts
    )
