"""Job that the daemon executes."""

from dataclasses import dataclass

from robosc.execution.runtime.settings import Settings
from robosc.supervisor import Supervisor
from robosc_bridge.configuration.channel_mapping import ChannelMapping


@dataclass(frozen=True)
class Job:
    """Job that is executed.

    Attributes:
        supervisor: Supervisor that is executed.
        mapping: Channels that its communications are mapped to.
        settings: Settings of the executor.
        needs_scanner: True if a LiDAR must be there before it starts.
        starts_itself: True if it starts as soon as the devices are there; else it stays in standby.
        stays_after_fault: True if it waits for somebody to start it again after a fault; else it ends.
        is_layer: True for a supervision layer, where programs ask for what it lets through; False for a controller.
        needs_camera: True if a camera must be there before it starts.
    """

    supervisor: Supervisor
    mapping: ChannelMapping
    settings: Settings
    needs_scanner: bool
    starts_itself: bool
    stays_after_fault: bool = False
    is_layer: bool = False
    needs_camera: bool = False
