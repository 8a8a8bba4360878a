"""Machines that a bridge is assembled on, and an endpoint that records what is done with it."""

import sys

from robosc.certification import make_supervisor
from robosc.execution.runtime.event_log import NullLog
from robosc.supervisor import Supervisor
from robosc_bridge.assembly import Machine, assemble
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.errors import BridgeError
from robosc_bridge.host import Host
from robosc_bridge.transport.system_host import SYSTEM_HOST
from support.daemons import MODEL
from support.models import bundle_of


def controller() -> Supervisor:
    """Return the supervisor of the model that most tests of the bridge take."""
    made = make_supervisor(bundle_of(MODEL))
    assert made.supervisor is not None
    return made.supervisor


def machine(supervisor: Supervisor, text: str, *, starts_itself: bool = True, host: Host = SYSTEM_HOST) -> Machine:
    """Return what is assembled of the text of a configuration."""
    configuration = parse(text.encode(), "test.yaml").configuration
    mapping = map_channels(supervisor.model, configuration)
    return assemble(configuration, mapping, supervisor, NullLog(), starts_itself=starts_itself, host=host)


class RecordedEndpoint:
    """A remote endpoint that notes when it is started and stopped."""

    name = "recorded endpoint"
    is_alive = True

    def __init__(self, made: Machine, problem: str = "") -> None:
        self.made = made
        self.problem = problem
        self.calls: list[str] = []
        self.switch_s = 0.0

    def start(self) -> None:
        if self.problem:
            raise BridgeError(self.problem)
        self.calls.append(f"start {self.made.drive.is_alive}")
        self.switch_s = sys.getswitchinterval()
        self.made.operations.order(OperatorCommand.QUIT, "a test")

    def stop(self) -> None:
        snapshot = self.made.operations.feed.snapshot
        self.calls.append(f"stop {self.made.drive.is_alive} {None if snapshot is None else snapshot.state}")
