"""Requests that programs may send to a supervision layer, and the check that they are valid.

The check depends only on the model and the configuration, so it runs in the thread of the caller: large data takes time
that the loop does not have.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from robosc.model.structure import Communication, CommunicationKind, Model
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import CHANNELS, Channel, RotateChannel, channel_name
from robosc_bridge.configuration.shapes import Shape
from robosc_bridge.daemon.channel_data import angle_of
from robosc_bridge.daemon.programs.items import (
    CallRequested,
    CancelRequested,
    FromProgram,
    GoalRequested,
    MessageRequested,
)
from robosc_bridge.daemon.programs.plain_data import accepted, completed, is_number, why_not_shaped, why_not_typed
from robosc_bridge.skills.rotate import MAXIMUM_ANGLE_RAD

MAXIMUM_ID = 255
"""Characters of an id of a program's own."""

ProgramRequest = MessageRequested | CallRequested | GoalRequested | CancelRequested
"""Request of a program."""


class InvalidRequestError(ValueError):
    """Request of a program that is invalid; the message is one sentence."""


class RequestChecker:
    """Checker of the requests of programs; used by all threads.

    Args:
        model: Model of the supervisor.
        mapping: Channel that each communication is mapped to.
        is_layer: True if the supervisor is a layer, so that programs may send requests.

    Attributes:
        messages: Messages that programs may send to the robot, by identifier.
    """

    def __init__(self, model: Model, mapping: ChannelMapping, *, is_layer: bool) -> None:
        self._model = model
        self._channels = mapping.channels
        self._is_layer = is_layer
        messages: dict[str, list[Communication]] = {}
        self._others: dict[tuple[CommunicationKind, str], Communication] = {}
        for item in mapping.communications:
            if item.kind is CommunicationKind.INCOMING_MESSAGE:
                messages.setdefault(item.identifier, []).append(item)
            elif item.kind is not CommunicationKind.OUTGOING_MESSAGE:
                self._others[item.kind, item.name] = item
        self.messages: Mapping[str, list[Communication]] = messages
        self._shapes: dict[str, Shape] = {}
        for item in (*(item for found in messages.values() for item in found), *self._others.values()):
            shape = CHANNELS[type(mapping.channels[item.name])].uses[item.kind].request
            self._shapes[item.name] = accepted(model, item.request, shape)

    def identifier(self, kind: CommunicationKind, name: str) -> str:
        """Return the identifier of a service or action that the model has."""
        return self._others[kind, name].identifier

    def check(self, item: FromProgram) -> FromProgram:
        """Return an item of a program as the layer receives it: data that is left out is zero, false or empty.

        Raises:
            InvalidRequestError: The item is an invalid request, whatever the state of the layer.
        """
        if not isinstance(item, ProgramRequest):
            return item
        if not self._is_layer:
            raise InvalidRequestError("the supervisor is a controller, which takes no requests")
        if not item.program.may_request:
            raise InvalidRequestError("this program may not send requests")
        match item:
            case MessageRequested(identifier=identifier, data=data):
                meant = self.messages.get(identifier)
                if meant is None:
                    raise InvalidRequestError(f"the model has no message to the robot on '{identifier:.255}'")
                # The layer finds the message that is meant, so the data must fit each of them.
                for message in meant:
                    self._require_fit(message, data)
                for message in meant:
                    data = completed(self._model, message.request, data)
                return replace(item, data=data)
            case CallRequested(service=service, call_id=call_id, data=data):
                return replace(item, data=self._started(CommunicationKind.SERVICE, service, call_id, data))
            case GoalRequested(action=action, goal_id=goal_id, data=data):
                return replace(item, data=self._started(CommunicationKind.ACTION, action, goal_id, data))
        return item

    def _started(self, kind: CommunicationKind, name: str, own_id: str, data: Any) -> Any:
        asked = self._others.get((kind, name))
        if asked is None:
            raise InvalidRequestError(f"the model has no {kind} '{name:.255}'")
        if not 1 <= len(own_id) <= MAXIMUM_ID:
            raise InvalidRequestError(f"an id has 1 to {MAXIMUM_ID} characters")
        self._require_fit(asked, data)
        return completed(self._model, asked.request, data)

    def _require_fit(self, communication: Communication, data: Any) -> None:
        """Do nothing if data is what the channel and the model take.

        Raises:
            InvalidRequestError: It is not.
        """
        channel = self._channels[communication.name]
        used_parts = CHANNELS[type(channel)].used_parts
        why = why_not_shaped(self._shapes[communication.name], data)
        why = why or why_not_typed(self._model, communication.request, data)
        if why:
            raise InvalidRequestError(f"'{communication.name}': {why}")
        for path, value in _leaves(data, "") if used_parts else ():
            if path not in used_parts and value:
                raise InvalidRequestError(
                    f"'{communication.name}': '{path}' must be 0: '{channel_name(channel)}' does not use it"
                )
        _require_angle(communication, channel, data)


def _require_angle(communication: Communication, channel: Channel, data: Any) -> None:
    """Do nothing if a rotation can be made of an angle; one that is not finite is held back by the layer."""
    if isinstance(channel, RotateChannel):
        angle = angle_of(data)
        rad = math.radians(angle) if channel.unit == "degrees" else angle
        if math.isfinite(rad) and abs(rad) > MAXIMUM_ANGLE_RAD:
            raise InvalidRequestError(
                f"'{communication.name}': an angle of {angle:g} {channel.unit} is beyond a hundred revolutions"
            )


def _leaves(data: Any, path: str) -> Iterator[tuple[str, float]]:
    """Numbers of plain data, by where they stand in it."""
    if isinstance(data, dict):
        for name, part in data.items():
            yield from _leaves(part, f"{path}.{name}" if path else name)
    elif is_number(data):
        yield path, data
