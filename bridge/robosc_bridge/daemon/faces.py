"""How the daemon is reached from elsewhere: its remote faces, as the program starts and stops them."""

from typing import Protocol

from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground import GroundLink, ground_settings
from robosc_bridge.remote import RemoteFace, settings_of
from robosc_bridge.safety import SafetyLimits


class Face(Protocol):
    """Serves operators or ground stations, in threads of its own."""

    def start(self) -> None:
        """Begin to serve; nothing moves yet.

        Raises:
            BridgeError: It cannot, such as on an address that is in use.
        """

    def stop(self) -> None:
        """End what is under way and every thread within some seconds; never raises, may be called again."""


def is_remote(configuration: Configuration) -> bool:
    """Whether a remote face is configured, through which somebody can start the robot, and start it again."""
    return configuration.remote.grpc_address is not None or configuration.remote.mavlink_url is not None


def make_faces(configuration: Configuration, operations: Operations, limits: SafetyLimits) -> tuple[Face, ...]:
    """The remote faces that are configured, not started yet.

    Raises:
        BridgeError: One cannot be made as it is configured.
    """
    faces: list[Face] = []
    remote = settings_of(configuration)
    if remote is not None:
        faces.append(RemoteFace(operations, remote))
    ground = ground_settings(configuration, Velocity(limits.linear_m_s, limits.angular_rad_s))
    if ground is not None:
        faces.append(GroundLink(operations, ground))
    return tuple(faces)
