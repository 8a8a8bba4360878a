"""Mapping of a model's communications to channels, checked as a whole before the bridge starts."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import msgspec

from robosc.execution.runtime.settings import Settings, settings_from
from robosc.expressions import Constant, Expression, Type
from robosc.model.structure import Communication, CommunicationKind, Deployment, Model, ObjectValue, ProvidedValue
from robosc_bridge.configuration.channels import (
    CHANNELS,
    BumperChannel,
    ButtonChannel,
    Channel,
    ChannelInfo,
    DriveChannel,
    FaultChannel,
    ImuChannel,
    ScannerChannel,
    channel_name,
)
from robosc_bridge.configuration.document import Document
from robosc_bridge.configuration.problems import ConfigurationError, Path, Problem, hint
from robosc_bridge.configuration.shapes import Direction, Shape, mismatches
from robosc_bridge.configuration.structure import TURTLEBOTS, Body, Configuration, Execution
from robosc_bridge.driver_registry import features_of


@dataclass(frozen=True, slots=True)
class ChannelMapping:
    """Channel that each communication of a model is mapped to.

    Attributes:
        channels: Channels by name of communication, for all communications of the model, in its order.
        communications: The same communications.
    """

    channels: Mapping[str, Channel]
    communications: tuple[Communication, ...]

    def mapped_to(self, channel: type[Channel]) -> tuple[tuple[Communication, Channel], ...]:
        """The communications that are mapped to channels of a kind, in the order of the model."""
        found = ((item, self.channels[item.name]) for item in self.communications)
        return tuple((item, mapped) for item, mapped in found if isinstance(mapped, channel))

    def settings(self, execution: Execution, deployment: Deployment = Deployment.CONTROLLER) -> Settings:
        """Settings of the executor; by default, a message that is mapped to the drive acts until it is released."""
        given = msgspec.structs.asdict(execution)
        if execution.every is None:
            # A scan is decided on at once; a layer decides nothing.
            given["every"] = "event" if deployment is Deployment.CONTROLLER else Settings().every
        if execution.release_identifiers is None:
            acting = (item.identifier for item, _ in self.mapped_to(DriveChannel))
            given["release_identifiers"] = tuple(dict.fromkeys(acting))
        return settings_from(given)

    def never_released(self, settings: Settings) -> tuple[str, ...]:
        """Identifiers mapped to the drive whose last message acts until another one comes, also from another sender."""
        released = settings.release_identifiers or ()
        driven = dict.fromkeys(item.identifier for item, _ in self.mapped_to(DriveChannel))
        return tuple(identifier for identifier in driven if identifier not in released)


def map_channels(model: Model, configuration: Configuration, document: Document | None = None) -> ChannelMapping:
    """Map every communication of a model.

    Args:
        model: A checked model.
        configuration: Configuration whose `channels` name identifiers, or single communications.
        document: Document that the configuration was read from, for the lines in messages.

    Raises:
        ConfigurationError: A communication is not mapped, is mapped twice, or is mapped to a channel that cannot serve
            it or that the robot does not have; or the model does not have it. Lists all problems.
    """
    found = _MappingChecks(model, configuration)
    problems = [
        Problem(message, path, None if document is None else document.line(path)) for path, message in found.problems()
    ]
    if problems:
        raise ConfigurationError("configuration" if document is None else document.name, problems)
    return ChannelMapping(found.channels, model.communications)


def unsuitable_because(model: Model, communication: Communication, channel: type[Channel]) -> tuple[str, ...]:
    """Return the reasons why a communication cannot be mapped to channels of a kind; empty: it can."""
    info = CHANNELS[channel]
    use = info.uses.get(communication.kind)
    if use is None:
        kinds = " or ".join(f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}" for kind in info.uses)
        return (f"the channel is for {kinds}",)
    parts: tuple[tuple[str, Type | None, Shape, Direction], ...] = (
        ("request", communication.request, use.request, Direction.TO_ROBOT),
        ("response", communication.response, use.response, Direction.TO_MODEL),
        ("feedback", communication.feedback, use.feedback, Direction.TO_MODEL),
    )
    is_message = communication.kind in (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE)
    found = [
        reason if is_message else f"{name}: {reason}"
        for name, type_, shape, direction in parts
        if type_ is not None
        for reason in mismatches(model, type_, shape, direction)
    ]
    return (*found, *_ignored_parts(model, communication, info))


def _ignored_parts(model: Model, communication: Communication, info: ChannelInfo) -> Iterator[str]:
    """Parts that the model gives and the channel does not use."""
    if info.used_parts:
        given = (
            path
            for provide in model.provides_for(communication.name)
            for path, value in _parts(provide.value, ())
            if not (isinstance(value, Constant) and value.value == 0)
        )
        for path in dict.fromkeys(given):
            if path not in info.used_parts:
                used = ", ".join(sorted(info.used_parts))
                yield f"the model gives '{path}', which the channel does not use; it uses {used}"


def _parts(value: ProvidedValue, path: tuple[str, ...]) -> Iterator[tuple[str, Expression]]:
    if isinstance(value, ObjectValue):
        for name, part in value.properties:
            yield from _parts(part, (*path, name))
    else:
        yield ".".join(path), value


class _MappingChecks:
    def __init__(self, model: Model, configuration: Configuration) -> None:
        self._model = model
        self._configuration = configuration
        self._features = features_of(configuration.drive.driver)
        self.channels: dict[str, Channel] = {}

    def problems(self) -> list[tuple[Path, str]]:
        """All problems; fills `channels`."""
        by_communication: dict[str, list[str]] = {item.name: [] for item in self._model.communications}
        found: list[tuple[Path, str]] = []
        for key in self._configuration.channels:
            meant = self._meant(key)
            if not meant:
                found.append((("channels", key), f"the model has no such communication; {hint(key, self._known())}"))
            for item in meant:
                by_communication[item.name].append(key)
        for item in self._model.communications:
            found.extend(self._mapped(item, by_communication[item.name]))
        found.extend(self._divided())
        found.extend(self._missing_devices())
        found.extend(self._unknown_names())
        return found

    def _meant(self, key: str) -> tuple[Communication, ...]:
        items = self._model.communications
        return tuple(item for item in items if item.identifier == key) or tuple(
            item for item in items if item.name == key
        )

    def _known(self) -> Iterable[str]:
        return {item.identifier for item in self._model.communications}

    def _mapped(self, item: Communication, keys: list[str]) -> Iterator[tuple[Path, str]]:
        text = f"{item.kind} '{item.name}' ('{item.identifier}')"
        if not keys:
            yield ("channels",), f"{text} is not mapped to a channel"
            return
        for key in keys[1:]:
            yield ("channels", key), f"{text} is mapped here again, but '{keys[0]}' maps it already"
        channel = self.channels[item.name] = self._configuration.channels[keys[0]]
        for reason in unsuitable_because(self._model, item, type(channel)):
            yield ("channels", keys[0]), f"{text} cannot be mapped to '{channel_name(channel)}': {reason}"

    def _divided(self) -> Iterator[tuple[Path, str]]:
        """Messages with one identifier reach all of its receivers, so they need one channel."""
        first: dict[str, str] = {}
        for item in self._model.communications:
            if item.kind is CommunicationKind.OUTGOING_MESSAGE and item.name in self.channels:
                other = first.setdefault(item.identifier, item.name)
                if self.channels[other] != self.channels[item.name]:
                    text = f"'{other}' and '{item.name}' share the identifier '{item.identifier}' and need one channel"
                    yield ("channels",), text

    def _missing_devices(self) -> Iterator[tuple[Path, str]]:
        configuration = self._configuration
        driver, features = configuration.drive.driver, self._features
        if features is not None and features.needs_turtlebot3 and isinstance(configuration.robot, Body):
            yield (
                ("robot",),
                f"the drive '{driver}' belongs to a TurtleBot3; 'robot' must be one of {', '.join(TURTLEBOTS)}",
            )
        for key, channel in configuration.channels.items():
            path = ("channels", key)
            is_scanner = isinstance(channel, ScannerChannel)
            if is_scanner or (isinstance(channel, FaultChannel) and channel.device == "scanner"):
                if configuration.scanner is None:
                    yield path, "there is no scanner: the section 'scanner' is missing"
            elif isinstance(channel, ImuChannel) and features is not None and not features.has_imu:
                yield path, f"the drive '{driver}' has no inertial sensor"
            elif isinstance(channel, BumperChannel) and features is not None and not features.has_bumpers:
                yield path, f"the drive '{driver}' has no bumpers"
            elif isinstance(channel, ButtonChannel):
                yield from self._missing_buttons((*path, "name"), (channel.name,))
        stop = configuration.skills.emergency_stop
        for name in ("stop_buttons", "resume_buttons"):
            yield from self._missing_buttons(("skills", "emergency_stop", name), getattr(stop, name))

    def _missing_buttons(self, path: Path, names: Iterable[str]) -> Iterator[tuple[Path, str]]:
        driver = self._configuration.drive.driver
        for name in names:
            if self._features is not None and name not in self._features.buttons:
                yield path, f"the drive '{driver}' has no button '{name}'; {hint(name, self._features.buttons)}"

    def _unknown_names(self) -> Iterator[tuple[Path, str]]:
        """Settings of the executor with names that the model does not have."""
        execution, items = self._configuration.execution, self._model.communications
        incoming = CommunicationKind.OUTGOING_MESSAGE
        requests = {item.name for item in items if item.kind is not incoming}
        for place, name in enumerate(execution.priority):
            if name not in requests:
                yield (
                    ("execution", "priority", place),
                    f"'{name}' is not a request of the model; {hint(name, requests)}",
                )
        received = {item.identifier for item in items if item.kind is incoming}
        for name in execution.max_age_s:
            if name not in received:
                yield (
                    ("execution", "max_age_s", name),
                    f"the model receives no message with this identifier; {hint(name, received)}",
                )
        sent = {item.identifier for item in items if item.kind is CommunicationKind.INCOMING_MESSAGE}
        for place, name in enumerate(execution.release_identifiers or ()):
            if name not in sent:
                path = ("execution", "release_identifiers", place)
                yield path, f"the model sends nothing on '{name}'; {hint(name, sent)}"
