"""Dispatch of items from programs: to the program channel, or to the requesters of a layer."""

from typing import assert_never

from robosc_bridge.daemon.execution import Execution
from robosc_bridge.daemon.programs.channel import ProgramChannel
from robosc_bridge.daemon.programs.inbox import Arrived, Overflowed, Unreadable
from robosc_bridge.daemon.programs.items import (
    Attached,
    CallFailed,
    CallRequested,
    CancelRequested,
    Clients,
    Detached,
    FeedbackGiven,
    GoalAccepted,
    GoalEnded,
    GoalRequested,
    MessageReceived,
    MessageRequested,
    Program,
    Replied,
)
from robosc_bridge.daemon.programs.requesters import Requesters
from robosc_bridge.daemon.robot.adapter import RobotAdapter


class ProgramDispatcher:
    """Dispatcher of the items that programs send, in the loop's thread.

    Args:
        clients: Connected programs.
        program_channel: The other side of the model's communications.
        requesters: The caller's side of a layer.
        execution: The supervisor at work.
        robot: Adapter that reports the outcome of requests to the executor.
    """

    def __init__(
        self,
        clients: Clients,
        program_channel: ProgramChannel,
        requesters: Requesters,
        execution: Execution,
        robot: RobotAdapter,
    ) -> None:
        self._clients = clients
        self._program_channel = program_channel
        self._requesters = requesters
        self._execution = execution
        self._robot = robot

    def take(self, item: Arrived) -> None:
        """Take a program's item, or refuse it with the reason."""
        program = item.program
        if isinstance(item, Attached):
            self._attach(program)
        elif program in self._clients:
            # Items of programs that have gone come too late.
            self._take(item)
        if self._execution.executor is not None:
            self._robot.deliver_pending(self._execution.executor)

    def _attach(self, program: Program) -> None:
        if program in self._clients:
            self._clients.refuse(program, "this program is there already")
            return
        self._clients.add(program)
        self._program_channel.attach(program)

    def _take(self, item: Arrived) -> None:
        program, executor, layer = item.program, self._execution.executor, self._execution.layer
        match item:
            case Attached():
                pass
            case Detached():
                self._clients.remove(program)
                self._program_channel.detach(program, executor)
                self._requesters.detach(program, layer)
            case Unreadable(why=why):
                self._clients.refuse(program, why)
            case Overflowed(lost=lost):
                self._clients.refuse(program, f"this program sends too much at once: {lost} of it were not looked at")
                if layer is not None:
                    self._requesters.overflow(program, layer)
            case MessageReceived():
                self._program_channel.receive(item, executor)
            case Replied() | CallFailed() | GoalAccepted() | FeedbackGiven() | GoalEnded():
                self._program_channel.take(item, executor)
            case MessageRequested() | CallRequested() | GoalRequested() | CancelRequested():
                self._requesters.take(item, layer)
            case _:
                assert_never(item)
