"""Messages received by a ground link, and the commands among them."""

from dataclasses import dataclass
from typing import Any

from robosc_bridge.ground_station.command_handler import ReceivedCommand
from robosc_bridge.ground_station.commands import Meaning, meaning, mode_meaning
from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.protocol.mavlink import is_old, is_signed
from robosc_bridge.protocol.mavlink_messages import Incoming

STOPPING = frozenset({Incoming.SET_MODE, Incoming.COMMAND_LONG, Incoming.COMMAND_INT})
"""Messages that can stop the robot: they are heard with every signature."""

OLD = STOPPING | {Incoming.HEARTBEAT}
"""Messages that are heard as MAVLink 1, too."""


@dataclass(frozen=True)
class ReceivedMessage:
    """Message that was received.

    Attributes:
        sender: System and component.
        number: Number of the message.
        message: The library's message.
        is_signed: True if it has a valid signature.
        is_old: True if it came as MAVLink 1.
    """

    sender: tuple[int, int]
    number: int
    message: Any
    is_signed: bool
    is_old: bool

    def is_for(self, settings: GroundSettings) -> bool:
        """Return True if the message is for the bridge, or for everybody."""
        system, component = getattr(self.message, "target_system", 0), getattr(self.message, "target_component", 0)
        return system in (0, settings.system) and component in (0, settings.component)


def received_from(message: Any) -> ReceivedMessage:
    """Return the received message, from a message of the library."""
    sender = (message.get_srcSystem(), message.get_srcComponent())
    return ReceivedMessage(sender, message.get_msgId(), message, is_signed(message), is_old(message))


def command_in(received: ReceivedMessage, settings: GroundSettings) -> ReceivedCommand | None:
    """The command that a message is, if it is one and for us."""
    message = received.message
    if received.number not in STOPPING or not received.is_for(settings):
        return None
    if received.number == Incoming.SET_MODE:
        return ReceivedCommand(
            received.sender, Incoming.SET_MODE, (message.base_mode, message.custom_mode, 0, 0, 0, 0, 0)
        )
    first = (message.param1, message.param2, message.param3, message.param4)
    if received.number == Incoming.COMMAND_INT:
        return ReceivedCommand(
            received.sender, message.command, (*first, float(message.x), float(message.y), message.z)
        )
    last = (message.param5, message.param6, message.param7)
    return ReceivedCommand(received.sender, message.command, (*first, *last), message.confirmation > 0)


def meaning_of(command: ReceivedCommand) -> Meaning:
    """Return the meaning of a command."""
    # The old message for modes is answered as a command of its number, as ArduPilot does.
    if command.number == Incoming.SET_MODE:
        return mode_meaning(command.parameters[0], command.parameters[1])
    return meaning(command.number, command.parameters)
