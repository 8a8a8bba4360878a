"""What the daemon executes."""

from dataclasses import dataclass

from robosc.execution.settings import Settings
from robosc.supervisor import Supervisor
from robosc_bridge.configuration.ties import Ties


@dataclass(frozen=True)
class Job:
    """What is executed.

    Attributes:
        supervisor: What is executed.
        ties: What its communications are tied to.
        settings: Of the executor.
        needs_scanner: Whether a LiDAR must be there before it starts.
        starts_itself: Whether it starts as soon as the devices are there; else it stays in standby.
        stays_after_fault: Whether it waits for somebody to start it again after a fault; else it ends.
        is_layer: Whether it is a supervision layer, so that programs ask for what it lets through; else a controller.
        needs_camera: Whether a camera must be there before it starts.
    """

    supervisor: Supervisor
    ties: Ties
    settings: Settings
    needs_scanner: bool
    starts_itself: bool
    stays_after_fault: bool = False
    is_layer: bool = False
    needs_camera: bool = False
