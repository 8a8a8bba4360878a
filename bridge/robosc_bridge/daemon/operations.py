"""Operations that a remote endpoint may perform on the daemon, from any thread and without waiting."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Protocol

from robosc.supervisor import Supervisor
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.daemon.feed import Feed
from robosc_bridge.daemon.programs.items import FromProgram
from robosc_bridge.daemon.states import OperatorCommand, Order

UNDONE_BY: Mapping[OperatorCommand, OperatorCommand] = {
    OperatorCommand.START: OperatorCommand.STANDBY,
    OperatorCommand.RESUME: OperatorCommand.STOP,
}
"""Commands that let the robot move, each with the command that takes it back.

A command that was reported to a person as failed does not take effect later.
"""


class Inbox(Protocol):
    """Function that puts an item into the inbox of the loop."""

    def __call__(self, item: Order | FromProgram, /) -> None:
        """Put an item into the inbox; never waits."""


class Operations:
    """The daemon as remote endpoints see it.

    Args:
        supervisor: Supervisor that is executed.
        mapping: Channels that its communications are mapped to.
        is_layer: True if the supervisor is a supervision layer.
        feed: Feed that the daemon shows.
        post: Function that puts an item into the inbox of the loop.
        operator_seen: Function that reports a sign of life of an operator to the safety layer.
        turtlebot: TurtleBot3 that is driven, as a configuration names it; empty: another robot.
        scanner_place: Place of the LiDAR by the configuration, forward and to the left, in metres; None: not there.

    Attributes:
        supervisor: Supervisor that is executed.
        model: Its model.
        mapping: Channels that its communications are mapped to.
        is_layer: True if the supervisor is a supervision layer.
        feed: Feed that the daemon shows.
        turtlebot: TurtleBot3 that is driven, as a configuration names it; empty: another robot.
        scanner_place: Place of the LiDAR by the configuration, forward and to the left, in metres; None: not there.
    """

    def __init__(
        self,
        supervisor: Supervisor,
        mapping: ChannelMapping,
        feed: Feed,
        post: Inbox,
        operator_seen: Callable[[], None],
        *,
        is_layer: bool,
        turtlebot: str = "",
        scanner_place: tuple[float, float] | None = None,
    ) -> None:
        self.supervisor = supervisor
        self.model = supervisor.model
        self.mapping = mapping
        self.is_layer = is_layer
        self.feed = feed
        self.turtlebot = turtlebot
        self.scanner_place = scanner_place
        self._post = post
        self._operator_seen = operator_seen

    def order(self, command: OperatorCommand, by: str) -> "Future[str]":
        """Give a command to the daemon; a stop takes effect before this returns.

        Returns:
            Future of the answer: one sentence that says why the command cannot be carried out, or "" once it is done.
            It is also resolved when the daemon ends.
        """
        answer: Future[str] = Future()
        self._post(Order(command, by, answer.set_result))
        return answer

    def post(self, item: FromProgram) -> None:
        """Pass an item of a program on to the loop."""
        self._post(item)

    def operator_seen(self) -> None:
        """Report a sign of life of the operator to the safety layer."""
        self._operator_seen()
