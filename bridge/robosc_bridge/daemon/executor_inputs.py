"""Input of an executor from the robot and programs, and the identifiers on which it receives each channel."""

from typing import Any, Protocol

from robosc.model.structure import CommunicationKind
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import Channel


class Supervised(Protocol):
    """Input of an executor of either deployment."""

    def receive(self, identifier: str, data: Any) -> None:
        """Take a message."""

    def on_reply(self, request_id: int, data: Any) -> None:
        """Take the answer to a call."""

    def on_call_failed(self, request_id: int, reason: str) -> None:
        """Take the failure of a call."""

    def on_goal_accepted(self, goal_id: int) -> None:
        """Take the acceptance of a goal."""

    def on_feedback(self, goal_id: int, data: Any) -> None:
        """Take the progress of a goal."""

    def on_goal_ended(self, goal_id: int, outcome: str, data: Any = None) -> None:
        """Take the end of a goal."""


class Listeners:
    """Identifiers that each kind of channel reports to; each identifier once.

    Args:
        mapping: Channel that each communication is mapped to.
    """

    def __init__(self, mapping: ChannelMapping) -> None:
        self._channels: dict[str, Channel] = {}
        for item in mapping.communications:
            if item.kind is CommunicationKind.OUTGOING_MESSAGE:
                self._channels.setdefault(item.identifier, mapping.channels[item.name])
        self._found: dict[type, tuple[tuple[str, Any], ...]] = {}

    def of[Kind: Channel](self, kind: type[Kind]) -> tuple[tuple[str, Kind], ...]:
        """Identifiers and channels of a kind, in the model's order."""
        if kind not in self._found:
            self._found[kind] = tuple((name, item) for name, item in self._channels.items() if isinstance(item, kind))
        return self._found[kind]
